// test_region.c: which vertices are held: expressions, lists, and whether they stop rigid motions.
#include "check.h"

#include "mesh/region.h"
#include "pliant/error.h"
#include "surfaces.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

// ---- Expressions ----

// The points of a 5 x 5 x 5 lattice on [-1, 1]^3: no faces, for expressions need none.
enum { SIDE = 5, POINTS = SIDE * SIDE * SIDE };

static pliant_mesh *lattice(void)
{
    pliant_mesh *mesh;
    pliant_error err;
    check_ok(pliant_mesh_create(POINTS, 0, &mesh, &err), &err);
    for (int i = 0; i < POINTS; i++) {
        mesh->vertices[3 * i] = i % SIDE / 2.0 - 1;
        mesh->vertices[3 * i + 1] = i / SIDE % SIDE / 2.0 - 1;
        mesh->vertices[3 * i + 2] = i / SIDE / SIDE / 2.0 - 1;
    }
    return mesh;
}

// The condition that an expression means, written in C.
typedef int condition(double x, double y, double z);

static int below(double x, double y, double z)
{
    (void)x, (void)y;
    return z < 0.5;
}
static int below_or_at(double x, double y, double z)
{
    (void)x, (void)y;
    return z <= 0.5;
}
static int slab(double x, double y, double z)
{
    (void)y, (void)z;
    return -0.5 < x && x <= 0.5;
}
static int two(double x, double y, double z)
{
    (void)z;
    return x < 0 && y >= 0;
}
static int either(double x, double y, double z)
{
    (void)z;
    return x < 0 || y >= 0.5;
}
static int mixed(double x, double y, double z)
{
    return x > 0 || (y > 0 && z > 0);
}
static int grouped(double x, double y, double z)
{
    return (x > 0 || y > 0) && z > 0;
}
static int neither(double x, double y, double z)
{
    return !(x < 0) && !(y < 0) && !(z < 0);
}
static int within(double x, double y, double z)
{
    return x >= -0.5 && y >= 0 && z >= -1 && x <= 0.5 && y <= 0.5 && z <= 1;
}
static int round_about(double x, double y, double z)
{
    return (x - 0.5) * (x - 0.5) + y * y + z * z <= 0.25;
}
static int never(double x, double y, double z)
{
    (void)x, (void)y, (void)z;
    return 0;
}
static int diagonal(double x, double y, double z)
{
    return x < y && y < z;
}

static void expressions_mean_what_they_say(void **state)
{
    (void)state;
    static const struct {
        const char *expression;
        condition *meaning;
    } cases[] = {
        {"z<0.5", below},
        {"  z < 5e-1 ", below},
        {"+.5>z", below},
        {"not z>=0.5", below},
        {"!!!(z>=0.5)", below},
        {"((((z<0.5))))", below},
        {"z<=0.5", below_or_at},
        {"0.5 >= z", below_or_at},
        {"not(z>0.5)", below_or_at},
        {"-0.5<x<=0.5", slab},
        {"0.5 >= x > -0.5", slab},
        {"x>-0.5 and x<=0.5 and -1e300<y<1e300", slab},
        {"x<0 and y>=0", two},
        {"x<0 && y>=0", two},
        {"all(x<0, y>=0)", two},
        {"all ( x<0 , all(y>=0), not z>9 )", two},
        {"not (x>=0 or y<0)", two},
        {"x<0 or y>=0.5", either},
        {"x<0||y>=0.5", either},
        {"any(x<0,y>=0.5)", either},
        {"any(x < 0 and y < 9, y >= 0.5)", either},
        {"x>0 or y>0 and z>0", mixed},
        {"y>0 and z>0 or x>0", mixed},
        {"any(x>0, all(y>0, z>0))", mixed},
        {"(x>0 or y>0) and z>0", grouped},
        {"all(any(x>0, y>0), z>0)", grouped},
        {"not x<0 and not y<0 and not z<0", neither},
        {"not any(x<0, y<0, z<0)", neither},
        {"box(-0.5,0,-1, 0.5,0.5,1)", within},
        {"not not box( -5e-1, 0, -1,\t0.5, 0.5, +1 )", within},
        {"sphere(0.5, 0, 0, 0.5)", round_about},
        {"sphere(0.5,0,0,0.5) and box(-9,-9,-9,9,9,9) and x<9", round_about},
        {"x<-1 or x>1", never},
        {"1<x<-1", never},
        {"x<y<z", diagonal},
    };
    pliant_mesh *mesh = lattice();
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        uint8_t held[POINTS];
        pliant_error err = {{0}};
        check_ok(pliant_region_evaluate(cases[i].expression, mesh, held, &err), &err);
        for (int v = 0; v < POINTS; v++) {
            const double *x = mesh->vertices + 3 * v;
            const int expected = cases[i].meaning(x[0], x[1], x[2]);
            if (held[v] != expected)
                fail_msg("%s at %g %g %g is %d, expected %d", cases[i].expression, x[0], x[1], x[2],
                         held[v], expected);
        }
    }
    pliant_mesh_destroy(mesh);
}

