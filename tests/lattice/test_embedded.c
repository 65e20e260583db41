// test_embedded.c: the carried surface is where the weights say, and faces where the surface does.
#include "allocations.h"

#include "check.h"
#include "synthetic_lattice.h"

#include "lattice/body.h"
#include "lattice/embedded.h"
#include "pliant/pliant.h"

#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

typedef struct setup {
    check_lattice *source;
    pliant_model *model;
    pliant_lattice *lattice;
    pliant_body *body;
    pliant_lattice_info info;
    pliant_vec3 *x;                    // shape [particle_count]
    pliant_vec3 *positions, *normals;  // shape [vertex_count]
} setup;

static setup make(check_cells shape, int32_t size, int32_t half_width)
{
    // A cell size that no float has, far enough from 1 that units show.
    setup s = {.source = check_lattice_create(&(check_lattice_def){.shape = shape,
                                                                   .size = size,
                                                                   .half_width = half_width,
                                                                   .cell_size = 0.03,
                                                                   .origin = {0.2, -0.1, 0.05}})};
    char path[64];
    snprintf(path, sizeof path, "/tmp/pliant_test_embedded_%d.h5", (int)getpid());
    check_lattice_write(s.source, path);
    pliant_error err = {""};
    check_ok(pliant_model_open(path, &s.model, &err), &err);
    unlink(path);
    check_ok(pliant_lattice_create(s.model, 0, &s.lattice, &err), &err);
    check_ok(pliant_body_create(s.lattice, NULL, &s.body, &err), &err);
    s.info = pliant_lattice_describe(s.lattice);
    assert_int_equal(s.info.vertex_count, s.source->mesh->vertex_count);
    assert_int_equal(s.info.face_count, s.source->mesh->face_count);
    assert_int_equal(s.info.batch_count, s.source->layout.batch_count);
    s.x = calloc((size_t)s.info.particle_count, sizeof *s.x);
    s.positions = calloc((size_t)s.info.vertex_count, sizeof *s.positions);
    s.normals = calloc((size_t)s.info.vertex_count, sizeof *s.normals);
    assert_true(s.x && s.positions && s.normals);
    return s;
}

static void destroy(setup *s)
{
    free(s->normals);
    free(s->positions);
    free(s->x);
    pliant_body_destroy(s->body);
    pliant_lattice_destroy(s->lattice);
    pliant_model_close(s->model);
    check_lattice_destroy(s->source);
}

static void evaluate(setup *s)
{
    assert_int_equal(pliant_body_set_positions(s->body, s->x), PLIANT_OK);
    assert_int_equal(pliant_body_surface(s->body, s->positions, s->normals), PLIANT_OK);
}

// ---- Small algebra ----

static double signed_random(check_random *random)
{
    return 2 * check_random_next(random) - 1;
}

static void transform(const double m[9], const double *a, double *to)
{
    for (int r = 0; r < 3; r++) to[r] = m[3 * r] * a[0] + m[3 * r + 1] * a[1] + m[3 * r + 2] * a[2];
}

static void cross(const double *a, const double *b, double *to)
{
    for (int c = 0; c < 3; c++)
        to[c] = a[(c + 1) % 3] * b[(c + 2) % 3] - a[(c + 2) % 3] * b[(c + 1) % 3];
}

static double length(const double *a)
{
    return sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
}

// Cofactors: the inverse transpose times the determinant.
static void cofactors(const double m[9], double to[9])
{
    for (int r = 0; r < 3; r++) cross(m + 3 * ((r + 1) % 3), m + 3 * ((r + 2) % 3), to + 3 * r);
}

static void check_direction(pliant_vec3 found, const double *expected, double tolerance)
{
    const double norm = length(expected);
    check_near((double)found.x, expected[0] / norm, tolerance);
    check_near((double)found.y, expected[1] / norm, tolerance);
    check_near((double)found.z, expected[2] / norm, tolerance);
}

static void check_place(pliant_vec3 found, const double *expected, double tolerance)
{
    check_near((double)found.x, expected[0], tolerance);
    check_near((double)found.y, expected[1], tolerance);
    check_near((double)found.z, expected[2], tolerance);
}

