// test_draw.c: the picture, its file and the command line of pliant-draw.
#include "check.h"

#include "draw/drawing.h"
#include "draw/options.h"
#include "draw/picture.h"
#include "draw/png_file.h"
#include "draw/recorder.h"
#include "draw/recording.h"
#include "surfaces.h"
#include "synthetic_model.h"

#include <math.h>
#include <png.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <unistd.h>

// ---- Files ----

// A folder for one test's files, removed with them.
typedef struct folder {
    char path[64], file[80], temporary[96];
} folder;

static folder make_folder(void)
{
    folder f = {.path = "/tmp/pliant-draw-XXXXXX"};
    assert_non_null(mkdtemp(f.path));
    snprintf(f.file, sizeof f.file, "%s/a.png", f.path);
    snprintf(f.temporary, sizeof f.temporary, "%s.tmp", f.file);
    return f;
}

static void remove_folder(const folder *f)
{
    assert_int_not_equal(access(f->temporary, F_OK), 0);
    unlink(f->file);
    assert_int_equal(rmdir(f->path), 0);
}

// The pixels of a PNG file; freed by the caller.
static uint8_t *read_png(const char *path, int32_t *width, int32_t *height)
{
    png_image image = {.version = PNG_IMAGE_VERSION};
    assert_true(png_image_begin_read_from_file(&image, path));
    image.format = PNG_FORMAT_RGB;
    uint8_t *rgb = malloc(PNG_IMAGE_SIZE(image));
    assert_non_null(rgb);
    assert_true(png_image_finish_read(&image, NULL, rgb, 0, NULL));
    *width = (int32_t)image.width;
    *height = (int32_t)image.height;
    return rgb;
}

static void png_files_give_back_their_pixels(void **state)
{
    (void)state;
    const folder f = make_folder();
    check_random random = check_random_seed(9);
    uint8_t rgb[17 * 11 * 3];
    for (size_t i = 0; i < sizeof rgb; i++) rgb[i] = (uint8_t)(256 * check_random_next(&random));
    pliant_error err;
    check_ok(pliant_png_file_write(f.file, 17, 11, rgb, &err), &err);
    int32_t width, height;
    uint8_t *found = read_png(f.file, &width, &height);
    assert_int_equal(width, 17);
    assert_int_equal(height, 11);
    assert_memory_equal(found, rgb, sizeof rgb);
    free(found);
    remove_folder(&f);
}

static void png_into_a_missing_folder_is_refused(void **state)
{
    (void)state;
    const uint8_t rgb[3] = {0};
    pliant_error err = {""};
    assert_int_equal(pliant_png_file_write("/tmp/no such folder/a.png", 1, 1, rgb, &err),
                     PLIANT_ERR_IO);
    assert_string_equal(err.text,
                        "/tmp/no such folder/a.png: cannot write: No such file or directory");
}

static void full_disk_leaves_the_old_picture(void **state)
{
    (void)state;
    const folder f = make_folder();
    const uint8_t old[3] = {1, 2, 3};
    pliant_error err = {""};
    check_ok(pliant_png_file_write(f.file, 1, 1, old, &err), &err);
    // A limit on the size of files stands for a full disk: noise of 120,000 bytes does not
    // compress.
    uint8_t *noise = malloc(200 * 200 * 3);
    assert_non_null(noise);
    check_random random = check_random_seed(11);
    for (size_t i = 0; i < 200 * 200 * 3; i++)
        noise[i] = (uint8_t)(256 * check_random_next(&random));
    struct rlimit before, small;
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &before), 0);
    small = before;
    small.rlim_cur = 20000;
    void (*handler)(int) = signal(SIGXFSZ, SIG_IGN);
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &small), 0);
    const pliant_status status = pliant_png_file_write(f.file, 200, 200, noise, &err);
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &before), 0);
    signal(SIGXFSZ, handler);
    free(noise);
    assert_int_equal(status, PLIANT_ERR_IO);
    assert_non_null(strstr(err.text, "a.png: cannot write: "));
    int32_t width, height;
    uint8_t *found = read_png(f.file, &width, &height);
    assert_int_equal(width * height, 1);
    assert_memory_equal(found, old, 3);
    free(found);
    remove_folder(&f);
}

