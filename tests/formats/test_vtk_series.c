// test_vtk_series.c: the VTK series is valid XML, holds the numbers it was given, and is whole or
// absent.
#include "check.h"

#include "pliant/vtk_series.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

// A tetrahedron.
enum { VERTEX_COUNT = 4, FACE_COUNT = 4 };
static const double positions[VERTEX_COUNT][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
static const int32_t faces[FACE_COUNT][3] = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}};

static pliant_vec3 displacement_at(int step, int v)
{
    return (pliant_vec3){0.25f * (float)step, (float)v, -0.125f};
}

static pliant_vec3 traction_at(int step, int v)
{
    return (pliant_vec3){(float)(10 * step + v), 0.5f, -1e6f};
}

// ---- A folder to work in ----

static void make_folder(char path[64])
{
    strcpy(path, "/tmp/pliant-vtk-XXXXXX");
    assert_non_null(mkdtemp(path));
}

static void remove_folder(const char *path)
{
    char command[128];
    snprintf(command, sizeof command, "rm -rf '%s'", path);
    assert_int_equal(system(command), 0);
}

static char *path_in(char *path, const char *folder, const char *name)
{
    snprintf(path, 256, "%s/%s", folder, name);
    return path;
}

static int exists(const char *folder, const char *name)
{
    char path[256];
    return access(path_in(path, folder, name), F_OK) == 0;
}

static char *read_all(const char *folder, const char *name)
{
    char path[256];
    FILE *file = fopen(path_in(path, folder, name), "rb");
    assert_non_null(file);
    char *text = calloc(1, 1 << 20);
    assert_non_null(text);
    assert_true(fread(text, 1, (1 << 20) - 1, file) > 0);
    fclose(file);
    return text;
}

static void touch(const char *folder, const char *name)
{
    char path[256];
    FILE *file = fopen(path_in(path, folder, name), "w");
    assert_non_null(file);
    fputs("mine", file);
    fclose(file);
}

static pliant_vtk_series_def def_in(const char *folder)
{
    return (pliant_vtk_series_def){
        .folder = folder,
        .mesh = {.vertex_count = VERTEX_COUNT,
                 .face_count = FACE_COUNT,
                 .positions = &positions[0][0],
                 .faces = &faces[0][0]},
    };
}

static pliant_status add(pliant_vtk_series *series, int step, pliant_error *err)
{
    pliant_vec3 u[VERTEX_COUNT], p[VERTEX_COUNT];
    for (int v = 0; v < VERTEX_COUNT; v++) {
        u[v] = displacement_at(step, v);
        p[v] = traction_at(step, v);
    }
    // The second step has no normals; u will do for them.
    return pliant_vtk_series_add(series, 0.001 * step, u, p, step == 2 ? NULL : u, err);
}

static void write_series(const char *folder, int steps)
{
    pliant_error err;
    pliant_vtk_series *series;
    const pliant_vtk_series_def def = def_in(folder);
    check_ok(pliant_vtk_series_create(&def, &series, &err), &err);
    for (int step = 1; step <= steps; step++) check_ok(add(series, step, &err), &err);
    check_ok(pliant_vtk_series_commit(series, &err), &err);
}

// ---- Reading back ----

// Every tag is closed by its like; attributes are name="value".
static void check_xml(const char *text)
{
    char open[16][32];
    int depth = 0, elements = 0;
    assert_memory_equal(text, "<?xml", 5);
    for (const char *at = strchr(text + 1, '<'); at; at = strchr(at + 1, '<')) {
        const char *end = strchr(at, '>');
        assert_non_null(end);
        char name[32];
        if (at[1] == '/') {
            assert_true(depth > 0);
            assert_int_equal(sscanf(at + 2, "%31[^>]", name), 1);
            assert_string_equal(name, open[--depth]);
            continue;
        }
        assert_int_equal(sscanf(at + 1, "%31[A-Za-z]", name), 1);
        int quotes = 0;
        for (const char *c = at; c < end; c++) quotes += *c == '"';
        assert_int_equal(quotes % 2, 0);
        elements++;
        if (end[-1] == '/') continue;
        assert_true(depth < 16);
        strcpy(open[depth++], name);
    }
    assert_int_equal(depth, 0);
    assert_true(elements > 1);
}

static int digit_of(char c)
{
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    const char *found = c ? strchr(digits, c) : NULL;
    return found ? (int)(found - digits) : -1;
}

