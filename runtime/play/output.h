// output.h: a text file that appears under its name whole or not at all.
//
// Open writes to PATH.tmp and commit renames it to PATH, which stays as it was until then. What
// stands under PATH and is no regular file (a pipe, a device) is written to as it is.
#pragma once

#include "pliant/base.h"

#include <stdio.h>

typedef struct pliant_output pliant_output;

PLIANT_UNUSED_RESULT pliant_status pliant_output_open(const char *path, pliant_output **output,
                                                      pliant_error *err);
FILE *pliant_output_stream(const pliant_output *output);  // borrowed until commit or abandon
// Refuses when anything written so far has failed.
PLIANT_UNUSED_RESULT pliant_status pliant_output_check(const pliant_output *output,
                                                       pliant_error *err);
// Ends the output's life whatever it returns; when it refuses, PATH is as it was.
PLIANT_UNUSED_RESULT pliant_status pliant_output_commit(pliant_output *output, pliant_error *err);
void pliant_output_abandon(pliant_output *output);  // NULL is fine; not after commit
