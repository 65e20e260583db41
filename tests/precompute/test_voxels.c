// test_voxels.c: which cells of a grid a surface touches, and which it bounds.
#include "check.h"

#include "lattice/triangle_box.h"
#include "lattice/voxels.h"
#include "surfaces.h"

#include "pliant/links.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// ---- The slow, obvious way: cut the triangle by the six sides of the box, see what is left ----

static int clip(double (*points)[3], int count, int axis, double at, double side)
{
    double kept[32][3];
    int n = 0;
    for (int i = 0; i < count; i++) {
        const double *p = points[i], *q = points[(i + 1) % count];
        const double a = side * (p[axis] - at), b = side * (q[axis] - at);
        if (a <= 0) memcpy(kept[n++], p, sizeof kept[0]);
        if ((a < 0 && b > 0) || (a > 0 && b < 0)) {
            for (int d = 0; d < 3; d++) kept[n][d] = p[d] + a / (a - b) * (q[d] - p[d]);
            kept[n++][axis] = at;
        }
    }
    memcpy(points, kept, (size_t)n * sizeof kept[0]);
    return n;
}

// Does the triangle meet the box of cells, every side of which is moved outwards by `grown`?
static int meets(const double corners[3][3], const int32_t first[3], const int32_t last[3],
                 double grown)
{
    double points[32][3];
    int count = 3;
    memcpy(points, corners, 9 * sizeof(double));
    for (int d = 0; d < 3 && count > 0; d++) {
        count = clip(points, count, d, last[d] + 1 + grown, 1);
        count = clip(points, count, d, first[d] - grown, -1);
    }
    return count > 0;
}

static const int32_t grid_dims[3] = {8, 8, 8};

// Every box of 1, 2 or 3 cells a side inside the triangle's own, against the reference: what meets
// the shrunken box must overlap, what misses the grown one must not. Returns the boxes looked at.
static int compare_boxes(const double corners[3][3], double shrunken, double grown)
{
    pliant_triangle_box t;
    int boxes = 0;
    pliant_triangle_box_prepare(corners, grid_dims, &t);
    for (int side = 1; side <= 3; side++)
        for (int32_t z = t.first[2]; z + side - 1 <= t.last[2]; z++)
            for (int32_t y = t.first[1]; y + side - 1 <= t.last[1]; y++)
                for (int32_t x = t.first[0]; x + side - 1 <= t.last[0]; x++, boxes++) {
                    const int32_t first[3] = {x, y, z};
                    const int32_t last[3] = {x + side - 1, y + side - 1, z + side - 1};
                    const int found = pliant_triangle_box_overlaps(&t, first, last, 1);
                    if (meets(corners, first, last, -shrunken)) assert_int_equal(found, 1);
                    if (!meets(corners, first, last, grown)) assert_int_equal(found, 0);
                    // Several cells are never denied when one of them is affirmed.
                    if (found)
                        assert_int_equal(pliant_triangle_box_overlaps(&t, first, last, 2), 1);
                }
    // Beyond its own box there is nothing.
    for (int d = 0; d < 3; d++) {
        int32_t first[3] = {0, 0, 0}, last[3] = {7, 7, 7};
        if (t.first[d] > 0) {
            last[d] = t.first[d] - 1;
            assert_int_equal(meets(corners, first, last, grown), 0);
        }
        last[d] = 7;
        if (t.last[d] < 7) {
            first[d] = t.last[d] + 1;
            assert_int_equal(meets(corners, first, last, grown), 0);
        }
    }
    return boxes;
}

// Wider than the slack, far above the reference's own rounding.
#define WIDER 1e-9

static void random_triangles_overlap_the_boxes_that_they_reach_into(void **state)
{
    (void)state;
    check_random random = check_random_seed(1);
    int boxes = 0;
    for (int i = 0; i < 3000; i++) {
        double x[3][3];
        const double size = pow(0.05, check_random_next(&random));
        for (int d = 0; d < 3; d++) {
            const double at = 8 * check_random_next(&random);
            for (int c = 0; c < 3; c++)
                x[c][d] = fmin(8, fmax(0, at + 8 * size * (check_random_next(&random) - 0.5)));
        }
        boxes += compare_boxes((const double(*)[3])x, WIDER, WIDER);
    }
    assert_true(boxes > 20000);
}

