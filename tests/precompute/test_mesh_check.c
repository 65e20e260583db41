// test_mesh_check.c: what bounds a solid is accepted, everything else is refused with the place.
#include "check.h"

#include "mesh/mesh_check.h"
#include "mesh/mesh_file.h"
#include "surfaces.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// ---- What the cases share ----

static pliant_mesh_report accept(pliant_mesh *mesh)
{
    pliant_mesh_report report;
    pliant_error err = {{0}};
    check_ok(pliant_mesh_check(mesh, "mesh", &report, &err), &err);
    return report;
}

static size_t mesh_bytes(const pliant_mesh *mesh)
{
    return sizeof *mesh + (size_t)mesh->vertex_count * 24 + (size_t)mesh->face_count * 12;
}

// Refused with this message, and the mesh and the report stay as they were.
static void refuse(pliant_mesh *mesh, const char *message)
{
    void *before = malloc(mesh_bytes(mesh));
    assert_non_null(before);
    memcpy(before, mesh, mesh_bytes(mesh));
    pliant_mesh_report report = {.component_count = -7};
    pliant_error err = {{0}};
    assert_int_equal(pliant_mesh_check(mesh, "mesh", &report, &err), PLIANT_ERR_FORMAT);
    assert_string_equal(err.text, message);
    assert_int_equal(report.component_count, -7);
    assert_memory_equal(before, mesh, mesh_bytes(mesh));
    free(before);
    // A caller may not want the text.
    assert_int_equal(pliant_mesh_check(mesh, "mesh", &report, NULL), PLIANT_ERR_FORMAT);
    pliant_mesh_destroy(mesh);
}

static void turn_face(pliant_mesh *mesh, int32_t f)
{
    int32_t *v = mesh->faces + 3 * f;
    const int32_t swapped = v[1];
    v[1] = v[2];
    v[2] = swapped;
}

static pliant_mesh *turned(pliant_mesh *mesh)
{
    for (int32_t f = 0; f < mesh->face_count; f++) turn_face(mesh, f);
    return mesh;
}

// Scaled about the origin, then moved.
static pliant_mesh *placed(pliant_mesh *mesh, double scale, double x, double y, double z)
{
    const double shift[3] = {x, y, z};
    for (int32_t i = 0; i < 3 * mesh->vertex_count; i++)
        mesh->vertices[i] = mesh->vertices[i] * scale + shift[i % 3];
    return mesh;
}

// Both as one mesh where they are; both are given.
static pliant_mesh *together(pliant_mesh *a, pliant_mesh *b)
{
    pliant_mesh *sum;
    pliant_error err;
    check_ok(pliant_mesh_create(a->vertex_count + b->vertex_count, a->face_count + b->face_count,
                                &sum, &err),
             &err);
    memcpy(sum->vertices, a->vertices, (size_t)a->vertex_count * 24);
    memcpy(sum->vertices + 3 * a->vertex_count, b->vertices, (size_t)b->vertex_count * 24);
    memcpy(sum->faces, a->faces, (size_t)a->face_count * 12);
    for (int32_t i = 0; i < 3 * b->face_count; i++)
        sum->faces[3 * a->face_count + i] = b->faces[i] + a->vertex_count;
    pliant_mesh_destroy(a);
    pliant_mesh_destroy(b);
    return sum;
}

// A sphere without its levels.
static pliant_mesh *sphere(int32_t levels)
{
    check_surface s = check_sphere(levels);
    pliant_mesh *mesh = s.mesh;
    s.mesh = NULL;
    check_surface_destroy(&s);
    return mesh;
}

static void add_faces(pliant_mesh **mesh, const int32_t *faces, int32_t count)
{
    pliant_mesh *sum;
    pliant_error err;
    check_ok(pliant_mesh_create((*mesh)->vertex_count, (*mesh)->face_count + count, &sum, &err),
             &err);
    memcpy(sum->vertices, (*mesh)->vertices, (size_t)sum->vertex_count * 24);
    memcpy(sum->faces, (*mesh)->faces, (size_t)(*mesh)->face_count * 12);
    memcpy(sum->faces + 3 * (*mesh)->face_count, faces, (size_t)count * 12);
    pliant_mesh_destroy(*mesh);
    *mesh = sum;
}

// ---- The files of the evaluation meshes ----

#define SPHERE_VOLUME 4.047044  // of the icosphere with 320 faces, to the digits of the files

