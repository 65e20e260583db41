// test_connectivity.c: the levels of a mesh found again, whatever happened to its order.
#include "check.h"

#include "multires_hierarchy.h"
#include "mesh/multires.h"
#include "surfaces.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static pliant_multires *detect(const pliant_mesh *mesh)
{
    pliant_multires *m = NULL;
    pliant_error err;
    check_ok(pliant_multires_detect(mesh, &m, &err), &err);
    return m;
}

static pliant_multires *subdivide(const pliant_mesh *base, int32_t levels)
{
    pliant_multires *m = NULL;
    pliant_error err;
    check_ok(pliant_multires_subdivide(base, levels, PLIANT_SUBDIVIDE_LOOP, &m, &err), &err);
    return m;
}

// No level is found, and the message says that much and what to do.
static void refuse(const pliant_mesh *mesh, const char *text)
{
    pliant_multires *m = NULL;
    pliant_error err = {{0}};
    const pliant_status status = pliant_multires_detect(mesh, &m, &err);
    const char *advice = "; take the mesh as a base mesh with --subdivide L";
    const int advised = status != PLIANT_ERR_MISSING || strstr(err.text, advice) != NULL;
    if (status >= 0 || m || !advised || !strstr(err.text, text)) {
        pliant_multires_destroy(m);
        fail_msg("%s: \"%s\", expected a refusal with \"%s\"", pliant_status_name(status), err.text,
                 text);
    }
}

// ---- The same surface ----

// A face by its vertices, begun at the lowest.
typedef struct triangle {
    int32_t v[3];
} triangle;

static triangle begin_lowest(int32_t a, int32_t b, int32_t c)
{
    if (b < a && b < c) return (triangle){{b, c, a}};
    if (c < a && c < b) return (triangle){{c, a, b}};
    return (triangle){{a, b, c}};
}

static int by_vertices(const void *left, const void *right)
{
    const triangle *a = left, *b = right;
    for (int k = 0; k < 3; k++)
        if (a->v[k] != b->v[k]) return a->v[k] < b->v[k] ? -1 : 1;
    return 0;
}

// A face and its number; compared by vertices alone.
typedef struct numbered {
    triangle vertices;
    int32_t face;
} numbered;

// The oriented faces, vertices renamed, in a fixed order.
static triangle *canonical(int32_t face_count, const int32_t *faces, const int32_t *name)
{
    triangle *t = malloc((size_t)face_count * sizeof *t);
    assert_non_null(t);
    for (int32_t f = 0; f < face_count; f++)
        t[f] = begin_lowest(name[faces[3 * f]], name[faces[3 * f + 1]], name[faces[3 * f + 2]]);
    qsort(t, (size_t)face_count, sizeof *t, by_vertices);
    return t;
}

// Two meshes with levels are the same on every level, when vertex v of `a` is vertex name[v] of
// `b`.
static void check_same_levels(const pliant_multires *a, const pliant_multires *b,
                              const int32_t *name)
{
    assert_int_equal(a->level_count, b->level_count);
    assert_memory_equal(a->vertex_count, b->vertex_count, sizeof a->vertex_count);
    int32_t *identity = malloc((size_t)b->mesh->vertex_count * sizeof *identity);
    assert_non_null(identity);
    for (int32_t v = 0; v < b->mesh->vertex_count; v++) identity[v] = v;
    for (int32_t v = 0; v < a->mesh->vertex_count; v++)
        assert_memory_equal(a->mesh->vertices + 3 * v, b->mesh->vertices + 3 * name[v],
                            3 * sizeof(double));
    pliant_hierarchy *ha = hierarchy_of(a), *hb = hierarchy_of(b);
    for (int32_t l = 0; l < a->level_count; l++) {
        assert_int_equal(ha->face_count[l], hb->face_count[l]);
        triangle *ta = canonical(ha->face_count[l], ha->faces[l], name);
        triangle *tb = canonical(hb->face_count[l], hb->faces[l], identity);
        assert_memory_equal(ta, tb, (size_t)ha->face_count[l] * sizeof *ta);
        free(tb);
        free(ta);
    }
    pliant_hierarchy_destroy(hb);
    pliant_hierarchy_destroy(ha);
    free(identity);
}

