// prop_statement.h: executes the statements of a script about patches, tools and proxies.
#pragma once

#include "props.h"

#include "pliant/script.h"

// Execute patch, contact, tool, proxy, move or drop. Refusals have no effect; `reason` says why,
// not where in the script.
PLIANT_UNUSED_RESULT pliant_status pliant_prop_statement_execute(pliant_props *props,
                                                                 const pliant_model *model,
                                                                 const pliant_statement *statement,
                                                                 pliant_error *reason);