// ---- Picture ----

typedef struct scene {
    check_surface sphere;
    uint8_t *held;
    pliant_vec3 *u;
    pliant_body_shape shape;
} scene;

// A unit sphere, held below z = -0.5, whose top is moved up by 1.
static scene make_scene(void)
{
    scene s = {.sphere = check_sphere(3)};
    const pliant_mesh *mesh = s.sphere.mesh;
    s.held = calloc((size_t)mesh->vertex_count, 1);
    s.u = calloc((size_t)mesh->vertex_count, sizeof *s.u);
    assert_non_null(s.held);
    assert_non_null(s.u);
    for (int32_t v = 0; v < mesh->vertex_count; v++) {
        const double z = mesh->vertices[3 * (size_t)v + 2];
        s.held[v] = z < -0.5;
        if (z > 0.5) s.u[v].z = 1;
    }
    s.shape = (pliant_body_shape){.vertex_count = mesh->vertex_count,
                                  .face_count = mesh->face_count,
                                  .rest = mesh->vertices,
                                  .faces = mesh->faces,
                                  .held = s.held};
    return s;
}

static void drop_scene(scene *s)
{
    free(s->u);
    free(s->held);
    check_surface_destroy(&s->sphere);
}

static uint8_t *draw(const pliant_picture_def *def, const scene *s, const pliant_panel *panels,
                     int32_t count)
{
    uint8_t *rgb = malloc(3 * (size_t)def->width * (size_t)def->height);
    assert_non_null(rgb);
    pliant_error err = {""};
    check_ok(pliant_picture_draw(def, &s->shape, panels, count, rgb, &err), &err);
    return rgb;
}

static pliant_picture_def level_view(void)
{
    pliant_picture_def def = pliant_picture_default();
    def.width = 400;
    def.height = 240;
    def.elevation = 0;  // no shadow: what is not paper is the body
    return def;
}

static void a_sphere_is_drawn_as_a_disc_in_the_middle(void **state)
{
    (void)state;
    scene s = make_scene();
    const pliant_picture_def def = level_view();
    const pliant_panel rest = {.label = ""};
    uint8_t *rgb = draw(&def, &s, &rest, 1);
    // Measure what is not paper.
    int count = 0, low[2] = {999, 999}, high[2] = {0, 0};
    for (int y = 0; y < def.height; y++)
        for (int x = 0; x < def.width; x++) {
            if (memcmp(rgb + 3 * (y * def.width + x), rgb, 3) == 0) continue;
            count++;
            const int at[2] = {x, y};
            for (int c = 0; c < 2; c++) {
                if (at[c] < low[c]) low[c] = at[c];
                if (at[c] > high[c]) high[c] = at[c];
            }
        }
    // One panel without a legend: the frame is the picture less gaps and a label's line.
    const double diameter = high[1] - low[1] + 1;
    check_near(high[0] - low[0] + 1, diameter, 3);
    check_at_least(diameter, 0.75 * def.height);
    check_near(low[0] + high[0], def.width - 1, 3);
    // A polyhedral disc, its rim's pixels counted whole: pi d^2 / 4 within the rim, pi d.
    check_near(count, 0.785398 * diameter * diameter, 3.2 * diameter);
    free(rgb);
    drop_scene(&s);
}

static void held_vertices_look_bluer_and_moved_ones_redder(void **state)
{
    (void)state;
    scene s = make_scene();
    const pliant_picture_def def = level_view();
    const pliant_panel panels[2] = {{.label = ""}, {.displacement = s.u, .label = ""}};
    uint8_t *rgb = draw(&def, &s, panels, 2);
    // Both panels share one camera, so that the raised top's panel shows the rest sphere at the
    // same place: in the left panel the upper half is paper.
    int blue = 0, red = 0, red_left = 0;
    for (int i = 0; i < def.width * (def.height - 36); i++) {  // above the legend
        const int excess = rgb[3 * i] - rgb[3 * i + 2];
        if (excess < -20) blue++;
        if (excess > 60) {
            if (i % def.width < def.width / 2) red_left++;
            else red++;
        }
    }
    check_at_least(blue, 200);
    check_at_least(red, 500);
    assert_int_equal(red_left, 0);
    free(rgb);
    drop_scene(&s);
}

