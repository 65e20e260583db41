// test_colour_map.c: the colours of displacements.
#include "check.h"

#include "draw/colour_map.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static void colours_darken_evenly_along_the_map(void **state)
{
    (void)state;
    double before = 2;
    for (int i = 0; i <= 64; i++) {
        float colour[3];
        pliant_colour_map_at((float)i / 64, colour);
        // Luminance of linear sRGB (IEC 61966-2-1).
        const double y =
            0.2126 * (double)colour[0] + 0.7152 * (double)colour[1] + 0.0722 * (double)colour[2];
        check_at_most(y, before - 1e-4);
        before = y;
    }
    float end[3], beyond[3];
    pliant_colour_map_at(1, end);
    pliant_colour_map_at(7, beyond);
    assert_memory_equal(end, beyond, sizeof end);
}

static void oklch_white_is_white(void **state)
{
    (void)state;
    // The inverse matrices' rows sum to 1 within the 1e-7 that their printed digits allow.
    float white[3];
    pliant_colour_from_oklch(1, 0, 0, white);
    for (int c = 0; c < 3; c++) check_near((double)white[c], 1, 1e-6);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(colours_darken_evenly_along_the_map),
        cmocka_unit_test(oklch_white_is_white),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
