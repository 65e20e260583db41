// test_mesh_file.c: meshes from files: numbers kept, bits kept, every kind of spelling, hostile
// bytes.
#include "check.h"

#include "mesh/mesh_check.h"
#include "mesh/mesh_file.h"
#include "mesh/mesh_file_formats.h"
#include "mesh/polygon.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

// ---- What the cases share ----

// A text or bytes that grow.
typedef struct text {
    char *data;
    size_t size;
} text;

static void append(text *t, const void *bytes, size_t size)
{
    t->data = realloc(t->data, t->size + size + 1);
    assert_non_null(t->data);
    if (size) memcpy(t->data + t->size, bytes, size);
    t->size += size;
    t->data[t->size] = 0;
}

__attribute__((format(printf, 2, 3))) static void print(text *t, const char *format, ...)
{
    char line[512];
    va_list arguments;
    va_start(arguments, format);
    const int length = vsnprintf(line, sizeof line, format, arguments);
    va_end(arguments);
    assert_in_range(length, 0, sizeof line - 1);
    append(t, line, (size_t)length);
}

// Read bytes as the format that the name asks for, from a copy of exactly their size, so that
// AddressSanitizer sees one byte too many.
static pliant_status read_bytes(const char *name, const void *bytes, size_t size,
                                pliant_mesh **mesh, pliant_error *err)
{
    char *copy = malloc(size ? size : 1);
    assert_non_null(copy);
    if (size) memcpy(copy, bytes, size);
    const pliant_mesh_source source = {.name = name, .bytes = copy, .size = size};
    pliant_mesh_reader *reader = pliant_mesh_file_reader(&source);
    assert_non_null(reader);
    const pliant_status status = pliant_mesh_file_parse(&source, reader, mesh, err);
    free(copy);
    return status;
}

static pliant_mesh *accept(const char *name, const void *bytes, size_t size)
{
    pliant_mesh *mesh = NULL;
    pliant_error err = {{0}};
    check_ok(read_bytes(name, bytes, size, &mesh, &err), &err);
    return mesh;
}

static pliant_mesh *accept_text(const char *name, const char *content)
{
    return accept(name, content, strlen(content));
}

static void refuse(const char *name, const void *bytes, size_t size, const char *message)
{
    pliant_mesh *mesh = NULL;
    pliant_error err = {{0}};
    const pliant_status status = read_bytes(name, bytes, size, &mesh, &err);
    assert_int_equal(status, PLIANT_ERR_FORMAT);
    assert_null(mesh);
    assert_string_equal(err.text, message);
}

typedef struct refusal {
    const char *content, *message;
} refusal;

static void refuse_all(const char *name, const refusal *list, size_t count)
{
    for (size_t i = 0; i < count; i++)
        refuse(name, list[i].content, strlen(list[i].content), list[i].message);
}
#define refuse_each(name, list) refuse_all((name), (list), sizeof(list) / sizeof *(list))

static void assert_same_mesh(const pliant_mesh *found, const pliant_mesh *expected)
{
    assert_int_equal(found->vertex_count, expected->vertex_count);
    assert_int_equal(found->face_count, expected->face_count);
    assert_memory_equal(found->vertices, expected->vertices,
                        (size_t)expected->vertex_count * 3 * sizeof(double));
    assert_memory_equal(found->faces, expected->faces,
                        (size_t)expected->face_count * 3 * sizeof(int32_t));
}

// An octahedron whose coordinates need all 53 bits, with a vertex that no face uses in the middle
// of the numbers, as object files have.
static pliant_mesh *sample(void)
{
    static const int32_t faces[8][3] = {{0, 2, 5}, {2, 1, 5}, {1, 3, 5}, {3, 0, 5},
                                        {2, 0, 6}, {1, 2, 6}, {3, 1, 6}, {0, 3, 6}};
    pliant_mesh *mesh;
    pliant_error err;
    check_ok(pliant_mesh_create(7, 8, &mesh, &err), &err);
    check_random random = check_random_seed(7);
    for (int i = 0; i < 21; i++) mesh->vertices[i] = check_random_next(&random) * 1e-3;
    static const int axis[7] = {0, 0, 1, 1, -1, 2, 2}, sign[7] = {1, -1, 1, -1, 0, 1, -1};
    for (int v = 0; v < 7; v++)
        if (axis[v] >= 0) mesh->vertices[3 * v + axis[v]] += sign[v];
    memcpy(mesh->faces, faces, sizeof faces);
    return mesh;
}

static text write_obj(const pliant_mesh *mesh)
{
    text t = {0};
    for (int v = 0; v < mesh->vertex_count; v++)
        print(&t, "v %.17g %.17g %.17g\n", mesh->vertices[3 * v], mesh->vertices[3 * v + 1],
              mesh->vertices[3 * v + 2]);
    for (int f = 0; f < mesh->face_count; f++)
        print(&t, "f %d %d %d\n", mesh->faces[3 * f] + 1, mesh->faces[3 * f + 1] + 1,
              mesh->faces[3 * f + 2] + 1);
    return t;
}

static text write_off(const pliant_mesh *mesh)
{
    text t = {0};
    print(&t, "OFF\n%d %d 0\n", mesh->vertex_count, mesh->face_count);
    for (int v = 0; v < mesh->vertex_count; v++)
        print(&t, "%.17g %.17g %.17g\n", mesh->vertices[3 * v], mesh->vertices[3 * v + 1],
              mesh->vertices[3 * v + 2]);
    for (int f = 0; f < mesh->face_count; f++)
        print(&t, "3 %d %d %d\n", mesh->faces[3 * f], mesh->faces[3 * f + 1],
              mesh->faces[3 * f + 2]);
    return t;
}

