// options.h: the command line of pliant-info.
#pragma once

#include "pliant/base.h"

typedef struct pliant_info_options {
    const char *path;       // the file to look at; borrowed from argv, as the next
    const char *output;     // --export; NULL: none
    int32_t level;          // --level; -1: the finest
    int32_t detail;         // 1: --export writes the detailed shape
    int32_t verify, json;   // 1: asked for
    int32_t help, version;  // 1: asked for; nothing else is checked
} pliant_info_options;

// Refusals name the option, what was expected and what was found. argv is permuted.
PLIANT_UNUSED_RESULT pliant_status pliant_info_options_parse(int argc, char **argv,
                                                             pliant_info_options *options,
                                                             pliant_error *err);
// The text of --help.
const char *pliant_info_options_help(void);