// Decode the array called `name` into `data`; returns its bytes, as its own head tells them.
static size_t read_array(const char *text, const char *name, void *data, size_t capacity)
{
    char mark[64];
    snprintf(mark, sizeof mark, "Name=\"%s\"", name);
    const char *at = strstr(text, mark);
    assert_non_null(at);
    at = strchr(at, '>');
    assert_non_null(at);
    unsigned char bytes[4096];
    size_t count = 0;
    for (at++; *at != '<'; at += 4) {
        int d[4];
        for (int k = 0; k < 4; k++) d[k] = digit_of(at[k]);
        assert_true(d[0] >= 0 && d[1] >= 0 && count + 3 <= sizeof bytes);
        bytes[count++] = (unsigned char)(d[0] << 2 | d[1] >> 4);
        if (d[2] >= 0) bytes[count++] = (unsigned char)((d[1] & 15) << 4 | d[2] >> 2);
        if (d[3] >= 0) bytes[count++] = (unsigned char)((d[2] & 3) << 6 | d[3]);
    }
    uint64_t told;
    memcpy(&told, bytes, sizeof told);
    assert_int_equal(told, count - sizeof told);
    assert_true(told <= capacity);
    memcpy(data, bytes + sizeof told, told);
    return told;
}

// ---- Cases ----

static void every_step_holds_points_cells_and_fields(void **state)
{
    (void)state;
    char folder[64], name[64];
    make_folder(folder);
    write_series(folder, 3);
    for (int step = 1; step <= 3; step++) {
        snprintf(name, sizeof name, "pliant_%08d.vtp", step);
        char *text = read_all(folder, name);
        check_xml(text);
        assert_non_null(strstr(text, "NumberOfPoints=\"4\""));
        assert_non_null(strstr(text, "NumberOfPolys=\"4\""));
        float u[VERTEX_COUNT][3], p[VERTEX_COUNT][3], x[VERTEX_COUNT][3];
        int32_t corners[FACE_COUNT][3], ends[FACE_COUNT];
        assert_int_equal(read_array(text, "displacement", u, sizeof u), sizeof u);
        assert_int_equal(read_array(text, "traction", p, sizeof p), sizeof p);
        assert_int_equal(read_array(text, "points", x, sizeof x), sizeof x);
        assert_int_equal(read_array(text, "connectivity", corners, sizeof corners), sizeof corners);
        assert_int_equal(read_array(text, "offsets", ends, sizeof ends), sizeof ends);
        assert_int_equal(strstr(text, "Normals=\"normal\"") != NULL, step != 2);
        assert_int_equal(strstr(text, "Name=\"normal\"") != NULL, step != 2);
        if (step != 2) {
            float n[VERTEX_COUNT][3];
            assert_int_equal(read_array(text, "normal", n, sizeof n), sizeof n);
            assert_memory_equal(n, u, sizeof n);
        }
        assert_memory_equal(corners, faces, sizeof faces);
        for (int f = 0; f < FACE_COUNT; f++) assert_int_equal(ends[f], 3 * (f + 1));
        for (int v = 0; v < VERTEX_COUNT; v++) {
            const pliant_vec3 du = displacement_at(step, v), dp = traction_at(step, v);
            assert_memory_equal(u[v], &du, sizeof du);
            assert_memory_equal(p[v], &dp, sizeof dp);
            const float d[3] = {du.x, du.y, du.z};
            // Exact: sums of small dyadic numbers.
            for (int c = 0; c < 3; c++) check_near(x[v][c], positions[v][c] + (double)d[c], 0);
        }
        free(text);
    }
    remove_folder(folder);
}

static void the_index_lists_every_step_with_its_time(void **state)
{
    (void)state;
    char folder[64];
    make_folder(folder);
    write_series(folder, 12);
    char *text = read_all(folder, "pliant.pvd");
    check_xml(text);
    int count = 0;
    for (const char *at = text; (at = strstr(at, "<DataSet ")); at++) {
        double time;
        char file[64];
        assert_int_equal(
            sscanf(at, "<DataSet timestep=\"%lf\" part=\"0\" file=\"%63[^\"]\"/>", &time, file), 2);
        check_near(time, 0.001 * ++count, 1e-12);
        assert_true(exists(folder, file));
    }
    assert_int_equal(count, 12);
    assert_false(exists(folder, "pliant.tmp"));
    free(text);
    remove_folder(folder);
}