static text write_ply_ascii(const pliant_mesh *mesh)
{
    text t = {0};
    print(&t,
          "ply\nformat ascii 1.0\ncomment made for a test\nelement vertex %d\nproperty double x\n"
          "property double y\nproperty double z\nelement face %d\n"
          "property list uchar int vertex_indices\nend_header\n",
          mesh->vertex_count, mesh->face_count);
    for (int v = 0; v < mesh->vertex_count; v++)
        print(&t, "%.17g %.17g %.17g\n", mesh->vertices[3 * v], mesh->vertices[3 * v + 1],
              mesh->vertices[3 * v + 2]);
    for (int f = 0; f < mesh->face_count; f++)
        print(&t, "3 %d %d %d\n", mesh->faces[3 * f], mesh->faces[3 * f + 1],
              mesh->faces[3 * f + 2]);
    return t;
}

typedef enum order { LITTLE, BIG } order;

// The lowest `size` bytes of a number.
static void append_bits(text *t, uint64_t bits, int size, order o)
{
    unsigned char bytes[8];
    for (int i = 0; i < size; i++) bytes[o == LITTLE ? i : size - 1 - i] = (bits >> 8 * i) & 0xff;
    append(t, bytes, (size_t)size);
}

static void append_double(text *t, double value, order o)
{
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    append_bits(t, bits, 8, o);
}

static void append_float(text *t, float value, order o)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    append_bits(t, bits, 4, o);
}

// Everything that a reader may stumble over: an element of no interest, z before x, scalars
// between, a second list, faces of shorts with an int length.
static text write_ply_binary(const pliant_mesh *mesh, order o)
{
    text t = {0};
    print(&t,
          "ply\nformat %s 1.0\nobj_info odd\nelement camera 2\nproperty list uchar double pose\n"
          "property char id\nelement vertex %d\nproperty double z\nproperty uchar red\n"
          "property double x\nproperty list ushort float weights\nproperty float64 y\nelement face "
          "%d\n"
          "property short material\nproperty list int ushort vertex_index\n"
          "property list uchar float texcoord\nend_header\n",
          o == LITTLE ? "binary_little_endian" : "binary_big_endian", mesh->vertex_count,
          mesh->face_count);
    for (int i = 0; i < 2; i++) {
        append_bits(&t, (uint64_t)i, 1, o);
        for (int k = 0; k < i; k++) append_double(&t, 0.5, o);
        append_bits(&t, 0xff, 1, o);
    }
    for (int v = 0; v < mesh->vertex_count; v++) {
        append_double(&t, mesh->vertices[3 * v + 2], o);
        append_bits(&t, 200, 1, o);
        append_double(&t, mesh->vertices[3 * v], o);
        append_bits(&t, (uint64_t)(v % 3), 2, o);
        for (int k = 0; k < v % 3; k++) append_float(&t, NAN, o);
        append_double(&t, mesh->vertices[3 * v + 1], o);
    }
    for (int f = 0; f < mesh->face_count; f++) {
        append_bits(&t, 0xfffe, 2, o);
        append_bits(&t, 3, 4, o);
        for (int k = 0; k < 3; k++) append_bits(&t, (uint64_t)mesh->faces[3 * f + k], 2, o);
        append_bits(&t, 1, 1, o);
        append_float(&t, 0.25f, o);
    }
    return t;
}

static text write_stl_binary(const pliant_mesh *mesh)
{
    text t = {0};
    char head[80] = "solid in name only";
    append(&t, head, sizeof head);
    append_bits(&t, (uint64_t)mesh->face_count, 4, LITTLE);
    for (int f = 0; f < mesh->face_count; f++) {
        for (int k = 0; k < 3; k++) append_float(&t, NAN, LITTLE);
        for (int k = 0; k < 9; k++)
            append_float(&t, (float)mesh->vertices[3 * mesh->faces[3 * f + k / 3] + k % 3], LITTLE);
        append_bits(&t, 0x1234, 2, LITTLE);
    }
    return t;
}

static text write_stl_ascii(const pliant_mesh *mesh)
{
    text t = {0};
    print(&t, "solid a name with facet in it\n");
    for (int f = 0; f < mesh->face_count; f++) {
        if (f == 4) print(&t, "endsolid\nSOLID second\n");
        print(&t, "  facet normal nan -nan(ind) 0\n    OUTER LOOP\n");
        for (int k = 0; k < 3; k++) {
            const double *x = mesh->vertices + 3 * mesh->faces[3 * f + k];
            print(&t, "      vertex %.17g %.17g %.17g\n", x[0], x[1], x[2]);
        }
        print(&t, "    endloop\n  endfacet\n");
    }
    print(&t, "endsolid second\n");
    return t;
}

// ---- The same mesh from every format ----

static void obj_ply_and_off_keep_numbers_and_every_bit(void **state)
{
    (void)state;
    pliant_mesh *mesh = sample();
    const text files[] = {write_obj(mesh), write_off(mesh), write_ply_ascii(mesh),
                          write_ply_binary(mesh, LITTLE), write_ply_binary(mesh, BIG)};
    const char *names[] = {"a.obj", "a.off", "a.ply", "a.ply", "a.PLY"};
    for (int i = 0; i < 5; i++) {
        pliant_mesh *found = accept(names[i], files[i].data, files[i].size);
        assert_same_mesh(found, mesh);
        pliant_mesh_destroy(found);
        free(files[i].data);
    }
    pliant_mesh_destroy(mesh);
}

static void stl_is_welded_in_order_of_appearance(void **state)
{
    (void)state;
    pliant_mesh *mesh = sample();
    const text ascii = write_stl_ascii(mesh), binary = write_stl_binary(mesh);
    pliant_mesh *a = accept("a.stl", ascii.data, ascii.size);
    pliant_mesh *b = accept("b.stl", binary.data, binary.size);
    assert_int_equal(a->vertex_count, 6);
    assert_int_equal(b->vertex_count, 6);
    assert_int_equal(a->face_count, 8);
    assert_memory_equal(a->faces, b->faces, 24 * sizeof(int32_t));
    // The first face's corners come first.
    for (int k = 0; k < 3; k++) {
        assert_int_equal(a->faces[k], k);
        for (int c = 0; c < 3; c++) {
            const double x = mesh->vertices[3 * mesh->faces[k] + c];
            assert_true(a->vertices[3 * k + c] == x);
            assert_true(b->vertices[3 * k + c] == (double)(float)x);
        }
    }
    pliant_mesh_report report;
    pliant_error err;
    check_ok(pliant_mesh_check(a, "a.stl", &report, &err), &err);
    pliant_mesh_destroy(a);
    pliant_mesh_destroy(b);
    free(ascii.data);
    free(binary.data);
    pliant_mesh_destroy(mesh);
}

