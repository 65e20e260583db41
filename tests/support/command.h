// command.h: run a program as a user would, and look at what it said.
#pragma once

#include "check.h"

typedef struct check_command {
    int status;          // exit status; 128 + signal when a signal ended it
    char output[65536];  // standard output, NUL-terminated, cut at this size
    char errors[65536];  // standard error
} check_command;

// Run a shell command. "%s" in `format` and the like are printf's. Programs of the build under test
// stand in the folder of check_build().
__attribute__((format(printf, 2, 3))) void check_run(check_command *command, const char *format, ...);
// PLIANT_BUILD, or "build".
const char *check_build(void);
// A folder of this test's own under TMPDIR, made on the first call, gone at exit.
const char *check_folder(void);
// The errors are one line that begins with `prefix` and contains `part`; prints them otherwise.
#define check_one_line(command, prefix, part) check_one_line_at((command), (prefix), (part), __FILE__, __LINE__)
void check_one_line_at(const check_command *command, const char *prefix, const char *part,
                       const char *file, int line);