static void contact_is_marked_by_an_arrow_on_its_side(void **state)
{
    (void)state;
    scene s = make_scene();
    const pliant_picture_def def = level_view();
    int32_t top = 0;
    for (int32_t v = 0; v < s.shape.vertex_count; v++)
        if (s.shape.rest[3 * (size_t)v + 2] > s.shape.rest[3 * (size_t)top + 2]) top = v;
    for (int push = 0; push < 2; push++) {
        // Both arrows, one in, one out, stand above the top: that is where the tool is.
        const pliant_mark marks[2] = {{.vertex = top, .direction = {0, 0, push ? -0.3 : 0.3}},
                                      {.vertex = top, .direction = {0, 0, 0}}};
        const pliant_panel panel = {.marks = &marks[0], .mark_count = 1, .label = ""};
        const pliant_panel bare = {.marks = &marks[1], .mark_count = 1, .label = ""};
        uint8_t *with = draw(&def, &s, &panel, 1), *without = draw(&def, &s, &bare, 1);
        int top_row = 0, above = 0, below = 0;
        while (memcmp(without + 3 * (top_row * def.width + def.width / 2), without, 3) == 0)
            top_row++;
        top_row += 6;  // the arrow's halo
        for (int i = 0; i < def.width * def.height; i++)
            if (memcmp(with + 3 * i, without + 3 * i, 3) != 0) {
                if (i / def.width < top_row) above++;
                else below++;
            }
        check_at_least(above, 40);
        assert_int_equal(below, 0);
        free(with);
        free(without);
    }
    drop_scene(&s);
}

static void magnified_displacement_reaches_further(void **state)
{
    (void)state;
    scene s = make_scene();
    pliant_picture_def def = level_view();
    const pliant_panel panels[2] = {{.label = ""}, {.displacement = s.u, .label = ""}};
    int size[2];
    for (int k = 0; k < 2; k++) {
        def.magnify = k ? 3 : 1;
        uint8_t *rgb = draw(&def, &s, panels, 2);
        size[k] = 0;
        for (int y = 0; y < def.height - 60; y++)  // the rest shape, above label and legend
            for (int x = 0; x < def.width / 2; x++)
                size[k] += memcmp(rgb + 3 * (y * def.width + x), rgb, 3) != 0;
        free(rgb);
    }
    // The taller the deformed shape, 3 and 5, the smaller both: (5/3)^2 = 2.8 in area.
    check_near((double)size[0] / size[1], 2.8, 0.4);
    drop_scene(&s);
}

static void pictures_are_the_same_bytes_every_time(void **state)
{
    (void)state;
    scene s = make_scene();
    pliant_picture_def def = level_view();
    def.elevation = 30;
    const pliant_mark mark = {.vertex = 3, .direction = {0, 0, 1}};
    const pliant_panel panels[2] = {
        {.label = "rest"},
        {.displacement = s.u, .marks = &mark, .mark_count = 1, .label = "step 1"}};
    uint8_t *first = draw(&def, &s, panels, 2), *second = draw(&def, &s, panels, 2);
    assert_memory_equal(first, second, 3 * (size_t)def.width * (size_t)def.height);
    free(first);
    free(second);
    drop_scene(&s);
}

