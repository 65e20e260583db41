// test_detail.c: the detailed surface against slow subdivision, rigid motions and exact shapes.
#include "check.h"

#include "loop_reference.h"
#include "synthetic_model.h"

#include "pliant/loop.h"
#include "pliant/pliant.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

// Model and detail, with the synthetic body that they were written from. Levels 0 .. 2 (162
// vertices, valences 5 and 6), 2562 vertices of detail.
enum { LEVELS = 2, STEPS = 2 };

typedef struct setup {
    check_synthetic *body;
    pliant_model *model;
    pliant_detail *detail[LEVELS + 1];  // over each control level
    pliant_detail_info info;
    pliant_hierarchy *hierarchy;  // of the finer shape
    pliant_vec3 *positions, *normals, *u;
} setup;

static setup make(void)
{
    setup s = {
        .body = check_synthetic_create(&(check_synthetic_def){
            .levels = LEVELS, .wavelet = pliant_wavelet_default(), .blocks = CHECK_FREE_BLOCK})};
    char path[64];
    snprintf(path, sizeof path, "/tmp/pliant_test_detail_%d.h5", (int)getpid());
    check_synthetic_roughen(s.body, STEPS);
    check_synthetic_write(s.body, path);
    pliant_error err = {""};
    check_ok(pliant_model_open(path, &s.model, &err), &err);
    unlink(path);
    for (int32_t l = 0; l <= LEVELS; l++)
        check_ok(pliant_detail_create(s.model, l, &s.detail[l], &err), &err);
    s.info = pliant_detail_describe(s.detail[LEVELS]);
    s.hierarchy = check_hierarchy(&s.body->shape);
    const size_t n = (size_t)s.info.vertex_count;
    s.positions = calloc(n, sizeof *s.positions);
    s.normals = calloc(n, sizeof *s.normals);
    s.u = calloc(n, sizeof *s.u);
    assert_true(s.positions && s.normals && s.u);
    return s;
}

static void destroy(setup *s)
{
    free(s->u);
    free(s->normals);
    free(s->positions);
    pliant_hierarchy_destroy(s->hierarchy);
    for (int32_t l = 0; l <= LEVELS; l++) pliant_detail_destroy(s->detail[l]);
    pliant_model_close(s->model);
    check_synthetic_destroy(s->body);
}

static double distance(pliant_vec3 a, const double *b)
{
    return sqrt(pow((double)a.x - b[0], 2) + pow((double)a.y - b[1], 2) +
                pow((double)a.z - b[2], 2));
}

static double apart(pliant_vec3 a, pliant_vec3 b)
{
    return distance(a, (const double[3]){(double)b.x, (double)b.y, (double)b.z});
}

static pliant_vec3 minus(pliant_vec3 a, pliant_vec3 b)
{
    return (pliant_vec3){a.x - b.x, a.y - b.y, a.z - b.z};
}

// A smooth displacement of unit size, and a rough one.
static void fill(setup *s, int32_t level, double smooth, double rough, check_random *random)
{
    const double *x = pliant_model_positions(s->model);
    for (int32_t v = 0; v < pliant_model_level_vertex_count(s->model, level); v++, x += 3) {
        double r[3];
        for (int c = 0; c < 3; c++) r[c] = rough * (2 * check_random_next(random) - 1);
        s->u[v] = (pliant_vec3){(float)(smooth * sin(2 * x[1] + x[2]) + r[0]),
                                (float)(smooth * x[0] * x[2] + r[1]),
                                (float)(smooth * cos(2 * x[0]) + r[2])};
    }
}