static void stl_triangles_that_collapse_are_dropped(void **state)
{
    (void)state;
    // A tetrahedron and a sliver that lies in one edge: -0 and 0 are one place.
    pliant_mesh *mesh = accept_text(
        "a.stl", "solid\nfacet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 0 1 0\nvertex 1 0 0\n"
                 "endloop\nendfacet\nfacet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n"
                 "vertex -0 0 -0.0\nendloop\nendfacet\nendsolid\n");
    assert_int_equal(mesh->face_count, 1);
    assert_int_equal(mesh->vertex_count, 3);
    pliant_mesh_destroy(mesh);
}

// ---- OBJ ----

#define TETRAHEDRON "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"

static void obj_is_read_in_every_spelling(void **state)
{
    (void)state;
    static const char *const spellings[] = {
        TETRAHEDRON "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n",
        // faces first, the last line without an end
        "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n" TETRAHEDRON "g last",
        // relative numbers, also in between
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -1 -2\nv 0 0 1\nf -4 -3 -1\nf 2 -2 -1\nf -4 4 -2\n",
        // textures and normals that do not exist, all forms
        TETRAHEDRON "f 1/1/1 3/99/99 2//7\nf 1/ 2// 4/5/\nf 2/-1 3/-1/-2 4\nf 1 4 3\n",
        // tabs, blanks, CRLF, CR, empty lines, comments at the end, upper E
        "\r\nv\t0 0\t 0  \r\n  v 1E0 0 0 # first\r\n\r\nv 0 +1.0e+0 0\rv 0 0 .1e1\r\n# f 9 9 "
        "9\\\r\n"
        "f 1 3 2\t\r\nf 1 2 4#x\r\nf 2 3 4\r\nf 1 4 3",
        // lines continued
        "v 0 \\\n0 0\nv 1 0 0\\\r\n\nv 0 1 0\nv 0 0 1\nf 1 \\\n 3 \\\r\n 2\nf 1 2 4\nf 2 3 4\nf 1 "
        "4 3\n",
        // a mark at the start, a colour, a weight, and what is passed over
        "\xEF\xBB\xBF# caf\xe9 latin\nmtllib a b.mtl\no Gr\xf6\xdf"
        "e\nv 0 0 0 1 0.5 nonsense\nv 1 0 0 1.0\n"
        "v 0 1 0 255 0 0 255\nv 0 0 1\nvt 0.5 0.5\nvn 0 0 1\nvp 1\ns off\nusemtl x\nl 1 2\np 1\ng "
        "a b\n"
        "fo 1 3 2\nf 1 2 4\nf 2 3 4\ncstype bezier\nf 1 4 3\nend\n",
        // a triangle written as a quadrilateral
        TETRAHEDRON "f 1 3 2 2\nf 1 1 2 4\nf 2 3 4 2\nf 1 4 4 3\n",
    };
    pliant_mesh *expected = accept_text("a.obj", spellings[0]);
    check_near(pliant_mesh_volume(expected), 1.0 / 6, 1e-15);
    for (size_t i = 1; i < sizeof spellings / sizeof *spellings; i++) {
        pliant_mesh *found = accept_text("a.obj", spellings[i]);
        assert_same_mesh(found, expected);
        pliant_mesh_destroy(found);
    }
    pliant_mesh_destroy(expected);
}

static void obj_refusals_name_line_and_reason(void **state)
{
    (void)state;
    static const refusal list[] = {
        {TETRAHEDRON "f 1 2 99999\n", "a.obj:5: face refers to vertex 99999 of 4"},
        {TETRAHEDRON "f 1 2 99999999999999999999999\n",
         "a.obj:5: face refers to vertex 4611686018427387904 of 4"},
        {TETRAHEDRON "f 0 1 2\n", "a.obj:5: face refers to vertex 0 of 4, expected numbers from 1"},
        {"v 0 0 0\nf -1 -2 -1\nv 1 0 0\n",
         "a.obj:2: face refers to vertex -2, but 1 stand before it"},
        {TETRAHEDRON "f 1 2 x\n", "a.obj:5: expected a vertex number in column 7, found 'x'"},
        {TETRAHEDRON "f 1 2 3/x\n", "a.obj:5: expected a vertex number in column 7, found '3/x'"},
        {TETRAHEDRON "f 1 2 3/1/1/1\n",
         "a.obj:5: expected a vertex number in column 7, found '3/1/1/1'"},
        {TETRAHEDRON "f 1.0 2 3\n", "a.obj:5: expected a vertex number in column 3, found '1.0'"},
        {TETRAHEDRON "\n\\\n\r\n f 1 2\n", "a.obj:8: face has 2 corners, expected at least 3"},
        {TETRAHEDRON "f\n", "a.obj:5: face has 0 corners, expected at least 3"},
        {"v 0 0\nv 1 0 0\n", "a.obj:1: expected the z coordinate, found the end of the line"},
        {"v 0 0", "a.obj:1: expected the z coordinate, found the end of the file"},
        {"v 0 zero 0\n", "a.obj:1: expected the y coordinate in column 5, found 'zero'"},
        {"v 0,5 1 0\n", "a.obj:1: expected the x coordinate in column 3, found '0,5'"},
        {"v 0 nan 0\n", "a.obj:1: the y coordinate is not finite: 'nan'"},
        {"v 0 0 1e999\n", "a.obj:1: the z coordinate is not finite: '1e999'"},
        {"# a\n\x01 3\n", "a.obj:2: expected a statement such as v or f in column 1, found '?'"},
        {"v 0 0 a_very_long_word_that_must_not_fill_the_message\n",
         "a.obj:1: expected the z coordinate in column 7, found "
         "'a_very_long_word_that_must_not_fil...'"},
        {"# nothing\n", "a.obj: there are no vertices: is it a mesh of that format?"},
        {TETRAHEDRON, "a.obj: there are 4 vertices, but no faces"},
    };
    refuse_each("a.obj", list);
}