static const struct {
    const char *file;
    int32_t vertex_count, face_count, component_count, turned_count;
    double volume;
} accepted_files[] = {
    {"inverted_all.obj", 162, 320, 1, 320, SPHERE_VOLUME},
    {"two_components.obj", 324, 640, 2, 0, SPHERE_VOLUME * 1.125},
    {"quads_only.obj", 8, 12, 1, 0, 1},
    {"quads_only_bob.obj", 334, 668, 1, 0, 0.735015},
    // A prism on a regular 30-gon of radius 1: 15 sin(12 degrees).
    {"ngon_prism.obj", 60, 116, 1, 0, 3.118675},
    {"negative_indices.obj", 162, 320, 1, 0, SPHERE_VOLUME},
    {"obj_crlf_tabs.obj", 162, 320, 1, 0, SPHERE_VOLUME},
    {"obj_latin1_name.obj", 8, 12, 1, 0, 1},
    {"stl_ok.stl", 162, 320, 1, 0, SPHERE_VOLUME},
    {"stl_solid_binary.stl", 162, 320, 1, 0, SPHERE_VOLUME},
    {"ply_ok.ply", 162, 320, 1, 0, SPHERE_VOLUME},
    {"ply_big_endian.ply", 162, 320, 1, 0, SPHERE_VOLUME},
    {"tetrahedron.obj", 4, 4, 1, 0, 1.0 / 6},
};

static const struct {
    const char *file, *reason;  // what follows the name, from its beginning or in part
} refused_files[] = {
    {"open_surface.obj",
     ": the surface is open: 63 edges have one face (first: vertices 279 and 1073 of "
     "face 598)"},
    {"open_one_missing_face.obj", ": the surface is open: 3 edges have one face (first: vertices "},
    {"nonmanifold_edge.obj",
     ": the surface is not manifold: 1 edge has more than two faces (first: "
     "vertices 1 and 0 of face 0, 4 faces)"},
    {"duplicate_faces.obj",
     ": 5 duplicate faces (first: face 320 has the vertices 0, 42 and 44 of face 0)"},
    {"duplicate_vertices_soup.obj",
     ": the surface is open: 960 edges have one face (first: vertices 0 and 1 of face 0); its 960 "
     "vertices stand on 162 places only: weld vertices of equal position first"},
    {"inverted_some.obj",
     ": inconsistent orientation: 20 of 320 faces look the other way (first: faces "},
    {"moebius.obj", ": the surface is open: 60 edges have one face"},
    {"zero_area_collinear.obj",
     ": 1 degenerate face without area (first: face 321, vertices 0, 42 and 162"},
    {"repeated_index.obj",
     ": 2 degenerate faces with a vertex used twice (first: face 320, vertices 0, 0 "
     "and 1)"},
    {"flat_closed.obj", ": the mesh is flat and encloses no volume: extent 0 along z"},
    {"nan.obj", ":11: the x coordinate is not finite: 'nan'"},
    {"huge.obj",
     ": vertex 10: the x coordinate is too large: expected at most 1e+60, found 1e+308"},
    {"text_number.obj", ":11: expected the y coordinate in column 7, found 'zero'"},
    {"two_coords.obj", ":11: expected the z coordinate, found the end of the line"},
    {"empty.obj", ": the file is empty"},
    {"comments_only.obj", ": there are no vertices"},
    {"empty.stl", ": the file is empty"},
    {"empty.ply", ": the file is empty"},
    {"empty.off", ": the file is empty"},
    {"garbage.obj", ":1: expected a statement such as v or f in column 1"},
    {"garbage.stl", ": expected the 1191196492 triangles that the STL header states, found 398"},
    {"self_intersecting_two.obj", ": two components cross: vertex "},
    {"negative_indices_interleaved.obj", "weld vertices of equal position first"},
    {"index_out_of_range.obj", ":483: face refers to vertex 163 of 162"},
    {"index_far_out.obj", ":483: face refers to vertex 2000000000 of 162"},
    {"index_zero.obj", ":483: face refers to vertex 0 of 162, expected numbers from 1"},
    {"index_not_number.obj", ":483: expected a vertex number in column 7, found 'x'"},
    {"face_slashes.obj", ": the surface is open: 3 edges have one face"},
    {"stl_truncated.stl",
     ": expected the 320 triangles that the STL header states, found 159 and a part"},
    {"stl_header_only.stl", ": expected the 320 triangles that the STL header states, found 0"},
    {"stl_huge_count.stl",
     ": expected the 4294967295 triangles that the STL header states, found 320"},
    {"stl_ascii_truncated.stl", ":6: expected vertex, found the end of the file"},
    {"ply_huge_vertices.ply",
     ": expected 4000000000 vertices of at least 12 bytes, found 6104 bytes"},
    {"ply_huge_faces.ply",
     ": expected 4000000000 faces of at least 1 byte, found 4160 bytes for them"},
    {"ply_list_255.ply", ": expected 320 faces of at least 1 byte, found 100 bytes for them"},
    {"ply_no_end.ply", ":8: expected end_header, found the end of the file"},
    {"off_short.off", ":5: expected 4 vertices, found the end of the file after 2"},
    {"one_triangle.obj", ": 3 vertices and 1 faces: a closed surface has at least 4 of each"},
    {"vertices_no_faces.obj", ": there are 3 vertices, but no faces"},
    {"faces_no_vertices.obj", ":1: face refers to vertex 1 of 0"},
    {"a_directory.obj", ": is a directory, expected a file"},
};