static void displacements_that_are_not_finite_are_refused(void **state)
{
    (void)state;
    scene s = make_scene();
    const pliant_picture_def def = level_view();
    uint8_t *rgb = malloc(3 * (size_t)def.width * (size_t)def.height);
    const float odd[] = {NAN, INFINITY, 3e38f};
    for (int k = 0; k < 3; k++) {
        s.u[7].y = odd[k];
        const pliant_panel panel = {.displacement = s.u, .label = "step 4"};
        pliant_error err = {""};
        assert_int_equal(pliant_picture_draw(&def, &s.shape, &panel, 1, rgb, &err),
                         PLIANT_ERR_ARGUMENT);
        assert_non_null(strstr(err.text, "step 4: vertex 7: "));
    }
    const pliant_mark mark = {.vertex = s.shape.vertex_count};
    const pliant_panel panel = {.marks = &mark, .mark_count = 1};
    assert_int_equal(pliant_picture_draw(&def, &s.shape, &panel, 1, rgb, NULL),
                     PLIANT_ERR_ARGUMENT);
    free(rgb);
    drop_scene(&s);
}

// ---- Command line ----

// Split at spaces and parse.
static pliant_status parse(const char *line, pliant_draw_options *options, pliant_error *err)
{
    static char text[256];  // options borrow from it
    static char *argv[24];
    int argc = 0;
    snprintf(text, sizeof text, "pliant-draw %s", line);
    for (char *word = strtok(text, " "); word; word = strtok(NULL, " ")) argv[argc++] = word;
    argv[argc] = NULL;
    return pliant_draw_options_parse(argc, argv, options, err);
}

static void options_mean_what_the_help_says(void **state)
{
    (void)state;
    pliant_draw_options o;
    pliant_error err = {""};
    check_ok(
        parse("a.h5 b.script -o c.png --steps 0,5,12 --sheet 2x3 --show deformed --view -30.5,40 "
              "--size 640x480 --magnify 2.5 --range 0.01 --level 3 --region -1,-2,-3,4,5,6 --lattice",
              &o, &err),
        &err);
    assert_string_equal(o.model, "a.h5");
    assert_string_equal(o.script, "b.script");
    assert_string_equal(o.output, "c.png");
    assert_int_equal(o.step_count, 3);
    assert_int_equal(o.steps[0], 0);
    assert_int_equal(o.steps[2], 12);
    assert_int_equal(o.sheet_columns, 2);
    assert_int_equal(o.sheet_rows, 3);
    assert_int_equal(o.show, PLIANT_SHOW_DEFORMED);
    check_near(o.picture.azimuth, -30.5, 0);
    check_near(o.picture.elevation, 40, 0);
    assert_int_equal(o.picture.width, 640);
    assert_int_equal(o.picture.height, 480);
    check_near(o.picture.magnify, 2.5, 0);
    check_near(o.picture.range, 0.01, 0);
    assert_int_equal(o.level, 3);
    assert_int_equal(o.picture.has_region, 1);
    check_near(o.picture.region[2], -3, 0);
    check_near(o.picture.region[5], 6, 0);
    assert_int_equal(o.lattice, 1);
    check_ok(parse("--output=c.png -- -odd.h5", &o, &err), &err);
    assert_string_equal(o.model, "-odd.h5");
    assert_null(o.script);
    assert_int_equal(o.level, -1);
    check_ok(parse("--help", &o, &err), &err);
    assert_int_equal(o.help, 1);
}