static void rest_normal(const setup *s, int32_t vertex, double n[3])
{
    double t[6];
    for (int c = 0; c < 6; c++) t[c] = (double)s->source->vertex_tangents[6 * (size_t)vertex + c];
    cross(t, t + 3, n);
}

static void place_affine(setup *s, const double m[9], const double *shift)
{
    const float *rest = pliant_lattice_positions(s->lattice);
    for (int32_t p = 0; p < s->info.particle_count; p++) {
        const double at[3] = {(double)rest[3 * p], (double)rest[3 * p + 1],
                              (double)rest[3 * p + 2]};
        double to[3];
        transform(m, at, to);
        s->x[p] = (pliant_vec3){(float)(to[0] + shift[0]), (float)(to[1] + shift[1]),
                                (float)(to[2] + shift[2])};
    }
}

// ---- Cases ----

static void rest_is_where_the_mesh_is(void **state)
{
    (void)state;
    for (check_cells shape = 0; shape < CHECK_CELLS_SHAPES; shape++) {
        setup s = make(shape, 5, 2);
        assert_int_equal(pliant_body_surface(s.body, s.positions, s.normals), PLIANT_OK);
        for (int32_t v = 0; v < s.info.vertex_count; v++) {
            double n[3];
            rest_normal(&s, v, n);
            check_place(s.positions[v], s.source->mesh->vertices + 3 * (size_t)v, 2e-7);
            check_direction(s.normals[v], n, 2e-5);  // of round-off in 0.5 m over cells of 0.03 m
        }
        destroy(&s);
    }
}

// Trilinear interpolation has affine maps exactly; their normals go by the inverse transpose, times
// the sign of the determinant (a reflected surface is turned inside out, and so are u x v).
static void affine_maps_are_reproduced_and_normals_go_by_the_inverse_transpose(void **state)
{
    (void)state;
    check_random random = check_random_seed(1);
    for (check_cells shape = 0; shape < CHECK_CELLS_SHAPES; shape++) {
        setup s = make(shape, 4, 1);
        for (int round = 0; round < 4; round++) {
            double m[9], c[9], shift[3];
            do {
                for (int i = 0; i < 9; i++) m[i] = 2 * signed_random(&random);
                cofactors(m, c);
            } while (fabs(m[0] * c[0] + m[1] * c[1] + m[2] * c[2]) < 0.5);
            for (int i = 0; i < 3; i++) shift[i] = signed_random(&random);
            place_affine(&s, m, shift);
            evaluate(&s);
            for (int32_t v = 0; v < s.info.vertex_count; v++) {
                double at[3], n[3], carried[3];
                transform(m, s.source->mesh->vertices + 3 * (size_t)v, at);
                for (int i = 0; i < 3; i++) at[i] += shift[i];
                check_place(s.positions[v], at, 2e-6);
                rest_normal(&s, v, n);
                transform(c, n, carried);
                // Round-off of coordinates below 4 m over a cell: 2^-22 m / 0.03 m, and both
                // stretches of the plane to the least, which is above 0.02.
                check_direction(s.normals[v], carried, 1e-3);
                check_near(pow((double)s.normals[v].x, 2) + pow((double)s.normals[v].y, 2) +
                               pow((double)s.normals[v].z, 2),
                           1, 1e-6);
            }
        }
        destroy(&s);
    }
}

static void scatter(setup *s, check_random *random, double range)
{
    for (int32_t p = 0; p < s->info.particle_count; p++)
        s->x[p] = (pliant_vec3){(float)(range * signed_random(random)),
                                (float)(range * signed_random(random)),
                                (float)(range * signed_random(random))};
}

// The sums of LSM-15 and 17, written out.
static void sum_weights(const setup *s, int32_t vertex, double x[3], double n[3])
{
    pliant_vertex_weights w;
    double u[3] = {0}, v[3] = {0};
    assert_int_equal(pliant_lattice_vertex(s->lattice, vertex, &w), PLIANT_OK);
    x[0] = x[1] = x[2] = 0;
    for (int k = 0; k < 8; k++) {
        const pliant_vec3 p = s->x[w.particle[k]];
        const double at[3] = {(double)p.x, (double)p.y, (double)p.z};
        for (int c = 0; c < 3; c++) {
            x[c] += (double)w.position[k] * at[c];
            u[c] += (double)w.u[k] * at[c];
            v[c] += (double)w.v[k] * at[c];
        }
    }
    cross(u, v, n);
}

