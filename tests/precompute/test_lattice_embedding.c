// test_lattice_embedding.c: a mesh's vertices in a lattice's cells, their tangents, and batches.
#include "check.h"

#include "lattice/lattice_data.h"
#include "surfaces.h"

#include "pliant/halfedge.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static pliant_lattice_data *lattice_of(const pliant_mesh *mesh, int32_t cells, int32_t half_width,
                                       pliant_voxel_filling filling)
{
    const pliant_lattice_data_def def = {
        .name = "mesh", .cells = cells, .half_width = half_width, .filling = filling, .density = 1};
    pliant_lattice_data *l = NULL;
    pliant_error err = {""};
    check_ok(pliant_lattice_data_create(&def, mesh, &l, &err), &err);
    return l;
}

// Particles are the cells' corners, as common/links.h has them; corners name them.
static void check_particles(const pliant_lattice_data *l)
{
    const pliant_voxels *v = l->voxels;
    int32_t *particles = malloc(24 * (size_t)v->cell_count * sizeof *particles);
    assert_non_null(particles);
    assert_int_equal(pliant_lattice_particles(v->cell_count, v->cells, particles),
                     l->particle_count);
    assert_memory_equal(particles, l->particles, 3 * (size_t)l->particle_count * sizeof *particles);
    free(particles);
    for (int32_t i = 0; i < v->cell_count; i++)
        for (int c = 0; c < 8; c++) {
            const int32_t p = l->corners[8 * (size_t)i + (size_t)c];
            assert_in_range(p, 0, l->particle_count - 1);
            for (int d = 0; d < 3; d++)
                assert_int_equal(l->particles[3 * (size_t)p + (size_t)d],
                                 v->cells[3 * (size_t)i + (size_t)d] + (c >> d & 1));
        }
}

// LSM-15 at rest gives the vertices back, but for the rounding of offsets to floats.
static void check_positions(const pliant_mesh *mesh, const pliant_lattice_data *l)
{
    const pliant_voxel_grid *grid = &l->voxels->grid;
    for (int32_t v = 0; v < mesh->vertex_count; v++) {
        const int32_t cell = l->embedding->cell[v];
        const float *X = l->embedding->offset + 3 * (size_t)v;
        double x[3] = {0};
        assert_in_range(cell, 0, l->voxels->cell_count - 1);
        for (int d = 0; d < 3; d++) {
            check_at_least((double)X[d], 0);
            check_at_most((double)X[d], 1);
        }
        for (int c = 0; c < 8; c++) {
            const int32_t *p = l->particles + 3 * (size_t)l->corners[8 * (size_t)cell + (size_t)c];
            double phi = 1;
            for (int d = 0; d < 3; d++) phi *= c >> d & 1 ? (double)X[d] : 1 - (double)X[d];
            for (int d = 0; d < 3; d++) x[d] += phi * (grid->origin[d] + grid->size * p[d]);
        }
        for (int d = 0; d < 3; d++)
            check_near(x[d], mesh->vertices[3 * (size_t)v + (size_t)d],
                       grid->size * 0x1p-24 + 1e-12);
    }
}

static void check_tangents(const pliant_mesh *mesh, const pliant_embedding *e)
{
    for (int32_t v = 0; v < mesh->vertex_count; v++) {
        const float *u = e->tangents + 6 * (size_t)v, *w = u + 3;
        double uu = 0, ww = 0, uw = 0;
        for (int d = 0; d < 3; d++) {
            uu += (double)u[d] * (double)u[d];
            ww += (double)w[d] * (double)w[d];
            uw += (double)u[d] * (double)w[d];
        }
        check_near(uu, 1, 3e-7);
        check_near(ww, 1, 3e-7);
        check_near(uw, 0, 3e-7);
    }
}

static void normal_of(const pliant_embedding *e, int32_t v, double n[3])
{
    const float *u = e->tangents + 6 * (size_t)v, *w = u + 3;
    for (int d = 0; d < 3; d++)
        n[d] = (double)u[(d + 1) % 3] * (double)w[(d + 2) % 3] -
               (double)u[(d + 2) % 3] * (double)w[(d + 1) % 3];
}

