// test_hierarchy.c: levels derived from the finest faces, and every false claim refused.
#include "check.h"

#include "pliant/halfedge.h"
#include "pliant/hierarchy.h"
#include "surfaces.h"

#include <stdlib.h>
#include <string.h>

#define CASES 8

// Bases of every genus and of valences from 3, and their refinements.
static check_surface surface(int which, int32_t levels)
{
    switch (which) {
    case 0:
        return check_refine(check_tetrahedron(), levels);
    case 1:
        return check_refine(check_octahedron(), levels);
    case 2:
        return check_sphere(levels);
    case 3:
        return check_refine(check_cube(), levels);
    case 4:
        return check_refine(check_torus(3, 5), levels);
    case 5:
        return check_refine(check_block(2), levels);
    case 6:
        return check_refine(check_beside(check_octahedron(), check_torus(4, 3)), levels);
    default:
        return check_refine(check_block(0), levels);
    }
}

static void the_generators_of_the_tests_enclose_what_they_say(void **state)
{
    (void)state;
    // Volumes and V - E + F = 2 (components) - 2 (genus), E = 3/2 F. The torus is its inscribed
    // polyhedron: pi^2/2 (0.65 * 0.35^2 * 4) = 1.57 at most.
    const struct {
        pliant_mesh *mesh;
        int euler;
        double volume_min, volume_max;
    } cases[] = {
        {check_tetrahedron(), 2, 2.666, 2.667},
        {check_octahedron(), 2, 1.333, 1.334},
        {check_icosahedron(), 2, 2.536, 2.537},
        {check_cube(), 2, 8, 8},
        {check_torus(9, 12), 0, 1.2, 1.58},
        {check_block(0), 2, 3, 3},
        {check_block(1), 0, 8, 8},
        {check_block(2), -2, 13, 13},
        {check_beside(check_cube(), check_octahedron()), 4, 9.333, 9.334},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        pliant_mesh *m = cases[i].mesh;
        assert_int_equal(m->vertex_count - m->face_count / 2, cases[i].euler);
        check_at_least(pliant_mesh_volume(m), cases[i].volume_min - 1e-12);
        check_at_most(pliant_mesh_volume(m), cases[i].volume_max + 1e-12);
        pliant_mesh_destroy(m);
    }
}

static void every_level_has_the_counts_of_a_closed_surface(void **state)
{
    (void)state;
    for (int which = 0; which < CASES; which++)
        for (int32_t levels = 0; levels <= 3; levels++) {
            check_surface s = surface(which, levels);
            pliant_hierarchy *h = check_hierarchy(&s);
            assert_int_equal(h->level_count, levels + 1);
            const int euler = h->vertex_count[0] - h->face_count[0] / 2;
            for (int32_t l = 0; l <= levels; l++) {
                assert_int_equal(h->vertex_count[l], s.vertex_count[l]);
                assert_int_equal(h->face_count[l], s.mesh->face_count >> 2 * (levels - l));
                assert_int_equal(h->vertex_count[l] - h->face_count[l] / 2, euler);
            }
            pliant_hierarchy_destroy(h);
            check_surface_destroy(&s);
        }
}

static void the_faces_of_each_level_are_those_it_was_refined_from(void **state)
{
    (void)state;
    for (int which = 0; which < CASES; which++) {
        check_surface fine = surface(which, 3);
        pliant_hierarchy *h = check_hierarchy(&fine);
        for (int32_t l = 0; l <= 3; l++) {
            check_surface coarse = surface(which, l);
            assert_int_equal(coarse.mesh->face_count, h->face_count[l]);
            assert_memory_equal(coarse.mesh->faces, h->faces[l],
                                (size_t)h->face_count[l] * 3 * sizeof(int32_t));
            check_surface_destroy(&coarse);
        }
        pliant_hierarchy_destroy(h);
        check_surface_destroy(&fine);
    }
}