// The order that multires.h promises.
static void check_order(const pliant_multires *m, const pliant_mesh *input)
{
    const int32_t n = input->vertex_count;
    assert_int_equal(m->mesh->vertex_count, n);
    for (int32_t l = 0; l < m->level_count; l++)
        for (int32_t v = l ? m->vertex_count[l - 1] + 1 : 1; v < m->vertex_count[l]; v++)
            assert_true(m->source_index[v - 1] < m->source_index[v]);
    for (int32_t v = 0; v < n; v++)
        assert_memory_equal(m->mesh->vertices + 3 * v, input->vertices + 3 * m->source_index[v],
                            3 * sizeof(double));
    // Base faces by the first of the input's faces in each: find every input face again.
    numbered *sorted = malloc((size_t)input->face_count * sizeof *sorted);
    assert_non_null(sorted);
    for (int32_t f = 0; f < input->face_count; f++) {
        const int32_t *v = input->faces + 3 * f;
        sorted[f] = (numbered){begin_lowest(v[0], v[1], v[2]), f};
    }
    qsort(sorted, (size_t)input->face_count, sizeof *sorted, by_vertices);
    const int32_t family = 1 << 2 * (m->level_count - 1);
    int32_t before = -1;
    for (int32_t f = 0; f < m->mesh->face_count; f += family) {
        int32_t lowest = input->face_count;
        for (int32_t i = f; i < f + family; i++) {
            const int32_t *v = m->mesh->faces + 3 * i, *s = m->source_index;
            const triangle t = begin_lowest(s[v[0]], s[v[1]], s[v[2]]);
            const numbered *same =
                bsearch(&t, sorted, (size_t)input->face_count, sizeof *sorted, by_vertices);
            assert_non_null(same);
            if (same->face < lowest) lowest = same->face;
        }
        assert_true(before < lowest);
        before = lowest;
    }
    free(sorted);
}

// ---- Properties ----

static void what_subdivision_made_comes_back_as_it_was(void **state)
{
    (void)state;
    for (int which = 0; which < 5; which++)
        for (int32_t levels = 1; levels <= 4; levels++) {
            pliant_mesh *base = which == 0   ? check_tetrahedron()
                                : which == 1 ? check_icosahedron()
                                : which == 2 ? check_cube()
                                : which == 3 ? check_torus(3, 5)
                                             : check_block(2);
            pliant_multires *made = subdivide(base, levels), *found = detect(made->mesh);
            assert_int_equal(found->level_count, levels + 1);
            assert_memory_equal(found->vertex_count, made->vertex_count,
                                sizeof found->vertex_count);
            const size_t n = (size_t)made->mesh->vertex_count, n0 = (size_t)made->vertex_count[0];
            assert_memory_equal(found->mesh->vertices, made->mesh->vertices,
                                n * 3 * sizeof(double));
            assert_memory_equal(found->mesh->faces, made->mesh->faces,
                                (size_t)made->mesh->face_count * 3 * sizeof(int32_t));
            assert_memory_equal(found->parents, made->parents, (n - n0) * 2 * sizeof(int32_t));
            for (size_t v = 0; v < n; v++) assert_int_equal(found->source_index[v], v);
            assert_string_equal(found->note.text, "");
            pliant_multires_destroy(found);
            pliant_multires_destroy(made);
            pliant_mesh_destroy(base);
        }
}