static void scattered_lattices_carry_what_the_weights_say(void **state)
{
    (void)state;
    check_random random = check_random_seed(2);
    for (check_cells shape = 0; shape < CHECK_CELLS_SHAPES; shape++) {
        setup s = make(shape, 6, 1);
        scatter(&s, &random, 0.1);
        evaluate(&s);
        for (int32_t v = 0; v < s.info.vertex_count; v++) {
            double x[3], n[3];
            sum_weights(&s, v, x, n);
            check_place(s.positions[v], x, 1e-7);
            // n is of the order of (0.1 / 0.03)^2; where it happens to be small, round-off shows.
            check_direction(s.normals[v], n, 1e-5 + 1e-5 / length(n));
        }
        destroy(&s);
    }
}

// phi_k at a place of the cell, which may be outside it.
static double shape_function(int k, const double *r)
{
    double product = 1;
    for (int c = 0; c < 3; c++) product *= k >> c & 1 ? r[c] : 1 - r[c];
    return product;
}

// b_i = U . grad phi_i against central differences of phi_i, whose error is of second order in
// h / a: a cubic at most.
static void weights_are_the_shape_functions_and_their_slopes(void **state)
{
    (void)state;
    const double h = 1e-4, a = 0.03;
    setup s = make(CHECK_CELLS_TORUS, 8, 3);
    for (int32_t v = 0; v < s.info.vertex_count; v++) {
        pliant_vertex_weights w;
        double sum = 0, sum_u = 0, sum_v = 0;
        assert_int_equal(pliant_lattice_vertex(s.lattice, v, &w), PLIANT_OK);
        const float *offset = s.source->vertex_offset + 3 * (size_t)v;
        const float *tangents = s.source->vertex_tangents + 6 * (size_t)v;
        for (int k = 0; k < 8; k++) {
            const int32_t *cell = s.source->cells + 3 * (size_t)s.source->vertex_cell[v];
            const int32_t *at = s.source->particles + 3 * (size_t)w.particle[k];
            for (int c = 0; c < 3; c++) assert_int_equal(at[c], cell[c] + (k >> c & 1));
            double r[3], slope[2];
            for (int c = 0; c < 3; c++) r[c] = (double)offset[c];
            check_near((double)w.position[k], shape_function(k, r), 1e-6);
            for (int t = 0; t < 2; t++) {
                double ahead[3], behind[3];
                for (int c = 0; c < 3; c++) {
                    const double step = h * (double)tangents[3 * t + c];
                    ahead[c] = r[c] + step;
                    behind[c] = r[c] - step;
                }
                slope[t] = (shape_function(k, ahead) - shape_function(k, behind)) / (2 * h * a);
            }
            check_near((double)w.u[k], slope[0], 1e-4);
            check_near((double)w.v[k], slope[1], 1e-4);
            sum += (double)w.position[k];
            sum_u += (double)w.u[k];
            sum_v += (double)w.v[k];
        }
        check_near(sum, 1, 1e-6);    // a body moved is a surface moved,
        check_near(sum_u, 0, 1e-4);  // and turned no way
        check_near(sum_v, 0, 1e-4);
    }
    destroy(&s);
}