// The deformed detail by the book, over control level `level`: slow subdivision of x + u, the limit
// masks on the finest mesh, double precision. `offset` has shape [N][3]. Positions are freed by the
// caller.
static double *by_the_book(const setup *s, int32_t level, const double *offset)
{
    const pliant_hierarchy *h = s->hierarchy;
    const int32_t control = h->vertex_count[level], finest = LEVELS + STEPS;
    double *y = malloc(3 * (size_t)control * sizeof *y);
    assert_non_null(y);
    for (int32_t v = 0; v < control; v++) {
        const double u[3] = {(double)s->u[v].x, (double)s->u[v].y, (double)s->u[v].z};
        for (int c = 0; c < 3; c++)
            y[3 * v + c] = s->body->surface.mesh->vertices[3 * v + c] + u[c];
    }
    double *fine = slow_loop(h, level, finest, y);
    free(y);
    const int32_t n = h->vertex_count[finest];
    double *result = malloc(3 * (size_t)n * sizeof *result);
    int32_t(*after)[32] = malloc((size_t)n * sizeof *after);
    int32_t *valence = calloc((size_t)n, sizeof *valence);
    assert_true(result && after && valence);
    // Pairs (next, last) of each corner; then walk round: last of one is next of the following.
    int32_t(*last)[32] = malloc((size_t)n * sizeof *last);
    assert_non_null(last);
    for (int32_t f = 0; f < h->face_count[finest]; f++)
        for (int k = 0; k < 3; k++) {
            const int32_t *c = h->faces[finest] + 3 * (size_t)f, v = c[k];
            after[v][valence[v]] = c[(k + 1) % 3];
            last[v][valence[v]++] = c[(k + 2) % 3];
        }
    for (int32_t v = 0; v < n; v++) {
        const int32_t count = valence[v];
        const double q = 0.375 + 0.25 * cos(2 * acos(-1.0) / count);
        const double beta = (0.625 - q * q) / count, chi = 1 / (count + 3 / (8 * beta));
        double sum[3][3] = {{0}}, frame[9];
        int32_t p = after[v][0];
        for (int32_t i = 0; i < count; i++) {
            const double angle = 2 * acos(-1.0) * i / count;
            for (int c = 0; c < 3; c++) {
                sum[0][c] += chi * fine[3 * p + c];
                sum[1][c] += cos(angle) * fine[3 * p + c];
                sum[2][c] += sin(angle) * fine[3 * p + c];
            }
            int32_t j = 0;
            while (after[v][j] != p) j++;
            p = last[v][j];
        }
        (void)pliant_loop_frame(sum[1], sum[2], frame);
        for (int c = 0; c < 3; c++) {
            result[3 * v + c] = sum[0][c] + (1 - count * chi) * fine[3 * v + c];
            for (int a = 0; a < 3; a++) result[3 * v + c] += frame[3 * a + c] * offset[3 * v + a];
        }
    }
    free(last);
    free(valence);
    free(after);
    free(fine);
    return result;
}

// Offsets over a level such that by_the_book returns the shape at rest.
static double *offsets_over(setup *s, int32_t level)
{
    const int32_t n = s->info.vertex_count;
    double *offset = calloc(3 * (size_t)n, sizeof *offset);
    double *axes[4];
    assert_non_null(offset);
    memset(s->u, 0, (size_t)n * sizeof *s->u);
    // The frame's columns are what unit offsets add.
    axes[3] = by_the_book(s, level, offset);
    for (int a = 0; a < 3; a++) {
        for (int32_t v = 0; v < n; v++)
            for (int c = 0; c < 3; c++) offset[3 * v + c] = a == c;
        axes[a] = by_the_book(s, level, offset);
    }
    const double *shape = s->body->shape.mesh->vertices;
    for (int32_t v = 0; v < n; v++)
        for (int a = 0; a < 3; a++) {
            offset[3 * v + a] = 0;
            for (int c = 0; c < 3; c++)
                offset[3 * v + a] += (axes[a][3 * v + c] - axes[3][3 * v + c]) *
                                     (shape[3 * v + c] - axes[3][3 * v + c]);
        }
    for (int a = 0; a < 4; a++) free(axes[a]);
    return offset;
}

// ---- At rest ----

// Positions are floats near 1; weights, offsets and frames are rounded, too: some roundings of
// 2^-24 in each component.
#define ROUNDING (16 * 0x1p-24)

static void at_rest_the_stored_shape_comes_back_over_every_level(void **state)
{
    setup *s = *state;
    for (int32_t l = 0; l <= LEVELS; l++) {
        const pliant_detail_info info = pliant_detail_describe(s->detail[l]);
        assert_int_equal(info.level, l);
        assert_int_equal(info.control_count, pliant_model_level_vertex_count(s->model, l));
        assert_int_equal(info.vertex_count, s->body->shape.mesh->vertex_count);
        assert_int_equal(info.face_count, s->body->shape.mesh->face_count);
        assert_memory_equal(pliant_detail_faces(s->detail[l]), s->body->shape.mesh->faces,
                            3 * (size_t)info.face_count * sizeof(int32_t));
        for (int with_u = 0; with_u < 2; with_u++) {
            memset(s->u, 0, (size_t)info.control_count * sizeof *s->u);
            assert_int_equal(pliant_detail_evaluate(s->detail[l], with_u ? s->u : NULL,
                                                    s->positions, s->normals),
                             PLIANT_OK);
            for (int32_t v = 0; v < info.vertex_count; v++)
                check_at_most(distance(s->positions[v], s->body->shape.mesh->vertices + 3 * v),
                              ROUNDING);
        }
    }
    const pliant_model_info info = pliant_model_describe(s->model);
    assert_int_equal(info.detail_steps, STEPS);
    assert_int_equal(info.detail_vertex_count, 2562);
    const int32_t *source = pliant_detail_source_index(s->detail[0]);
    assert_int_equal(source[0], 161);
    assert_int_equal(source[200], 200);
}