static void random_surfaces_in_random_order_have_their_levels_found(void **state)
{
    (void)state;
    check_random random = check_random_seed(21);
    int refined_bases = 0;
    for (int run = 0; run < 120; run++) {
        const int which = run % 6;
        pliant_mesh *base = which == 0   ? check_icosahedron()
                            : which == 1 ? check_cube()
                            : which == 2 ? check_torus(5, 7)
                            : which == 3 ? check_block(1)
                            : which == 4 ? check_block(2)
                                         : check_beside(check_block(2), check_icosahedron());
        check_flip_edges(base, 20 * (1 + run / 6), 3, 12, &random);
        pliant_multires *none = NULL;
        if (pliant_multires_detect(base, &none, NULL) == PLIANT_OK) {
            // The flips missed, or made a refinement of something coarser.
            refined_bases++;
            pliant_multires_destroy(none);
            pliant_mesh_destroy(base);
            continue;
        }
        const int32_t levels = 1 + run % 4;
        pliant_multires *made = subdivide(base, levels);
        const int32_t n = made->mesh->vertex_count;
        pliant_mesh *shuffled = NULL;
        pliant_error err;
        check_ok(pliant_mesh_create(n, made->mesh->face_count, &shuffled, &err), &err);
        memcpy(shuffled->vertices, made->mesh->vertices, (size_t)n * 3 * sizeof(double));
        memcpy(shuffled->faces, made->mesh->faces,
               (size_t)shuffled->face_count * 3 * sizeof(int32_t));
        int32_t *to = malloc((size_t)n * sizeof *to), *from = malloc((size_t)n * sizeof *from);
        assert_non_null(to);
        assert_non_null(from);
        check_shuffle(shuffled, &random, to);
        pliant_multires *found = detect(shuffled);
        check_order(found, shuffled);
        // Vertex v found is source_index[v] of the shuffled mesh, which came from ... of the made
        // one.
        int32_t *name = malloc((size_t)n * sizeof *name);
        assert_non_null(name);
        for (int32_t v = 0; v < n; v++) from[to[v]] = v;
        for (int32_t v = 0; v < n; v++) name[v] = from[found->source_index[v]];
        check_same_levels(found, made, name);
        free(name);
        free(from);
        free(to);
        pliant_multires_destroy(found);
        pliant_mesh_destroy(shuffled);
        pliant_multires_destroy(made);
        pliant_mesh_destroy(base);
    }
    check_at_most(refined_bases, 10);
}

static void tori_of_regular_vertices_are_as_deep_as_their_grid_halves(void **state)
{
    (void)state;
    // All valences are 6, and no vertex tells that it is coarse. A grid halves while both sides are
    // even and leave at least three vertices each way, below which the mesh has double edges.
    const struct {
        int32_t rows, columns, levels;
    } cases[] = {{24, 12, 3}, {12, 24, 3}, {6, 6, 2},  {48, 40, 4},
                 {16, 16, 3}, {6, 10, 2},  {20, 12, 3}};
    check_random random = check_random_seed(22);
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
        for (int run = 0; run < 5; run++) {
            pliant_mesh *torus = check_torus(cases[i].rows, cases[i].columns);
            check_shuffle(torus, &random, NULL);
            pliant_multires *m = detect(torus);
            assert_int_equal(m->level_count, cases[i].levels);
            for (int32_t l = 0; l < m->level_count; l++)
                assert_int_equal(m->vertex_count[l],
                                 torus->vertex_count >> 2 * (m->level_count - 1 - l));
            assert_int_equal(m->source_index[0], 0);
            check_order(m, torus);
            pliant_hierarchy_destroy(hierarchy_of(m));
            pliant_multires_destroy(m);
            pliant_mesh_destroy(torus);
        }
    pliant_mesh *odd = check_torus(7, 12), *tight = check_torus(4, 8);
    refuse(odd, "of valence 6 would be both an end and the midpoint of a coarse edge");
    refuse(tight, "the coarser level of 8 vertices is no closed manifold mesh");
    pliant_mesh_destroy(tight);
    pliant_mesh_destroy(odd);
}

static void components_are_as_deep_as_the_shallowest_and_the_note_says_so(void **state)
{
    (void)state;
    pliant_mesh *icosahedron = check_icosahedron(), *cube = check_cube();
    pliant_multires *deep = subdivide(icosahedron, 3), *shallow = subdivide(cube, 1);
    pliant_mesh *parts[2] = {deep->mesh, shallow->mesh};
    deep->mesh = shallow->mesh = NULL;
    const int32_t cube_begins = parts[0]->vertex_count;
    pliant_mesh *both = check_beside(parts[0], parts[1]);
    pliant_multires *m = detect(both);
    assert_int_equal(m->level_count, 2);
    assert_int_equal(m->vertex_count[0], 162 + 8);
    // The contradiction is in the cube, and names one of its vertices.
    int32_t components = 0, vertex = -1;
    if (sscanf(m->note.text, "2 levels, as many as all %d components have: vertex %d", &components,
               &vertex) != 2 ||
        components != 2 || vertex < cube_begins ||
        !strstr(m->note.text, "another component could be coarser"))
        fail_msg("note: \"%s\"", m->note.text);
    pliant_hierarchy_destroy(hierarchy_of(m));
    pliant_multires_destroy(m);
    pliant_mesh_destroy(both);
    pliant_multires_destroy(shallow);
    pliant_multires_destroy(deep);
    pliant_mesh_destroy(cube);
    pliant_mesh_destroy(icosahedron);

    // A component without levels leaves none to the other.
    check_surface sphere = check_sphere(2);
    both = check_beside(check_cube(), sphere.mesh);
    sphere.mesh = NULL;
    refuse(both, "no subdivision connectivity: vertex");
    pliant_mesh_destroy(both);
    check_surface_destroy(&sphere);
}