static void mistakes_are_told_with_column_expected_and_found(void **state)
{
    (void)state;
#define CONDITION "a condition such as z<0.1, not, (, all(, any(, box( or sphere("
    static const struct {
        const char *expression, *message;
    } cases[] = {
        {"", "column 1: expected " CONDITION ", found the end"},
        {"   ", "column 4: expected " CONDITION ", found the end"},
        {"w<1", "column 1: expected " CONDITION ", found 'w'"},
        {"z", "column 2: expected <, <=, > or >=, found the end"},
        {"z=1", "column 2: expected <, <=, > or >=, found '='"},
        {"z<", "column 3: expected a number, x, y or z, found the end"},
        {"z<abc", "column 3: expected a number, x, y or z, found 'abc'"},
        {"z<0..1", "column 3: expected a number, x, y or z, found '0..1'"},
        {"z<1e999", "column 3: expected a number, x, y or z, found '1e999'"},
        {"z<nan", "column 3: expected a number, x, y or z, found 'nan'"},
        {"z<0x10", "column 4: expected and, or or the end, found 'x10'"},
        {"z<1 z>0", "column 5: expected and, or or the end, found 'z'"},
        {"z<1 & z>0", "column 5: expected and, or or the end, found '&'"},
        {"z<1 and", "column 8: expected " CONDITION ", found the end"},
        {"1<2", "column 3: expected x, y or z on one side of the relation, found '2'"},
        {"(z<1", "column 5: expected and, or or ), found the end"},
        {"z<1)", "column 4: expected and, or or the end, found ')'"},
        {"()", "column 2: expected " CONDITION ", found ')'"},
        {"all", "column 4: expected (, found the end"},
        {"all()", "column 5: expected " CONDITION ", found ')'"},
        {"any(z<1,)", "column 9: expected " CONDITION ", found ')'"},
        {"any(z<1;x<1)", "column 8: expected and, or, a comma or ), found ';'"},
        {"box(0,0,0,1,1)", "column 14: expected a comma: box(x0,y0,z0, x1,y1,z1), found ')'"},
        {"box(0,0,0,1,1,1", "column 16: expected ), found the end"},
        {"box(0,0,0,1,1,1,1)", "column 16: expected ), found ','"},
        {"box(0,0,x,1,1,1)", "column 9: expected a number, found 'x'"},
        {"z<0 or box(0,2,0,1,1,1)", "column 8: an empty box: expected y0 <= y1, found 2 > 1"},
        {"sphere(0,0,0)", "column 13: expected a comma: sphere(x,y,z,radius), found ')'"},
        {"sphere(0,0,0,-1)", "column 1: expected a radius of 0 or more, found -1"},
        {"z<1\xc3\xa4", "column 4: expected and, or or the end, found '?'"},
    };
    pliant_mesh *mesh = lattice();
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        uint8_t held[POINTS];
        memset(held, 7, sizeof held);
        pliant_error err = {{0}};
        assert_int_equal(pliant_region_evaluate(cases[i].expression, mesh, held, &err),
                         PLIANT_ERR_ARGUMENT);
        assert_string_equal(err.text, cases[i].message);
        for (int v = 0; v < POINTS; v++) assert_int_equal(held[v], 7);
    }
    pliant_mesh_destroy(mesh);
}

// `count` times a piece, then a tail.
static char *repeat(const char *piece, size_t count, const char *tail)
{
    const size_t length = strlen(piece);
    char *content = malloc(length * count + strlen(tail) + 1);
    assert_non_null(content);
    for (size_t i = 0; i < count; i++) memcpy(content + length * i, piece, length);
    memcpy(content + length * count, tail, strlen(tail) + 1);
    return content;
}