// ---- Deformed ----

static void the_deformed_shape_equals_slow_subdivision(void **state)
{
    setup *s = *state;
    check_random random = check_random_seed(1);
    for (int32_t l = 0; l <= LEVELS; l++) {
        double *offset = offsets_over(s, l);
        for (int trial = 0; trial < 4; trial++) {
            fill(s, l, 0.3, trial * 0.03, &random);
            const pliant_status status =
                pliant_detail_evaluate(s->detail[l], s->u, s->positions, NULL);
            assert_int_equal(status, PLIANT_OK);
            double *y = by_the_book(s, l, offset);
            for (int32_t v = 0; v < s->info.vertex_count; v++)
                check_at_most(distance(s->positions[v], y + 3 * v), 2 * ROUNDING);
            free(y);
        }
        free(offset);
    }
}

static void rigid_motions_carry_the_detail_along(void **state)
{
    setup *s = *state;
    check_random random = check_random_seed(2);
    for (int trial = 0; trial < 20; trial++) {
        // A rotation by any angle about any axis (Rodrigues), and a translation.
        double a[3], r[3][3], move[3], length = 0;
        for (int c = 0; c < 3; c++) {
            a[c] = 2 * check_random_next(&random) - 1;
            move[c] = 2 * check_random_next(&random) - 1;
            length += a[c] * a[c];
        }
        for (int c = 0; c < 3; c++) a[c] /= sqrt(length);
        const double angle = 6 * check_random_next(&random), k = 1 - cos(angle);
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++) {
                const int third = 3 - i - j;
                r[i][j] = k * a[i] * a[j] + (i == j) * cos(angle);
                if (i != j) r[i][j] += ((j - i + 3) % 3 == 1 ? -1 : 1) * a[third] * sin(angle);
            }
        const int32_t l = trial % (LEVELS + 1);
        const double *x = pliant_model_positions(s->model);
        for (int32_t v = 0; v < pliant_model_level_vertex_count(s->model, l); v++, x += 3) {
            double y[3];
            for (int i = 0; i < 3; i++)
                y[i] = r[i][0] * x[0] + r[i][1] * x[1] + r[i][2] * x[2] + move[i] - x[i];
            s->u[v] = (pliant_vec3){(float)y[0], (float)y[1], (float)y[2]};
        }
        pliant_vec3 *still = malloc((size_t)s->info.vertex_count * sizeof *still);
        assert_non_null(still);
        assert_int_equal(pliant_detail_evaluate(s->detail[l], NULL, s->positions, still),
                         PLIANT_OK);
        assert_int_equal(pliant_detail_evaluate(s->detail[l], s->u, s->positions, s->normals),
                         PLIANT_OK);
        for (int32_t v = 0; v < s->info.vertex_count; v++) {
            const double *p = s->body->shape.mesh->vertices + 3 * v;
            const double q[3] = {(double)still[v].x, (double)still[v].y, (double)still[v].z};
            double y[3], n[3];
            for (int i = 0; i < 3; i++) {
                y[i] = r[i][0] * p[0] + r[i][1] * p[1] + r[i][2] * p[2] + move[i];
                n[i] = r[i][0] * q[0] + r[i][1] * q[1] + r[i][2] * q[2];
            }
            check_at_most(distance(s->positions[v], y), 4 * ROUNDING);
            // Normals are of differences: edges are a twentieth of a unit.
            check_at_most(distance(s->normals[v], n), 100 * ROUNDING);
        }
        free(still);
    }
}