static pliant_status read_and_check(const char *path, pliant_mesh **mesh,
                                    pliant_mesh_report *report, pliant_error *err)
{
    pliant_status status = pliant_mesh_file_read(path, mesh, err);
    if (status == PLIANT_OK) status = pliant_mesh_check(*mesh, path, report, err);
    return status;
}

static const char *bad_path(const char *file)
{
    char name[100];
    snprintf(name, sizeof name, "bad/%s", file);
    return check_model_path(name);
}

static void bad_files_that_are_sound_are_accepted(void **state)
{
    (void)state;
    if (!check_model_path("bad/README.md")) skip();
    for (size_t i = 0; i < sizeof accepted_files / sizeof *accepted_files; i++) {
        const char *path = bad_path(accepted_files[i].file);
        if (!path) continue;
        pliant_mesh *mesh = NULL;
        pliant_mesh_report report;
        pliant_error err = {{0}};
        check_ok(read_and_check(path, &mesh, &report, &err), &err);
        assert_int_equal(mesh->vertex_count, accepted_files[i].vertex_count);
        assert_int_equal(mesh->face_count, accepted_files[i].face_count);
        assert_int_equal(report.component_count, accepted_files[i].component_count);
        assert_int_equal(report.turned_count, accepted_files[i].turned_count);
        // The files carry 6 digits and more.
        check_near(report.volume, accepted_files[i].volume, 1e-6 * accepted_files[i].volume);
        check_near(pliant_mesh_volume(mesh), report.volume, 1e-12 * report.volume);
        pliant_mesh_destroy(mesh);
    }
}

static void bad_files_are_refused_with_name_and_reason(void **state)
{
    (void)state;
    if (!check_model_path("bad/README.md")) skip();
    int wrong = 0;
    for (size_t i = 0; i < sizeof refused_files / sizeof *refused_files; i++) {
        const char *path = bad_path(refused_files[i].file), *reason = refused_files[i].reason;
        if (!path) continue;
        pliant_mesh *mesh = NULL;
        pliant_mesh_report report;
        pliant_error err = {{0}};
        const pliant_status status = read_and_check(path, &mesh, &report, &err);
        pliant_mesh_destroy(mesh);
        if (status < 0 && strncmp(err.text, path, strlen(path)) == 0 && strstr(err.text, reason))
            continue;
        print_error("%s: status %d, \"%s\", expected \"%s\"\n", path, status, err.text, reason);
        wrong++;
    }
    assert_int_equal(wrong, 0);
}

