// identity.h: what makes two runs the same run: program, inputs and every option that shapes the
// file.
#pragma once

#include "problem.h"

// "key = value" lines; the caller frees. First rank: the files named in the options are read and
// hashed.
PLIANT_UNUSED_RESULT pliant_status pliant_identity_create(const pliant_options *options,
                                                          const pliant_problem *problem,
                                                          char **text, pliant_error *err);
// PLIANT_OK when both are the same, else PLIANT_ERR_ARGUMENT and in `err` what differs: "young = 1
// then, 2 now" and how much else.
PLIANT_UNUSED_RESULT pliant_status pliant_identity_compare(const char *then, const char *now,
                                                           pliant_error *err);