// A control mesh that is stretched as a whole stretches the limit surface, but no offset.
static void offsets_keep_their_length(void **state)
{
    setup *s = *state;
    const double *x = pliant_model_positions(s->model);
    for (int32_t v = 0; v < s->info.control_count; v++, x += 3)
        s->u[v] = (pliant_vec3){(float)x[0], (float)x[1], (float)x[2]};
    assert_int_equal(pliant_detail_evaluate(s->detail[LEVELS], s->u, s->positions, NULL),
                     PLIANT_OK);
    float *base = malloc(3 * (size_t)s->info.vertex_count * sizeof *base);
    float *rest = malloc(3 * (size_t)s->info.control_count * sizeof *rest);
    assert_true(base && rest);
    x = pliant_model_positions(s->model);
    for (int32_t i = 0; i < 3 * s->info.control_count; i++) rest[i] = (float)x[i];
    assert_int_equal(pliant_detail_interpolate(s->detail[LEVELS], 3, rest, base), PLIANT_OK);
    for (int32_t v = 0; v < s->info.vertex_count; v++) {
        // Twice the size: y = 2 S + F o, and at rest p = S + F o.
        const double *p = s->body->shape.mesh->vertices + 3 * v;
        double y[3];
        for (int c = 0; c < 3; c++) y[c] = p[c] + (double)base[3 * v + c];
        check_at_most(distance(s->positions[v], y), 4 * ROUNDING);
    }
    free(rest);
    free(base);
}

// ---- Normals ----

static void normals_are_area_weighted_means_of_the_faces_around(void **state)
{
    setup *s = *state;
    check_random random = check_random_seed(3);
    fill(s, LEVELS, 0.3, 0.03, &random);
    assert_int_equal(pliant_detail_evaluate(s->detail[LEVELS], s->u, s->positions, s->normals),
                     PLIANT_OK);
    const int32_t n = s->info.vertex_count, *faces = pliant_detail_faces(s->detail[LEVELS]);
    double(*sum)[3] = calloc((size_t)n, sizeof *sum);
    assert_non_null(sum);
    for (int32_t f = 0; f < s->info.face_count; f++, faces += 3) {
        const pliant_vec3 p = minus(s->positions[faces[1]], s->positions[faces[0]]);
        const pliant_vec3 q = minus(s->positions[faces[2]], s->positions[faces[0]]);
        const double m[3] = {(double)p.y * (double)q.z - (double)p.z * (double)q.y,
                             (double)p.z * (double)q.x - (double)p.x * (double)q.z,
                             (double)p.x * (double)q.y - (double)p.y * (double)q.x};
        for (int k = 0; k < 3; k++)
            for (int c = 0; c < 3; c++) sum[faces[k]][c] += m[c];
    }
    for (int32_t v = 0; v < n; v++) {
        const double length =
            sqrt(sum[v][0] * sum[v][0] + sum[v][1] * sum[v][1] + sum[v][2] * sum[v][2]);
        for (int c = 0; c < 3; c++) sum[v][c] /= length;
        check_at_most(distance(s->normals[v], sum[v]), 1e-5);
    }
    free(sum);
}

// ---- Chosen vertices ----

static void chosen_points_are_those_of_the_whole_and_read_their_support_alone(void **state)
{
    setup *s = *state;
    check_random random = check_random_seed(4);
    enum { MOST = 100 };
    for (int32_t l = 0; l <= LEVELS; l++) {
        fill(s, l, 0.3, 0.02, &random);
        assert_int_equal(pliant_detail_evaluate(s->detail[l], s->u, s->positions, s->normals),
                         PLIANT_OK);
        const int32_t controls = pliant_detail_describe(s->detail[l]).control_count;
        pliant_vec3 *sparse = malloc((size_t)controls * sizeof *sparse);
        assert_non_null(sparse);
        for (int32_t count = 0; count <= MOST; count += count < 5 ? 1 : 19) {
            int32_t vertices[MOST], support[200], support_count = -1;
            pliant_vec3 p[MOST], q[MOST];
            for (int32_t i = 0; i < count; i++)
                vertices[i] = check_random_index(&random, s->info.vertex_count);
            assert_int_equal(
                pliant_detail_support(s->detail[l], vertices, count, support, 200, &support_count),
                PLIANT_OK);
            if (count == 1 && l == LEVELS) check_at_most(support_count, 30);
            for (int32_t v = 0; v < controls; v++) sparse[v] = (pliant_vec3){NAN, NAN, NAN};
            for (int32_t i = 0; i < support_count; i++) {
                assert_in_range(support[i], i > 0 ? support[i - 1] + 1 : 0, controls - 1);
                sparse[support[i]] = s->u[support[i]];
            }
            assert_int_equal(pliant_detail_points(s->detail[l], sparse, vertices, count, p, q),
                             PLIANT_OK);
            for (int32_t i = 0; i < count; i++) {
                check_at_most(apart(p[i], s->positions[vertices[i]]), ROUNDING);
                check_at_most(apart(q[i], s->normals[vertices[i]]), 1e-5);
            }
            assert_int_equal(pliant_detail_points(s->detail[l], sparse, vertices, count, p, NULL),
                             PLIANT_OK);
            if (support_count == 0) continue;
            assert_int_equal(pliant_detail_support(s->detail[l], vertices, count, support,
                                                   support_count, &support_count),
                             PLIANT_OK);
            const int32_t before = support_count;
            assert_int_equal(pliant_detail_support(s->detail[l], vertices, count, support,
                                                   support_count - 1, &support_count),
                             PLIANT_ERR_CAPACITY);
            assert_int_equal(support_count, before);
        }
        free(sparse);
    }
}