static void a_shorter_series_leaves_nothing_of_a_longer_one(void **state)
{
    (void)state;
    char folder[64];
    make_folder(folder);
    write_series(folder, 3);
    touch(folder, "notes.txt");
    write_series(folder, 2);
    assert_true(exists(folder, "pliant_00000002.vtp"));
    assert_false(exists(folder, "pliant_00000003.vtp"));
    assert_true(exists(folder, "notes.txt"));
    remove_folder(folder);
}

static void an_abandoned_series_leaves_the_earlier_one_whole(void **state)
{
    (void)state;
    char folder[64], fresh[256];
    pliant_error err;
    pliant_vtk_series *series;
    make_folder(folder);
    write_series(folder, 2);
    char *before = read_all(folder, "pliant_00000001.vtp");
    const pliant_vtk_series_def def = def_in(folder);
    check_ok(pliant_vtk_series_create(&def, &series, &err), &err);
    check_ok(add(series, 7, &err), &err);
    pliant_vtk_series_abandon(series);
    char *after = read_all(folder, "pliant_00000001.vtp");
    assert_string_equal(before, after);
    assert_true(exists(folder, "pliant.pvd"));
    assert_false(exists(folder, "pliant.tmp"));
    free(before);
    free(after);

    // And a folder that was made for it goes with it.
    const pliant_vtk_series_def other = def_in(path_in(fresh, folder, "fresh"));
    check_ok(pliant_vtk_series_create(&other, &series, &err), &err);
    assert_true(exists(folder, "fresh"));
    pliant_vtk_series_abandon(series);
    assert_false(exists(folder, "fresh"));
    remove_folder(folder);
}

static void several_series_of_ours_share_a_folder(void **state)
{
    (void)state;
    static const int32_t instance[VERTEX_COUNT] = {0, 0, 1, 1};
    char folder[64];
    pliant_error err;
    pliant_vtk_series *series[PLIANT_VTK_CONTENT_COUNT];
    make_folder(folder);
    const pliant_vec3 u[VERTEX_COUNT] = {{0, 0, 0}};
    for (int pass = 0; pass < 2; pass++) {
        for (int c = 0; c < PLIANT_VTK_CONTENT_COUNT; c++) {
            pliant_vtk_series_def def = def_in(folder);
            def.content = (pliant_vtk_content)c;
            def.mesh.instance = instance;
            if (c == PLIANT_VTK_PARTICLES) def.mesh.face_count = 0;
            check_ok(pliant_vtk_series_create(&def, &series[c], &err), &err);
            for (int step = 0; step < 2 - pass; step++)
                check_ok(pliant_vtk_series_add(series[c], step, u, NULL, NULL, &err), &err);
        }
        for (int c = 0; c < PLIANT_VTK_CONTENT_COUNT; c++)
            check_ok(pliant_vtk_series_commit(series[c], &err), &err);
        // The second pass leaves nothing of the longer first.
        assert_int_equal(exists(folder, "pliant_particles_00000002.vtp"), pass == 0);
        assert_int_equal(exists(folder, "pliant_obstacles_00000002.vtp"), pass == 0);
    }
    assert_true(exists(folder, "pliant.pvd"));
    assert_true(exists(folder, "pliant_particles.pvd"));
    assert_true(exists(folder, "pliant_obstacles_00000001.vtp"));
    assert_false(exists(folder, "pliant_particles.tmp"));
    char *text = read_all(folder, "pliant_particles_00000001.vtp");
    check_xml(text);
    assert_non_null(strstr(text, "NumberOfVerts=\"4\""));
    assert_non_null(strstr(text, "NumberOfPolys=\"0\""));
    assert_non_null(strstr(text, "Name=\"instance\""));
    assert_null(strstr(text, "traction"));
    free(text);
    // A surface alone leaves none of the others to be mistaken for its own.
    write_series(folder, 1);
    assert_false(exists(folder, "pliant_particles.pvd"));
    assert_false(exists(folder, "pliant_obstacles_00000001.vtp"));
    remove_folder(folder);
}