static void rigid_bodies_carry_their_surface_rigidly(void **state)
{
    (void)state;
    setup s = make(CHECK_CELLS_BALL, 6, 2);
    pliant_body_def def = pliant_body_default();
    def.position = (pliant_vec3){0.5f, -0.25f, 1};
    // A turn of 120 degrees about (1, 1, 1): x to y, y to z, z to x.
    for (int c = 0; c < 4; c++) def.rotation[c] = 0.5f;
    pliant_error err = {""};
    pliant_body *turned = NULL;
    check_ok(pliant_body_create(s.lattice, &def, &turned, &err), &err);
    assert_int_equal(pliant_body_surface(turned, s.positions, s.normals), PLIANT_OK);
    for (int32_t v = 0; v < s.info.vertex_count; v++) {
        const double *from = s.source->mesh->vertices + 3 * (size_t)v;
        const double at[3] = {from[2] + 0.5, from[0] - 0.25, from[1] + 1};
        double n[3];
        rest_normal(&s, v, n);
        const double to[3] = {n[2], n[0], n[1]};
        check_place(s.positions[v], at, 5e-7);
        check_direction(s.normals[v], to, 1e-4);
    }
    // Undisturbed, it stays so, steps later.
    for (int i = 0; i < 100; i++) assert_int_equal(pliant_body_step(turned, 0.01f), PLIANT_OK);
    pliant_vec3 *later = calloc((size_t)s.info.vertex_count, sizeof *later);
    assert_non_null(later);
    assert_int_equal(pliant_body_surface(turned, later, NULL), PLIANT_OK);
    for (int32_t v = 0; v < s.info.vertex_count; v++) {
        const double at[3] = {(double)s.positions[v].x, (double)s.positions[v].y,
                              (double)s.positions[v].z};
        check_place(later[v], at, 5e-5);  // a step rounds to some 1e-7
    }
    free(later);
    pliant_body_destroy(turned);
    destroy(&s);
}

static void check_all_unit(const setup *s, const char *what)
{
    for (int32_t v = 0; v < s->info.vertex_count; v++) {
        const pliant_vec3 n = s->normals[v], x = s->positions[v];
        const double square =
            (double)n.x * (double)n.x + (double)n.y * (double)n.y + (double)n.z * (double)n.z;
        if (!(fabs(square - 1) < 1e-5) || !isfinite(x.x) || !isfinite(x.y) || !isfinite(x.z))
            fail_msg("%s: vertex %d: at (%g, %g, %g), normal (%g, %g, %g)", what, (int)v,
                     (double)x.x, (double)x.y, (double)x.z, (double)n.x, (double)n.y, (double)n.z);
    }
}

static void collapsed_lattices_have_finite_unit_normals(void **state)
{
    (void)state;
    check_random random = check_random_seed(3);
    setup s = make(CHECK_CELLS_SPONGE, 4, 2);
    const double none[3] = {0, 0, 0};

    // To a point: there the normals at rest stand in.
    const double far[3] = {3, -7, 11};
    place_affine(&s, (const double[9]){0}, far);
    evaluate(&s);
    check_all_unit(&s, "point");
    for (int32_t v = 0; v < s.info.vertex_count; v++) {
        double n[3];
        rest_normal(&s, v, n);
        check_direction(s.normals[v], n, 1e-6);
    }
    place_affine(&s, (const double[9]){1, 2, 3, 2, 4, 6, -1, -2, -3}, none);
    evaluate(&s);
    check_all_unit(&s, "line");
    place_affine(&s, (const double[9]){1, 0, 0, 0, 1, 0, 0, 0, 0}, none);
    evaluate(&s);
    check_all_unit(&s, "plane");
    place_affine(&s, (const double[9]){1, 0, 0, 0, -1, 0, 0, 0, 1}, none);
    evaluate(&s);
    check_all_unit(&s, "mirror");
    // From a mote to as large as a step lets it become.
    for (int power = -15; power <= 9; power += 3) {
        scatter(&s, &random, pow(10, power) * 0.03);
        evaluate(&s);
        check_all_unit(&s, "scattered");
    }
    // Corners in one place, at random, and others far apart: large terms that cancel exactly.
    for (int round = 0; round < 50; round++) {
        scatter(&s, &random, pow(10, round % 10) * 0.03);
        const double kept = check_random_next(&random);
        for (int32_t p = 0; p < s.info.particle_count; p++)
            if (check_random_next(&random) > kept) s.x[p] = s.x[0];
        evaluate(&s);
        check_all_unit(&s, "some");
    }
    destroy(&s);
}

typedef struct part {
    const pliant_embedded *embedded;
    const float *x;
    int32_t first, last;
    pliant_vec3 *positions, *normals;
} part;

static void *run_part(void *argument)
{
    const part *p = argument;
    pliant_embedded_evaluate(p->embedded, p->x, p->first, p->last, p->positions, p->normals);
    return NULL;
}