static void bad_options_are_refused_by_name(void **state)
{
    (void)state;
    static const struct {
        const char *line, *part;
    } cases[] = {
        {"", "MODEL.h5"},
        {"a.h5", "-o"},
        {"a.h5 b c -o d", "found 3 names"},
        {"a.h5 b -o", "-o: expected a value"},
        {"a.h5 b -o d --sideways", "--sideways: unknown option"},
        {"a.h5 b -o d -x", "unknown option"},
        {"a.h5 b -o d --step", "--step: expected a value"},
        {"a.h5 b -o d --step -1", "--step"},
        {"a.h5 b -o d --step 9223372036854775807", "--step"},
        {"a.h5 b -o d --step 99999999999999999999", "--step"},
        {"a.h5 b -o d --step 3x", "'3x'"},
        {"a.h5 b -o d --steps 1,", "--steps"},
        {"a.h5 b -o d --steps 1,1", "ascending"},
        {"a.h5 b -o d --steps 1;2", "--steps"},
        {"a.h5 b -o d --sheet 0", "--sheet"},
        {"a.h5 b -o d --sheet 9x9", "64 panels"},
        {"a.h5 b -o d --sheet 2x", "--sheet"},
        {"a.h5 b -o d --sheet 2x1 --steps 1,2,3", "cannot hold 3"},
        {"a.h5 - -o d --sheet 3", "standard input"},
        {"a.h5 -o d --step 3", "SCRIPT"},
        {"a.h5 b -o d --show all", "'all'"},
        {"a.h5 b -o d --view 30", "--view"},
        {"a.h5 b -o d --view 30,91", "--view"},
        {"a.h5 b -o d --view nan,0", "--view"},
        {"a.h5 b -o d --size 640", "--size"},
        {"a.h5 b -o d --size 640x63", "--size"},
        {"a.h5 b -o d --size 4097x640", "--size"},
        {"a.h5 b -o d --magnify inf", "--magnify"},
        {"a.h5 b -o d --range 0", "--range"},
        {"a.h5 b -o d --level 16", "--level"},
        {"a.h5 b -o d --region 0,0,0,1,1", "--region"},
        {"a.h5 b -o d --region 0,0,0,1,1,0", "least corner first"},
        {"a.h5 b -o d --region 0,0,0,1,1,1,1", "--region"},
        {"a.h5 b -o d --region 0,0,0,1,1,inf", "--region"},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        pliant_draw_options options;
        pliant_error err = {""};
        const pliant_status status = parse(cases[k].line, &options, &err);
        if (status != PLIANT_ERR_ARGUMENT || !strstr(err.text, cases[k].part))
            fail_msg("'%s': %s: '%s' without '%s'", cases[k].line, pliant_status_name(status),
                     err.text, cases[k].part);
    }
}

// ---- From model and script to a picture ----

// A small model and a script beside it: presses the top, 3 steps, lets go, 1 step.
typedef struct stage {
    folder folder;
    char model[80], script[80];
} stage;

static stage make_stage(const char *script)
{
    stage s = {.folder = make_folder()};
    snprintf(s.model, sizeof s.model, "%s/m.h5", s.folder.path);
    snprintf(s.script, sizeof s.script, "%s/s.script", s.folder.path);
    check_write_synthetic_model(s.model, NULL, 2, 0, pliant_wavelet_default(), CHECK_FREE_BLOCK);
    FILE *stream = fopen(s.script, "w");
    assert_non_null(stream);
    assert_true(fputs(script, stream) >= 0);
    assert_int_equal(fclose(stream), 0);
    return s;
}

static void drop_stage(const stage *s)
{
    unlink(s->model);
    unlink(s->script);
    remove_folder(&s->folder);
}

static const char press_and_release[] = "pliant-script 1\n"
                                        "probe top near 0 0 1\n"
                                        "displace near 0 0 1 0 0 -0.1\n"
                                        "step\n"
                                        "displace near 0 0 1 0 0 -0.2\n"
                                        "step 2\n"
                                        "expect top 9 9 9 1\n"
                                        "release all\n"
                                        "step\n";

static pliant_draw_options options_for(const stage *s)
{
    pliant_draw_options options = {.model = s->model,
                                   .script = s->script,
                                   .output = s->folder.file,
                                   .picture = pliant_picture_default(),
                                   .level = -1};
    options.picture.elevation = 0;  // no shadow: what is not paper is the body
    options.picture.width = 320;
    options.picture.height = 200;
    return options;
}