static void meshes_without_levels_are_refused_with_the_reason_and_the_way_out(void **state)
{
    (void)state;
    pliant_mesh *meshes[] = {check_tetrahedron(), check_octahedron(), check_icosahedron(),
                             check_cube(),        check_block(0),     check_block(2)};
    for (size_t i = 0; i < sizeof meshes / sizeof *meshes; i++) {
        refuse(meshes[i], "no subdivision connectivity: vertex");
        pliant_mesh_destroy(meshes[i]);
    }
    pliant_mesh *open = check_cube();
    open->face_count--;
    refuse(open, "edge from vertex");
    pliant_mesh_destroy(open);
}

static void any_flipped_edge_leaves_no_level(void **state)
{
    (void)state;
    check_random random = check_random_seed(23);
    for (int run = 0; run < 200; run++) {
        check_surface s = check_sphere(3);
        const pliant_mesh *whole = s.mesh;
        int32_t *before = malloc((size_t)whole->face_count * 3 * sizeof *before);
        assert_non_null(before);
        memcpy(before, whole->faces, (size_t)whole->face_count * 3 * sizeof *before);
        do check_flip_edges(s.mesh, 1, 3, 12, &random);
        while (memcmp(before, s.mesh->faces, (size_t)whole->face_count * 3 * sizeof *before) == 0);
        refuse(s.mesh, "no subdivision connectivity: vertex");
        free(before);
        check_surface_destroy(&s);
    }
}

static void a_sphere_of_163842_vertices_has_its_eight_levels(void **state)
{
    (void)state;
    check_random random = check_random_seed(24);
    check_surface s = check_sphere(7);
    check_shuffle(s.mesh, &random, NULL);
    pliant_multires *m = detect(s.mesh);
    assert_int_equal(m->level_count, 8);
    for (int32_t l = 0; l < 8; l++) assert_int_equal(m->vertex_count[l], s.vertex_count[l]);
    pliant_hierarchy_destroy(hierarchy_of(m));
    pliant_multires_destroy(m);
    check_surface_destroy(&s);
}

// ---- Evaluation meshes ----

static pliant_mesh *load(const char *name)
{
    char path[128];
    snprintf(path, sizeof path, "semireg/%s.obj", name);
    const char *full = check_model_path(path);
    if (!full) return NULL;
    pliant_mesh *mesh = check_load_obj(full);
    assert_non_null(mesh);
    return mesh;
}

static void the_evaluation_meshes_have_the_levels_of_their_manifest(void **state)
{
    (void)state;
    const struct {
        const char *name;
        int32_t levels[7];
    } cases[] = {
        {"bob_L2", {155, 620, 2480}},
        {"bob_L2_shuffled", {155, 620, 2480}},
        {"bunny_L4", {12, 42, 162, 642, 2562}},
        {"bunny_L4_shuffled", {12, 42, 162, 642, 2562}},
        {"bunny_L5", {12, 42, 162, 642, 2562, 10242}},
        {"blob_L4", {12, 42, 162, 642, 2562}},
        {"dragon_L3", {155, 620, 2480, 9920}},
        {"dragon_L3_shuffled", {155, 620, 2480, 9920}},
        {"spot_loop_L1", {188, 746}},
        {"spot_loop_L1_steps", {188, 746}},
        {"spot_loop_L2_shuffled", {188, 746, 2978}},
        {"spot_loop_L2_steps", {188, 746, 2978}},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        pliant_mesh *mesh = load(cases[i].name);
        if (!mesh) skip();
        pliant_multires *m = detect(mesh);
        int32_t count = 0;
        while (count < 7 && cases[i].levels[count]) count++;
        assert_int_equal(m->level_count, count);
        for (int32_t l = 0; l < count; l++)
            assert_int_equal(m->vertex_count[l], cases[i].levels[l]);
        check_order(m, mesh);
        // Those in order keep their vertex numbers.
        for (int32_t v = 0; v < mesh->vertex_count && !strstr(cases[i].name, "shuffled"); v++)
            assert_int_equal(m->source_index[v], v);
        pliant_hierarchy_destroy(hierarchy_of(m));
        pliant_multires_destroy(m);
        pliant_mesh_destroy(mesh);
    }
}