// ---- PLY ----

#define PLY_HEAD(n, m)                                                                             \
    "ply\nformat ascii 1.0\nelement vertex " n "\nproperty float x\nproperty float y\n"            \
    "property float z\nelement face " m "\nproperty list uchar int vertex_indices\nend_header\n"
#define PLY_BODY "0 0 0\n1 0 0\n0 1 0\n0 0 1\n"

static void ply_is_read_whatever_the_order(void **state)
{
    (void)state;
    static const char *const spellings[] = {
        PLY_HEAD("4", "2") PLY_BODY "3 0 2 1\n4 0 1 2 3\n",
        // faces first, indices as doubles, CRLF, empty lines, no end of the last line
        "ply\r\nformat ascii 1.0\r\nelement face 2\r\nproperty float quality\r\n"
        "property list float double vertex_index\r\nelement nothing 4000000000\r\nelement vertex "
        "4\r\n"
        "property int8 z\r\nproperty int16 y\r\nproperty uint32 x\r\nend_header\r\n\r\n"
        "nan 3 0 2 1\r\n1 4 0 1 2 3\r\n\r\n0 0 0\r\n0 0 1\r\n0 1 0\r\n1 0 0",
    };
    pliant_mesh *expected = accept_text("a.ply", spellings[0]);
    assert_int_equal(expected->face_count, 3);
    pliant_mesh *found = accept_text("a.ply", spellings[1]);
    assert_same_mesh(found, expected);
    pliant_mesh_destroy(found);
    pliant_mesh_destroy(expected);
}

static void ply_refusals_name_line_or_element_and_reason(void **state)
{
    (void)state;
    static const refusal list[] = {
        {"plyx\n", "a.ply:1: expected ply in column 1, found 'plyx'"},
        {"ply\nformat ascii 1.0\nelement vertex 4\n",
         "a.ply:4: expected end_header, found the end of the file"},
        {"ply\nformat binary 1.0\n", "a.ply:2: expected ascii, binary_little_endian or "
                                     "binary_big_endian in column 8, found 'binary'"},
        {"ply\nelement vertex -1\n", "a.ply:2: expected a count in column 16, found '-1'"},
        {"ply\nproperty float x\n", "a.ply:2: a property before the first element"},
        {"ply\nelement vertex 1\nproperty float x\nproperty float x\n",
         "a.ply:4: the property is declared twice"},
        {"ply\nelement face 1\nelement face 1\n", "a.ply:3: the element is declared twice"},
        {"ply\nelement vertex 1\nproperty real x\n",
         "a.ply:3: expected a scalar type such as float or uchar in column 10, found 'real'"},
        {"ply\nelement vertex 1\nproperty list uchar\n",
         "a.ply:3: expected a scalar type such as float or uchar, found the end of the line"},
        {"ply\nvertex 1\n", "a.ply:2: expected format, element, property, comment or end_header in "
                            "column 1, found 'vertex'"},
        {"ply\nelement vertex 1\nend_header\n",
         "a.ply:3: expected a format line before end_header"},
        {"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n",
         "a.ply:5: expected an element vertex with the properties x, y and z"},
        {"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
         "property float z\nend_header\n0 0 0\n",
         "a.ply:7: expected an element face, found points or strips only"},
        {"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
         "property float z\nelement face 1\nend_header\n0 0 0\n",
         "a.ply:8: expected a list vertex_indices in the element face"},
        {PLY_HEAD("4", "1") PLY_BODY "3 0 1 4\n", "a.ply:14: face refers to vertex 4 of 4"},
        {PLY_HEAD("4", "1") PLY_BODY "3 0 1 -1\n", "a.ply:14: face refers to vertex -1 of 4"},
        {PLY_HEAD("4", "1") PLY_BODY "3 0 1 0.5\n",
         "a.ply:14: expected a vertex number, found: 0.5"},
        {PLY_HEAD("4", "1") PLY_BODY "-3 0 1 2\n", "a.ply:14: expected a list length, found: -3"},
        {PLY_HEAD("4", "1") PLY_BODY "2 0 1\n",
         "a.ply:14: face has 2 corners, expected at least 3"},
        {PLY_HEAD("4", "1") PLY_BODY "3 0 1 2 3\n",
         "a.ply:14: expected the end of the line in column 9, found '3'"},
        {PLY_HEAD("4", "1") "0 0 0\n1 0\n",
         "a.ply:11: expected a number, found the end of the line"},
        {PLY_HEAD("4", "1") "0 0 inf\n", "a.ply:10: the z coordinate is not finite: inf"},
        {PLY_HEAD("4", "1") "0 0 0\n\n",
         "a.ply: expected 4 vertices, found the end of the file after 1"},
        {PLY_HEAD("4", "9") PLY_BODY "3 0 1 2\n",
         "a.ply: expected 9 faces, found the end of the file after 1"},
        {PLY_HEAD("4000000000", "1") PLY_BODY,
         "a.ply: expected 4000000000 vertices, found the end of the file after 4"},
        {PLY_HEAD("4", "1") PLY_BODY "4000000000 0 1 2\n",
         "a.ply:14: expected a number, found the end of the line"},
    };
    refuse_each("a.ply", list);
}