// Corners on quarters: planes, edges and corners of cells are met exactly, and what is not met is
// off by far more than rounding.
static void triangles_on_cell_planes_edges_and_corners_touch_both_sides(void **state)
{
    (void)state;
    check_random random = check_random_seed(2);
    for (int i = 0; i < 3000; i++) {
        double x[3][3];
        const int32_t parts = i % 2 ? 4 : 1,
                      flat = i % 4 == 3 ? check_random_index(&random, 3) : -1;
        for (int c = 0; c < 3; c++)
            for (int d = 0; d < 3; d++) {
                x[c][d] = 1 + (double)check_random_index(&random, 6 * parts + 1) / parts;
                if (d == flat) x[c][d] = floor(x[0][d]);
            }
        // Met by the grown box alone is met in a tie.
        compare_boxes((const double(*)[3])x, -1e-7, 1e-7);
    }
    // A face in the plane x = 3, a line in an edge, a point in a corner.
    const double plane[3][3] = {{3, 2.2, 2.2}, {3, 2.8, 2.2}, {3, 2.2, 2.8}};
    const double line[3][3] = {{3, 3, 2.2}, {3, 3, 2.8}, {3, 3, 2.4}};
    const double point[3][3] = {{3, 3, 3}, {3, 3, 3}, {3, 3, 3}};
    const double(*cases[3])[3] = {plane, line, point};
    for (int i = 0; i < 3; i++) {
        pliant_triangle_box t;
        pliant_triangle_box_prepare(cases[i], grid_dims, &t);
        int touched = 0;
        for (int32_t z = t.first[2]; z <= t.last[2]; z++)
            for (int32_t y = t.first[1]; y <= t.last[1]; y++)
                for (int32_t x = t.first[0]; x <= t.last[0]; x++) {
                    const int32_t cell[3] = {x, y, z};
                    touched += pliant_triangle_box_overlaps(&t, cell, cell, 1);
                }
        assert_int_equal(touched, 2 << i);
    }
}

// An edge that runs through a corner of cells, but for rounding, touches all eight of them; and so
// does a sliver along it, however thin.
static void what_rounding_cannot_tell_from_touching_touches(void **state)
{
    (void)state;
    check_random random = check_random_seed(6);
    for (int i = 0; i < 3000; i++) {
        double x[3][3], forth = 0.2 + check_random_next(&random),
                        back = 0.2 + check_random_next(&random);
        int32_t corner[3];
        const double width = pow(10, -15 * check_random_next(&random));
        for (int d = 0; d < 3; d++) {
            const double along = check_random_next(&random) - 0.5;
            corner[d] = 2 + check_random_index(&random, 4);
            x[0][d] = corner[d] + forth * along;
            x[1][d] = corner[d] - back * along;
            x[2][d] = corner[d] + 0.3 * along + width * (check_random_next(&random) - 0.5);
        }
        pliant_triangle_box t;
        pliant_triangle_box_prepare((const double(*)[3])x, grid_dims, &t);
        for (int k = 0; k < 8; k++) {
            int32_t cell[3];
            for (int d = 0; d < 3; d++) {
                cell[d] = corner[d] - (k >> d & 1);
                assert_in_range(cell[d], t.first[d], t.last[d]);
            }
            assert_int_equal(pliant_triangle_box_overlaps(&t, cell, cell, 1), 1);
        }
    }
}