static void recorded_states_are_those_of_their_steps(void **state)
{
    (void)state;
    const stage s = make_stage(press_and_release);
    pliant_model *model = NULL;
    pliant_error err = {""};
    check_ok(pliant_model_open(s.model, &model, &err), &err);
    const int32_t top = pliant_model_nearest(model, (const double[3]){0, 0, 1});
    const int64_t steps[] = {0, 1, 3, PLIANT_RECORDING_END};
    const double expected[] = {0, -0.1, -0.2, 0};
    pliant_recording *recording = NULL;
    check_ok(pliant_recording_create(model, 2, s.script, steps, 4, &recording, &err), &err);
    assert_int_equal(recording->count, 4);
    for (int k = 0; k < 4; k++) {
        const struct pliant_recorded_state *r = &recording->states[k];
        assert_int_equal(r->step, k == 3 ? 4 : steps[k]);
        // A prescribed displacement is met to the round-off of floats.
        check_near((double)r->displacement[top].z, expected[k], 1e-6);
        assert_int_equal(r->mark_count, k == 1 || k == 2);
        if (r->mark_count) assert_int_equal(r->marks[0].vertex, top);
    }
    pliant_recording_destroy(recording);
    recording = NULL;
    // Steps that are not there, or not in order.
    const int64_t beyond[] = {2, 5}, backwards[] = {3, 1};
    assert_int_equal(pliant_recording_create(model, 2, s.script, beyond, 2, &recording, &err),
                     PLIANT_ERR_ARGUMENT);
    assert_non_null(strstr(err.text, "step 5: expected one of its 4 steps"));
    assert_int_equal(pliant_recording_create(model, 2, s.script, backwards, 2, &recording, &err),
                     PLIANT_ERR_ARGUMENT);
    assert_int_equal(pliant_recording_create(model, 3, s.script, steps, 4, &recording, &err),
                     PLIANT_ERR_ARGUMENT);
    assert_null(recording);
    int64_t count = 0;
    check_ok(pliant_recorder_count_steps(s.script, &count, &err), &err);
    assert_int_equal(count, 4);
    pliant_model_close(model);
    drop_stage(&s);
}

static void recorded_tools_and_patches_have_marks(void **state)
{
    (void)state;
    const stage s = make_stage("pliant-script 1\n"
                               "tool ball sphere 0 0 1.25 0.3\n"
                               "step\n"
                               "patch thumb tolerance 1e-3\n"
                               "patch thumb near 1 0 0 -0.1 0 0\n"
                               "step\n"
                               "drop ball\n"
                               "step\n");
    pliant_model *model = NULL;
    pliant_error err = {""};
    check_ok(pliant_model_open(s.model, &model, &err), &err);
    const int32_t side = pliant_model_nearest(model, (const double[3]){1, 0, 0});
    const double *x = pliant_model_positions(model);
    const int64_t steps[] = {1, 2, 3};
    pliant_recording *recording = NULL;
    check_ok(pliant_recording_create(model, 2, s.script, steps, 3, &recording, &err), &err);
    const int32_t touched = recording->states[0].mark_count;
    check_at_least(touched, 1);
    for (int32_t i = 0; i < touched; i++) {
        const pliant_mark *mark = &recording->states[0].marks[i];
        check_at_least(x[3 * mark->vertex + 2], 0.8);  // at the top, under the ball
        check_at_most(mark->direction[2], 0);
    }
    assert_int_equal(recording->states[1].mark_count, touched + 1);
    assert_int_equal(recording->states[2].mark_count, 1);
    assert_int_equal(recording->states[2].marks[0].vertex, side);
    check_near(recording->states[2].marks[0].direction[0], -0.1, 1e-6);
    // Where they are.
    check_near((double)recording->states[2].displacement[side].x, -0.1, 2e-3);
    pliant_recording_destroy(recording);
    pliant_model_close(model);
    drop_stage(&s);
}

// Pixels of columns [x0, x1) above the legend that differ from the picture's corner.
static int count_drawn(const uint8_t *rgb, int32_t width, int32_t height, int32_t x0, int32_t x1)
{
    int count = 0;
    for (int32_t y = 0; y < height - 50; y++)
        for (int32_t x = x0; x < x1; x++) count += memcmp(rgb + 3 * (y * width + x), rgb, 3) != 0;
    return count;
}