// Any cut of the work, by any thread, gives the same bits; and so does one output without the
// other.
static void parts_and_threads_give_the_same_bits(void **state)
{
    (void)state;
    enum { PARTS = 5 };
    check_random random = check_random_seed(4);
    setup s = make(CHECK_CELLS_FOLDED, 7, 1);
    const size_t n = (size_t)s.info.vertex_count;
    pliant_vec3 *x = calloc(n, sizeof *x), *normals = calloc(n, sizeof *normals);
    assert_true(x && normals);
    scatter(&s, &random, 0.2);
    evaluate(&s);
    for (int round = 0; round < 40; round++) {
        int32_t cut[PARTS + 1] = {0};
        pthread_t threads[PARTS];
        part parts[PARTS];
        for (int i = 1; i <= PARTS; i++) {
            const int32_t left = s.info.vertex_count - cut[i - 1];
            cut[i] = i == PARTS ? s.info.vertex_count
                                : cut[i - 1] + (int32_t)(check_random_next(&random) * left / 2);
        }
        memset(x, 0x7f, n * sizeof *x);
        memset(normals, 0x7f, n * sizeof *normals);
        for (int i = 0; i < PARTS; i++) {
            parts[i] = (part){s.lattice->embedded,
                              s.body->x,
                              cut[i],
                              cut[i + 1],
                              round % 3 == 1 ? NULL : x,
                              round % 3 == 2 ? NULL : normals};
            assert_int_equal(pthread_create(&threads[i], NULL, run_part, &parts[i]), 0);
        }
        for (int i = 0; i < PARTS; i++) assert_int_equal(pthread_join(threads[i], NULL), 0);
        if (round % 3 != 1) assert_memory_equal(x, s.positions, n * sizeof *x);
        if (round % 3 != 2) assert_memory_equal(normals, s.normals, n * sizeof *normals);
    }
    assert_int_equal(pliant_body_surface(s.body, NULL, NULL), PLIANT_OK);
    free(normals);
    free(x);
    destroy(&s);
}

// Another half-width is another lattice of the same cells: the surface is carried alike.
static void the_half_width_does_not_matter(void **state)
{
    (void)state;
    check_random random = check_random_seed(5);
    setup s = make(CHECK_CELLS_COMB, 4, 1);
    const size_t n = (size_t)s.info.vertex_count;
    pliant_lattice *wide = NULL;
    pliant_body *body = NULL;
    pliant_error err = {""};
    pliant_vec3 *x = calloc(n, sizeof *x), *normals = calloc(n, sizeof *normals);
    assert_true(x && normals);
    check_ok(pliant_lattice_create(s.model, 4, &wide, &err), &err);
    check_ok(pliant_body_create(wide, NULL, &body, &err), &err);
    scatter(&s, &random, 0.2);
    evaluate(&s);
    assert_int_equal(pliant_body_set_positions(body, s.x), PLIANT_OK);
    assert_int_equal(pliant_body_surface(body, x, normals), PLIANT_OK);
    assert_memory_equal(x, s.positions, n * sizeof *x);
    assert_memory_equal(normals, s.normals, n * sizeof *normals);
    free(normals);
    free(x);
    pliant_body_destroy(body);
    pliant_lattice_destroy(wide);
    destroy(&s);
}

static void every_face_is_in_a_batch_that_has_its_particles(void **state)
{
    (void)state;
    for (check_cells shape = 0; shape < CHECK_CELLS_SHAPES; shape++) {
        setup s = make(shape, 6, 1);
        const int32_t *faces = pliant_model_faces(s.model, 0);
        int32_t *batch_of = calloc((size_t)s.info.face_count, sizeof *batch_of);
        char *has = calloc((size_t)s.info.particle_count, 1);
        assert_true(batch_of && has);
        assert_in_range(s.info.batch_count, 1, s.info.face_count);
        for (int32_t b = 0; b < s.info.batch_count; b++) {
            pliant_lattice_batch batch;
            assert_int_equal(pliant_lattice_find_batch(s.lattice, b, &batch), PLIANT_OK);
            assert_in_range(batch.particle_count, 8, PLIANT_BATCH_PARTICLES);
            memset(has, 0, (size_t)s.info.particle_count);
            for (int32_t i = 0; i < batch.particle_count; i++) has[batch.particles[i]] = 1;
            for (int32_t i = 0; i < batch.face_count; i++) {
                batch_of[batch.faces[i]]++;
                for (int k = 0; k < 3; k++) {
                    pliant_vertex_weights w;
                    const int32_t vertex = faces[3 * (size_t)batch.faces[i] + (size_t)k];
                    assert_int_equal(pliant_lattice_vertex(s.lattice, vertex, &w), PLIANT_OK);
                    for (int c = 0; c < 8; c++) assert_true(has[w.particle[c]]);
                }
            }
        }
        for (int32_t f = 0; f < s.info.face_count; f++) assert_int_equal(batch_of[f], 1);
        free(has);
        free(batch_of);
        destroy(&s);
    }
}

