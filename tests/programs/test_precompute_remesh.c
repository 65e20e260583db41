// test_precompute_remesh.c: pliant-precompute --remesh from the outside: meshes, models, refusals.
#include "check.h"
#include "command.h"
#include "surfaces.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const char name[] = "pliant-precompute: ";

static const char *in_folder(const char *file)
{
    static char paths[4][512];
    static int turn;
    char *path = paths[turn++ % 4];
    snprintf(path, sizeof paths[0], "%s/%s", check_folder(), file);
    return path;
}

static void write_obj(const pliant_mesh *mesh, int32_t face_count, const char *path)
{
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    for (int32_t v = 0; v < mesh->vertex_count; v++)
        fprintf(file, "v %.17g %.17g %.17g\n", mesh->vertices[3 * v], mesh->vertices[3 * v + 1],
                mesh->vertices[3 * v + 2]);
    for (int32_t f = 0; f < face_count; f++)
        fprintf(file, "f %d %d %d\n", mesh->faces[3 * f] + 1, mesh->faces[3 * f + 1] + 1,
                mesh->faces[3 * f + 2] + 1);
    assert_int_equal(fclose(file), 0);
}

// A mesh without levels.
static const char *torus(void)
{
    const char *path = in_folder("torus.obj");
    pliant_mesh *mesh = check_torus(13, 21);
    write_obj(mesh, mesh->face_count, path);
    pliant_mesh_destroy(mesh);
    return path;
}

static void a_mesh_alone_is_written_and_told_of(void **state)
{
    (void)state;
    check_command c;
    const char *input = torus(), *output = in_folder("made.obj");
    check_run(&c, "%s/pliant-precompute --remesh 40 --levels 2 --mesh-only --json %s -o %s",
              check_build(), input, output);
    if (c.status != 0) fail_msg("%s", c.errors);
    assert_non_null(strstr(c.output, "\"vertices\": 640"));
    assert_non_null(strstr(c.output, "\"flipped\": 0"));
    assert_non_null(strstr(c.output, "\"met\": true"));
    assert_non_null(strstr(c.errors, "remeshed: 40 base vertices, 2 levels above, 640 vertices"));
    pliant_mesh *mesh = check_load_obj(output);
    assert_non_null(mesh);
    assert_int_equal(mesh->vertex_count, 640);
    assert_int_equal(mesh->face_count, 1280);
    // The same mesh as PLY.
    const char *ply = in_folder("made.ply");
    check_run(&c, "%s/pliant-precompute -q --remesh 40 --levels 2 --mesh-only %s -o %s",
              check_build(), input, ply);
    assert_int_equal(c.status, 0);
    assert_string_equal(c.errors, "");
    FILE *file = fopen(ply, "rb");
    assert_non_null(file);
    char line[128];
    do assert_non_null(fgets(line, sizeof line, file));
    while (strcmp(line, "end_header\n") != 0);
    double *vertices = malloc(3 * 640 * sizeof *vertices);
    assert_non_null(vertices);
    assert_int_equal(fread(vertices, sizeof *vertices, 3 * 640, file), 3 * 640);
    assert_memory_equal(vertices, mesh->vertices, 3 * 640 * sizeof *vertices);
    free(vertices);
    fclose(file);
    pliant_mesh_destroy(mesh);
    check_run(&c, "%s/pliant-precompute -q --remesh 40 --mesh-only %s -o %s", check_build(), input,
              output);
    assert_int_equal(c.status, 1);
    check_one_line(&c, name, "--force replaces it");
}

// The vertex highest up, in the order of the mesh that a run makes: runs make the same one.
static int32_t highest_of(const char *options)
{
    check_command c;
    const char *path = in_folder("same.obj");
    check_run(&c, "%s/pliant-precompute -q --force %s --mesh-only %s -o %s", check_build(), options,
              torus(), path);
    if (c.status != 0) fail_msg("%s", c.errors);
    pliant_mesh *mesh = check_load_obj(path);
    assert_non_null(mesh);
    int32_t highest = 0;
    for (int32_t v = 1; v < mesh->vertex_count; v++)
        if (mesh->vertices[3 * v + 2] > mesh->vertices[3 * highest + 2]) highest = v;
    pliant_mesh_destroy(mesh);
    return highest;
}

