// clock.c: monotonic time, which deadlines are given in.
#include "pliant/pliant.h"

#include <time.h>

int64_t pliant_clock_ns(void)
{
    struct timespec time;
    clock_gettime(CLOCK_MONOTONIC, &time);
    return time.tv_sec * INT64_C(1000000000) + time.tv_nsec;
}