// The vertex of `file` that lies exactly there.
static int32_t vertex_at(const pliant_mesh *file, int32_t count, const double *x)
{
    for (int32_t v = 0; v < count; v++)
        if (memcmp(file->vertices + 3 * v, x, 3 * sizeof *x) == 0) return v;
    fail_msg("no vertex at %.9g %.9g %.9g", x[0], x[1], x[2]);
    return -1;
}

static void shuffled_files_lead_back_to_the_ordered_ones_and_to_their_bases(void **state)
{
    (void)state;
    const char *names[][3] = {{"bob_L2_shuffled", "bob_L2", "bob_base"},
                              {"bunny_L4_shuffled", "bunny_L4", "bunny_base"},
                              {"dragon_L3_shuffled", "dragon_L3", "dragon_base"}};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        pliant_mesh *shuffled = load(names[i][0]), *ordered = load(names[i][1]),
                    *base = load(names[i][2]);
        if (!shuffled || !ordered || !base) skip();
        pliant_multires *a = detect(shuffled), *b = detect(ordered);
        const int32_t n = shuffled->vertex_count, n0 = base->vertex_count;
        int32_t *name = malloc((size_t)n * sizeof *name);
        int32_t *identity = malloc((size_t)n0 * sizeof *identity);
        assert_non_null(name);
        assert_non_null(identity);
        for (int32_t v = 0; v < n; v++) name[v] = vertex_at(b->mesh, n, a->mesh->vertices + 3 * v);
        check_same_levels(a, b, name);

        // The coarsest level is the base file.
        pliant_hierarchy *h = hierarchy_of(a);
        assert_int_equal(a->vertex_count[0], n0);
        assert_int_equal(h->face_count[0], base->face_count);
        for (int32_t v = 0; v < n0; v++) {
            name[v] = vertex_at(base, n0, a->mesh->vertices + 3 * v);
            identity[v] = v;
        }
        triangle *ta = canonical(h->face_count[0], h->faces[0], name);
        triangle *tb = canonical(base->face_count, base->faces, identity);
        assert_memory_equal(ta, tb, (size_t)base->face_count * sizeof *ta);
        free(tb);
        free(ta);
        pliant_hierarchy_destroy(h);
        free(identity);
        free(name);
        pliant_multires_destroy(b);
        pliant_multires_destroy(a);
        pliant_mesh_destroy(base);
        pliant_mesh_destroy(ordered);
        pliant_mesh_destroy(shuffled);
    }
}

static void the_bunny_with_one_flipped_edge_is_refused(void **state)
{
    (void)state;
    pliant_mesh *mesh = load("bunny_L5_oneflip");
    if (!mesh) skip();
    refuse(mesh, "no subdivision connectivity: vertex");
    pliant_mesh_destroy(mesh);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_subdivision_made_comes_back_as_it_was),
        cmocka_unit_test(random_surfaces_in_random_order_have_their_levels_found),
        cmocka_unit_test(tori_of_regular_vertices_are_as_deep_as_their_grid_halves),
        cmocka_unit_test(components_are_as_deep_as_the_shallowest_and_the_note_says_so),
        cmocka_unit_test(meshes_without_levels_are_refused_with_the_reason_and_the_way_out),
        cmocka_unit_test(any_flipped_edge_leaves_no_level),
        cmocka_unit_test(a_sphere_of_163842_vertices_has_its_eight_levels),
        cmocka_unit_test(the_evaluation_meshes_have_the_levels_of_their_manifest),
        cmocka_unit_test(shuffled_files_lead_back_to_the_ordered_ones_and_to_their_bases),
        cmocka_unit_test(the_bunny_with_one_flipped_edge_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