static void slivers_down_to_a_line_touch_what_the_line_touches(void **state)
{
    (void)state;
    check_random random = check_random_seed(3);
    for (int i = 0; i < 3000; i++) {
        double x[3][3];
        const double width = i % 10 == 0 ? 0 : pow(10, -14 * check_random_next(&random));
        const double part = check_random_next(&random);
        for (int d = 0; d < 3; d++) {
            x[0][d] = 8 * check_random_next(&random);
            x[1][d] = 8 * check_random_next(&random);
            x[2][d] = fmin(8, fmax(0, x[0][d] + part * (x[1][d] - x[0][d]) +
                                          width * (check_random_next(&random) - 0.5)));
        }
        // Of a sliver less is certain: the nine products and the normal all lean on small numbers.
        compare_boxes((const double(*)[3])x, WIDER, 1e-7);
    }
}

// ---- Whole surfaces ----

static pliant_voxels *voxelise(const pliant_mesh *mesh, int32_t cells, pliant_voxel_filling filling)
{
    pliant_voxels *v = NULL;
    pliant_error err = {""};
    check_ok(pliant_voxels_create(mesh, "mesh", cells, filling, 0, &v, &err), &err);
    return v;
}

static int has(const pliant_voxels *v, int32_t x, int32_t y, int32_t z)
{
    return pliant_cell_set_find(v->set, x, y, z) >= 0;
}

static int holds(const pliant_voxels *v, double x, double y, double z)
{
    double at[3];
    pliant_voxel_grid_locate(&v->grid, (const double[3]){x, y, z}, at);
    return has(v, (int32_t)floor(at[0]), (int32_t)floor(at[1]), (int32_t)floor(at[2]));
}

// The list is the set in order, and the outermost cells of every axis are used.
static void check_list(const pliant_voxels *v)
{
    int32_t low[3] = {1 << 20, 1 << 20, 1 << 20}, high[3] = {-1, -1, -1};
    for (int32_t i = 0; i < v->cell_count; i++) {
        const int32_t *cell = v->cells + 3 * (size_t)i;
        assert_int_equal(pliant_cell_set_find(v->set, cell[0], cell[1], cell[2]), i);
        for (int d = 0; d < 3; d++) {
            if (cell[d] < low[d]) low[d] = cell[d];
            if (cell[d] > high[d]) high[d] = cell[d];
        }
    }
    for (int d = 0; d < 3; d++) {
        assert_int_equal(low[d], 0);
        assert_int_equal(high[d], v->grid.dims[d] - 1);
    }
}

// A lattice whose cells the mesh's planes miss: turned by something that is no round number.
static void turn(pliant_mesh *mesh)
{
    for (int32_t v = 0; v < mesh->vertex_count; v++) {
        double *x = mesh->vertices + 3 * (size_t)v;
        for (int d = 0; d < 3; d++) {
            const double a = x[d], b = x[(d + 1) % 3];
            x[d] = 0.8 * a - 0.6 * b;
            x[(d + 1) % 3] = 0.6 * a + 0.8 * b;
        }
    }
}

static void stretch(pliant_mesh *mesh, double x, double y, double z)
{
    for (int32_t v = 0; v < mesh->vertex_count; v++) {
        mesh->vertices[3 * (size_t)v] *= x;
        mesh->vertices[3 * (size_t)v + 1] *= y;
        mesh->vertices[3 * (size_t)v + 2] *= z;
    }
}

static void a_shell_is_every_cell_that_some_triangle_meets(void **state)
{
    (void)state;
    pliant_mesh *meshes[] = {check_octahedron(), check_torus(12, 20), check_block(1), check_cube()};
    for (size_t m = 0; m < sizeof meshes / sizeof *meshes; m++) {
        if (m < 3) turn(meshes[m]);
        for (int32_t cells = 1; cells <= 19; cells += 6) {
            pliant_voxels *v = voxelise(meshes[m], cells, PLIANT_VOXELS_SHELL);
            const int32_t *dims = v->grid.dims;
            check_list(v);
            for (int32_t z = 0; z < dims[2]; z++)
                for (int32_t y = 0; y < dims[1]; y++)
                    for (int32_t x = 0; x < dims[0]; x++) {
                        const int32_t cell[3] = {x, y, z};
                        int surely = 0, maybe = 0;
                        for (int32_t f = 0; f < meshes[m]->face_count && !surely; f++) {
                            double corners[3][3];
                            pliant_voxel_grid_triangle(&v->grid, meshes[m], f, corners);
                            surely |= meets((const double(*)[3])corners, cell, cell, -WIDER);
                            maybe |= meets((const double(*)[3])corners, cell, cell, WIDER);
                        }
                        if (surely) assert_int_equal(has(v, x, y, z), 1);
                        if (!surely && !maybe) assert_int_equal(has(v, x, y, z), 0);
                    }
            pliant_voxels_destroy(v);
        }
        pliant_mesh_destroy(meshes[m]);
    }
}

