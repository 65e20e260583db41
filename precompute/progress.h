// progress.h: what a long run says while it works: a bar on a terminal, else a line now and then.
#pragma once

#include <stdint.h>

typedef struct pliant_progress {
    const char *program;  // name before lines; NULL: say nothing
    const char *phase;
    double begin, last;    // seconds, monotonic
    int64_t total, first;  // first: units that were done before the phase began
    int terminal;
} pliant_progress;

// Only the rank that speaks gets a program name.
pliant_progress pliant_progress_create(const char *program);
// A phase of `total` units of work begins; total 0: not known to be divisible.
void pliant_progress_begin(pliant_progress *progress, const char *phase, int64_t total);
// The same, `done` of them by an earlier run: rate and time left are of the rest.
void pliant_progress_begin_at(pliant_progress *progress, const char *phase, int64_t done,
                              int64_t total);
void pliant_progress_update(pliant_progress *progress, int64_t done);
// Returns the phase's seconds.
double pliant_progress_end(pliant_progress *progress);
// A line of its own, whatever bar is showing. printf-like.
#if defined(__GNUC__)
__attribute__((format(printf, 2, 3)))
#endif
void
pliant_progress_note(pliant_progress *progress, const char *format, ...);

double pliant_progress_clock(void);  // seconds, monotonic