static void a_model_is_remeshed_solved_and_played(void **state)
{
    (void)state;
    check_command c;
    static const char options[] = "--remesh 30 --levels 1";
    char model[512], script[512], rows[512];
    snprintf(model, sizeof model, "%s", in_folder("model.h5"));
    snprintf(script, sizeof script, "%s", in_folder("pull.script"));
    snprintf(rows, sizeof rows, "%s", in_folder("pull.csv"));
    const int32_t top = highest_of(options);
    check_run(&c, "mpirun --quiet -n 2 %s/pliant-precompute -q --force %s --fixed 'z<0' %s -o %s",
              check_build(), options, torus(), model);
    if (c.status != 0) fail_msg("%s", c.errors);
    check_run(&c, "%s/pliant-info --verify %s", check_build(), model);
    if (c.status != 0) fail_msg("%s", c.errors);
    FILE *file = fopen(script, "w");
    assert_non_null(file);
    fprintf(file, "pliant-script 1\nprobe top vertex %d\nforce %d 0 0 0.01\nstep\n", top, top);
    fclose(file);
    check_run(&c, "%s/pliant-play -o %s %s %s", check_build(), rows, model, script);
    if (c.status != 0) fail_msg("%s", c.errors);
    file = fopen(rows, "r");
    assert_non_null(file);
    char line[512];
    double pulled = 0;
    while (fgets(line, sizeof line, file))
        (void)sscanf(line, "%*d,%*f,%*f,%*d,%*d,%*f,%*f,%lf", &pulled);
    fclose(file);
    check_at_least(pulled, 1e-6);
}

static void small_defects_are_told_large_ones_refused(void **state)
{
    (void)state;
    check_command c;
    const char *input = in_folder("holes.obj"), *output = in_folder("holes_made.obj");
    check_surface s = check_sphere(4);
    write_obj(s.mesh, s.mesh->face_count - 1, input);
    check_run(&c, "%s/pliant-precompute --remesh 40 --levels 1 --mesh-only %s -o %s", check_build(),
              input, output);
    assert_int_equal(c.status, 0);
    assert_non_null(strstr(c.errors, "1 small hole closed"));
    write_obj(s.mesh, s.mesh->face_count - 900, input);
    check_run(&c, "%s/pliant-precompute -q --force --remesh 40 --levels 1 --mesh-only %s -o %s",
              check_build(), input, output);
    assert_int_equal(c.status, 1);
    check_one_line(&c, name, "the surface is open");
    check_surface_destroy(&s);
}

static void options_that_do_not_go_together_are_misuse(void **state)
{
    (void)state;
    static const struct {
        const char *options, *part;
    } cases[] = {
        {"--levels 2 --fixed 'z<0' -o x.h5", "--levels goes with --remesh"},
        {"--mesh-only -o x.obj", "--mesh-only goes with --remesh"},
        {"--remesh 40 --subdivide 1 --fixed 'z<0' -o x.h5", "--levels instead of --subdivide"},
        {"--remesh 40 --fixed-list list -o x.h5", "--fixed-list names vertices of MESH"},
        {"--remesh 40 --mesh-only -o x.h5", ".obj or .ply"},
        {"--remesh 40 --mesh-only --fixed 'z<0' -o x.obj", "--fixed is for a model"},
        {"--remesh some --mesh-only -o x.obj", "--remesh"},
    };
    check_command c;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        check_run(&c, "%s/pliant-precompute %s mesh.obj", check_build(), cases[i].options);
        assert_int_equal(c.status, 2);
        check_one_line(&c, name, cases[i].part);
    }
}

static void the_base_may_be_left_out(void **state)
{
    (void)state;
    check_command c;
    char whole[1024];
    const char *input = torus(), *output = in_folder("auto.obj");
    check_run(&c, "%s/pliant-precompute -q --json --force --remesh auto --levels 3 --mesh-only %s -o %s",
              check_build(), input, output);
    if (c.status != 0) fail_msg("%s", c.errors);
    const char *made = strstr(c.output, "\"base_vertices\"");
    assert_non_null(made);
    snprintf(whole, sizeof whole, "%.*s", (int)strcspn(made, ","), made);
    static const char *const orders[] = {"--remesh --levels 3 --mesh-only %1$s -o %2$s",
                                         "--levels 3 --mesh-only --remesh %1$s -o %2$s",
                                         "--levels 3 --mesh-only %1$s -o %2$s --remesh"};
    for (int i = 0; i < 3; i++) {
        char arguments[1024];
        snprintf(arguments, sizeof arguments, orders[i], input, output);
        check_run(&c, "%s/pliant-precompute -q --json --force %s", check_build(), arguments);
        if (c.status != 0) fail_msg("%s: %s", arguments, c.errors);
        assert_non_null(strstr(c.output, whole));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_mesh_alone_is_written_and_told_of),
        cmocka_unit_test(a_model_is_remeshed_solved_and_played),
        cmocka_unit_test(small_defects_are_told_large_ones_refused),
        cmocka_unit_test(the_base_may_be_left_out),
        cmocka_unit_test(options_that_do_not_go_together_are_misuse),
    };
    return cmocka_run_group_tests(tests, NULL, NULL) != 0;
}
