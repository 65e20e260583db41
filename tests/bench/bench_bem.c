// bench_bem.c: assembly of the boundary element matrices at 2562 vertices, one thread, CPU time.
//
// Baselines of the same run: the far field by the scalar reference, and dgemm of as many
// operations. The table of errors is the experiment behind PLIANT_FAR_FIELD_RATIO and far_field.c's
// one rule.
#include "bem/bem.h"
#include "bem/far_field.h"
#include "bem/kelvin.h"
#include "bem/near_integral.h"
#include "bem/singular_integral.h"
#include "bem/triangle_rule.h"
#include "mesh/multires.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

void dgemm_(const char *trans_a, const char *trans_b, const int *m, const int *n, const int *k,
            const double *alpha, const double *A, const int *ld_a, const double *B, const int *ld_b,
            const double *beta, double *C, const int *ld_c);

static const pliant_material material = {1, 0.3, 1};
static const pliant_kelvin_constants constants = {.diagonal = 3 - 4 * 0.3, .shear = 1 - 2 * 0.3};

// Additions and multiplications of far_field.c, counted by hand: per point 61 of evaluate_kernels
// and 6 of r, per bracket 21 of the hats' sums and 3 of the rows'.
static const double far_flops = 7 * 67 + 15 * 24;

static double cpu_seconds(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void *need(void *memory)
{
    if (memory) return memory;
    fprintf(stderr, "bench_bem: no memory\n");
    exit(1);
}

// The icosahedron, split and put on the unit sphere.
static pliant_multires *sphere_of(int32_t levels)
{
    const double golden = (1 + sqrt(5)) / 2, p = 1, q = golden;
    double vertices[12][3] = {{-p, q, 0}, {p, q, 0}, {-p, -q, 0}, {p, -q, 0},
                              {0, -p, q}, {0, p, q}, {0, -p, -q}, {0, p, -q},
                              {q, 0, -p}, {q, 0, p}, {-q, 0, -p}, {-q, 0, p}};
    int32_t faces[20][3] = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                            {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                            {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                            {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
    const pliant_mesh base = {12, 20, vertices[0], faces[0]};
    pliant_multires *sphere = NULL;
    pliant_error err;
    if (pliant_multires_subdivide(&base, levels, PLIANT_SUBDIVIDE_MIDPOINT, &sphere, &err) < 0) {
        fprintf(stderr, "bench_bem: %s\n", err.text);
        exit(1);
    }
    for (int32_t v = 0; v < sphere->mesh->vertex_count; v++) {
        double *x = sphere->mesh->vertices + 3 * (size_t)v;
        const double length = sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]);
        for (int i = 0; i < 3; i++) x[i] /= length;
    }
    return sphere;
}

typedef struct bench {
    const pliant_mesh *mesh;
    pliant_element *elements;
    pliant_row_sum *sums;
    uint8_t *near;
} bench;

static void x_of(const bench *b, int32_t row, pliant_lanes x[3])
{
    for (int lane = 0; lane < PLIANT_LANES; lane++)
        for (int i = 0; i < 3; i++)
            x[i][lane] = b->mesh->vertices[3 * (size_t)((row + lane) % b->mesh->vertex_count) + i];
}

static double time_assembly(const bench *b, double *A, double *B)
{
    const int32_t n = b->mesh->vertex_count;
    const size_t size = 3 * (size_t)n;
    uint8_t *fixed = need(calloc((size_t)n, 1));
    double *gravity = need(malloc(3 * size * sizeof *gravity));
    pliant_error err;
    pliant_bem *bem = NULL;
    double start = cpu_seconds();
    if (pliant_bem_create(b->mesh, &material, &bem, &err) < 0 ||
        pliant_bem_assemble(bem, 0, n, fixed, A, size, B, size, gravity, size, &err) < 0) {
        fprintf(stderr, "bench_bem: %s\n", err.text);
        exit(1);
    }
    start = cpu_seconds() - start;
    pliant_bem_destroy(bem);
    free(gravity);
    free(fixed);
    return start;
}

static double time_far(const bench *b)
{
    const double start = cpu_seconds();
    memset(b->sums, 0, (size_t)b->mesh->vertex_count * sizeof *b->sums);
    for (int32_t row = 0; row < b->mesh->vertex_count; row += PLIANT_LANES) {
        pliant_lanes x[3];
        x_of(b, row, x);
        pliant_far_field_add(&constants, b->elements, b->mesh->face_count, x, b->sums, NULL,
                             b->near);
    }
    return cpu_seconds() - start;
}

static double time_near(const bench *b, double *pair_count)
{
    double sum = 0, count = 0, seconds = 0;
    for (int32_t row = 0; row < b->mesh->vertex_count; row += PLIANT_LANES) {
        pliant_lanes x[3];
        x_of(b, row, x);
        pliant_far_field_add(&constants, b->elements, b->mesh->face_count, x, b->sums, NULL,
                             b->near);
        const double start = cpu_seconds();
        for (int32_t e = 0; e < b->mesh->face_count; e++)
            for (int lane = 0; lane < PLIANT_LANES && row + lane < b->mesh->vertex_count; lane++) {
                if (!(b->near[e] >> lane & 1)) continue;
                const pliant_element *element = b->elements + e;
                int own = 0;
                while (own < 3 && element->vertices[own] != row + lane) own++;
                pliant_element_integrals integrals;
                if (own < 3) pliant_singular_integral_set(&constants, element, own, &integrals);
                else
                    pliant_near_integral_set(&constants, element,
                                             b->mesh->vertices + 3 * (size_t)(row + lane),
                                             &integrals);
                sum += integrals.of_hat[0][0];
                count++;
            }
        seconds += cpu_seconds() - start;
    }
    if (!isfinite(sum)) puts("near integrals are not finite");
    *pair_count = count;
    return seconds;
}

// Brackets of one element by a rule's points and the scalar formulas.
static void add_scalar(const pliant_triangle_rule *rule, const pliant_element *element,
                       const double x[3], double U[3][9], double T[3][9])
{
    for (int q = 0; q < rule->point_count; q++) {
        double r[3], u[3][3], t[3][3];
        for (int i = 0; i < 3; i++) {
            r[i] = element->centre[i] - x[i];
            for (int k = 0; k < 3; k++) r[i] += rule->points[q][k] * element->spokes[k][i];
        }
        pliant_kelvin_displacement(&material, r, u);
        pliant_kelvin_traction(&material, r, element->normal, t);
        for (int k = 0; k < 3; k++) {
            const double weight = element->area * rule->weights[q] * rule->points[q][k];
            for (int m = 0; m < 9; m++) {
                U[k][m] += weight * u[m / 3][m % 3];
                T[k][m] += weight * t[m / 3][m % 3];
            }
        }
    }
}

// Nanoseconds per vertex-triangle pair of the scalar reference, over some rows.
static double time_scalar(const bench *b)
{
    enum { ROWS = 16 };
    const pliant_triangle_rule *rule = pliant_triangle_rule_of_degree(5);
    double sum = 0, start = cpu_seconds();
    for (int row = 0; row < ROWS; row++) {
        const double *x = b->mesh->vertices + 3 * (size_t)(b->mesh->vertex_count / ROWS * row);
        for (int32_t e = 0; e < b->mesh->face_count; e++) {
            double U[3][9] = {{0}}, T[3][9] = {{0}};
            add_scalar(rule, b->elements + e, x, U, T);
            sum += U[0][0] + T[0][0];
        }
    }
    const double seconds = cpu_seconds() - start;
    if (!isfinite(sum) && b->mesh->face_count < 0) puts("scalar far field is not finite");
    return 1e9 * seconds / ((double)b->mesh->face_count * ROWS);
}

// Sum over elements of |error of T|, relative to the sum of |T|, by distance in longest edges, when
// 7 or 4 points serve from that distance on. Against 16 points, or halves down to 1.5 edges.
static void print_errors(const bench *b)
{
    static const double from[] = {2, 3, 4, 6, 8, 12, 16, 20};
    enum { BINS = sizeof from / sizeof from[0], ROWS = 12 };
    static const int degrees[] = {5, 3};
    double errors[2][BINS] = {{0}}, size = 0, pairs[BINS] = {0};
    const double pi = 3.14159265358979323846, t = -1 / (8 * pi * 0.7);
    for (int row = 0; row < ROWS; row++) {
        const int32_t v = b->mesh->vertex_count - 1 - b->mesh->vertex_count / ROWS * row;
        const double *x = b->mesh->vertices + 3 * (size_t)v;
        for (int32_t e = 0; e < b->mesh->face_count; e++) {
            const pliant_element *element = b->elements + e;
            if (element->vertices[0] == v || element->vertices[1] == v || element->vertices[2] == v)
                continue;
            pliant_element_integrals integrals;
            pliant_near_integral_set(&constants, element, x, &integrals);
            double exact[3][9], distance = 0, edge = 0, radius = 0;
            for (int k = 0; k < 3; k++) {
                const double *w = integrals.of_hat[k] + PLIANT_INTEGRAL_W;
                const double turn[9] = {0, w[2], -w[1], -w[2], 0, w[0], w[1], -w[0], 0};
                double side = 0, spoke = 0;
                for (int m = 0; m < 9; m++) {
                    exact[k][m] = t * (integrals.of_hat[k][PLIANT_INTEGRAL_S +
                                                           pliant_integral_place[m / 3][m % 3]] -
                                       turn[m]);
                    size += fabs(exact[k][m]);
                }
                for (int i = 0; i < 3; i++) {
                    side += pow(element->spokes[k][i] - element->spokes[(k + 1) % 3][i], 2);
                    spoke += pow(element->spokes[k][i], 2);
                }
                distance += pow(element->centre[k] - x[k], 2);
                edge = fmax(edge, sqrt(side));
                radius = fmax(radius, sqrt(spoke));
            }
            const double ratio = (sqrt(distance) - radius) / edge;
            for (int bin = 0; bin < BINS; bin++) pairs[bin] += ratio >= from[bin];
            for (int d = 0; d < 2 && ratio >= from[0]; d++) {
                double U[3][9] = {{0}}, T[3][9] = {{0}}, off = 0;
                add_scalar(pliant_triangle_rule_of_degree(degrees[d]), element, x, U, T);
                for (int m = 0; m < 27; m++) off += fabs(T[m / 9][m % 9] - exact[m / 9][m % 9]);
                for (int bin = 0; bin < BINS; bin++)
                    if (ratio >= from[bin]) errors[d][bin] += off;
            }
        }
    }
    printf(
        "edges away   pairs   7 points from there on   4 points (error relative to a row of H)\n");
    for (int bin = 0; bin < BINS; bin++)
        printf("%8.0f   %5.1f %%   %.1e                  %.1e\n", from[bin],
               100 * pairs[bin] / ROWS / b->mesh->face_count, errors[0][bin] / size,
               errors[1][bin] / size);
}

static double dgemm_gflops(void)
{
    const int size = 1200;
    const double one = 1, zero = 0;
    double *M = need(malloc(3 * (size_t)size * size * sizeof *M));
    for (size_t i = 0; i < 3 * (size_t)size * size; i++) M[i] = (double)(i % 17) / 17;
    double *N = M + (size_t)size * size, *C = N + (size_t)size * size, best = INFINITY;
    for (int trial = 0; trial < 3; trial++) {
        const double start = cpu_seconds();
        dgemm_("N", "N", &size, &size, &size, &one, M, &size, N, &size, &zero, C, &size);
        best = fmin(best, cpu_seconds() - start);
    }
    free(M);
    return 2e-9 * size * size * size / best;
}

int main(void)
{
    pliant_multires *sphere = sphere_of(4);
    bench b = {.mesh = sphere->mesh};
    const int32_t n = b.mesh->vertex_count, faces = b.mesh->face_count;
    b.elements = need(malloc((size_t)faces * sizeof *b.elements));
    b.sums = need(aligned_alloc(sizeof(pliant_lanes), (size_t)n * sizeof *b.sums));
    b.near = need(malloc((size_t)faces));
    for (int32_t f = 0; f < faces; f++) {
        const int32_t *v = b.mesh->faces + 3 * (size_t)f;
        pliant_element_set(&b.elements[f], v, b.mesh->vertices + 3 * (size_t)v[0],
                           b.mesh->vertices + 3 * (size_t)v[1],
                           b.mesh->vertices + 3 * (size_t)v[2]);
    }
    const double pairs = (double)n * faces;
    const size_t bytes = 9 * (size_t)n * (size_t)n * sizeof(double);
    double *A = need(malloc(2 * bytes)), *B = A + bytes / sizeof *A, again = INFINITY;
    const double first = time_assembly(&b, A, B);
    for (int trial = 0; trial < 3; trial++) again = fmin(again, time_assembly(&b, A, B));
    free(A);
    double far = INFINITY, near = INFINITY, near_pairs;
    for (int trial = 0; trial < 3; trial++) {
        far = fmin(far, time_far(&b));
        near = fmin(near, time_near(&b, &near_pairs));
    }
    const double far_pairs = pairs - near_pairs, scalar = time_scalar(&b), dgemm = dgemm_gflops();
    const double far_gflops = 1e-9 * far_flops * far_pairs / far;
    printf("%d vertices, %d triangles, %.1f M pairs, A and B %.2f GB\n", n, faces, 1e-6 * pairs,
           2e-9 * (double)bytes);
    printf("assembly    %.3f s   %.1f ns a pair   %.0f rows/s (3 a vertex)\n", again,
           1e9 * again / pairs, 3 * n / again);
    printf("  into fresh pages   %.3f s\n", first);
    printf("  far       %.3f s   %.1f ns a pair   %.0f GFLOP/s   %.0f %% of dgemm's %.0f\n", far,
           1e9 * far / far_pairs, far_gflops, 100 * far_gflops / dgemm, dgemm);
    printf("  near      %.3f s   %.0f ns a pair   %.0f pairs a vertex\n", near,
           1e9 * near / near_pairs, near_pairs / n);
    printf("  the rest  %.3f s (diagonal, body force, writing)\n", again - far - near);
    printf("scalar reference, 7 points: %.0f ns a pair, %.1f times the far field\n", scalar,
           scalar / (1e9 * far / far_pairs));
    printf("dgemm of the far field's operations: %.3f s\n", 1e-9 * far_flops * far_pairs / dgemm);
    print_errors(&b);
    free(b.near);
    free(b.sums);
    free(b.elements);
    pliant_multires_destroy(sphere);
    return 0;
}
