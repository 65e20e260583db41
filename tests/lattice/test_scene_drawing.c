// test_scene_drawing.c: pictures of scenes: who is where, in which hue, and what cannot be drawn.
#include "check.h"

#include "draw/drawing.h"
#include "draw/scene_recording.h"
#include "synthetic_lattice.h"

#include <math.h>
#include <png.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { WIDTH = 300, HEIGHT = 200 };

static char folder[64];
static pliant_model *cube;  // 27 cells of a third, from 0 0 0 to 1 1 1

static char *in_folder(const char *name)
{
    static char paths[4][128];
    static int turn;
    char *path = paths[turn++ % 4];
    snprintf(path, sizeof paths[0], "%s/%s", folder, name);
    return path;
}

static int set_up(void **state)
{
    (void)state;
    pliant_error err;
    strcpy(folder, "/tmp/pliant-scene-XXXXXX");
    if (!mkdtemp(folder)) return -1;
    check_lattice *lattice = check_lattice_create(&(check_lattice_def){
        .shape = CHECK_CELLS_CUBE, .size = 3, .half_width = 1, .cell_size = 1.0 / 3});
    check_lattice_write(lattice, in_folder("m.h5"));
    check_lattice_destroy(lattice);
    check_ok(pliant_model_open(in_folder("m.h5"), &cube, &err), &err);
    return 0;
}

static int tear_down(void **state)
{
    (void)state;
    pliant_model_close(cube);
    char line[128];
    snprintf(line, sizeof line, "rm -rf '%s'", folder);
    return system(line);
}

static void write_script(const char *text)
{
    FILE *file = fopen(in_folder("s.script"), "w");
    assert_non_null(file);
    fprintf(file, "pliant-script 1\n%s", text);
    assert_int_equal(fclose(file), 0);
}

// Draw the script's state after `step` from above; freed by the caller.
static uint8_t *draw(const char *script, int64_t step, const double *region)
{
    static char model[128], path[128], output[128];
    pliant_error err = {""};
    write_script(script);
    snprintf(model, sizeof model, "%s", in_folder("m.h5"));
    snprintf(path, sizeof path, "%s", in_folder("s.script"));
    snprintf(output, sizeof output, "%s", in_folder("a.png"));
    pliant_draw_options options = {.model = model,
                                   .script = path,
                                   .output = output,
                                   .picture = pliant_picture_default(),
                                   .show = PLIANT_SHOW_DEFORMED,
                                   .level = -1,
                                   .steps = {step},
                                   .step_count = 1};
    options.picture.width = WIDTH;
    options.picture.height = HEIGHT;
    options.picture.azimuth = -90;  // x to the right
    options.picture.elevation = 89;
    if (region) {
        options.picture.has_region = 1;
        memcpy(options.picture.region, region, sizeof options.picture.region);
    }
    check_ok(pliant_drawing_make(&options, &err), &err);
    png_image image = {.version = PNG_IMAGE_VERSION};
    assert_true(png_image_begin_read_from_file(&image, output));
    image.format = PNG_FORMAT_RGB;
    uint8_t *rgb = malloc(PNG_IMAGE_SIZE(image));
    assert_non_null(rgb);
    assert_true(png_image_finish_read(&image, NULL, rgb, 0, NULL));
    assert_int_equal(image.width, WIDTH);
    return rgb;
}

static const uint8_t *pixel(const uint8_t *rgb, double x, double y)
{
    return rgb + 3 * ((size_t)(y * HEIGHT) * WIDTH + (size_t)(x * WIDTH));
}

static int difference(const uint8_t *a, const uint8_t *b)
{
    return abs(a[0] - b[0]) + abs(a[1] - b[1]) + abs(a[2] - b[2]);
}

static const double window[6] = {-1, -1.4, -1, 5, 2.4, 1};  // about two cubes, 3 apart

static void instances_have_hues_of_their_own(void **state)
{
    (void)state;
    uint8_t *rgb = draw("collide none\ninstances 2 step 3 0 0\nstep\n", 0, window);
    const uint8_t *paper = pixel(rgb, 0.01, 0.01), *first = pixel(rgb, 0.26, 0.45);
    const uint8_t *second = pixel(rgb, 0.73, 0.45), *between = pixel(rgb, 0.5, 0.45);
    check_at_least(difference(first, paper), 60);
    check_at_least(difference(second, paper), 60);
    check_at_least(difference(first, second), 60);
    check_at_most(difference(between, paper), 3);
    free(rgb);
}