static void picture_of_a_step_has_the_rest_shape_beside_it(void **state)
{
    (void)state;
    const stage s = make_stage(press_and_release);
    pliant_draw_options options = options_for(&s);
    options.steps[0] = 2;
    options.step_count = 1;
    pliant_error err = {""};
    check_ok(pliant_drawing_make(&options, &err), &err);
    int32_t width, height;
    uint8_t *rgb = read_png(s.folder.file, &width, &height);
    assert_int_equal(width, 320);
    assert_int_equal(height, 200);
    // Each panel holds a disc about 130 pixels across, or 13,000 pixels; the margin is paper.
    check_at_least(count_drawn(rgb, width, height, 0, 160), 8000);
    check_at_least(count_drawn(rgb, width, height, 160, 320), 8000);
    assert_int_equal(count_drawn(rgb, width, height, 0, 8), 0);
    // Only the right one is coloured.
    int red[2] = {0, 0};
    for (int32_t i = 0; i < width * (height - 50); i++)
        if (rgb[3 * i] - rgb[3 * i + 2] > 90) red[i % width >= 160]++;
    assert_int_equal(red[0], 0);
    check_at_least(red[1], 20);
    free(rgb);
    drop_stage(&s);
}

static void coarse_levels_and_single_panels_are_drawn(void **state)
{
    (void)state;
    const stage s = make_stage(press_and_release);
    for (int show = PLIANT_SHOW_DEFORMED; show <= PLIANT_SHOW_REST; show++) {
        pliant_draw_options options = options_for(&s);
        options.show = (pliant_draw_show)show;
        options.level = 0;
        options.picture.width = options.picture.height = 0;
        pliant_error err = {""};
        check_ok(pliant_drawing_make(&options, &err), &err);
        int32_t width, height;
        uint8_t *rgb = read_png(s.folder.file, &width, &height);
        check_at_least(count_drawn(rgb, width, height, 0, width), 0.2 * width * height);
        free(rgb);
    }
    drop_stage(&s);
}

// A sphere whose finer vertices have waves: its outline is no longer that of the control mesh, and
// it is pressed where that is pressed.
static void detailed_surfaces_are_drawn_over_any_level(void **state)
{
    (void)state;
    const stage s = make_stage(press_and_release);
    pliant_draw_options options = options_for(&s);
    pliant_error err = {""};
    options.detail = 1;
    assert_int_equal(pliant_drawing_make(&options, &err), PLIANT_ERR_MISSING);
    assert_non_null(strstr(err.text, "/detail: expected geometric detail"));
    assert_int_not_equal(access(s.folder.file, F_OK), 0);

    check_synthetic *body = check_synthetic_create(&(check_synthetic_def){
        .levels = 2, .wavelet = pliant_wavelet_default(), .blocks = CHECK_FREE_BLOCK});
    check_synthetic_roughen(body, 2);
    check_synthetic_write(body, s.model);
    check_synthetic_destroy(body);
    int drawn[3], red[3];
    for (int k = 0; k < 3; k++) {
        options.detail = k > 0;
        options.level = k == 2 ? 0 : 2;
        options.steps[0] = 2;
        options.step_count = 1;
        check_ok(pliant_drawing_make(&options, &err), &err);
        int32_t width, height;
        uint8_t *rgb = read_png(s.folder.file, &width, &height);
        drawn[k] = count_drawn(rgb, width, height, 0, 160);
        red[k] = 0;
        for (int32_t i = 0; i < width * (height - 50); i++)
            if (i % width >= 160 && rgb[3 * i] - rgb[3 * i + 2] > 90) red[k]++;
        free(rgb);
    }
    // The frame fits what is drawn, so that areas tell shapes apart, not sizes.
    assert_int_not_equal(drawn[0], drawn[1]);
    for (int k = 0; k < 3; k++) {
        check_at_least(drawn[k], 8000);
        check_at_least(red[k], 20);
    }
    drop_stage(&s);
}

static void contact_sheet_has_a_panel_for_each_step(void **state)
{
    (void)state;
    const stage s = make_stage(press_and_release);
    pliant_draw_options options = options_for(&s);
    options.sheet_columns = 4;
    pliant_error err = {""};
    check_ok(pliant_drawing_make(&options, &err), &err);
    int32_t width, height;
    uint8_t *rgb = read_png(s.folder.file, &width, &height);
    for (int k = 0; k < 4; k++)
        check_at_least(count_drawn(rgb, width, height, 80 * k, 80 * (k + 1)), 2000);
    free(rgb);
    drop_stage(&s);
}

