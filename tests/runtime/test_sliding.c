// test_sliding.c: where a point slides to, on surfaces of which the answer is known.
#include "check.h"

#include "pliant/halfedge.h"
#include "sliding.h"
#include "surfaces.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// ---- A surface: any closed mesh, with the normals and compliances that a case wants ----

typedef enum normals { FLAT_NORMALS, SMOOTH_NORMALS } normals;

typedef struct fixture {
    pliant_mesh *mesh;
    int32_t *twin;
    normals normals;
    double compliance;  // isotropic
    pliant_sliding_surface surface;
} fixture;

static void cross(const double *a, const double *b, double *to)
{
    for (int c = 0; c < 3; c++)
        to[c] = a[(c + 1) % 3] * b[(c + 2) % 3] - a[(c + 2) % 3] * b[(c + 1) % 3];
}

static double dot(const double *a, const double *b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

// Normals: the face's own, or the direction from the origin, which is a sphere's.
static void fetch(void *context, int32_t face, pliant_sliding_face *to)
{
    const fixture *f = context;
    double edge[2][3], flat[3];
    memset(to, 0, sizeof *to);
    for (int k = 0; k < 3; k++) {
        const double *x = f->mesh->vertices + 3 * (size_t)f->mesh->faces[3 * face + k];
        memcpy(to->place[k], x, sizeof to->place[k]);
        for (int c = 0; c < 9; c += 4) to->compliance[k][c] = f->compliance;
    }
    for (int i = 0; i < 2; i++)
        for (int c = 0; c < 3; c++) edge[i][c] = to->place[i + 1][c] - to->place[0][c];
    cross(edge[0], edge[1], flat);
    for (int k = 0; k < 3; k++) {
        const double *n = f->normals == FLAT_NORMALS ? flat : to->place[k];
        for (int c = 0; c < 3; c++) to->normal[k][c] = n[c] / sqrt(dot(n, n));
    }
}

static fixture set_up(pliant_mesh *mesh)
{
    fixture f = {.mesh = mesh};
    pliant_error err = {""};
    f.twin = malloc(3 * (size_t)mesh->face_count * sizeof *f.twin);
    assert_non_null(f.twin);
    check_ok(pliant_halfedge_match(mesh->vertex_count, mesh->face_count, mesh->faces, f.twin, &err),
             &err);
    f.surface = (pliant_sliding_surface){.twin = f.twin, .fetch = fetch, .give = 0.01};
    return f;
}

static void tear_down(fixture *f)
{
    pliant_mesh_destroy(f->mesh);
    free(f->twin);
}

static fixture set_up_sphere(int32_t levels)
{
    check_surface sphere = check_sphere(levels);
    pliant_mesh *mesh = sphere.mesh;
    free(sphere.areas);
    free(sphere.parents);
    return set_up(mesh);
}

// A square of `count` x `count` places in [-1, 1]^2 with z = height(x, y), closed by a wall and a
// bottom: a bowl or a plane, seen from above.
static fixture set_up_graph(int32_t count, double (*height)(double x, double y))
{
    const int32_t top = count * count, rim = 4 * (count - 1);
    pliant_mesh *mesh = NULL;
    pliant_error err = {""};
    check_ok(pliant_mesh_create(top + 1, 2 * (count - 1) * (count - 1) + rim, &mesh, &err), &err);
    for (int32_t j = 0; j < count; j++)
        for (int32_t i = 0; i < count; i++) {
            double *x = mesh->vertices + 3 * (j * count + i);
            x[0] = -1 + 2.0 * i / (count - 1);
            x[1] = -1 + 2.0 * j / (count - 1);
            x[2] = height(x[0], x[1]);
        }
    mesh->vertices[3 * top + 2] = -10;
    int32_t *face = mesh->faces;
    for (int32_t j = 0; j + 1 < count; j++)
        for (int32_t i = 0; i + 1 < count; i++) {
            const int32_t a = j * count + i, b = a + 1, c = a + count, d = c + 1;
            const int32_t corners[6] = {a, b, d, a, d, c};
            memcpy(face, corners, sizeof corners);
            face += 6;
        }
    for (int32_t side = 0; side < 4; side++)
        for (int32_t i = 0; i + 1 < count; i++) {
            const int32_t last = count - 1, p = last - i;
            const int32_t from[4] = {i, i * count + last, last * count + p, p * count};
            const int32_t to[4] = {i + 1, (i + 1) * count + last, last * count + p - 1,
                                   (p - 1) * count};
            const int32_t corners[3] = {to[side], from[side], top};
            memcpy(face, corners, sizeof corners);
            face += 3;
        }
    return set_up(mesh);
}

static double plane(double x, double y)
{
    (void)x, (void)y;
    return 0;
}

static double bowl(double x, double y)
{
    return 0.3 * (x * x + y * y);
}

static int32_t slide(fixture *f, pliant_sliding_point *point, const double *device,
                     pliant_sliding_state *state)
{
    f->surface.context = f;
    return pliant_sliding_move(&f->surface, point, device, state);
}

// ---- Cases ----

// On a finely faceted sphere of radius 1 with radial normals the answer is nearly the sphere's: the
// point is where the device's ray leaves, F = depth / (1 / k + C) along it. A chord lies h^2 / 8
// lower, h = 0.08 at level 4.
static void without_friction_the_force_stands_along_the_smoothed_normal(void **state)
{
    (void)state;
    fixture f = set_up_sphere(4);
    f.normals = SMOOTH_NORMALS;
    f.compliance = 0.02;
    check_random random = check_random_seed(5);
    for (int trial = 0; trial < 200; trial++) {
        double device[3], square = 0;
        for (int c = 0; c < 3; c++) device[c] = 2 * check_random_next(&random) - 1;
        square = dot(device, device);
        const double radius = 0.6 + 0.39 * check_random_next(&random);
        for (int c = 0; c < 3; c++) device[c] *= radius / sqrt(square);
        // From a face nearby: the one with a corner nearest, and then from its neighbours.
        pliant_sliding_point point = {-1, {1, 0, 0}};
        double best = -1;
        for (int32_t face = 0; face < f.mesh->face_count; face++) {
            const double *x = f.mesh->vertices + 3 * (size_t)f.mesh->faces[3 * face];
            if (dot(x, device) > best) best = dot(x, device), point.face = face;
        }
        pliant_sliding_state moved, looked;
        pliant_sliding_point other = {f.twin[3 * point.face + 1] / 3, {0.2, 0.3, 0.5}};
        (void)slide(&f, &point, device, &moved);
        for (int c = 0; c < 3; c++) {
            check_near(moved.place[c], device[c] / radius, 0.0015);
            check_near(moved.normal[c], device[c] / radius, 1e-3);
            check_near(moved.force[c], -moved.press * moved.normal[c], 2e-9 * moved.press);
        }
        check_near(moved.press, (1 - radius) / 0.03, 0.0015 / 0.03);
        check_near(moved.energy, 0.5 * moved.press * moved.press * 0.03, 1e-9);
        // Wherever it started.
        (void)slide(&f, &other, device, &looked);
        for (int c = 0; c < 3; c++) check_near(looked.place[c], moved.place[c], 1e-8);
        pliant_sliding_look(&f.surface, &point, device, &looked);
        for (int c = 0; c < 3; c++) check_near(looked.force[c], moved.force[c], 1e-12);
    }
    tear_down(&f);
}

// By small steps over many faces of a coarse sphere (dihedral angles of 18 degrees): the force
// follows at a bounded rate. With radial normals the point moves at most 1 / (1 - depth) as fast as
// the device, the force at most K (1 + that) as fast; an edge of flat faces turns it by 18 degrees.
static void the_force_is_continuous_over_edges_with_smoothed_normals_only(void **state)
{
    (void)state;
    fixture f = set_up_sphere(1);
    const double step = 1e-3, stiffness = 1 / 0.03;
    double jump[2];
    for (int smooth = 0; smooth < 2; smooth++) {
        f.normals = smooth ? SMOOTH_NORMALS : FLAT_NORMALS;
        f.compliance = 0.02;
        pliant_sliding_point point = {0, {1, 0, 0}};
        double before[3] = {0};
        int32_t faces = 0, last = -1;
        jump[smooth] = 0;
        for (int i = 0; i < 6000; i++) {
            const double t = i * step, z = 0.5 * sin(0.37 * t), r = sqrt(1 - z * z);
            const double device[3] = {0.9 * r * cos(t), 0.9 * r * sin(t), 0.9 * z};
            pliant_sliding_state now;
            // To where the device is at first, then along.
            for (int k = 0; k < (i == 0 ? 50 : 1); k++) (void)slide(&f, &point, device, &now);
            double change = 0;
            for (int c = 0; c < 3; c++) change += pow(now.force[c] - before[c], 2);
            if (i > 0) jump[smooth] = fmax(jump[smooth], sqrt(change));
            memcpy(before, now.force, sizeof before);
            faces += point.face != last;
            last = point.face;
        }
        check_at_least(faces, 20);
    }
    printf("largest change of the force in a step: flat %g, smoothed %g\n", jump[0], jump[1]);
    check_at_most(jump[1], 2.5 * stiffness * step);
    check_at_least(jump[0], 20 * jump[1]);
    tear_down(&f);
}

// Trapezoidal work of the force on the device around a closed path, out of and into the surface.
static double work_around(fixture *f, int32_t steps, pliant_sliding_point point, double *stored)
{
    double work = 0, before[3] = {0}, place[3] = {0};
    *stored = 0;
    for (int32_t i = 0; i <= steps; i++) {
        const double t = 6.283185307179586 * i / steps;
        const double device[3] = {0.45 * cos(t) + 0.1, 0.45 * sin(t) - 0.05,
                                  -0.1 + 0.05 * sin(2 * t + 1)};
        pliant_sliding_state now;
        for (int k = 0; k < (i == 0 ? 200 : 1); k++) (void)slide(f, &point, device, &now);
        for (int c = 0; i > 0 && c < 3; c++)
            work += 0.5 * (before[c] + now.force[c]) * (device[c] - place[c]);
        memcpy(before, now.force, sizeof before);
        memcpy(place, device, sizeof place);
        *stored = fmax(*stored, now.energy);
    }
    return work;
}

// Without smoothing and on a surface as soft all over the force is a gradient: on a bowl, whose
// edges hold the point and never let it snap. The trapezoidal rule errs by O(step^2).
static void a_closed_path_takes_no_work(void **state)
{
    (void)state;
    fixture f = set_up_graph(9, bowl);
    f.normals = FLAT_NORMALS;
    f.compliance = 0.02;
    const pliant_sliding_point start = {2 * (3 * 8 + 4), {0.4, 0.3, 0.3}};
    double stored, coarse = work_around(&f, 2000, start, &stored);
    const double fine = work_around(&f, 20000, start, &stored);
    printf("work %.3g in 2000 steps, %.3g in 20000; %.3g stored\n", coarse, fine, stored);
    check_near(coarse, 0, 1e-4 * stored);
    check_near(fine, 0, 1e-6 * stored);
    tear_down(&f);
}

static void within_the_friction_cone_the_point_stays_and_beyond_it_the_cone_is_kept(void **state)
{
    (void)state;
    fixture f = set_up_graph(9, plane);
    f.normals = FLAT_NORMALS;
    f.compliance = 0.02;
    f.surface.friction = 0.5;
    pliant_sliding_point point = {2 * (3 * 8 + 4), {0.4, 0.3, 0.3}};
    pliant_sliding_state now;
    const double down[3] = {0, 0, -0.1};
    f.surface.context = &f;
    pliant_sliding_look(&f.surface, &point, down, &now);
    const double begin[3] = {now.place[0], now.place[1], 0};
    double device[3] = {begin[0], begin[1], -0.1};
    for (int i = 0; i <= 40; i++) {
        device[0] = begin[0] + 0.01 * i;
        device[1] = begin[1] + 0.005 * i;
        const int32_t moved = slide(&f, &point, device, &now);
        // Dragged by d, the tangential force is d / 0.03 until it is mu 0.1 / 0.03.
        const double drag = i * sqrt(1.25e-4), hold = 0.5 * 0.1;
        const double rest[2] = {0.8944271909999159, 0.4472135954999579};
        assert_int_equal(moved, drag > hold);
        for (int c = 0; c < 2; c++) {
            check_near(now.force[c], rest[c] * fmin(drag, hold) / 0.03, 1e-6);
            check_near(now.place[c], begin[c] + rest[c] * fmax(drag - hold, 0), 1e-7);
        }
        check_near(now.press, 0.1 / 0.03, 1e-9);
    }
    tear_down(&f);
}

// In a valley between two planes the device is under both: the point is on the valley's floor, an
// edge, right over the device; beyond its end at a corner of the mesh it stays there.
static double valley(double x, double y)
{
    (void)x;
    return fabs(y);
}

static double funnel(double x, double y)
{
    return fmax(fabs(x), fabs(y));
}

static void edges_and_corners_of_valleys_hold_the_point(void **state)
{
    (void)state;
    for (int corner = 0; corner < 2; corner++) {
        fixture f = set_up_graph(9, corner ? funnel : valley);
        f.normals = FLAT_NORMALS;
        f.compliance = 0.02;
        check_random random = check_random_seed(8);
        for (int trial = 0; trial < 100; trial++) {
            pliant_sliding_point point = {check_random_index(&random, 2 * 64), {0.2, 0.5, 0.3}};
            const double device[3] = {corner ? 0.1 * check_random_next(&random)
                                             : 1.6 * check_random_next(&random) - 0.8,
                                      0.2 * check_random_next(&random) - 0.1, -0.4};
            pliant_sliding_state now;
            for (int k = 0; k < 3; k++) (void)slide(&f, &point, device, &now);
            check_near(now.place[0], corner ? 0 : device[0], 1e-8);
            check_near(now.place[1], 0, 1e-12);
            check_near(now.place[2], 0, 1e-12);
        }
        tear_down(&f);
    }
}

static void nothing_breaks_on_faces_without_area(void **state)
{
    (void)state;
    fixture f = set_up_sphere(1);
    f.normals = SMOOTH_NORMALS;
    // Three corners of a face in a line, and two of another in one place.
    double *x = f.mesh->vertices;
    const int32_t *a = f.mesh->faces, *b = f.mesh->faces + 3 * 40;
    for (int c = 0; c < 3; c++) {
        x[3 * a[2] + c] = 0.5 * (x[3 * a[0] + c] + x[3 * a[1] + c]);
        x[3 * b[1] + c] = x[3 * b[0] + c];
    }
    check_random random = check_random_seed(9);
    for (int trial = 0; trial < 2000; trial++) {
        pliant_sliding_point point = {check_random_index(&random, f.mesh->face_count),
                                      {0.2, 0.5, 0.3}};
        double device[3];
        for (int c = 0; c < 3; c++) device[c] = 1.2 * (2 * check_random_next(&random) - 1);
        pliant_sliding_state now;
        (void)slide(&f, &point, device, &now);
        assert_in_range(point.face, 0, f.mesh->face_count - 1);
        double sum = 0;
        for (int k = 0; k < 3; k++) {
            check_at_least(point.weights[k], 0);
            sum += point.weights[k];
            assert_true(isfinite(now.force[k]));
        }
        check_near(sum, 1, 1e-12);
    }
    tear_down(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(without_friction_the_force_stands_along_the_smoothed_normal),
        cmocka_unit_test(the_force_is_continuous_over_edges_with_smoothed_normals_only),
        cmocka_unit_test(a_closed_path_takes_no_work),
        cmocka_unit_test(within_the_friction_cone_the_point_stays_and_beyond_it_the_cone_is_kept),
        cmocka_unit_test(edges_and_corners_of_valleys_hold_the_point),
        cmocka_unit_test(nothing_breaks_on_faces_without_area),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
