// test_camera.c: what is where in the frame.
#include "check.h"

#include "draw/camera.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static void fitted_points_fill_the_frame(void **state)
{
    (void)state;
    check_random random = check_random_seed(7);
    double points[60];
    for (int i = 0; i < 60; i++) points[i] = 10 * check_random_next(&random) - 3;
    const pliant_frame frame = {100, 50, 300, 400};
    for (int view = 0; view < 8; view++) {
        pliant_camera camera = pliant_camera_aim(47.0 * view, 25.0 * view - 85, points, 20);
        pliant_camera_fit(&camera, points, 20, &frame);
        double low[2] = {1e9, 1e9}, high[2] = {-1e9, -1e9};
        for (int i = 0; i < 20; i++) {
            double seen[3];
            pliant_camera_project(&camera, points + 3 * i, seen);
            check_at_least(seen[2], 0);  // in front of the eye
            for (int c = 0; c < 2; c++) {
                low[c] = fmin(low[c], seen[c]);
                high[c] = fmax(high[c], seen[c]);
            }
        }
        // Centred both ways, and touching the frame's sides one way: round-off at 500 pixels.
        check_near((low[0] + high[0]) / 2, 250, 1e-9);
        check_near((low[1] + high[1]) / 2, 250, 1e-9);
        check_near(fmax((high[0] - low[0]) / 300, (high[1] - low[1]) / 400), 1, 1e-12);
    }
}

static void z_is_up_and_nearer_points_are_nearer(void **state)
{
    (void)state;
    const double points[] = {1, 0, 0, -1, 0, 0, 0, 0, 1, 0, 0, -1, 0, 1, 0, 0, -1, 0};
    const pliant_frame frame = {0, 0, 100, 100};
    pliant_camera camera = pliant_camera_aim(0, 0, points, 6);  // from +x: +y is to the right
    pliant_camera_fit(&camera, points, 6, &frame);
    double seen[6][3];
    for (int i = 0; i < 6; i++) pliant_camera_project(&camera, points + 3 * i, seen[i]);
    check_at_most(seen[0][2], seen[1][2] - 1.9);  // +x before -x by their distance, 2
    check_at_most(seen[2][1], seen[3][1] - 90);   // +z above -z by most of the frame
    check_at_least(seen[4][0], seen[5][0] + 90);  // +y right of -y
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(fitted_points_fill_the_frame),
        cmocka_unit_test(z_is_up_and_nearer_points_are_nearer),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