// Cells that meet a ball of radius r are as many, over all places of the grid, as the ball widened
// by a cube of edge a has volume: Steiner, V = 4/3 pi r^3 + 3 pi r^2 a + 6 r a^2 + a^3.
static void a_balls_cells_have_the_volume_of_the_ball_and_a_cube(void **state)
{
    (void)state;
    check_surface ball = check_sphere(5);
    for (int32_t cells = 21; cells <= 81; cells += 20) {
        pliant_voxels *v = voxelise(ball.mesh, cells, PLIANT_VOXELS_SOLID);
        check_list(v);
        const double a = v->grid.size, pi = acos(-1);
        const double expected = (4 * pi / 3 + 3 * pi * a + 6 * a * a + a * a * a) / (a * a * a);
        printf("ball, %d cells across: %d cells, %.0f expected\n", cells, v->cell_count, expected);
        // The number of lattice points in a ball fluctuates by less than its surface to the 2/3.
        check_near(v->cell_count / expected, 1, 2.0 / cells);
        pliant_voxels_destroy(v);
    }
    check_surface_destroy(&ball);
}

// An own flood, cell by cell: from beyond the grid it reaches no cell of the solid that is not of
// the shell, and every other cell that is not of the solid. Returns the cells that are shut off.
static int32_t check_tight(const pliant_mesh *mesh, int32_t cells)
{
    pliant_voxels *solid = voxelise(mesh, cells, PLIANT_VOXELS_SOLID);
    pliant_voxels *shell = voxelise(mesh, cells, PLIANT_VOXELS_SHELL);
    const int32_t nx = solid->grid.dims[0] + 2, ny = solid->grid.dims[1] + 2,
                  nz = solid->grid.dims[2] + 2;
    const int32_t total = nx * ny * nz, steps[3] = {1, nx, nx * ny};
    uint8_t *wet = calloc((size_t)total, 1);
    int32_t *stack = malloc((size_t)total * sizeof *stack), depth = 1;
    assert_non_null(wet);
    assert_non_null(stack);
    stack[0] = 0;
    wet[0] = 1;
    while (depth > 0) {
        const int32_t at = stack[--depth], p[3] = {at % nx, at / nx % ny, at / nx / ny};
        for (int k = 0; k < 6; k++) {
            int32_t q[3] = {p[0], p[1], p[2]};
            q[k / 2] += k % 2 ? 1 : -1;
            if (q[0] < 0 || q[1] < 0 || q[2] < 0 || q[0] >= nx || q[1] >= ny || q[2] >= nz)
                continue;
            const int32_t to = at + (k % 2 ? 1 : -1) * steps[k / 2];
            if (wet[to] || has(shell, q[0] - 1, q[1] - 1, q[2] - 1)) continue;
            wet[to] = 1;
            stack[depth++] = to;
        }
    }
    int32_t inside = 0;
    for (int32_t at = 0; at < total; at++) {
        const int32_t x = at % nx - 1, y = at / nx % ny - 1, z = at / nx / ny - 1;
        assert_int_equal(has(solid, x, y, z), !wet[at]);
        inside += has(solid, x, y, z) && !has(shell, x, y, z);
    }
    assert_int_equal(solid->cell_count, shell->cell_count + inside);
    free(stack);
    free(wet);
    pliant_voxels_destroy(shell);
    pliant_voxels_destroy(solid);
    return inside;
}