// The corner of the face on the left of the edge from a to b, found by looking at every face.
static int32_t left_corner(const pliant_hierarchy *h, int32_t level, int32_t a, int32_t b)
{
    for (int32_t f = 0; f < h->face_count[level]; f++)
        for (int k = 0; k < 3; k++) {
            const int32_t *face = h->faces[level] + 3 * (size_t)f;
            if (face[k] == a && face[(k + 1) % 3] == b) return face[(k + 2) % 3];
        }
    fail_msg("no edge from %d to %d on level %d", a, b, level);
    return -1;
}

static void stencils_name_the_neighbourhood_that_a_search_finds(void **state)
{
    (void)state;
    for (int which = 0; which < CASES; which++) {
        check_surface s = surface(which, 2);
        pliant_hierarchy *h = check_hierarchy(&s);
        for (int32_t v = h->vertex_count[0]; v < h->vertex_count[2]; v++) {
            const int32_t l = pliant_hierarchy_level_of(h, v) - 1;
            const pliant_stencil *x = &h->stencils[v - h->vertex_count[0]];
            const int32_t a = x->parents[0], b = x->parents[1];
            assert_int_equal(a, s.parents[2 * (v - h->vertex_count[0])]);
            assert_int_equal(b, s.parents[2 * (v - h->vertex_count[0]) + 1]);
            assert_true(a < b);
            const int32_t c = left_corner(h, l, a, b), d = left_corner(h, l, b, a);
            assert_int_equal(x->opposite[0], c);
            assert_int_equal(x->opposite[1], d);
            // The triangle across an edge of a counterclockwise face runs along it backwards.
            assert_int_equal(x->wings[0], left_corner(h, l, a, c));
            assert_int_equal(x->wings[1], left_corner(h, l, c, b));
            assert_int_equal(x->wings[2], left_corner(h, l, d, a));
            assert_int_equal(x->wings[3], left_corner(h, l, b, d));
        }
        pliant_hierarchy_destroy(h);
        check_surface_destroy(&s);
    }
}

static void the_level_of_a_vertex_is_where_it_first_appears(void **state)
{
    (void)state;
    check_surface s = check_sphere(3);
    pliant_hierarchy *h = check_hierarchy(&s);
    const int32_t first[] = {0, 12, 42, 162, 642};
    for (int32_t l = 0; l <= 3; l++) {
        assert_int_equal(pliant_hierarchy_level_of(h, first[l]), l);
        assert_int_equal(pliant_hierarchy_level_of(h, first[l + 1] - 1), l);
    }
    pliant_hierarchy_destroy(h);
    check_surface_destroy(&s);
}

static void parents_may_come_in_either_order_and_none_are_needed_for_one_level(void **state)
{
    (void)state;
    check_surface s = check_sphere(2);
    for (int32_t i = 0; i < 2 * (s.vertex_count[2] - 12); i += 4) {
        const int32_t keep = s.parents[i];
        s.parents[i] = s.parents[i + 1];
        s.parents[i + 1] = keep;
    }
    pliant_hierarchy *h = check_hierarchy(&s);
    for (int32_t i = 0; i < s.vertex_count[2] - 12; i++)
        assert_true(h->stencils[i].parents[0] < h->stencils[i].parents[1]);
    pliant_hierarchy_destroy(h);

    pliant_error err;
    const int32_t count = s.mesh->vertex_count;
    check_ok(pliant_hierarchy_create(1, &count, s.mesh->face_count, s.mesh->faces, NULL, &h, &err),
             &err);
    assert_int_equal(h->level_count, 1);
    pliant_hierarchy_destroy(h);
    check_surface_destroy(&s);
}

// The claims about an octahedron refined twice (6, 18, 66 vertices; 8, 32, 128 faces).
typedef struct claims {
    int32_t level_count, vertex_count[PLIANT_LEVEL_LIMIT + 1], face_count;
    int32_t faces[128 * 3], parents[60 * 2];
} claims;

