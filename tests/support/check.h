// check.h: what the tests share around CMocka: numbers in failures, and data that may be absent.
#pragma once

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

#include "pliant/base.h"

// |found - expected| <= tolerance, printing all three on failure.
#define check_near(found, expected, tolerance)                                                     \
    check_near_at((found), (expected), (tolerance), #found, __FILE__, __LINE__)
// found <= bound (or >=), printing both on failure.
#define check_at_most(found, bound)  check_order_at((found), (bound), "<=", #found, __FILE__, __LINE__)
#define check_at_least(found, bound) check_order_at((found), (bound), ">=", #found, __FILE__, __LINE__)
// status == PLIANT_OK, printing the error's text on failure.
#define check_ok(status, err) check_ok_at((status), (err), #status, __FILE__, __LINE__)

void check_near_at(double found, double expected, double tolerance, const char *what,
                   const char *file, int line);
void check_order_at(double found, double bound, const char *order, const char *what,
                    const char *file, int line);
void check_ok_at(pliant_status status, const pliant_error *err, const char *what, const char *file,
                 int line);

// Path of a file of the evaluation meshes (PLIANT_MODELS, or ../shared/models beside the
// repository), or NULL after printing a "skipped:" line: then call skip(). Static storage, good
// until the fourth next call.
const char *check_model_path(const char *name);

// The repeatable random numbers of tests: uniform in [0, 1), from a printed seed.
typedef struct check_random {
    uint64_t state;
} check_random;
check_random check_random_seed(uint64_t seed);
double check_random_next(check_random *random);