static void interpolation_carries_constants_and_moves_with_the_surface(void **state)
{
    setup *s = *state;
    const int32_t n = s->info.vertex_count, controls = s->info.control_count;
    check_random random = check_random_seed(5);
    float *values = malloc(4 * (size_t)controls * sizeof *values);
    float *result = malloc(4 * (size_t)n * sizeof *result);
    assert_true(values && result);
    fill(s, LEVELS, 0, 1, &random);
    for (int32_t v = 0; v < controls; v++) {
        values[4 * v] = 7;
        values[4 * v + 1] = s->u[v].x;
        values[4 * v + 2] = s->u[v].y;
        values[4 * v + 3] = s->u[v].z;
    }
    assert_int_equal(pliant_detail_interpolate(s->detail[LEVELS], 4, values, result), PLIANT_OK);
    float most = 0;
    for (int32_t v = 0; v < n; v++) {
        check_near((double)result[4 * v], 7, 7 * ROUNDING);
        // A mean of what is around: inside the range of the values.
        for (int c = 1; c < 4; c++) most = fmaxf(most, fabsf(result[4 * v + c]));
    }
    check_at_most((double)most, 1);
    check_at_least((double)most, 0.5);
    free(result);
    free(values);
}

// ---- Exactness of constraints ----

// GF 9.2: Loop averages, so a displacement of one vertex is halved on the detail where its valence
// is 6: chi = 1/12, 1 - 6 chi = 1/2. Where all neighbours move alike, it is met.
static void prescribed_displacements_are_averaged_as_documented(void **state)
{
    setup *s = *state;
    const pliant_detail *detail = s->detail[LEVELS];
    const int32_t vertex = 30;  // of level 1, valence 6
    pliant_vec3 rest, moved;
    assert_int_equal(pliant_detail_points(detail, NULL, &vertex, 1, &rest, NULL), PLIANT_OK);
    // Along the normal at the vertex, its frame stays as it is by symmetry only up to the shape of
    // its ring; small motions keep the rest small.
    const float small = 1e-3f;
    memset(s->u, 0, (size_t)s->info.control_count * sizeof *s->u);
    s->u[vertex] = (pliant_vec3){small, 0, 0};
    assert_int_equal(pliant_detail_points(detail, s->u, &vertex, 1, &moved, NULL), PLIANT_OK);
    check_near((double)(moved.x - rest.x), 0.5e-3, 0.05e-3);
    for (int32_t v = 0; v < s->info.control_count; v++) s->u[v] = (pliant_vec3){small, 0, 0};
    assert_int_equal(pliant_detail_points(detail, s->u, &vertex, 1, &moved, NULL), PLIANT_OK);
    check_near((double)(moved.x - rest.x), 1e-3, 1e-6);
}

// ---- Folded, refused, wrong ----

static void what_has_no_normal_is_rough_and_finite(void **state)
{
    setup *s = *state;
    const double *x = pliant_model_positions(s->model);
    const double sizes[] = {1, 1e6, 1e20, 1e30};
    for (int kind = 0; kind < 6; kind++) {
        // Into a point, into a line, and blown up beyond any sense; then one vertex alone.
        for (int32_t v = 0; v < s->info.control_count; v++) {
            const double *p = x + 3 * v, keep = kind == 1 ? p[0] : 0;
            s->u[v] =
                (pliant_vec3){(float)(keep - p[0]), (float)(keep - p[1]), (float)(keep - p[2])};
            if (kind >= 2)
                s->u[v] =
                    v == 40 ? (pliant_vec3){(float)sizes[kind - 2], 0, 0} : (pliant_vec3){0, 0, 0};
        }
        const pliant_status status =
            pliant_detail_evaluate(s->detail[LEVELS], s->u, s->positions, s->normals);
        if (kind < 2) assert_int_equal(status, PLIANT_ROUGH);
        else assert_true(status >= 0);
        for (int32_t v = 0; v < s->info.vertex_count; v++) {
            const pliant_vec3 p = s->positions[v], q = s->normals[v];
            if (!isfinite(p.x) || !isfinite(p.y) || !isfinite(p.z))
                fail_msg("kind %d: vertex %d: %g %g %g", kind, v, (double)p.x, (double)p.y,
                         (double)p.z);
            if (kind < 4) assert_true(isfinite(q.x) && isfinite(q.y) && isfinite(q.z));
        }
        if (kind == 0)
            // All in the origin: there only the offsets at rest are left.
            check_at_most(apart(s->positions[0], (pliant_vec3){0, 0, 0}), 0.1);
    }
}