static void every_good_model_is_accepted(void **state)
{
    (void)state;
    static const struct {
        const char *file;
        int32_t vertex_count, face_count;
    } models[] = {
        {"armadillo.obj", 8280, 16556},
        {"bob.obj", 5344, 10688},
        {"bob_control.obj", 334, 668},
        {"bunny.obj", 3301, 6598},
        {"dragon.obj", 9409, 18818},
        {"fandisk.obj", 6475, 12946},
        {"liver.obj", 2923, 5842},
        {"liver_tiny.obj", 139, 274},
        {"penguin.obj", 3362, 6720},
        {"spot.obj", 2930, 5856},
        {"spot_control.obj", 188, 372},
        {"torus.obj", 2304, 4608},
        {"semireg/blob_L4.obj", 2562, 5120},
        {"semireg/bunny_L5.obj", 10242, 20480},
        {"semireg/dragon_L3_shuffled.obj", 9920, 19840},
        {"semireg/spot_loop_base.obj", 188, 372},
    };
    if (!check_model_path("bunny.obj")) skip();
    for (size_t i = 0; i < sizeof models / sizeof *models; i++) {
        const char *path = check_model_path(models[i].file);
        if (!path) continue;
        pliant_mesh *mesh = NULL;
        pliant_error err = {{0}};
        check_ok(pliant_mesh_file_read(path, &mesh, &err), &err);
        const pliant_mesh_report report = accept(mesh);
        assert_int_equal(mesh->vertex_count, models[i].vertex_count);
        assert_int_equal(mesh->face_count, models[i].face_count);
        assert_int_equal(report.component_count, 1);
        assert_int_equal(report.turned_count, 0);
        check_at_least(report.volume, 0.01);
        pliant_mesh_destroy(mesh);
    }
}

// ---- What is accepted ----

static void solids_of_every_genus_are_accepted_in_any_order(void **state)
{
    (void)state;
    pliant_mesh *meshes[] = {check_tetrahedron(), check_octahedron(), check_icosahedron(),
                             check_cube(),        check_torus(5, 9),  check_block(0),
                             check_block(3),      sphere(3)};
    check_random random = check_random_seed(5);
    for (size_t i = 0; i < sizeof meshes / sizeof *meshes; i++) {
        const pliant_mesh_report first = accept(meshes[i]);
        assert_int_equal(first.component_count, 1);
        assert_int_equal(first.turned_count, 0);
        check_near(first.volume, pliant_mesh_volume(meshes[i]), 1e-12 * first.volume);
        check_shuffle(meshes[i], &random, NULL);
        const pliant_mesh_report second = accept(meshes[i]);
        check_near(second.volume, first.volume, 1e-12 * first.volume);
        assert_memory_equal(second.bounding_min, first.bounding_min, sizeof first.bounding_min);
        assert_memory_equal(second.bounding_max, first.bounding_max, sizeof first.bounding_max);
        pliant_mesh_destroy(meshes[i]);
    }
}

static void the_report_has_volume_and_box(void **state)
{
    (void)state;
    pliant_mesh *mesh = placed(check_cube(), 0.5, 10, 20, 30);
    const pliant_mesh_report report = accept(mesh);
    check_near(report.volume, 1, 1e-12);
    for (int k = 0; k < 3; k++) {
        check_near(report.bounding_min[k], 10 * (k + 1) - 0.5, 0);
        check_near(report.bounding_max[k], 10 * (k + 1) + 0.5, 0);
    }
    pliant_mesh_destroy(mesh);
}

static void components_that_look_inwards_are_turned(void **state)
{
    (void)state;
    pliant_mesh *mesh = check_beside(turned(check_icosahedron()), check_cube());
    const pliant_mesh_report report = accept(mesh);
    assert_int_equal(report.component_count, 2);
    assert_int_equal(report.turned_count, 20);
    check_near(report.volume, pliant_mesh_volume(mesh), 1e-12);
    const pliant_mesh_report again = accept(mesh);
    assert_int_equal(again.turned_count, 0);
    check_near(again.volume, report.volume, 0);
    pliant_mesh_destroy(mesh);
}

static void cavities_look_into_themselves_and_islands_outwards(void **state)
{
    (void)state;
    // A cube with a cavity, an island in the cavity, a hole in the island, and a cube beside, each
    // looking out or in: always the same solid, volume 8 (1 - 1/8 + 1/64 - 1/512 + 1/8).
    const double volume = 8 * (1 - 1 / 8.0 + 1 / 64.0 - 1 / 512.0 + 1 / 8.0);
    static const double scale[5] = {1, 0.5, 0.25, 0.125, 0.5};
    static const int outwards[5] = {1, 0, 1, 0, 1};
    for (int turns = 0; turns < 32; turns++) {
        pliant_mesh *mesh = NULL;
        int expected = 0;
        for (int i = 0; i < 5; i++) {
            // From the innermost to the outermost for half of the cases.
            const int k = turns % 2 ? 4 - i : i;
            pliant_mesh *cube = placed(check_cube(), scale[k], k == 4 ? 3 : 0.01, 0.02, 0.03);
            const int in = turns >> i & 1;
            if (in) turned(cube);
            expected += in == outwards[k] ? 12 : 0;
            mesh = mesh ? together(mesh, cube) : cube;
        }
        const pliant_mesh_report report = accept(mesh);
        assert_int_equal(report.component_count, 5);
        assert_int_equal(report.turned_count, expected);
        check_near(report.volume, volume, 1e-12);
        check_near(pliant_mesh_volume(mesh), volume, 1e-12);
        pliant_mesh_destroy(mesh);
    }
}

