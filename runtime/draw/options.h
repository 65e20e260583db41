// options.h: the command line of pliant-draw.
#pragma once

#include "picture.h"
#include "recorder.h"

typedef enum pliant_draw_show {
    PLIANT_SHOW_BOTH,  // the rest shape beside the deformed one
    PLIANT_SHOW_DEFORMED,
    PLIANT_SHOW_REST,
} pliant_draw_show;

typedef struct pliant_draw_options {
    const char *model, *script, *output;  // script may be NULL; borrowed from argv
    pliant_picture_def picture;
    pliant_draw_show show;
    int32_t level;                          // -1: the finest
    int32_t sheet_columns, sheet_rows;      // 0: no contact sheet; as many rows as needed
    int64_t steps[PLIANT_RECORDING_LIMIT];  // as given by --step or --steps
    int32_t step_count;                     // 0: the script's end, or evenly spaced for a sheet
    int32_t detail;                         // 1: the detailed surface over that level
    int32_t lattice;                        // 1: play the lattice, whatever the script begins with
    int32_t help, version;                  // 1: asked for; nothing else is checked
} pliant_draw_options;

// Refusals name the option, what was expected and what was found. argv is permuted.
PLIANT_UNUSED_RESULT pliant_status pliant_draw_options_parse(int argc, char **argv,
                                                             pliant_draw_options *options,
                                                             pliant_error *err);
// The text of --help.
const char *pliant_draw_options_help(void);