static void binary_ply_refusals_name_the_element(void **state)
{
    (void)state;
    static const char head[] =
        "ply\nformat binary_little_endian 1.0\nelement vertex 3\n"
        "property float x\nproperty float y\nproperty float z\nelement face 1\n"
        "property list uint int vertex_indices\nend_header\n";
    static const struct {
        float z;
        uint32_t length, index;
        size_t dropped;  // bytes at the end
        const char *message;
    } cases[] = {
        {0, 3, 3, 0, "a.ply: face 0 refers to vertex 3 of 3"},
        {0, 3, 0xffffffff, 0, "a.ply: face 0 refers to vertex -1 of 3"},
        {NAN, 3, 2, 0, "a.ply: vertex 2: the z coordinate is not finite: nan"},
        {0, 0xffffffff, 2, 0, "a.ply: expected 1 faces, found the end of the file after 0"},
        {0, 2, 2, 0, "a.ply: face 0 has 2 corners, expected at least 3"},
        {0, 3, 2, 1, "a.ply: expected 1 faces, found the end of the file after 0"},
        {0, 3, 2, 14, "a.ply: expected 1 faces of at least 4 bytes, found 2 bytes for them"},
        {0, 3, 2, 17, "a.ply: expected 3 vertices of at least 12 bytes, found 35 bytes for them"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        text t = {0};
        append(&t, head, strlen(head));
        for (int k = 0; k < 8; k++) append_float(&t, (float)(k % 4 == 3), LITTLE);
        append_float(&t, cases[i].z, LITTLE);
        append_bits(&t, cases[i].length, 4, LITTLE);
        append_bits(&t, 0, 4, LITTLE);
        append_bits(&t, 1, 4, LITTLE);
        append_bits(&t, cases[i].index, 4, LITTLE);
        refuse("a.ply", t.data, t.size - cases[i].dropped, cases[i].message);
        free(t.data);
    }
}

// ---- OFF ----

static void off_is_read_with_every_header(void **state)
{
    (void)state;
    static const char *const spellings[] = {
        "OFF\n4 2 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n4 0 1 2 3\n",
        "OFF 4 2\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n4 0 1 2 3",
        "# comment\r\n\r\nOFF # more\r\n# counts\r\n4 2 6 # v f e\r\n0 0 0\r\n1 0 0 # x\r\n\r\n0 1 "
        "0\r\n"
        "#y\r\n0 0 1\r\n3 0 2 1 255 0 0\r\n4 0 1 2 3 0.5 0.5 0.5\r\n# end",
        "4 2 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n4 0 1 2 3\n",
        "COFF\n4 2 0\n0 0 0 255 0 0 255\n1 0 0 0 0 0 0\n0 1 0 1 1 1 1\n0 0 1 1 1 1 1\n3 0 2 1\n"
        "4 0 1 2 3\n",
        "STCNOFF\n4 2 0\n0 0 0 0 0 1 1 1 1 1 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n4 0 1 2 3\n",
    };
    pliant_mesh *expected = accept_text("a.off", spellings[0]);
    assert_int_equal(expected->vertex_count, 4);
    assert_int_equal(expected->face_count, 3);
    for (size_t i = 1; i < sizeof spellings / sizeof *spellings; i++) {
        pliant_mesh *found = accept_text("a.off", spellings[i]);
        assert_same_mesh(found, expected);
        pliant_mesh_destroy(found);
    }
    // Without a keyword only the name tells: its letters may be large.
    pliant_mesh *found = accept_text("A.OFF", spellings[3]);
    assert_same_mesh(found, expected);
    pliant_mesh_destroy(found);
    pliant_mesh_destroy(expected);
}

static void off_refusals_name_line_and_reason(void **state)
{
    (void)state;
    static const refusal list[] = {
        {"# only\n", "a.off: expected OFF, found nothing"},
        {"OBJ\n4 4 0\n", "a.off:1: expected OFF in column 1, found 'OBJ'"},
        {"4OFF\n4 4 0\n", "a.off:1: expected OFF in three dimensions in column 1, found '4OFF'"},
        {"OFF BINARY\n", "a.off:1: expected ascii OFF in column 5, found 'BINARY'"},
        {"OFF\n", "a.off:2: expected 3 counts, found the end of the file after 0"},
        {"OFF\n4\n", "a.off:2: expected the face count, found the end of the line"},
        {"OFF\n4 -4 0\n", "a.off:2: expected the face count in column 3, found '-4'"},
        {"OFF\n4 4 6\n0 0 0\n1 0 0\n",
         "a.off:5: expected 4 vertices, found the end of the file after 2"},
        {"OFF\n4000000000000 4 6\n0 0 0\n",
         "a.off:4: expected 4000000000000 vertices, found the end of the file after 1"},
        {"OFF\n1 2 6\n0 0 0\n3 0 0 0\n",
         "a.off:5: expected 2 faces, found the end of the file after 1"},
        {"OFF\n2 1 0\n0 0 0\n1 0\n",
         "a.off:4: expected the z coordinate, found the end of the line"},
        {"OFF\n1 1 0\n0 0 0\n3 0 0 1\n", "a.off:4: face refers to vertex 1 of 1"},
        {"OFF\n1 1 0\n0 0 0\n3 0 0\n",
         "a.off:4: expected a vertex number, found the end of the line"},
        {"OFF\n1 1 0\n0 0 0\n9000000000 0 0\n",
         "a.off:4: expected a vertex number, found the end of the line"},
        {"OFF\n1 1 0\n0 0 0\n2 0 0\n", "a.off:4: face has 2 corners, expected at least 3"},
        {"OFF\n0 0 0\n", "a.off: there are no vertices: is it a mesh of that format?"},
    };
    refuse_each("a.off", list);
}

// ---- STL ----

static void stl_refusals_name_line_or_triangle_and_reason(void **state)
{
    (void)state;
    static const refusal list[] = {
        {"solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0\n",
         "a.stl:5: expected the z coordinate, found the end of the line"},
        {"solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n",
         "a.stl:5: expected vertex, found the end of the file"},
        {"solid a\nfacet normal 0 0 1\nouter ring\n",
         "a.stl:3: expected loop in column 7, found 'ring'"},
        {"solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 nan 0\n",
         "a.stl:4: the y coordinate is not finite: 'nan'"},
        {"solid a\nface\n", "a.stl:2: expected facet or endsolid in column 1, found 'face'"},
        {"solid a\n", "a.stl:2: expected facet or endsolid, found the end of the file"},
        {"solid a\nendsolid\nfacet\n", "a.stl:3: expected solid in column 1, found 'facet'"},
        {"solid a\nendsolid\n", "a.stl: there are no vertices: is it a mesh of that format?"},
        {"sol", "a.stl: expected the 84 bytes of an STL header, or solid; found 3 bytes"},
    };
    refuse_each("a.stl", list);

    pliant_mesh *mesh = sample();
    text t = write_stl_binary(mesh);
    refuse("a.stl", t.data, t.size - 1,
           "a.stl: expected the 8 triangles that the STL header states, found 7 and a part of one");
    append(&t, "\n", 1);  // a line end behind the last triangle does no harm
    pliant_mesh_destroy(accept("a.stl", t.data, t.size));
    char more[50] = {0};
    append(&t, more, sizeof more);
    refuse("a.stl", t.data, t.size,
           "a.stl: expected the 8 triangles that the STL header states, found 9");
    const float infinite = INFINITY;
    memcpy(t.data + 84 + 50 * 2 + 12 + 16, &infinite, sizeof infinite);
    refuse("a.stl", t.data, 84 + 50 * 8,
           "a.stl: triangle 2: the y coordinate of corner 1 is not finite");
    free(t.data);
    pliant_mesh_destroy(mesh);
}

// ---- Polygons ----

static void prisms_with_odd_caps_have_their_volume(void **state)
{
    (void)state;
    // A star of 30 corners, tilted out of every coordinate plane, height 2.
    text t = {0};
    double area = 0;
    for (int side = 0; side < 2; side++)
        for (int i = 0; i < 30; i++) {
            const double angle = 6.283185307179586 * i / 30, r = i % 2 ? 0.3 : 1;
            const double u = r * cos(angle), v = r * sin(angle), w = 2 * side;
            print(&t, "v %.17g %.17g %.17g\n", u + 0.5 * w, v - 0.25 * w, w + 0.3 * u + 0.7 * v);
        }
    area = 15 * 1 * 0.3 * sin(6.283185307179586 / 30);
    print(&t, "f");
    for (int i = 30; i > 0; i--) print(&t, " %d", i);
    print(&t, "\nf");
    for (int i = 31; i <= 60; i++) print(&t, " %d", i);
    for (int i = 0; i < 30; i++)
        print(&t, "\nf %d %d %d %d", i + 1, (i + 1) % 30 + 1, (i + 1) % 30 + 31, i + 31);
    pliant_mesh *mesh = accept("prism.obj", t.data, t.size);
    pliant_mesh_report report;
    pliant_error err;
    check_ok(pliant_mesh_check(mesh, "prism.obj", &report, &err), &err);
    assert_int_equal(mesh->face_count, 116);
    // The map (u, v, w) -> position has determinant 1 - 0.15 + 0.175: area times height times that.
    check_near(report.volume, 2 * area * (1 - 0.3 * 0.5 + 0.7 * 0.25), 1e-14);
    pliant_mesh_destroy(mesh);
    free(t.data);
}

static void polygons_of_too_many_corners_are_refused_and_large_ones_end(void **state)
{
    (void)state;
    // A saw of as many corners as are allowed has no good ear for long; then one corner more.
    for (int extra = 0; extra < 2; extra++) {
        const int count = PLIANT_POLYGON_CORNER_LIMIT + extra;
        text t = {0};
        for (int i = 0; i < count - 2; i++) print(&t, "v %d %d 0\n", count - i, i % 2 ? 1 : 9);
        print(&t, "v 0 0 0\nv %d 0 0\nf", count);
        for (int i = 1; i <= count; i++) print(&t, " %d", i);
        print(&t, "\n");
        if (extra) {
            char message[100];
            snprintf(message, sizeof message, "a.obj:%d: face has more than %d corners", count + 1,
                     PLIANT_POLYGON_CORNER_LIMIT);
            refuse("a.obj", t.data, t.size, message);
        } else {
            pliant_mesh *mesh = accept("a.obj", t.data, t.size);
            assert_int_equal(mesh->face_count, count - 2);
            pliant_mesh_destroy(mesh);
        }
        free(t.data);
    }
}

// ---- Files ----

static void write_file(const char *path, const void *bytes, size_t size)
{
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(bytes, 1, size, file), size);
    assert_int_equal(fclose(file), 0);
}