static void deep_and_long_expressions_do_no_harm(void **state)
{
    (void)state;
    pliant_mesh *mesh = lattice();
    uint8_t held[POINTS];
    pliant_error err = {{0}};
    static const char *const openings[] = {"(", "all(", "any(x<0,", "not(", "!(x<1 and "};
    for (int i = 0; i < 5; i++) {
        char *content = repeat(openings[i], 1000000, "z<0");
        assert_int_equal(pliant_region_evaluate(content, mesh, held, &err), PLIANT_ERR_ARGUMENT);
        assert_non_null(strstr(err.text, ": expected at most 100 nested parentheses, found more"));
        free(content);
    }
    // Nested as deep as is allowed, and long without nesting.
    char *inner = repeat("(x<9 and (z<0 or ", 49, "z<0");
    char *content = repeat(")", 98, "");
    char *whole = malloc(strlen(inner) + strlen(content) + 1);
    assert_non_null(whole);
    strcpy(whole, inner);
    strcat(whole, content);
    check_ok(pliant_region_evaluate(whole, mesh, held, &err), &err);
    assert_int_equal(held[0], 1);
    assert_int_equal(held[POINTS - 1], 0);
    free(inner);
    free(content);
    free(whole);
    content = repeat("z>0 or ", 10000, "z<0");
    check_ok(pliant_region_evaluate(content, mesh, held, &err), &err);
    assert_int_equal(held[0], 1);
    free(content);
    content = repeat("not ", 1000001, "z<0");
    check_ok(pliant_region_evaluate(content, mesh, held, &err), &err);
    assert_int_equal(held[0], 0);
    free(content);
    pliant_mesh_destroy(mesh);
}

static void random_expressions_do_no_harm(void **state)
{
    (void)state;
    static const char *const pieces[] = {
        "x",  "y",      "z",    "<", "<=", ">",    ">=",   "!",    "not ", " and ",
        "&&", "||",     " or ", "(", ")",  ",",    "all(", "any(", "box(", "sphere(",
        "1",  "-2.5e3", ".",    "e", "&",  "\x7f", " ",    "x<1"};
    pliant_mesh *mesh = lattice();
    check_random random = check_random_seed(77);
    int accepted = 0;
    for (int round = 0; round < 100000; round++) {
        char content[200] = "";
        const int count = 1 + check_random_index(&random, 12);
        for (int i = 0; i < count; i++)
            strcat(content, pieces[check_random_index(&random, sizeof pieces / sizeof *pieces)]);
        char *copy = strdup(content); // of exactly its size
        assert_non_null(copy);
        uint8_t held[POINTS];
        pliant_error err = {{0}};
        const pliant_status status = pliant_region_evaluate(copy, mesh, held, &err);
        if (status == PLIANT_OK) accepted++;
        else assert_memory_equal(err.text, "column ", 7);
        free(copy);
    }
    check_at_least(accepted, 300); // the pieces do make sense now and then
    pliant_mesh_destroy(mesh);
}

// ---- Lists ----

typedef struct list_file {
    char folder[40], path[60];
} list_file;

static int make_folder(void **state)
{
    list_file *file = calloc(1, sizeof *file);
    if (!file) return 1;
    strcpy(file->folder, "/tmp/pliant-region-XXXXXX");
    if (!mkdtemp(file->folder)) return 1;
    snprintf(file->path, sizeof file->path, "%s/held.txt", file->folder);
    *state = file;
    return 0;
}

static int remove_folder(void **state)
{
    list_file *file = *state;
    remove(file->path);
    const int failed = rmdir(file->folder);
    free(file);
    return failed;
}

static void write_list(const list_file *file, const char *content)
{
    FILE *stream = fopen(file->path, "wb");
    assert_non_null(stream);
    assert_int_equal(fwrite(content, 1, strlen(content), stream), strlen(content));
    assert_int_equal(fclose(stream), 0);
}

static void lists_are_read_with_comments_and_repeats(void **state)
{
    const list_file *file = *state;
    static const char *const spellings[] = {
        "0 3 9\n",
        "9\t3\r\n0",
        "# all\n\n 3 # three\n9 9 3\r0#x\n#",
        "\xEF\xBB\xBF\t0\f03 +9\n0 0 0\n",
    };
    for (size_t i = 0; i < sizeof spellings / sizeof *spellings; i++) {
        write_list(file, spellings[i]);
        uint8_t held[10];
        memset(held, 7, sizeof held);
        pliant_error err = {{0}};
        check_ok(pliant_region_read(file->path, 10, held, &err), &err);
        for (int v = 0; v < 10; v++) assert_int_equal(held[v], v == 0 || v == 3 || v == 9);
    }
}

