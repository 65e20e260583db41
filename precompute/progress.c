// progress.c: what a long run says while it works: a bar on a terminal, else a line now and then.
#include "progress.h"

#include <stdarg.h>
#include <stdio.h>
#include <time.h>
#include <unistd.h>

static const double bar_every = 0.1, line_every = 5;  // seconds
static const int bar_width = 30;
static const char clear_line[] = "\r\033[K";

double pliant_progress_clock(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

pliant_progress pliant_progress_create(const char *program)
{
    return (pliant_progress){.program = program, .terminal = isatty(STDERR_FILENO)};
}

void pliant_progress_begin(pliant_progress *p, const char *phase, int64_t total)
{
    pliant_progress_begin_at(p, phase, 0, total);
}

void pliant_progress_begin_at(pliant_progress *p, const char *phase, int64_t done, int64_t total)
{
    p->first = done;
    p->phase = phase;
    p->total = total;
    p->begin = p->last = pliant_progress_clock();
    if (p->program && p->terminal) fprintf(stderr, "%s%-10s ...", clear_line, phase);
}

void pliant_progress_update(pliant_progress *p, int64_t done)
{
    if (!p->program || p->total <= 0 || done <= p->first) return;
    const double now = pliant_progress_clock(), elapsed = now - p->begin;
    if (now - p->last < (p->terminal ? bar_every : line_every)) return;
    p->last = now;
    const double part = (double)done / (double)p->total;
    const double rate = (double)(done - p->first) / elapsed,
                 left = (double)(p->total - done) / rate;
    if (!p->terminal) {
        fprintf(stderr, "%s: %s: %lld of %lld (%.0f%%), %.3g a second, %.0f s left\n", p->program,
                p->phase, (long long)done, (long long)p->total, 100 * part, rate, left);
        return;
    }
    char bar[64];
    for (int i = 0; i < bar_width; i++) bar[i] = i < part * bar_width ? '#' : '.';
    bar[bar_width] = 0;
    fprintf(stderr, "%s%-10s [%s] %3.0f%%  %.3g/s  %.0f s left", clear_line, p->phase, bar, 100 * part,
            rate, left);
    fflush(stderr);
}

double pliant_progress_end(pliant_progress *p)
{
    if (p->program && p->terminal) fputs(clear_line, stderr);
    return pliant_progress_clock() - p->begin;
}

void pliant_progress_note(pliant_progress *p, const char *format, ...)
{
    if (!p->program) return;
    va_list arguments;
    va_start(arguments, format);
    fprintf(stderr, "%s%s: ", p->terminal ? clear_line : "", p->program);
    vfprintf(stderr, format, arguments);
    fputc('\n', stderr);
    va_end(arguments);
}