static void refusals_have_no_effect(void **state)
{
    setup *s = *state;
    const pliant_detail *d = s->detail[LEVELS];
    pliant_error err = {""};
    pliant_detail *none = NULL;
    for (int32_t level = -1; level <= LEVELS + 1; level += LEVELS + 2) {
        assert_int_equal(pliant_detail_create(s->model, level, &none, &err), PLIANT_ERR_ARGUMENT);
        assert_non_null(strstr(err.text, "expected 0 to 2, found"));
    }
    assert_int_equal(pliant_detail_create(NULL, 0, &none, &err), PLIANT_ERR_ARGUMENT);
    assert_null(none);
    const int32_t wrong[2] = {3, s->info.vertex_count}, negative = -1;
    pliant_vec3 p[2] = {{5, 5, 5}, {5, 5, 5}};
    int32_t list[40], count = 77;
    assert_int_equal(pliant_detail_evaluate(d, NULL, NULL, NULL), PLIANT_ERR_ARGUMENT);
    assert_int_equal(pliant_detail_points(d, NULL, wrong, 2, p, NULL), PLIANT_ERR_ARGUMENT);
    assert_int_equal(pliant_detail_points(d, NULL, &negative, 1, p, NULL), PLIANT_ERR_ARGUMENT);
    assert_int_equal(pliant_detail_points(d, NULL, wrong, -1, p, NULL), PLIANT_ERR_ARGUMENT);
    assert_int_equal(pliant_detail_support(d, wrong, 2, list, 40, &count), PLIANT_ERR_ARGUMENT);
    assert_int_equal(pliant_detail_interpolate(d, 0, NULL, NULL), PLIANT_ERR_ARGUMENT);
    check_near((double)p[0].x, 5, 0);
    assert_int_equal(count, 77);
    pliant_detail_destroy(NULL);
}

static void a_model_without_detail_says_so(void **state)
{
    (void)state;
    char path[64];
    snprintf(path, sizeof path, "/tmp/pliant_test_detail_%d.h5", (int)getpid());
    check_write_synthetic_model(path, NULL, 1, 0, pliant_wavelet_default(), CHECK_FREE_BLOCK);
    pliant_model *model = NULL;
    pliant_detail *detail = NULL;
    pliant_error err = {""};
    check_ok(pliant_model_open(path, &model, &err), &err);
    unlink(path);
    assert_int_equal(pliant_detail_create(model, 1, &detail, &err), PLIANT_ERR_MISSING);
    assert_non_null(strstr(err.text, "/detail: expected geometric detail"));
    assert_null(detail);
    assert_int_equal(pliant_model_describe(model).detail_steps, 0);
    pliant_model_close(model);
}

static setup shared;

static int begin(void **state)
{
    shared = make();
    *state = &shared;
    return 0;
}

static int end(void **state)
{
    destroy(*state);
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(at_rest_the_stored_shape_comes_back_over_every_level),
        cmocka_unit_test(the_deformed_shape_equals_slow_subdivision),
        cmocka_unit_test(rigid_motions_carry_the_detail_along),
        cmocka_unit_test(offsets_keep_their_length),
        cmocka_unit_test(normals_are_area_weighted_means_of_the_faces_around),
        cmocka_unit_test(chosen_points_are_those_of_the_whole_and_read_their_support_alone),
        cmocka_unit_test(interpolation_carries_constants_and_moves_with_the_surface),
        cmocka_unit_test(prescribed_displacements_are_averaged_as_documented),
        cmocka_unit_test(what_has_no_normal_is_rough_and_finite),
        cmocka_unit_test(refusals_have_no_effect),
        cmocka_unit_test(a_model_without_detail_says_so),
    };
    return cmocka_run_group_tests(tests, begin, end);
}