static void check_batches(const pliant_mesh *mesh, const pliant_lattice_data *l)
{
    const pliant_batches *b = l->batches;
    uint8_t *seen = calloc((size_t)mesh->face_count, 1),
            *used = calloc((size_t)l->particle_count, 1);
    assert_true(seen && used);
    assert_int_equal(b->face_offset[0], 0);
    assert_int_equal(b->point_offset[0], 0);
    assert_int_equal(b->face_offset[b->batch_count], mesh->face_count);
    for (int32_t i = 0; i < b->batch_count; i++) {
        const int32_t *points = b->points + b->point_offset[i];
        const int32_t point_count = b->point_offset[i + 1] - b->point_offset[i];
        assert_true(b->face_offset[i + 1] > b->face_offset[i]);
        assert_in_range(point_count, 8, PLIANT_BATCH_LIMIT);
        // Exactly the particles that its faces need, ascending.
        int32_t needed = 0;
        for (int32_t f = b->face_offset[i]; f < b->face_offset[i + 1]; f++) {
            const int32_t face = b->faces[f];
            if (f > b->face_offset[i]) assert_true(face > b->faces[f - 1]);
            assert_int_equal(seen[face]++, 0);
            for (int c = 0; c < 3; c++)
                for (int k = 0; k < 8; k++) {
                    const int32_t cell =
                        l->embedding->cell[mesh->faces[3 * (size_t)face + (size_t)c]];
                    const int32_t p = l->corners[8 * (size_t)cell + (size_t)k];
                    needed += !used[p];
                    used[p] = 1;
                }
        }
        assert_int_equal(needed, point_count);
        for (int32_t k = 0; k < point_count; k++) {
            if (k > 0) assert_true(points[k] > points[k - 1]);
            assert_int_equal(used[points[k]], 1);
            used[points[k]] = 0;
        }
    }
    free(used);
    free(seen);
}

static void check_all(const pliant_mesh *mesh, const pliant_lattice_data *l)
{
    check_particles(l);
    check_positions(mesh, l);
    check_tangents(mesh, l->embedding);
    check_batches(mesh, l);
    assert_int_equal(l->regions->particle_count, l->particle_count);
}

static void rest_positions_give_the_vertices_back(void **state)
{
    (void)state;
    check_surface blob = check_blob(4), torus = check_refine(check_torus(5, 8), 2);
    check_surface cube = check_refine(check_cube(), 3);
    const check_surface *surfaces[] = {&blob, &torus, &cube};
    for (size_t s = 0; s < sizeof surfaces / sizeof *surfaces; s++)
        for (int filling = 0; filling < 2; filling++)
            for (int32_t cells = 1; cells <= 64; cells *= 2) {
                pliant_lattice_data *l =
                    lattice_of(surfaces[s]->mesh, cells, 2, (pliant_voxel_filling)filling);
                check_all(surfaces[s]->mesh, l);
                pliant_lattice_data_destroy(l);
            }
    check_surface_destroy(&cube);
    check_surface_destroy(&torus);
    check_surface_destroy(&blob);
}

// On a sphere the normal is the position; at a cube's corner, however it is cut into triangles, the
// diagonal; U x V points outwards.
static void tangents_are_right_handed_about_the_normal(void **state)
{
    (void)state;
    check_surface sphere = check_sphere(4);
    pliant_lattice_data *l = lattice_of(sphere.mesh, 10, 1, PLIANT_VOXELS_SOLID);
    double worst = 1;
    for (int32_t v = 0; v < sphere.mesh->vertex_count; v++) {
        double n[3], along = 0;
        normal_of(l->embedding, v, n);
        for (int d = 0; d < 3; d++) along += n[d] * sphere.mesh->vertices[3 * v + d];
        worst = fmin(worst, along);
    }
    printf("sphere of 2562 vertices: normals within %.2f degrees\n", acos(worst) * 180 / acos(-1));
    check_at_least(worst, cos(0.02));
    pliant_lattice_data_destroy(l);
    check_surface_destroy(&sphere);

    check_surface cube = check_refine(check_cube(), 2);
    l = lattice_of(cube.mesh, 3, 1, PLIANT_VOXELS_SOLID);
    for (int32_t v = 0; v < cube.mesh->vertex_count; v++) {
        const double *x = cube.mesh->vertices + 3 * v;
        double n[3], expected[3], length = 0;
        normal_of(l->embedding, v, n);
        for (int d = 0; d < 3; d++) {
            expected[d] = fabs(x[d]) == 1 ? x[d] : 0;
            length += fabs(expected[d]);
        }
        for (int d = 0; d < 3; d++) check_near(n[d], expected[d] / sqrt(length), 1e-6);
    }
    pliant_lattice_data_destroy(l);
    check_surface_destroy(&cube);
}