static void the_mesh_may_change_between_steps(void **state)
{
    (void)state;
    static const double two[6][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {5, 5, 5}, {6, 5, 5}, {5, 6, 5}};
    static const int32_t two_faces[2][3] = {{0, 1, 2}, {3, 4, 5}};
    char folder[64];
    pliant_error err;
    pliant_vtk_series *series;
    make_folder(folder);
    const pliant_vtk_series_def def = def_in(folder);
    const pliant_vec3 u[6] = {{0, 0, 0}};
    const pliant_vtk_mesh mesh = {
        .vertex_count = 6, .face_count = 2, .positions = &two[0][0], .faces = &two_faces[0][0]};
    check_ok(pliant_vtk_series_create(&def, &series, &err), &err);
    check_ok(pliant_vtk_series_add(series, 0, u, NULL, NULL, &err), &err);
    check_ok(pliant_vtk_series_remesh(series, &mesh, &err), &err);
    check_ok(pliant_vtk_series_add(series, 1, u, NULL, NULL, &err), &err);
    check_ok(pliant_vtk_series_commit(series, &err), &err);
    char *text = read_all(folder, "pliant_00000001.vtp");
    assert_non_null(strstr(text, "NumberOfPoints=\"4\""));
    free(text);
    text = read_all(folder, "pliant_00000002.vtp");
    check_xml(text);
    assert_non_null(strstr(text, "NumberOfPoints=\"6\""));
    assert_non_null(strstr(text, "NumberOfPolys=\"2\""));
    free(text);
    remove_folder(folder);
}

static void another_series_is_refused_unless_forced(void **state)
{
    (void)state;
    char folder[64];
    pliant_error err;
    pliant_vtk_series *series = NULL;
    make_folder(folder);
    touch(folder, "theirs.vtu");
    pliant_vtk_series_def def = def_in(folder);
    assert_int_equal(pliant_vtk_series_create(&def, &series, &err), PLIANT_ERR_ARGUMENT);
    assert_non_null(strstr(err.text, "theirs.vtu"));
    assert_null(series);
    assert_false(exists(folder, "pliant.tmp"));
    def.overwrite = PLIANT_VTK_FOREIGN;
    check_ok(pliant_vtk_series_create(&def, &series, &err), &err);
    check_ok(add(series, 1, &err), &err);
    check_ok(pliant_vtk_series_commit(series, &err), &err);
    assert_true(exists(folder, "theirs.vtu"));
    assert_true(exists(folder, "pliant.pvd"));
    remove_folder(folder);
}

static void a_folder_that_cannot_be_is_refused(void **state)
{
    (void)state;
    char folder[64], path[256];
    pliant_error err;
    pliant_vtk_series *series = NULL;
    make_folder(folder);
    pliant_vtk_series_def def = def_in(path_in(path, folder, "no/where"));
    assert_int_equal(pliant_vtk_series_create(&def, &series, &err), PLIANT_ERR_IO);
    assert_non_null(strstr(err.text, "no/where: No such file"));
    touch(folder, "file");
    def.folder = path_in(path, folder, "file");
    assert_int_equal(pliant_vtk_series_create(&def, &series, &err), PLIANT_ERR_IO);
    def.overwrite = PLIANT_VTK_FOREIGN;
    assert_int_equal(pliant_vtk_series_create(&def, &series, &err), PLIANT_ERR_IO);
    assert_null(series);
    remove_folder(folder);
}

static void a_full_disk_is_told_and_leaves_nothing(void **state)
{
    (void)state;
    char folder[64];
    pliant_error err;
    pliant_vtk_series *series;
    struct rlimit limit, small;
    make_folder(folder);
    const pliant_vtk_series_def def = def_in(folder);
    check_ok(pliant_vtk_series_create(&def, &series, &err), &err);
    // A limit on the file's size stands for a full disk: write fails half-way in both.
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &limit), 0);
    small = limit;
    small.rlim_cur = 100;
    void (*before)(int) = signal(SIGXFSZ, SIG_IGN);
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &small), 0);
    const pliant_status status = add(series, 1, &err);
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &limit), 0);
    signal(SIGXFSZ, before);
    assert_int_equal(status, PLIANT_ERR_IO);
    assert_non_null(strstr(err.text, strerror(EFBIG)));
    pliant_vtk_series_abandon(series);
    assert_false(exists(folder, "pliant.tmp"));
    assert_false(exists(folder, "pliant.pvd"));
    remove_folder(folder);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_step_holds_points_cells_and_fields),
        cmocka_unit_test(the_index_lists_every_step_with_its_time),
        cmocka_unit_test(a_shorter_series_leaves_nothing_of_a_longer_one),
        cmocka_unit_test(an_abandoned_series_leaves_the_earlier_one_whole),
        cmocka_unit_test(several_series_of_ours_share_a_folder),
        cmocka_unit_test(the_mesh_may_change_between_steps),
        cmocka_unit_test(another_series_is_refused_unless_forced),
        cmocka_unit_test(a_folder_that_cannot_be_is_refused),
        cmocka_unit_test(a_full_disk_is_told_and_leaves_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