static void what_lies_in_a_hole_or_a_bay_is_not_inside(void **state)
{
    (void)state;
    // A small cube in the hole of a torus: inside its box, not inside it. The rays of its vertices
    // pass the torus in its vertices and edges: both are cut symmetrically.
    pliant_mesh *mesh = together(check_torus(12, 16), placed(check_cube(), 0.02, 0, 0, 0));
    const pliant_mesh_report report = accept(mesh);
    assert_int_equal(report.component_count, 2);
    assert_int_equal(report.turned_count, 0);
    pliant_mesh_destroy(mesh);
}

static void rays_through_edges_and_vertices_count_once(void **state)
{
    (void)state;
    // Octahedra about one centre, in any order of vertices: rays along x meet vertices and edges of
    // the outer one exactly.
    check_random random = check_random_seed(31);
    for (int round = 0; round < 100; round++) {
        pliant_mesh *outer = check_octahedron(), *inner = turned(check_octahedron());
        check_shuffle(outer, &random, NULL);
        check_shuffle(inner, &random, NULL);
        pliant_mesh *mesh = together(outer, placed(inner, 0.5, 0, 0, 0));
        const pliant_mesh_report report = accept(mesh);
        assert_int_equal(report.turned_count, 0);
        check_near(report.volume, 4.0 / 3 * (1 - 1 / 8.0), 1e-12);
        pliant_mesh_destroy(mesh);
    }
}

static void very_small_large_and_distant_solids_are_accepted(void **state)
{
    (void)state;
    static const double scale[] = {1e-50, 1e-9, 1e9, 1e59};
    for (int i = 0; i < 4; i++) {
        pliant_mesh *mesh = placed(check_icosahedron(), scale[i], 0, 0, 0);
        const pliant_mesh_report report = accept(mesh);
        assert_int_equal(report.turned_count, 0);
        check_at_least(report.volume / scale[i] / scale[i] / scale[i], 2.5);
        pliant_mesh_destroy(mesh);
    }
    pliant_mesh *mesh = placed(turned(check_icosahedron()), 1, 1e6, -1e6, 1e6);
    assert_int_equal(accept(mesh).turned_count, 20);
    pliant_mesh_destroy(mesh);
}

// ---- What is refused ----

static void too_little_or_too_much_is_refused(void **state)
{
    (void)state;
    pliant_mesh *mesh = check_tetrahedron();
    mesh->face_count = 3;
    refuse(mesh, "mesh: 4 vertices and 3 faces: a closed surface has at least 4 of each");
    mesh = check_cube();
    mesh->vertices[3 * 5 + 1] = NAN;
    refuse(mesh, "mesh: vertex 5: the y coordinate is not finite: nan");
    mesh = check_cube();
    mesh->vertices[2] = -1e61;
    refuse(mesh,
           "mesh: vertex 0: the z coordinate is too large: expected at most 1e+60, found -1e+61");
    mesh = placed(check_cube(), 0, 1, 1, 1);
    refuse(mesh, "mesh: all vertices stand on one place: extent 0");
    mesh = check_cube();
    mesh->faces[16] = 8;
    refuse(mesh, "mesh: face 5 refers to vertex 8 of 8");
    mesh = check_cube();
    mesh->faces[16] = -1;
    refuse(mesh, "mesh: face 5 refers to vertex -1 of 8");
}

static void unused_vertices_are_refused_with_count_and_first(void **state)
{
    (void)state;
    pliant_mesh *mesh = together(check_cube(), check_tetrahedron());
    mesh->face_count = 12;
    refuse(mesh,
           "mesh: 4 of 12 vertices are used by no face (first: vertex 8); remove what is not used");
}