static claims sound_claims(void)
{
    check_surface s = check_refine(check_octahedron(), 2);
    claims c = {.level_count = 3, .face_count = 128};
    memcpy(c.vertex_count, s.vertex_count, sizeof c.vertex_count);
    memcpy(c.faces, s.mesh->faces, sizeof c.faces);
    memcpy(c.parents, s.parents, sizeof c.parents);
    check_surface_destroy(&s);
    return c;
}

// Nothing is made, and the text says that much.
static void refuse(const claims *c, const char *text)
{
    pliant_hierarchy *h = NULL;
    pliant_error err = {{0}};
    // In blocks of their exact sizes, so that a sanitizer sees a read beyond them.
    const size_t face_bytes = sizeof c->faces, parent_bytes = sizeof c->parents;
    int32_t *faces = malloc(face_bytes), *parents = malloc(parent_bytes);
    assert_non_null(faces);
    assert_non_null(parents);
    memcpy(faces, c->faces, face_bytes);
    memcpy(parents, c->parents, parent_bytes);
    const pliant_status status = pliant_hierarchy_create(c->level_count, c->vertex_count,
                                                         c->face_count, faces, parents, &h, &err);
    free(parents);
    free(faces);
    if (status != PLIANT_ERR_FORMAT || h || !strstr(err.text, text)) {
        pliant_hierarchy_destroy(h);
        fail_msg("%s: \"%s\", expected PLIANT_ERR_FORMAT and \"%s\"", pliant_status_name(status),
                 err.text, text);
    }
}

static void counts_that_cannot_be_are_refused_before_anything_is_read(void **state)
{
    (void)state;
    const claims sound = sound_claims();
    const int32_t level_counts[] = {0, -1, 17, INT32_MAX, INT32_MIN};
    for (size_t i = 0; i < 5; i++) {
        claims c = sound;
        c.level_count = level_counts[i];
        refuse(&c, "levels: expected 1..16");
    }
    const int32_t face_counts[] = {0, -128, 127, 112, 16, INT32_MAX, INT32_MIN};
    for (size_t i = 0; i < 7; i++) {
        claims c = sound;
        c.face_count = face_counts[i];
        refuse(&c, "faces: expected a positive multiple of 32");
    }
    const int32_t vertex_counts[] = {0, -1, 3, 9, INT32_MAX, INT32_MIN};
    for (size_t i = 0; i < 6; i++) {
        claims c = sound;
        c.vertex_count[0] = vertex_counts[i];
        refuse(&c, "vertices of level 0: expected 4..8");
    }
    for (int32_t l = 1; l < 3; l++)
        for (size_t i = 0; i < 6; i++) {
            claims c = sound;
            c.vertex_count[l] = vertex_counts[i];
            refuse(&c, l == 1 ? "vertices of level 1: expected 18"
                              : "vertices of level 2: expected 66");
        }
    claims c = sound;  // far more than the arrays hold, each count alone plausible
    c.face_count = 1 << 30;
    c.vertex_count[0] = 1 << 25;
    refuse(&c, "vertices of level 1: expected");
}

static void vertices_out_of_range_are_refused(void **state)
{
    (void)state;
    const int32_t wrong[] = {-1, 66, INT32_MAX, INT32_MIN};
    for (int32_t i = 0; i < 128 * 3; i += 7)
        for (size_t k = 0; k < 4; k++) {
            claims c = sound_claims();
            c.faces[i] = wrong[k];
            refuse(&c, "of level 2: expected vertices 0..65");
        }
}

static void any_other_corner_or_parent_is_refused(void **state)
{
    (void)state;
    // Every single value replaced by every other vertex would be slow to no purpose: some of each.
    for (int32_t i = 0; i < 128 * 3; i++)
        for (int32_t step = 1; step < 66; step += 5) {
            claims c = sound_claims();
            c.faces[i] = (c.faces[i] + step) % 66;
            refuse(&c, "expected");
        }
    for (int32_t i = 0; i < 60 * 2; i++)
        for (int32_t step = 1; step < 66; step += 5) {
            claims c = sound_claims();
            c.parents[i] = (c.parents[i] + step) % 66;
            refuse(&c, "parents of vertex");
        }
}