static int make_folder(void **state)
{
    static char folder[] = "/tmp/pliant-mesh-XXXXXX";
    strcpy(folder + strlen(folder) - 6, "XXXXXX");
    *state = mkdtemp(folder);
    return *state == NULL;
}

static int remove_folder(void **state)
{
    char command[100];
    snprintf(command, sizeof command, "rm -rf '%s'", (const char *)*state);
    return system(command);
}

static void refuse_file(const char *path, pliant_status wanted, const char *reason)
{
    pliant_mesh *mesh = NULL;
    pliant_error err = {{0}};
    const pliant_status status = pliant_mesh_file_read(path, &mesh, &err);
    assert_null(mesh);
    assert_int_equal(status, wanted);
    // The name as given, or its end when that is long; then the reason.
    const size_t given = strlen(path), said = strlen(err.text) - strlen(reason);
    if (strlen(err.text) < strlen(reason) || strcmp(err.text + said, reason) != 0)
        fail_msg("\"%s\", expected \"...%s\"", err.text, reason);
    const size_t shown = given < said ? given : said - 3;
    assert_memory_equal(err.text + said - shown, path + given - shown, shown);
}

static void the_file_system_has_its_own_messages(void **state)
{
    const char *folder = *state;
    char path[600];
    snprintf(path, sizeof path, "%s/absent.obj", folder);
    refuse_file(path, PLIANT_ERR_IO, ": cannot open: No such file or directory");
    snprintf(path, sizeof path, "%s/folder.obj", folder);
    assert_int_equal(mkdir(path, 0700), 0);
    refuse_file(path, PLIANT_ERR_IO, ": is a directory, expected a file");
    snprintf(path, sizeof path, "%s/pipe.obj", folder);
    assert_int_equal(mkfifo(path, 0600), 0);
    refuse_file(path, PLIANT_ERR_IO, ": is not a regular file");
    snprintf(path, sizeof path, "%s/empty.obj", folder);
    write_file(path, "", 0);
    refuse_file(path, PLIANT_ERR_FORMAT, ": the file is empty");
    // A path of 500 characters leaves the reason in the message.
    snprintf(path, sizeof path, "%s", folder);
    while (strlen(path) < 500) strcat(path, "/.");
    strcat(path, "/empty.obj");
    refuse_file(path, PLIANT_ERR_FORMAT, ": the file is empty");
    if (geteuid() == 0) return;  // who may read everything
    snprintf(path, sizeof path, "%s/locked.obj", folder);
    write_file(path, "v 0 0 0\n", 8);
    assert_int_equal(chmod(path, 0), 0);
    refuse_file(path, PLIANT_ERR_IO, ": cannot open: Permission denied");
}