// Every direction, the poles of the construction among them.
static void tangents_are_orthonormal_about_any_normal(void **state)
{
    (void)state;
    const double axes[6][3] = {{0, 0, 1}, {0, 0, -1},      {1e-9, 0, -1},
                               {1, 0, 0}, {0, -1, -1e-12}, {1, 1, 0}};
    for (int i = 0; i < 6; i++) {
        // A pyramid over a triangle across the axis: its tip's normal is the axis.
        pliant_mesh *mesh = check_tetrahedron();
        double n[3], u[3], w[3], length = 0;
        for (int d = 0; d < 3; d++) length += axes[i][d] * axes[i][d];
        for (int d = 0; d < 3; d++) n[d] = axes[i][d] / sqrt(length);
        const int k = fabs(n[0]) < 0.6 ? 0 : 1;
        double along = n[k], u_length = 0;
        for (int d = 0; d < 3; d++) u[d] = (d == k) - along * n[d], u_length += u[d] * u[d];
        for (int d = 0; d < 3; d++) u[d] /= sqrt(u_length);
        for (int d = 0; d < 3; d++)
            w[d] = n[(d + 1) % 3] * u[(d + 2) % 3] - n[(d + 2) % 3] * u[(d + 1) % 3];
        const int32_t faces[4][3] = {{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 3, 2}};
        memcpy(mesh->faces, faces, sizeof faces);
        for (int v = 0; v < 4; v++)
            for (int d = 0; d < 3; d++) {
                const double turn = 2 * acos(-1) * v / 3;
                mesh->vertices[3 * v + d] = v == 0 ? n[d] : cos(turn) * u[d] + sin(turn) * w[d];
            }
        pliant_lattice_data *l = lattice_of(mesh, 2, 1, PLIANT_VOXELS_SOLID);
        double found[3];
        normal_of(l->embedding, 0, found);
        for (int d = 0; d < 3; d++) check_near(found[d], n[d], 1e-6);
        check_tangents(mesh, l->embedding);
        pliant_lattice_data_destroy(l);
        pliant_mesh_destroy(mesh);
    }
}

// Faces of a batch hang together along edges, but for the last pieces of a component: far fewer
// batches than one a face, and no more than a quarter above what the particles ask for.
static void batches_are_few(void **state)
{
    (void)state;
    check_surface sphere = check_sphere(5);
    for (int32_t cells = 8; cells <= 64; cells *= 2) {
        pliant_lattice_data *l = lattice_of(sphere.mesh, cells, 1, PLIANT_VOXELS_SHELL);
        check_batches(sphere.mesh, l);
        int32_t used = 0;
        uint8_t *seen = calloc((size_t)l->particle_count, 1);
        assert_non_null(seen);
        const pliant_batches *b = l->batches;
        for (int32_t i = 0; i < b->point_offset[b->batch_count]; i++) used += !seen[b->points[i]]++;
        free(seen);
        printf("sphere of %d faces, %d cells across: %d batches, %.0f particles each, %.2f times "
               "the %d in use\n",
               sphere.mesh->face_count, cells, b->batch_count,
               (double)b->point_offset[b->batch_count] / b->batch_count,
               (double)b->point_offset[b->batch_count] / used, used);
        check_at_most(b->batch_count, 2.5 * used / PLIANT_BATCH_LIMIT + 4);
        pliant_lattice_data_destroy(l);
    }
    check_surface_destroy(&sphere);
}