static void degenerate_faces_are_refused(void **state)
{
    (void)state;
    // A vertex pushed so close to the middle of the opposite side that the height is 1e-7 of it.
    pliant_mesh *mesh = check_octahedron();
    const int32_t *v = mesh->faces;
    for (int k = 0; k < 3; k++)
        mesh->vertices[3 * v[0] + k] =
            (mesh->vertices[3 * v[1] + k] + mesh->vertices[3 * v[2] + k]) / 2 * (1 + 2e-7);
    pliant_mesh_report report;
    pliant_error err = {{0}};
    assert_int_equal(pliant_mesh_check(mesh, "mesh", &report, &err), PLIANT_ERR_FORMAT);
    assert_non_null(
        strstr(err.text, "mesh: 1 degenerate face without area (first: face 0, vertices "));
    // Ten times the limit is thin, but a face.
    for (int k = 0; k < 3; k++) mesh->vertices[3 * v[0] + k] *= 1 + 2e-5;
    accept(mesh);
    pliant_mesh_destroy(mesh);
}

static void duplicates_are_refused_whatever_their_direction(void **state)
{
    (void)state;
    pliant_mesh *mesh = check_cube();
    int32_t more[6];
    for (int k = 0; k < 3; k++) {
        more[k] = mesh->faces[3 * 7 + 2 - k];
        more[3 + k] = mesh->faces[3 * 2 + (k + 1) % 3];
    }
    char message[120];
    snprintf(message, sizeof message,
             "mesh: 2 duplicate faces (first: face 12 has the vertices %d, %d and %d of face 7)",
             more[0], more[1], more[2]);
    add_faces(&mesh, more, 2);
    refuse(mesh, message);
}

static void mixed_orientation_is_refused_with_the_place(void **state)
{
    (void)state;
    pliant_mesh *mesh = check_icosahedron();
    turn_face(mesh, 13);
    pliant_mesh_report report;
    pliant_error err = {{0}};
    assert_int_equal(pliant_mesh_check(mesh, "mesh", &report, &err), PLIANT_ERR_FORMAT);
    assert_non_null(
        strstr(err.text, "mesh: inconsistent orientation: 1 of 20 faces look the other way"));
    assert_non_null(strstr(err.text, "13"));
    pliant_mesh_destroy(mesh);
}

static void a_closed_surface_of_one_side_is_refused(void **state)
{
    (void)state;
    // Klein's bottle: a torus of quads whose last row meets the first mirrored.
    enum { N = 8 };
    pliant_mesh *mesh;
    pliant_error err;
    check_ok(pliant_mesh_create(N * N, 2 * N * N, &mesh, &err), &err);
    check_random random = check_random_seed(9);
    for (int i = 0; i < 3 * N * N; i++) mesh->vertices[i] = check_random_next(&random);
    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j++) {
            const int mirrored = i == N - 1;
            const int32_t a = N * i + j, b = N * i + (j + 1) % N;
            const int32_t row = N * ((i + 1) % N);
            const int32_t c = row + (mirrored ? (N - j) % N : j);
            const int32_t d = row + (mirrored ? (2 * N - j - 1) % N : (j + 1) % N);
            const int32_t faces[6] = {a, b, d, a, d, c};
            memcpy(mesh->faces + 6 * (N * i + j), faces, sizeof faces);
        }
    pliant_mesh_report report;
    assert_int_equal(pliant_mesh_check(mesh, "mesh", &report, &err), PLIANT_ERR_FORMAT);
    assert_non_null(strstr(err.text, "mesh: the surface is not orientable: it has one side only"));
    pliant_mesh_destroy(mesh);
}

static void fans_that_meet_in_a_vertex_are_refused(void **state)
{
    (void)state;
    // Two tetrahedra that share a vertex.
    pliant_mesh *mesh = together(check_tetrahedron(), check_tetrahedron());
    for (int32_t i = 12; i < 24; i++) mesh->faces[i] = mesh->faces[i] == 4 ? 0 : mesh->faces[i];
    for (int32_t i = 12; i < 24; i++) mesh->faces[i] -= mesh->faces[i] > 4;
    memmove(mesh->vertices + 12, mesh->vertices + 15, 9 * sizeof(double));
    for (int k = 0; k < 9; k++)
        mesh->vertices[12 + k] = 2 * mesh->vertices[k % 3] - mesh->vertices[12 + k];
    mesh->vertex_count = 7;
    refuse(mesh,
           "mesh: the surface is not manifold: 1 vertex where separate fans of faces meet (first: "
           "vertex 0, 2 fans)");
}