static void no_flood_by_faces_gets_through_a_shell(void **state)
{
    (void)state;
    pliant_mesh *meshes[] = {check_octahedron(), check_torus(12, 20), check_block(2),
                             check_beside(check_cube(), check_block(1))};
    for (size_t m = 0; m < sizeof meshes / sizeof *meshes; m++) {
        for (int turned = 0; turned < 2; turned++) {
            if (turned) turn(meshes[m]);
            for (int32_t cells = 1; cells <= 70; cells = 2 * cells + 1) {
                const int32_t inside = check_tight(meshes[m], cells);
                if (cells > 20) assert_true(inside > 0);
            }
        }
        pliant_mesh_destroy(meshes[m]);
    }
    check_surface blob = check_blob(4);
    // Rows of 63, 64, 65 and 129 cells: words end at the row's end, before and after it.
    for (int32_t cells = 63; cells <= 65; cells++) check_tight(blob.mesh, cells);
    check_tight(blob.mesh, 129);
    check_surface_destroy(&blob);
}

// A box of 4 x 3 x 3 with a hole of 3 x 1 x 1 from the side x = 0, drawn out along x.
static pliant_mesh *drawn_cup(double length)
{
    // Corners of a box, bit 0: x, 1: y, 2: z; its sides -x, +x, -y, +y, -z, +z seen from outside.
    static const int32_t sides[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                                        {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
    int32_t quads[14][4], count = 0;
    for (int s = 1; s < 6; s++, count += 2)
        for (int k = 0; k < 4; k++) {
            quads[count][k] = sides[s][k];
            quads[count + 1][k] = 8 + sides[s][3 - k];
        }
    for (int k = 0; k < 4; k++, count++) {
        const int32_t a = sides[0][k], b = sides[0][(k + 1) % 4];
        memcpy(quads[count], (int32_t[4]){a, b, 8 + b, 8 + a}, sizeof quads[0]);
    }
    pliant_mesh *mesh = NULL;
    pliant_error err = {""};
    check_ok(pliant_mesh_create(16, 28, &mesh, &err), &err);
    for (int v = 0; v < 16; v++) {
        double *x = mesh->vertices + 3 * v;
        x[0] = v & 1 ? (v < 8 ? 4 : 3) * length / 4 : 0;
        for (int d = 1; d < 3; d++) x[d] = v < 8 ? 3 * (v >> d & 1) : 1 + (v >> d & 1);
    }
    for (int q = 0; q < 14; q++)
        for (int k = 0; k < 2; k++)
            memcpy(mesh->faces + 6 * q + 3 * k,
                   (int32_t[3]){quads[q][0], quads[q][1 + k], quads[q][2 + k]},
                   3 * sizeof(int32_t));
    return mesh;
}

// Hundreds of cells deep, along every axis and from both ends: the flood finds the bottom.
static void a_deep_hole_stays_open_to_its_bottom(void **state)
{
    (void)state;
    for (int k = 0; k < 6; k++) {
        pliant_mesh *cup = drawn_cup(100);
        check_near(pliant_mesh_volume(cup), 900 - 75, 1e-9);
        for (int32_t v = 0; v < cup->vertex_count; v++) {
            // Turned so that the long axis is x, y or z, by a rotation; k odd: about another one by
            // pi.
            double *x = cup->vertices + 3 * v, y[3];
            for (int d = 0; d < 3; d++) y[(d + k / 2) % 3] = x[d];
            for (int d = 0; d < 3; d++) x[d] = k % 2 && d != (k / 2 + 1) % 3 ? -y[d] : y[d];
        }
        // The planes of the cup lie between cells, which touch on both sides: the hole is two cells
        // wide, and with 300 along it is one.
        assert_true(check_tight(cup, 400) > 0);
        pliant_voxels *v = voxelise(cup, 300, PLIANT_VOXELS_SOLID);
        double at[3];
        for (double along = 0.1; along < 100; along += 7) {
            const double from[3] = {along, 1.5, 1.5};
            for (int d = 0; d < 3; d++) at[(d + k / 2) % 3] = from[d];
            for (int d = 0; d < 3; d++) at[d] = k % 2 && d != (k / 2 + 1) % 3 ? -at[d] : at[d];
            assert_int_equal(holds(v, at[0], at[1], at[2]), along > 74);
        }
        pliant_voxels_destroy(v);
        pliant_mesh_destroy(cup);
    }
}

static void the_hole_of_a_torus_stays_open(void **state)
{
    (void)state;
    pliant_mesh *torus = check_torus(24, 48);
    pliant_voxels *v = voxelise(torus, 30, PLIANT_VOXELS_SOLID);
    double low[3] = {9, 9, 9}, high[3] = {-9, -9, -9};
    for (int32_t i = 0; i < 3 * torus->vertex_count; i++) {
        low[i % 3] = fmin(low[i % 3], torus->vertices[i]);
        high[i % 3] = fmax(high[i % 3], torus->vertices[i]);
    }
    int axis = 0;
    for (int d = 1; d < 3; d++)
        if (high[d] - low[d] < high[axis] - low[axis]) axis = d;
    // Along the axis nothing is in; through the tube something is.
    double at[3] = {0, 0, 0};
    for (int i = 0; i <= 20; i++) {
        at[axis] = low[axis] + (high[axis] - low[axis]) * (i + 0.5) / 21;
        assert_int_equal(holds(v, at[0], at[1], at[2]), 0);
    }
    at[axis] = 0;
    double tube[3] = {0, 0, 0};
    tube[(axis + 1) % 3] = high[(axis + 1) % 3] - (high[axis] - low[axis]) / 2;
    assert_int_equal(holds(v, tube[0], tube[1], tube[2]), 1);
    pliant_voxels_destroy(v);
    pliant_mesh_destroy(torus);
}

// Two spheres of one centre as one mesh: `inner` of the radius, looking inwards.
static pliant_mesh *nested(const double *radii, int count)
{
    pliant_mesh *all = NULL;
    for (int i = 0; i < count; i++) {
        check_surface sphere = check_sphere(3);
        pliant_mesh *mesh = sphere.mesh;
        for (int32_t k = 0; k < 3 * mesh->vertex_count; k++) mesh->vertices[k] *= radii[i];
        for (int32_t f = 0; i % 2 && f < mesh->face_count; f++) {
            int32_t *v = mesh->faces + 3 * (size_t)f, first = v[0];
            v[0] = v[1];
            v[1] = first;
        }
        const int32_t n = all ? all->vertex_count : 0, faces = all ? all->face_count : 0;
        pliant_mesh *sum = NULL;
        pliant_error err = {""};
        check_ok(pliant_mesh_create(n + mesh->vertex_count, faces + mesh->face_count, &sum, &err),
                 &err);
        if (all) {
            memcpy(sum->vertices, all->vertices, 3 * (size_t)n * sizeof(double));
            memcpy(sum->faces, all->faces, 3 * (size_t)faces * sizeof(int32_t));
        }
        memcpy(sum->vertices + 3 * (size_t)n, mesh->vertices,
               3 * (size_t)mesh->vertex_count * sizeof(double));
        for (int32_t k = 0; k < 3 * mesh->face_count; k++)
            sum->faces[3 * (size_t)faces + (size_t)k] = mesh->faces[k] + n;
        pliant_mesh_destroy(all);
        all = sum;
        check_surface_destroy(&sphere);
    }
    return all;
}

static void cavities_stay_open_and_bodies_inside_them_are_filled(void **state)
{
    (void)state;
    const double radii[3] = {3, 2, 1};
    for (int count = 1; count <= 3; count++) {
        pliant_mesh *mesh = nested(radii, count);
        pliant_voxels *v = voxelise(mesh, 40, PLIANT_VOXELS_SOLID);
        assert_int_equal(holds(v, 0, 2.5, 0), 1);
        assert_int_equal(holds(v, 0, 1.5, 0), count < 2);
        assert_int_equal(holds(v, 0, 0.1, 0), count != 2);
        check_list(v);
        pliant_voxels_destroy(v);
        pliant_mesh_destroy(mesh);
    }
}

static void components_are_voxelised_each(void **state)
{
    (void)state;
    pliant_mesh *both = check_beside(check_octahedron(), check_cube());
    pliant_voxels *v = voxelise(both, 50, PLIANT_VOXELS_SOLID);
    // Along x there is a gap: a plane of cells none of which is in, with cells on both sides.
    int32_t *in_plane = calloc((size_t)v->grid.dims[0], sizeof *in_plane);
    assert_non_null(in_plane);
    for (int32_t i = 0; i < v->cell_count; i++) in_plane[v->cells[3 * (size_t)i]]++;
    int32_t gaps = 0;
    for (int32_t x = 1; x < v->grid.dims[0]; x++) gaps += !in_plane[x] && in_plane[x - 1];
    assert_int_equal(gaps, 1);
    free(in_plane);
    pliant_voxels_destroy(v);
    pliant_mesh_destroy(both);
}

// A plate thinner than a cell is one layer of cells, without a hole, wherever the grid lies; and
// larger triangles than cells by hundreds are as good as small ones.
static void thin_plates_are_all_shell(void **state)
{
    (void)state;
    pliant_mesh *plate = check_cube();
    stretch(plate, 1, 1, 1e-3);
    for (int32_t cells = 1; cells <= 400; cells = 3 * cells + 2) {
        pliant_voxels *v = voxelise(plate, cells, PLIANT_VOXELS_SOLID);
        assert_int_equal(v->grid.dims[2], 1);
        assert_int_equal(v->cell_count, cells * cells);
        pliant_voxels_destroy(v);
    }
    turn(plate);
    for (int32_t cells = 5; cells <= 45; cells += 20)
        assert_int_equal(check_tight(plate, cells), 0);
    pliant_mesh_destroy(plate);
}

// A box of whole cells has them all and no more.
static void a_box_of_whole_cells_is_its_cells(void **state)
{
    (void)state;
    pliant_mesh *box = check_cube();
    stretch(box, 7.0 / 10, 4.0 / 10, 1.0 / 10);
    for (int32_t scale = 1; scale <= 9; scale += 4) {
        pliant_voxels *v = voxelise(box, 7 * scale, PLIANT_VOXELS_SOLID);
        assert_int_equal(v->grid.dims[0], 7 * scale);
        assert_int_equal(v->grid.dims[1], 4 * scale);
        assert_int_equal(v->grid.dims[2], scale);
        assert_int_equal(v->cell_count, 28 * scale * scale * scale);
        check_near(v->grid.size, 0.2 / scale, 1e-15);
        pliant_voxels_destroy(v);
    }
    pliant_mesh_destroy(box);
}

// Far from the origin, very large and very small: the same cells.
static void place_and_size_do_not_matter(void **state)
{
    (void)state;
    check_surface blob = check_blob(3);
    pliant_voxels *v = voxelise(blob.mesh, 24, PLIANT_VOXELS_SOLID);
    const int32_t count = v->cell_count;
    pliant_voxels_destroy(v);
    const double scales[3] = {1e-9, 1, 1e9}, shifts[3] = {0, 1000, 1e4};
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) {
            for (int32_t c = 0; c < 3 * blob.mesh->vertex_count; c++)
                blob.mesh->vertices[c] = scales[i] * (blob.mesh->vertices[c] + shifts[k]);
            v = voxelise(blob.mesh, 24, PLIANT_VOXELS_SOLID);
            assert_int_equal(v->cell_count, count);
            pliant_voxels_destroy(v);
            for (int32_t c = 0; c < 3 * blob.mesh->vertex_count; c++)
                blob.mesh->vertices[c] = blob.mesh->vertices[c] / scales[i] - shifts[k];
        }
    check_surface_destroy(&blob);
}

static void what_is_too_large_is_refused_with_the_numbers(void **state)
{
    (void)state;
    pliant_mesh *cube = check_cube();
    pliant_voxels *v = NULL;
    pliant_error err = {""};
    const int32_t wrong[3] = {0, -4, 1024};
    for (int i = 0; i < 3; i++)
        assert_int_equal(
            pliant_voxels_create(cube, "cube", wrong[i], PLIANT_VOXELS_SOLID, 0, &v, &err),
            PLIANT_ERR_ARGUMENT);
    assert_non_null(strstr(err.text, "expected 1 to 1023 cells, found 1024"));
    // The grid, then the cells.
    assert_int_equal(pliant_voxels_create(cube, "cube", 1023, PLIANT_VOXELS_SOLID, 1e9, &v, &err),
                     PLIANT_ERR_MEMORY);
    assert_non_null(strstr(err.text, "cube: 1.071e+09 cells of a grid of 1023 x 1023 x 1023 need"));
    assert_int_equal(pliant_voxels_create(cube, "cube", 100, PLIANT_VOXELS_SOLID, 1e7, &v, &err),
                     PLIANT_ERR_MEMORY);
    assert_non_null(strstr(err.text, "cube: 1e+06 cells of a grid of 100 x 100 x 100 need 0.16"));
    assert_non_null(strstr(err.text, "(0.01 GB are available here): use fewer cells"));
    assert_null(v);
    pliant_mesh_destroy(cube);
}

static void the_evaluation_meshes_are_tight(void **state)
{
    (void)state;
    const char *names[] = {"bunny.obj", "penguin.obj", "fandisk.obj", "torus.obj", "dragon.obj"};
    for (size_t m = 0; m < sizeof names / sizeof *names; m++) {
        const char *path = check_model_path(names[m]);
        if (!path) skip();
        pliant_mesh *mesh = check_load_obj(path);
        assert_non_null(mesh);
        for (int32_t cells = 6; cells <= 48; cells *= 2) {
            check_tight(mesh, cells);
            pliant_voxels *v = voxelise(mesh, cells, PLIANT_VOXELS_SOLID);
            int32_t *particles = malloc(24 * (size_t)v->cell_count * sizeof *particles);
            assert_non_null(particles);
            const double volume = v->cell_count * pow(v->grid.size, 3);
            printf("%s: %d cells along: %d cells, %d particles, %.2f of the mesh's volume\n",
                   names[m], cells, v->cell_count,
                   pliant_lattice_particles(v->cell_count, v->cells, particles),
                   volume / pliant_mesh_volume(mesh));
            check_at_least(volume, pliant_mesh_volume(mesh));
            free(particles);
            pliant_voxels_destroy(v);
        }
        pliant_mesh_destroy(mesh);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(random_triangles_overlap_the_boxes_that_they_reach_into),
        cmocka_unit_test(triangles_on_cell_planes_edges_and_corners_touch_both_sides),
        cmocka_unit_test(what_rounding_cannot_tell_from_touching_touches),
        cmocka_unit_test(slivers_down_to_a_line_touch_what_the_line_touches),
        cmocka_unit_test(a_shell_is_every_cell_that_some_triangle_meets),
        cmocka_unit_test(a_balls_cells_have_the_volume_of_the_ball_and_a_cube),
        cmocka_unit_test(no_flood_by_faces_gets_through_a_shell),
        cmocka_unit_test(a_deep_hole_stays_open_to_its_bottom),
        cmocka_unit_test(the_hole_of_a_torus_stays_open),
        cmocka_unit_test(cavities_stay_open_and_bodies_inside_them_are_filled),
        cmocka_unit_test(components_are_voxelised_each),
        cmocka_unit_test(thin_plates_are_all_shell),
        cmocka_unit_test(a_box_of_whole_cells_is_its_cells),
        cmocka_unit_test(place_and_size_do_not_matter),
        cmocka_unit_test(what_is_too_large_is_refused_with_the_numbers),
        cmocka_unit_test(the_evaluation_meshes_are_tight),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