static void unknown_names_go_by_their_content(void **state)
{
    const char *folder = *state;
    pliant_mesh *mesh = sample();
    const text files[] = {write_obj(mesh),       write_off(mesh),
                          write_ply_ascii(mesh), write_ply_binary(mesh, BIG),
                          write_stl_ascii(mesh), write_stl_binary(mesh)};
    for (int i = 0; i < 6; i++) {
        char path[100];
        snprintf(path, sizeof path, "%s/mesh%s", folder, i % 2 ? ".unknown" : "");
        write_file(path, files[i].data, files[i].size);
        pliant_mesh *found = NULL;
        pliant_error err = {{0}};
        check_ok(pliant_mesh_file_read(path, &found, &err), &err);
        assert_int_equal(found->face_count, 8);
        pliant_mesh_destroy(found);
        free(files[i].data);
    }
    pliant_mesh_destroy(mesh);
    char path[100];
    snprintf(path, sizeof path, "%s/notes.txt", folder);
    write_file(path, "these are notes\n", 16);
    refuse_file(
        path, PLIANT_ERR_FORMAT,
        ": unknown kind of mesh: expected .obj, .ply, .off, .stl, or what the import library "
        "reads (.glb, .gltf, .3ds, .dae, .fbx, ...)");
}

static void print_base64(text *t, const unsigned char *bytes, size_t size)
{
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    for (size_t i = 0; i < size; i += 3) {
        const uint32_t group = (uint32_t)bytes[i] << 16 |
                               (i + 1 < size ? (uint32_t)bytes[i + 1] << 8 : 0) |
                               (i + 2 < size ? bytes[i + 2] : 0);
        print(t, "%c%c%c%c", digits[group >> 18], digits[group >> 12 & 63],
              i + 1 < size ? digits[group >> 6 & 63] : '=',
              i + 2 < size ? digits[group & 63] : '=');
    }
}

static void scenes_are_placed_merged_and_welded(void **state)
{
    // glTF: half a unit octahedron (x >= 0, its square hole open) with a normal per corner, placed
    // twice: as it is and mirrored at x = 0, both shifted by 5. Together they are closed: volume
    // 4/3.
    static const float points[12][3] = {{1, 0, 0},  {0, 1, 0},  {0, 0, 1},  {1, 0, 0},
                                        {0, 0, 1},  {0, -1, 0}, {1, 0, 0},  {0, -1, 0},
                                        {0, 0, -1}, {1, 0, 0},  {0, 0, -1}, {0, 1, 0}};
    const char *folder = *state;
    text buffer = {0}, t = {0};
    for (int i = 0; i < 36; i++) append_float(&buffer, points[i / 3][i % 3], LITTLE);
    for (int i = 0; i < 36; i++)
        append_float(&buffer, i % 3 == 0 ? 0.577f : i / 9 % 2 ? -0.577f : 0.577f, LITTLE);
    print(&t,
          "{\"asset\":{\"version\":\"2.0\"},\"scene\":0,\"scenes\":[{\"nodes\":[0]}],\"nodes\":["
          "{\"translation\":[5,0,0],\"children\":[1,2]},{\"mesh\":0},"
          "{\"mesh\":0,\"scale\":[-1,1,1]}],");
    print(&t,
          "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0,\"NORMAL\":1}}]}],"
          "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":12,\"type\":\"VEC3\","
          "\"min\":[0,-1,-1],\"max\":[1,1,1]},");
    print(&t, "{\"bufferView\":1,\"componentType\":5126,\"count\":12,\"type\":\"VEC3\"}],"
              "\"bufferViews\":[{\"buffer\":0,\"byteOffset\":0,\"byteLength\":144},"
              "{\"buffer\":0,\"byteOffset\":144,\"byteLength\":144}],");
    print(&t, "\"buffers\":[{\"byteLength\":288,\"uri\":\"data:application/octet-stream;base64,");
    print_base64(&t, (const unsigned char *)buffer.data, buffer.size);
    print(&t, "\"}]}\n");
    char path[100];
    snprintf(path, sizeof path, "%s/scene.gltf", folder);
    write_file(path, t.data, t.size);
    pliant_mesh *mesh = NULL;
    pliant_error err = {{0}};
    check_ok(pliant_mesh_file_read(path, &mesh, &err), &err);
    assert_int_equal(mesh->vertex_count, 6);
    pliant_mesh_report report;
    check_ok(pliant_mesh_check(mesh, path, &report, &err), &err);
    assert_int_equal(report.component_count, 1);
    assert_int_equal(report.turned_count, 0);
    check_near(report.volume, 4.0 / 3, 1e-6);  // positions are floats
    check_near(report.bounding_min[0], 4, 1e-6);
    check_near(report.bounding_max[0], 6, 1e-6);
    pliant_mesh_destroy(mesh);
    // Cut in the middle, the library refuses it: one line, with the file's name.
    write_file(path, t.data, t.size / 2);
    mesh = NULL;
    assert_int_equal(pliant_mesh_file_read(path, &mesh, &err), PLIANT_ERR_FORMAT);
    assert_null(mesh);
    assert_memory_equal(err.text, path, strlen(path));
    assert_non_null(strstr(err.text, ": the import library refuses it: "));
    assert_null(strchr(err.text, '\n'));
    free(buffer.data);
    free(t.data);
}

