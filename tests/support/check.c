// check.c: what the tests share around CMocka.
#include "check.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

void check_near_at(double found, double expected, double tolerance, const char *what,
                   const char *file, int line)
{
    // Written so that NaN fails.
    if (fabs(found - expected) <= tolerance) return;
    print_error("%s = %.9g, expected %.9g within %.3g (off by %.3g)\n", what, found, expected,
                tolerance, fabs(found - expected));
    _fail(file, line);
}

void check_order_at(double found, double bound, const char *order, const char *what,
                    const char *file, int line)
{
    if (order[0] == '<' ? found <= bound : found >= bound) return;
    print_error("%s = %.9g, expected %s %.9g\n", what, found, order, bound);
    _fail(file, line);
}

void check_ok_at(pliant_status status, const pliant_error *err, const char *what, const char *file,
                 int line)
{
    if (status == PLIANT_OK) return;
    print_error("%s: %s: %s\n", what, pliant_status_name(status), err ? err->text : "");
    _fail(file, line);
}

const char *check_model_path(const char *name)
{
    static char paths[4][1024];
    static int turn;
    char *path = paths[turn++ % 4];
    const char *folder = getenv("PLIANT_MODELS");
    snprintf(path, sizeof paths[0], "%s/%s", folder ? folder : "../shared/models", name);
    if (access(path, R_OK) == 0) return path;
    printf("skipped: %s is not here (set PLIANT_MODELS to the folder of the evaluation meshes)\n", path);
    return NULL;
}

check_random check_random_seed(uint64_t seed)
{
    print_message("seed %llu\n", (unsigned long long)seed);
    return (check_random){seed * 0x9E3779B97F4A7C15ull + 1};
}

double check_random_next(check_random *random)
{
    // splitmix64 (S. Vigna): the top 53 bits make a double in [0, 1).
    uint64_t z = random->state += 0x9E3779B97F4A7C15ull;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ull;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBull;
    return (double)((z ^ (z >> 31)) >> 11) * 0x1p-53;
}