static void swap_faces(claims *c, int32_t f, int32_t g)
{
    for (int k = 0; k < 3; k++) {
        const int32_t keep = c->faces[3 * f + k];
        c->faces[3 * f + k] = c->faces[3 * g + k];
        c->faces[3 * g + k] = keep;
    }
}

static void faces_out_of_child_order_are_refused(void **state)
{
    (void)state;
    for (int32_t f = 0; f < 128; f += 3)
        for (int32_t g = f + 1; g < 128; g += 5) {
            claims c = sound_claims();
            swap_faces(&c, f, g);
            refuse(&c, "expected");
        }
    for (int32_t f = 0; f < 128; f++) {
        claims c = sound_claims();  // the same faces, one begun at another corner
        const int32_t first = c.faces[3 * f];
        memmove(c.faces + 3 * f, c.faces + 3 * f + 1, 2 * sizeof(int32_t));
        c.faces[3 * f + 2] = first;
        refuse(&c, f % 4 == 3 ? "beside the middle face"
                              : "of level 2: expected a first corner of level 1");
    }
    for (int32_t f = 3; f < 128; f += 4) {
        claims c = sound_claims();  // a coarse vertex for a midpoint
        c.faces[3 * f + f % 3] = c.faces[3 * (f - 1)];
        refuse(&c, "of level 2: expected odd vertices (18 or more)");
    }
    // All four children of a face may move together: that is another order of the coarse faces,
    // and it is refused only because their own parent face no longer finds its children.
    claims c = sound_claims();
    for (int32_t k = 0; k < 4; k++) swap_faces(&c, k, 12 + k);
    refuse(&c, "of level 1");
}

static void a_sheet_turned_over_is_refused(void **state)
{
    (void)state;
    // One base face and its children replaced by the mirror image in valid child order: corners
    // a c b in place of a b c.
    check_surface s = check_refine(check_octahedron(), 1);
    claims c = {.level_count = 2, .vertex_count = {6, 18}, .face_count = 32};
    memcpy(c.faces, s.mesh->faces, 96 * sizeof(int32_t));
    memcpy(c.parents, s.parents, 24 * sizeof(int32_t));
    const int32_t *f = s.mesh->faces;
    const int32_t ab = f[9], bc = f[10], ca = f[11];
    const int32_t turned[12] = {f[0], ca, ab, f[6], bc, ca, f[3], ab, bc, ca, bc, ab};
    memcpy(c.faces, turned, sizeof turned);
    refuse(&c, "one face of level 0 on each side");
    check_surface_destroy(&s);
}

// A base mesh alone, with its faces given.
static void refuse_base(int32_t vertex_count, int32_t face_count, const int32_t *faces,
                        const char *text)
{
    claims c = {.level_count = 1, .vertex_count = {vertex_count}, .face_count = face_count};
    memcpy(c.faces, faces, (size_t)face_count * 3 * sizeof(int32_t));
    refuse(&c, text);
}