static void drawings_are_the_same_bytes_every_time(void **state)
{
    (void)state;
    const stage s = make_stage(press_and_release);
    pliant_draw_options options = options_for(&s);
    options.steps[0] = 3;
    options.step_count = 1;
    char *bytes[2];
    size_t sizes[2];
    for (int k = 0; k < 2; k++) {
        pliant_error err = {""};
        check_ok(pliant_drawing_make(&options, &err), &err);
        FILE *stream = fopen(s.folder.file, "rb");
        assert_non_null(stream);
        bytes[k] = malloc(1 << 20);
        sizes[k] = fread(bytes[k], 1, 1 << 20, stream);
        fclose(stream);
    }
    assert_int_equal(sizes[0], sizes[1]);
    check_at_least((double)sizes[0], 1000);
    assert_memory_equal(bytes[0], bytes[1], sizes[0]);
    free(bytes[0]);
    free(bytes[1]);
    drop_stage(&s);
}

static void what_cannot_be_drawn_is_refused_and_leaves_no_file(void **state)
{
    (void)state;
    const stage s = make_stage("pliant-script 1\ndisplace 3 0 0 x\n");
    pliant_error err = {""};
    pliant_draw_options options = options_for(&s);
    assert_int_equal(pliant_drawing_make(&options, &err), PLIANT_ERR_FORMAT);
    assert_non_null(strstr(err.text, "s.script:2:"));
    options = options_for(&s);
    options.level = 3;
    assert_int_equal(pliant_drawing_make(&options, &err), PLIANT_ERR_ARGUMENT);
    assert_non_null(strstr(err.text, "--level 3: expected 0 to 2"));
    options = options_for(&s);
    options.script = "/tmp/no such.script";
    assert_true(pliant_drawing_make(&options, &err) < 0);
    assert_non_null(strstr(err.text, "/tmp/no such.script"));
    options = options_for(&s);
    options.model = s.script;
    assert_true(pliant_drawing_make(&options, &err) < 0);
    assert_non_null(strstr(err.text, s.script));
    assert_int_not_equal(access(s.folder.file, F_OK), 0);
    options = options_for(&s);
    options.script = NULL;
    options.output = "/tmp/no such folder/a.png";
    assert_int_equal(pliant_drawing_make(&options, &err), PLIANT_ERR_IO);
    drop_stage(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(png_files_give_back_their_pixels),
        cmocka_unit_test(png_into_a_missing_folder_is_refused),
        cmocka_unit_test(full_disk_leaves_the_old_picture),
        cmocka_unit_test(a_sphere_is_drawn_as_a_disc_in_the_middle),
        cmocka_unit_test(held_vertices_look_bluer_and_moved_ones_redder),
        cmocka_unit_test(contact_is_marked_by_an_arrow_on_its_side),
        cmocka_unit_test(magnified_displacement_reaches_further),
        cmocka_unit_test(pictures_are_the_same_bytes_every_time),
        cmocka_unit_test(displacements_that_are_not_finite_are_refused),
        cmocka_unit_test(options_mean_what_the_help_says),
        cmocka_unit_test(bad_options_are_refused_by_name),
        cmocka_unit_test(recorded_states_are_those_of_their_steps),
        cmocka_unit_test(recorded_tools_and_patches_have_marks),
        cmocka_unit_test(picture_of_a_step_has_the_rest_shape_beside_it),
        cmocka_unit_test(coarse_levels_and_single_panels_are_drawn),
        cmocka_unit_test(detailed_surfaces_are_drawn_over_any_level),
        cmocka_unit_test(contact_sheet_has_a_panel_for_each_step),
        cmocka_unit_test(drawings_are_the_same_bytes_every_time),
        cmocka_unit_test(what_cannot_be_drawn_is_refused_and_leaves_no_file),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