// Components may share a batch; nothing of the order of the arrays may break the partition.
static void batches_partition_the_faces_of_several_components_in_any_order(void **state)
{
    (void)state;
    check_random random = check_random_seed(5);
    for (int i = 0; i < 4; i++) {
        pliant_mesh *mesh =
            check_beside(check_beside(check_octahedron(), check_cube()), check_torus(9, 14));
        if (i > 0) check_shuffle(mesh, &random, NULL);
        for (int32_t cells = 3; cells <= 48; cells *= 4) {
            pliant_lattice_data *l = lattice_of(mesh, cells, 1, PLIANT_VOXELS_SOLID);
            check_all(mesh, l);
            if (cells == 48) assert_int_equal(l->component_count, 3);
            pliant_lattice_data_destroy(l);
        }
        pliant_mesh_destroy(mesh);
    }
}

static void the_same_mesh_makes_the_same_lattice(void **state)
{
    (void)state;
    check_surface blob = check_blob(3);
    pliant_lattice_data *a = lattice_of(blob.mesh, 20, 2, PLIANT_VOXELS_SOLID);
    pliant_lattice_data *b = lattice_of(blob.mesh, 20, 2, PLIANT_VOXELS_SOLID);
    assert_int_equal(a->particle_count, b->particle_count);
    assert_memory_equal(a->mass, b->mass, (size_t)a->particle_count * sizeof(float));
    assert_memory_equal(a->batches->faces, b->batches->faces,
                        (size_t)blob.mesh->face_count * sizeof(int32_t));
    assert_memory_equal(a->embedding->tangents, b->embedding->tangents,
                        6 * (size_t)blob.mesh->vertex_count * sizeof(float));
    pliant_lattice_data_destroy(b);
    pliant_lattice_data_destroy(a);
    check_surface_destroy(&blob);
}

static void half_widths_beyond_the_limit_are_refused(void **state)
{
    (void)state;
    pliant_mesh *cube = check_cube();
    const int32_t wrong[3] = {0, -1, 16};
    for (int i = 0; i < 3; i++) {
        const pliant_lattice_data_def def = {
            .name = "cube", .cells = 2, .half_width = wrong[i], .density = 1};
        pliant_lattice_data *l = NULL;
        pliant_error err = {""};
        assert_int_equal(pliant_lattice_data_create(&def, cube, &l, &err), PLIANT_ERR_ARGUMENT);
        assert_non_null(strstr(err.text, "expected 1 to 15, found"));
        assert_null(l);
    }
    pliant_mesh_destroy(cube);
}

static void the_evaluation_meshes_are_embedded(void **state)
{
    (void)state;
    const char *names[] = {"bunny.obj", "penguin.obj", "fandisk.obj", "liver_tiny.obj"};
    for (size_t m = 0; m < sizeof names / sizeof *names; m++) {
        const char *path = check_model_path(names[m]);
        if (!path) skip();
        pliant_mesh *mesh = check_load_obj(path);
        assert_non_null(mesh);
        for (int32_t cells = 8; cells <= 32; cells *= 4) {
            pliant_lattice_data *l = lattice_of(mesh, cells, 2, PLIANT_VOXELS_SOLID);
            check_all(mesh, l);
            assert_int_equal(l->component_count, 1);
            printf("%s: %d cells along: %d particles, %d regions, %d irregular; %d faces in %d "
                   "batches\n",
                   names[m], cells, l->particle_count, l->regions->region_count,
                   l->regions->region_node_count, mesh->face_count, l->batches->batch_count);
            pliant_lattice_data_destroy(l);
        }
        pliant_mesh_destroy(mesh);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rest_positions_give_the_vertices_back),
        cmocka_unit_test(tangents_are_right_handed_about_the_normal),
        cmocka_unit_test(tangents_are_orthonormal_about_any_normal),
        cmocka_unit_test(batches_are_few),
        cmocka_unit_test(batches_partition_the_faces_of_several_components_in_any_order),
        cmocka_unit_test(the_same_mesh_makes_the_same_lattice),
        cmocka_unit_test(half_widths_beyond_the_limit_are_refused),
        cmocka_unit_test(the_evaluation_meshes_are_embedded),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