static void base_meshes_that_bound_no_solid_are_refused(void **state)
{
    (void)state;
    pliant_mesh *octahedron = check_octahedron();
    int32_t f[3 * 18];
    const size_t bytes = 24 * sizeof(int32_t);

    memcpy(f, octahedron->faces, bytes);  // one face turned
    f[0] = octahedron->faces[1], f[1] = octahedron->faces[0];
    refuse_base(6, 8, f, "level 0: edge from vertex");

    memcpy(f, octahedron->faces, bytes);  // a face twice, another missing
    memcpy(f + 3, f, 3 * sizeof *f);
    refuse_base(6, 8, f, "level 0: ");

    memcpy(f, octahedron->faces, bytes);  // a corner twice in a face
    f[1] = f[0];
    refuse_base(6, 8, f, "level 0: face 0: expected three different vertices");

    memcpy(f, octahedron->faces, bytes);  // a vertex that no face uses
    refuse_base(7, 8, f, "level 0: vertex 6: expected at least 3 faces around it, found 0");

    // Two octahedra that share a vertex: vertex 6 of the second is vertex 0 of the first.
    memcpy(f, octahedron->faces, bytes);
    for (int i = 0; i < 24; i++) f[24 + i] = f[i] == 0 ? 0 : f[i] + 5;
    refuse_base(11, 16, f,
                "level 0: vertex 0: expected one ring of 8 faces around it, found a ring of 4");

    // Two that share an edge, and so have four faces on it.
    memcpy(f, octahedron->faces, bytes);
    for (int i = 0; i < 24; i++) f[24 + i] = f[i] == 0 || f[i] == 2 ? f[i] : f[i] + 6;
    for (int i = 24; i < 48; i++) f[i] -= f[i] > 6 ? (f[i] > 8 ? 2 : 1) : 0;
    refuse_base(10, 16, f, "level 0: edge from vertex 0 to 2");

    // Two faces of an icosahedron missing, far from each other.
    pliant_mesh *icosahedron = check_icosahedron();
    memcpy(f, icosahedron->faces, 18 * 3 * sizeof *f);
    memcpy(f + 3 * 6, icosahedron->faces + 3 * 19, 3 * sizeof *f);
    refuse_base(12, 18, f, "expected a face on its right, found none");
    pliant_mesh_destroy(icosahedron);

    // Two tetrahedra back to back on one face, whose sheet is there twice, are still not a solid.
    const int32_t pillow[12] = {0, 1, 2, 0, 2, 1, 0, 1, 3, 0, 3, 1};
    refuse_base(4, 4, pillow, "level 0: ");
    pliant_mesh_destroy(octahedron);
}

static void random_damage_is_refused_or_harmless(void **state)
{
    (void)state;
    check_random random = check_random_seed(7);
    int32_t accepted = 0;
    for (int32_t run = 0; run < 20000; run++) {
        claims c = sound_claims();
        for (int32_t hits = 1 + check_random_index(&random, 3); hits > 0; hits--) {
            const int32_t value = check_random_index(&random, 70) - 2;
            if (check_random_index(&random, 2)) c.faces[check_random_index(&random, 384)] = value;
            else c.parents[check_random_index(&random, 120)] = value;
        }
        pliant_hierarchy *h = NULL;
        pliant_error err;
        if (pliant_hierarchy_create(3, c.vertex_count, 128, c.faces, c.parents, &h, &err) ==
            PLIANT_OK)
            accepted++;
        pliant_hierarchy_destroy(h);
    }
    // A value hit by itself again changes nothing, which has a chance of about 1/70 for one hit.
    check_at_most(accepted, 20000 / 70);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_generators_of_the_tests_enclose_what_they_say),
        cmocka_unit_test(every_level_has_the_counts_of_a_closed_surface),
        cmocka_unit_test(the_faces_of_each_level_are_those_it_was_refined_from),
        cmocka_unit_test(stencils_name_the_neighbourhood_that_a_search_finds),
        cmocka_unit_test(the_level_of_a_vertex_is_where_it_first_appears),
        cmocka_unit_test(parents_may_come_in_either_order_and_none_are_needed_for_one_level),
        cmocka_unit_test(counts_that_cannot_be_are_refused_before_anything_is_read),
        cmocka_unit_test(vertices_out_of_range_are_refused),
        cmocka_unit_test(any_other_corner_or_parent_is_refused),
        cmocka_unit_test(faces_out_of_child_order_are_refused),
        cmocka_unit_test(a_sheet_turned_over_is_refused),
        cmocka_unit_test(base_meshes_that_bound_no_solid_are_refused),
        cmocka_unit_test(random_damage_is_refused_or_harmless),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