static void questions_about_nothing_are_refused(void **state)
{
    (void)state;
    pliant_vertex_weights w;
    pliant_lattice_batch batch;
    setup s = make(CHECK_CELLS_SINGLE, 1, 1);
    assert_int_equal(pliant_lattice_vertex(s.lattice, -1, &w), PLIANT_ERR_ARGUMENT);
    assert_int_equal(pliant_lattice_vertex(s.lattice, s.info.vertex_count, &w),
                     PLIANT_ERR_ARGUMENT);
    assert_int_equal(pliant_lattice_vertex(s.lattice, 0, NULL), PLIANT_ERR_ARGUMENT);
    assert_int_equal(pliant_lattice_find_batch(s.lattice, -1, &batch), PLIANT_ERR_ARGUMENT);
    assert_int_equal(pliant_lattice_find_batch(s.lattice, s.info.batch_count, &batch),
                     PLIANT_ERR_ARGUMENT);
    assert_int_equal(pliant_lattice_find_batch(s.lattice, 0, NULL), PLIANT_ERR_ARGUMENT);

    // Made from cells alone, a lattice has no surface.
    const pliant_lattice_def def = {.shape = s.source->shape,
                                    .mass = s.source->mass,
                                    .regions = s.source->regions,
                                    .cell_size = 1};
    pliant_lattice *bare = NULL;
    pliant_body *body = NULL;
    pliant_error err = {""};
    check_ok(pliant_lattice_build(&def, &bare, &err), &err);
    check_ok(pliant_body_create(bare, NULL, &body, &err), &err);
    assert_int_equal(pliant_lattice_describe(bare).vertex_count, 0);
    assert_int_equal(pliant_body_surface(body, s.positions, NULL), PLIANT_ERR_MISSING);
    assert_int_equal(pliant_lattice_vertex(bare, 0, &w), PLIANT_ERR_MISSING);
    assert_int_equal(pliant_lattice_find_batch(bare, 0, &batch), PLIANT_ERR_MISSING);
    pliant_body_destroy(body);
    pliant_lattice_destroy(bare);
    destroy(&s);
}

static void evaluating_allocates_nothing(void **state)
{
    (void)state;
    if (!COUNTING) skip();
    pliant_vertex_weights w;
    pliant_lattice_batch batch;
    setup s = make(CHECK_CELLS_SHELL, 6, 2);
    const long before = atomic_load(&calls);
    assert_int_equal(pliant_body_surface(s.body, s.positions, s.normals), PLIANT_OK);
    assert_int_equal(pliant_lattice_vertex(s.lattice, 0, &w), PLIANT_OK);
    assert_int_equal(pliant_lattice_find_batch(s.lattice, 0, &batch), PLIANT_OK);
    assert_int_equal(atomic_load(&calls) - before, 0);
    destroy(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_counter_counts),
        cmocka_unit_test(rest_is_where_the_mesh_is),
        cmocka_unit_test(affine_maps_are_reproduced_and_normals_go_by_the_inverse_transpose),
        cmocka_unit_test(scattered_lattices_carry_what_the_weights_say),
        cmocka_unit_test(weights_are_the_shape_functions_and_their_slopes),
        cmocka_unit_test(rigid_bodies_carry_their_surface_rigidly),
        cmocka_unit_test(collapsed_lattices_have_finite_unit_normals),
        cmocka_unit_test(parts_and_threads_give_the_same_bits),
        cmocka_unit_test(the_half_width_does_not_matter),
        cmocka_unit_test(every_face_is_in_a_batch_that_has_its_particles),
        cmocka_unit_test(questions_about_nothing_are_refused),
        cmocka_unit_test(evaluating_allocates_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
