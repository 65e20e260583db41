// condition_statement.h: executes the statements of a script about conditions of single vertices.
#pragma once

#include "conditions.h"
#include "props.h"

#include "pliant/script.h"

// Execute displace, traction, force, support, gravity or release (of all: the props, too).
// Refusals have no effect; `reason` says why, not where in the script.
PLIANT_UNUSED_RESULT pliant_status pliant_condition_statement_execute(
    pliant_conditions *conditions, pliant_props *props, const pliant_model *model,
    const pliant_statement *statement, pliant_error *reason);