static void components_without_volume_are_refused(void **state)
{
    (void)state;
    // A flat cushion in a tilted plane: closed, manifold, no volume.
    pliant_mesh *mesh;
    pliant_error err;
    static const double corners[5][2] = {{0, 0}, {1, 0}, {0, 1}, {0.3, 0.3}, {0.2, 0.4}};
    static const int32_t faces[6][3] = {{0, 1, 3}, {1, 2, 3}, {2, 0, 3},
                                        {1, 0, 4}, {2, 1, 4}, {0, 2, 4}};
    check_ok(pliant_mesh_create(5, 6, &mesh, &err), &err);
    for (int v = 0; v < 5; v++) {
        mesh->vertices[3 * v] = corners[v][0];
        mesh->vertices[3 * v + 1] = corners[v][1];
        mesh->vertices[3 * v + 2] = 0.5 * corners[v][0] + 0.25 * corners[v][1];
    }
    memcpy(mesh->faces, faces, sizeof faces);
    pliant_mesh_report report;
    assert_int_equal(pliant_mesh_check(mesh, "mesh", &report, &err), PLIANT_ERR_FORMAT);
    assert_non_null(strstr(err.text, "mesh: the component of vertex 0 encloses no volume: "));
    pliant_mesh_destroy(mesh);
}

static void components_that_cross_are_refused(void **state)
{
    (void)state;
    // Beside each other, and one within the box of the other.
    pliant_mesh *meshes[] = {together(sphere(2), placed(sphere(2), 0.7, 0.9, 0.1, 0)),
                             together(sphere(2), placed(check_cube(), 0.3, 0.5, 0.5, 0.5))};
    for (int i = 0; i < 2; i++) {
        pliant_mesh_report report;
        pliant_error err = {{0}};
        assert_int_equal(pliant_mesh_check(meshes[i], "mesh", &report, &err), PLIANT_ERR_FORMAT);
        assert_non_null(strstr(err.text, "mesh: two components cross: vertex "));
        pliant_mesh_destroy(meshes[i]);
    }
}

static void thousands_of_components_are_refused_quickly(void **state)
{
    (void)state;
    pliant_mesh *mesh;
    pliant_error err = {{0}};
    enum { COUNT = 20000 };
    pliant_mesh *one = check_tetrahedron();
    check_ok(pliant_mesh_create(4 * COUNT, 4 * COUNT, &mesh, &err), &err);
    for (int32_t i = 0; i < COUNT; i++)
        for (int k = 0; k < 12; k++) {
            mesh->vertices[12 * i + k] = one->vertices[k] + 10 * i;
            mesh->faces[12 * i + k] = one->faces[k] + 4 * i;
        }
    pliant_mesh_destroy(one);
    refuse(mesh, "mesh: the surface has 20000 separate components, at most 1024 are accepted");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(bad_files_that_are_sound_are_accepted),
        cmocka_unit_test(bad_files_are_refused_with_name_and_reason),
        cmocka_unit_test(every_good_model_is_accepted),
        cmocka_unit_test(solids_of_every_genus_are_accepted_in_any_order),
        cmocka_unit_test(the_report_has_volume_and_box),
        cmocka_unit_test(components_that_look_inwards_are_turned),
        cmocka_unit_test(cavities_look_into_themselves_and_islands_outwards),
        cmocka_unit_test(what_lies_in_a_hole_or_a_bay_is_not_inside),
        cmocka_unit_test(rays_through_edges_and_vertices_count_once),
        cmocka_unit_test(very_small_large_and_distant_solids_are_accepted),
        cmocka_unit_test(too_little_or_too_much_is_refused),
        cmocka_unit_test(unused_vertices_are_refused_with_count_and_first),
        cmocka_unit_test(degenerate_faces_are_refused),
        cmocka_unit_test(duplicates_are_refused_whatever_their_direction),
        cmocka_unit_test(mixed_orientation_is_refused_with_the_place),
        cmocka_unit_test(a_closed_surface_of_one_side_is_refused),
        cmocka_unit_test(fans_that_meet_in_a_vertex_are_refused),
        cmocka_unit_test(components_without_volume_are_refused),
        cmocka_unit_test(components_that_cross_are_refused),
        cmocka_unit_test(thousands_of_components_are_refused_quickly),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