static void list_mistakes_are_told_with_file_line_and_column(void **state)
{
    const list_file *file = *state;
    static const struct {
        const char *content, *message;
    } cases[] = {
        {"0 1\n2 x\n", ":2: expected a vertex number in column 3, found 'x'"},
        {"0 1.5\n", ":1: expected a vertex number in column 3, found '1.5'"},
        {"0,1\n", ":1: expected a vertex number in column 1, found '0,1'"},
        {"\n\n 10\n", ":3: expected a vertex number from 0 to 9 in column 2, found '10'"},
        {"-1", ":1: expected a vertex number from 0 to 9 in column 1, found '-1'"},
        {"99999999999999999999999999", ":1: expected a vertex number from 0 to 9 in column 1, "
                                       "found '99999999999999999999999999'"},
        {"# nothing\n", ": expected vertex numbers, found none"},
        {"", ": the file is empty"},
    };
    uint8_t held[10];
    memset(held, 7, sizeof held);
    pliant_error err = {{0}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        write_list(file, cases[i].content);
        assert_int_equal(pliant_region_read(file->path, 10, held, &err), PLIANT_ERR_FORMAT);
        assert_memory_equal(err.text, file->path, strlen(file->path));
        assert_string_equal(err.text + strlen(file->path), cases[i].message);
    }
    assert_int_equal(pliant_region_read(file->folder, 10, held, &err), PLIANT_ERR_IO);
    assert_non_null(strstr(err.text, ": is a directory, expected a file"));
    remove(file->path);
    assert_int_equal(pliant_region_read(file->path, 10, held, &err), PLIANT_ERR_IO);
    for (int v = 0; v < 10; v++) assert_int_equal(held[v], 7);
    write_list(file, "0\n"); // for the teardown
}

// ---- Rigid motions ----

static void check_held(const pliant_mesh *mesh, const uint8_t *held, const char *message)
{
    pliant_error err = {{0}};
    const pliant_status status = pliant_region_check(mesh, held, &err);
    if (!message) {
        check_ok(status, &err);
        return;
    }
    assert_int_equal(status, PLIANT_ERR_ARGUMENT);
    assert_string_equal(err.text, message);
}

static void what_stops_no_rigid_motion_is_refused(void **state)
{
    (void)state;
    pliant_mesh *mesh = check_octahedron(); // vertices on the axes
    // 0 and 1 opposite each other, whatever their axis; 4 beside their line.
    double *x = mesh->vertices;
    int opposite = 1;
    while (x[3 * opposite] + x[0] != 0 || x[3 * opposite + 1] + x[1] != 0 ||
           x[3 * opposite + 2] + x[2] != 0)
        opposite++;
    const int beside = opposite == 1 ? 2 : 1;
    uint8_t held[6] = {0};
    check_held(mesh, held,
               "no vertex is held: expected at least 3 that are not on one line, or the body "
               "moves freely");
    held[0] = held[opposite] = 1;
    check_held(mesh, held,
               "2 vertices are held: expected at least 3 that are not on one line, or the "
               "body moves freely");
    held[beside] = 1;
    check_held(mesh, held, NULL);
    memset(held, 1, sizeof held);
    check_held(mesh, held, "all 6 vertices are held: expected some that can move");
    held[opposite] = 0;
    check_held(mesh, held, NULL);
    pliant_mesh_destroy(mesh);
}

static void vertices_on_one_line_are_refused_to_a_relative_tolerance(void **state)
{
    (void)state;
    // The refined tetrahedron has vertices in the middle of its straight edges.
    static const double scale[] = {1e-20, 1, 1e20};
    for (int i = 0; i < 3; i++) {
        check_surface s = check_refine(check_tetrahedron(), 2);
        double *x = s.mesh->vertices;
        for (int k = 0; k < 3 * s.mesh->vertex_count; k++) x[k] *= scale[i];
        const int middle = 4;
        uint8_t *held = calloc((size_t)s.mesh->vertex_count, 1);
        assert_non_null(held);
        held[middle] = held[s.parents[0]] = held[s.parents[1]] = 1;
        check_held(s.mesh, held,
                   "the 3 held vertices are on one line: the body turns about it; hold at "
                   "least one vertex beside the line");
        // Vertex 4 is between 0 and 1, along an edge across the x axis. Off the line by a millionth
        // of the body it is still a line; by a thousandth it holds.
        assert_true(s.parents[0] == 0 && s.parents[1] == 1 && x[0] == x[3]);
        x[3 * middle] += 1e-6 * scale[i];
        pliant_error err = {{0}};
        assert_int_equal(pliant_region_check(s.mesh, held, &err), PLIANT_ERR_ARGUMENT);
        x[3 * middle] += 1e-3 * scale[i];
        check_held(s.mesh, held, NULL);
        free(held);
        check_surface_destroy(&s);
    }
}