// ---- Hostile files ----

// Whatever the bytes: a mesh with valid numbers, or one line of refusal.
static void try_bytes(const char *name, const void *bytes, size_t size)
{
    pliant_mesh *mesh = NULL;
    pliant_error err = {{0}};
    const pliant_status status = read_bytes(name, bytes, size, &mesh, &err);
    if (status < 0) {
        assert_null(mesh);
        assert_in_range(strlen(err.text), strlen(name) + 3, sizeof err.text - 1);
        for (const char *c = err.text; *c; c++) assert_in_range(*c, 0x20, 0x7e);
        return;
    }
    for (int32_t i = 0; i < 3 * mesh->face_count; i++)
        assert_in_range(mesh->faces[i], 0, mesh->vertex_count - 1);
    pliant_mesh_report report;
    if (pliant_mesh_check(mesh, name, &report, &err) < 0) assert_int_not_equal(err.text[0], 0);
    pliant_mesh_destroy(mesh);
}

static void truncated_and_flipped_files_do_no_harm(void **state)
{
    (void)state;
    pliant_mesh *mesh = sample();
    text quads = {0};
    print(&quads, "%s",
          "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n"
          "f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2/1 3/2 7//3 6\nf -6 -5 \\\n -1 -2\n"
          "f 4 1 5 8\nf 1 2 6 7 8 4\n");
    const text files[] = {write_obj(mesh),
                          write_off(mesh),
                          write_ply_ascii(mesh),
                          write_ply_binary(mesh, LITTLE),
                          write_ply_binary(mesh, BIG),
                          write_stl_ascii(mesh),
                          write_stl_binary(mesh),
                          quads};
    const char *names[] = {"a.obj", "a.off", "a.ply", "b.ply", "c.ply", "a.stl", "b.stl", "q.obj"};
    check_random random = check_random_seed(2024);
    for (int i = 0; i < 8; i++) {
        for (size_t size = 0; size < files[i].size; size++)
            try_bytes(names[i], files[i].data, size);
        char *copy = malloc(files[i].size);
        assert_non_null(copy);
        for (int round = 0; round < 4000; round++) {
            memcpy(copy, files[i].data, files[i].size);
            const int flips = 1 + round % 4;
            for (int k = 0; k < flips; k++) {
                const size_t at = (size_t)(check_random_next(&random) * (double)files[i].size);
                // Half the flips hit one bit, half write a byte that text takes a meaning from.
                static const char meaning[] = "0123456789-+.eE/\\#\n\r \t";
                const double choice = check_random_next(&random);
                if (round % 2) copy[at] = (char)(copy[at] ^ (1 << (int)(8 * choice)));
                else copy[at] = meaning[(int)(choice * (double)(sizeof meaning - 1))];
            }
            try_bytes(names[i], copy, files[i].size);
        }
        free(copy);
        free(files[i].data);
    }
    pliant_mesh_destroy(mesh);
}

static void every_flipped_header_byte_of_binary_files_does_no_harm(void **state)
{
    (void)state;
    pliant_mesh *mesh = sample();
    const text files[] = {write_ply_binary(mesh, LITTLE), write_stl_binary(mesh)};
    const char *names[] = {"a.ply", "a.stl"};
    for (int i = 0; i < 2; i++) {
        for (size_t at = 0; at < 400 && at < files[i].size; at++)
            for (int bit = 0; bit < 8; bit++) {
                files[i].data[at] = (char)(files[i].data[at] ^ (1 << bit));
                try_bytes(names[i], files[i].data, files[i].size);
                files[i].data[at] = (char)(files[i].data[at] ^ (1 << bit));
            }
        free(files[i].data);
    }
    pliant_mesh_destroy(mesh);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(obj_ply_and_off_keep_numbers_and_every_bit),
        cmocka_unit_test(stl_is_welded_in_order_of_appearance),
        cmocka_unit_test(stl_triangles_that_collapse_are_dropped),
        cmocka_unit_test(obj_is_read_in_every_spelling),
        cmocka_unit_test(obj_refusals_name_line_and_reason),
        cmocka_unit_test(ply_is_read_whatever_the_order),
        cmocka_unit_test(ply_refusals_name_line_or_element_and_reason),
        cmocka_unit_test(binary_ply_refusals_name_the_element),
        cmocka_unit_test(off_is_read_with_every_header),
        cmocka_unit_test(off_refusals_name_line_and_reason),
        cmocka_unit_test(stl_refusals_name_line_or_triangle_and_reason),
        cmocka_unit_test(prisms_with_odd_caps_have_their_volume),
        cmocka_unit_test(polygons_of_too_many_corners_are_refused_and_large_ones_end),
        cmocka_unit_test_setup_teardown(the_file_system_has_its_own_messages, make_folder,
                                        remove_folder),
        cmocka_unit_test_setup_teardown(unknown_names_go_by_their_content, make_folder,
                                        remove_folder),
        cmocka_unit_test_setup_teardown(scenes_are_placed_merged_and_welded, make_folder,
                                        remove_folder),
        cmocka_unit_test(truncated_and_flipped_files_do_no_harm),
        cmocka_unit_test(every_flipped_header_byte_of_binary_files_does_no_harm),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
