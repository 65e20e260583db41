// options.h: the command line of pliant-play.
#pragma once

#include "pliant/base.h"

typedef struct pliant_play_options {
    const char *model;
    const char *script;                        // "-": standard input
    const char *csv, *frames, *vtk, *compare;  // NULL: not asked for
    int32_t level;                             // of --lod, -1: all
    int32_t repeat, threads;
    int32_t deadline_us;  // -1: none
    int32_t every;        // steps from one that is written to the next
    int force, quiet, json, verify, passive, detail, lattice, particles;
} pliant_play_options;  // strings are argv's

typedef enum pliant_play_request {
    PLIANT_PLAY_RUN,      // play
    PLIANT_PLAY_HELP,     // print the help and leave
    PLIANT_PLAY_VERSION,  // print the version and leave
} pliant_play_request;

// PLIANT_ERR_ARGUMENT: misuse; the message names the option, what was expected and what was found.
PLIANT_UNUSED_RESULT pliant_status pliant_play_options_parse(int argc, char **argv,
                                                             pliant_play_options *options,
                                                             pliant_play_request *request,
                                                             pliant_error *err);
// An option that makes no sense on a lattice, NULL: none was given.
const char *pliant_play_options_of_greens(const pliant_play_options *options);
// What plays a script more than once at a time, or several times, needs a regular file. `threads`:
// how many play it.
PLIANT_UNUSED_RESULT pliant_status pliant_play_options_check_script(
    const pliant_play_options *options, int32_t threads, pliant_error *err);
extern const char *const pliant_play_help[];  // the text of --help in parts, then NULL