static void vertices_on_one_place_are_refused(void **state)
{
    (void)state;
    pliant_mesh *mesh = check_cube();
    for (int v = 1; v < 3; v++) memcpy(mesh->vertices + 3 * v, mesh->vertices, 3 * sizeof(double));
    const uint8_t held[8] = {1, 1, 1};
    check_held(mesh, held,
               "the 3 held vertices are on one line: the body turns about it; hold at least "
               "one vertex beside the line");
    pliant_mesh_destroy(mesh);
}

static void every_component_must_be_held(void **state)
{
    (void)state;
    pliant_mesh *mesh = check_beside(check_cube(), check_icosahedron());
    uint8_t held[20] = {1, 1, 1, 1};
    check_held(mesh, held,
               "0 vertices of the component of vertex 8 are held: expected at least 3 that "
               "are not on one line, or the body moves freely");
    held[8] = held[12] = 1;
    check_held(mesh, held,
               "2 vertices of the component of vertex 8 are held: expected at least 3 that "
               "are not on one line, or the body moves freely");
    held[19] = 1;
    check_held(mesh, held, NULL);
    pliant_mesh_destroy(mesh);
}

static void a_cavity_is_held_by_its_body(void **state)
{
    (void)state;
    // A cube of half the size inside a cube, looking into the cavity: one body of two components.
    pliant_mesh *mesh = check_beside(check_cube(), check_cube());
    for (int k = 0; k < 24; k++) mesh->vertices[24 + k] = mesh->vertices[k] / 2;
    for (int f = 12; f < 24; f++) {
        int32_t *v = mesh->faces + 3 * f, swapped = v[1];
        v[1] = v[2];
        v[2] = swapped;
    }
    uint8_t held[16] = {1, 1, 1};
    check_held(mesh, held, NULL);
    // The cavity's vertices hold the body as well.
    memset(held, 0, sizeof held);
    held[8] = held[9] = held[11] = 1;
    check_held(mesh, held, NULL);
    held[11] = 0;
    check_held(mesh, held,
               "2 vertices of the component of vertex 0 are held: expected at least 3 that "
               "are not on one line, or the body moves freely");
    pliant_mesh_destroy(mesh);
}

static void the_lists_of_the_evaluation_meshes_hold_them(void **state)
{
    (void)state;
    static const struct {
        const char *mesh, *list;
        int count;
    } cases[] = {{"semireg/blob_L4.obj", "semireg/blob_L4.fixed", 419},
                 {"semireg/bunny_L4.obj", "semireg/bunny_L4.fixed", 417}};
    for (int i = 0; i < 2; i++) {
        const char *mesh_path = check_model_path(cases[i].mesh);
        const char *list_path = check_model_path(cases[i].list);
        if (!mesh_path || !list_path) skip();
        pliant_mesh *mesh = check_load_obj(mesh_path);
        assert_non_null(mesh);
        uint8_t *held = malloc((size_t)mesh->vertex_count);
        assert_non_null(held);
        pliant_error err = {{0}};
        check_ok(pliant_region_read(list_path, mesh->vertex_count, held, &err), &err);
        int count = 0;
        for (int32_t v = 0; v < mesh->vertex_count; v++) count += held[v];
        assert_int_equal(count, cases[i].count);
        check_held(mesh, held, NULL);
        free(held);
        pliant_mesh_destroy(mesh);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(expressions_mean_what_they_say),
        cmocka_unit_test(mistakes_are_told_with_column_expected_and_found),
        cmocka_unit_test(deep_and_long_expressions_do_no_harm),
        cmocka_unit_test(random_expressions_do_no_harm),
        cmocka_unit_test_setup_teardown(lists_are_read_with_comments_and_repeats, make_folder,
                                        remove_folder),
        cmocka_unit_test_setup_teardown(list_mistakes_are_told_with_file_line_and_column,
                                        make_folder, remove_folder),
        cmocka_unit_test(what_stops_no_rigid_motion_is_refused),
        cmocka_unit_test(vertices_on_one_line_are_refused_to_a_relative_tolerance),
        cmocka_unit_test(vertices_on_one_place_are_refused),
        cmocka_unit_test(every_component_must_be_held),
        cmocka_unit_test(a_cavity_is_held_by_its_body),
        cmocka_unit_test(the_lists_of_the_evaluation_meshes_hold_them),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