static void states_are_those_of_their_steps(void **state)
{
    (void)state;
    // The second is carried to the middle.
    static const char script[] = "collide none\ninstances 2 step 3 0 0\n"
                                 "grab instance 1 near 3.5 0.5 0.5 radius 3 hand\n"
                                 "move hand 2 0.5 0.5 over 4\nstep 8\nexpect nobody 0 0 0 1\n";
    uint8_t *rgb = draw(script, 4, window);
    const uint8_t *paper = pixel(rgb, 0.01, 0.01);
    check_at_least(difference(pixel(rgb, 0.5, 0.45), paper), 60);
    check_at_most(difference(pixel(rgb, 0.73, 0.45), paper), 3);
    free(rgb);

    static const int64_t steps[] = {0, 2, 8};
    pliant_scene_recording *recording = NULL;
    pliant_error err = {""};
    check_ok(pliant_scene_recording_create(cube, in_folder("s.script"), steps, 3, &recording, &err),
             &err);
    assert_int_equal(recording->count, 3);
    assert_int_equal(recording->instance_count, 2);
    const int32_t n = recording->vertex_count / 2;
    static const float x[] = {3, 2.25f, 1.5f};
    for (int k = 0; k < 3; k++) {
        assert_int_equal(recording->states[k].step, steps[k]);
        check_near((double)recording->states[k].displacement[n].x, (double)x[k], 1e-5);
        check_near((double)recording->states[k].displacement[0].x, 0, 1e-5);
    }
    pliant_scene_recording_destroy(recording);
}

static void obstacles_are_drawn_where_they_are(void **state)
{
    (void)state;
    uint8_t *without = draw("step\n", 1, window);
    uint8_t *with =
        draw("sphere 3.5 0.5 0 0.9 as ball\nstep 2\nmove ball 3.5 0.5 0.1\nstep\n", 1, window);
    check_at_most(difference(pixel(without, 0.73, 0.45), pixel(without, 0.01, 0.01)), 3);
    check_at_least(difference(pixel(with, 0.73, 0.45), pixel(with, 0.01, 0.01)), 20);
    check_at_most(difference(pixel(with, 0.26, 0.45), pixel(without, 0.26, 0.45)), 30);
    free(without);
    // A plane under all of it fills the panel; shadows lie on it.
    uint8_t *plane = draw("plane 0 0 1 -1\nstep\n", 1, window);
    check_at_least(difference(pixel(plane, 0.5, 0.45), pixel(with, 0.5, 0.45)), 4);
    free(plane);
    free(with);
}

static void drawings_are_the_same_bytes_every_time(void **state)
{
    (void)state;
    static const char script[] = "gravity 0 0 -10\ndt 0.01\ninstances 4 step 1.1 1.1 1.1 columns 2 "
                                 "rows 1 random 3\nplane 0 0 1 -0.5 friction 0.4\nstep 60\n";
    uint8_t *first = draw(script, 60, NULL), *second = draw(script, 60, NULL);
    assert_memory_equal(first, second, (size_t)3 * WIDTH * HEIGHT);
    free(first);
    free(second);
}

static void what_cannot_be_drawn_is_refused(void **state)
{
    (void)state;
    static const struct {
        const char *script, *part;
        int64_t step;
        int32_t level;
    } cases[] = {
        {"step 3\n", "step 4: expected one of its 3 steps", 4, -1},
        {"displace 3 0 0 1\nstep\n", "displace is about Green's functions", 1, -1},
        {"step\n", "--level is about Green's functions", 1, 0},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char model[128], path[128], output[128];
        pliant_error err = {""};
        write_script(cases[i].script);
        snprintf(model, sizeof model, "%s", in_folder("m.h5"));
        snprintf(path, sizeof path, "%s", in_folder("s.script"));
        snprintf(output, sizeof output, "%s", in_folder("none.png"));
        const pliant_draw_options options = {.model = model,
                                             .script = path,
                                             .output = output,
                                             .picture = pliant_picture_default(),
                                             .show = PLIANT_SHOW_DEFORMED,
                                             .level = cases[i].level,
                                             .steps = {cases[i].step},
                                             .step_count = 1};
        assert_true(pliant_drawing_make(&options, &err) < 0);
        if (!strstr(err.text, cases[i].part)) fail_msg("%s: %s", cases[i].part, err.text);
        assert_int_not_equal(access(output, F_OK), 0);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(instances_have_hues_of_their_own),
        cmocka_unit_test(states_are_those_of_their_steps),
        cmocka_unit_test(obstacles_are_drawn_where_they_are),
        cmocka_unit_test(drawings_are_the_same_bytes_every_time),
        cmocka_unit_test(what_cannot_be_drawn_is_refused),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
