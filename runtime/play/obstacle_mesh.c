// obstacle_mesh.c: a scene's obstacles as triangles, to be looked at.
#include "obstacle_mesh.h"

#include "pliant/error.h"

#include <math.h>
#include <stdlib.h>

enum {
    AROUND = 32,  // points around a sphere or capsule
    CAP = 8,      // rings from a pole to the equator
    SQUARE = 16,  // squares along a plane's side: lights fall off over a vertex, not over it all
};

// ---- Vectors ----

static void rotate(const float q[4], const double x[3], double turned[3])
{
    const double v[3] = {(double)q[0], (double)q[1], (double)q[2]}, w = (double)q[3];
    const double t[3] = {2 * (v[1] * x[2] - v[2] * x[1]), 2 * (v[2] * x[0] - v[0] * x[2]),
                         2 * (v[0] * x[1] - v[1] * x[0])};
    turned[0] = x[0] + w * t[0] + v[1] * t[2] - v[2] * t[1];
    turned[1] = x[1] + w * t[1] + v[2] * t[0] - v[0] * t[2];
    turned[2] = x[2] + w * t[2] + v[0] * t[1] - v[1] * t[0];
}

// Unit vectors across, also unit, and each other.
static void find_across(const double along[3], double first[3], double second[3])
{
    const int axis = fabs(along[0]) < 0.6 ? 0 : 1;
    double length = 0;
    for (int c = 0; c < 3; c++) first[c] = (c == axis) - along[axis] * along[c];
    for (int c = 0; c < 3; c++) length += first[c] * first[c];
    for (int c = 0; c < 3; c++) first[c] /= sqrt(length);
    for (int c = 0; c < 3; c++) {
        const int i = (c + 1) % 3, k = (c + 2) % 3;
        second[c] = along[i] * first[k] - along[k] * first[i];
    }
}

// ---- Growing ----

static int reserve(pliant_obstacle_mesh *mesh, int32_t vertices, int32_t faces)
{
    if (mesh->vertex_count + vertices > mesh->vertex_capacity) {
        const int32_t capacity = 2 * (mesh->vertex_count + vertices);
        double *positions = realloc(mesh->positions, 3 * (size_t)capacity * sizeof *positions);
        if (!positions) return 0;
        mesh->positions = positions;
        mesh->vertex_capacity = capacity;
    }
    if (mesh->face_count + faces > mesh->face_capacity) {
        const int32_t capacity = 2 * (mesh->face_count + faces);
        int32_t *grown = realloc(mesh->faces, 3 * (size_t)capacity * sizeof *grown);
        if (!grown) return 0;
        mesh->faces = grown;
        mesh->face_capacity = capacity;
    }
    return 1;
}

static void put_vertex(pliant_obstacle_mesh *mesh, double x, double y, double z)
{
    double *p = mesh->positions + 3 * (size_t)mesh->vertex_count++;
    p[0] = x;
    p[1] = y;
    p[2] = z;
}

static void put_face(pliant_obstacle_mesh *mesh, int32_t a, int32_t b, int32_t c)
{
    int32_t *f = mesh->faces + 3 * (size_t)mesh->face_count++;
    f[0] = a;
    f[1] = b;
    f[2] = c;
}

// A grid of vertices that begins at `first`, `width` to a row, two faces a square.
static void put_grid(pliant_obstacle_mesh *mesh, int32_t first, int32_t rows, int32_t width)
{
    for (int32_t j = 0; j + 1 < rows; j++)
        for (int32_t i = 0; i + 1 < width; i++) {
            const int32_t v = first + j * width + i;
            put_face(mesh, v, v + 1, v + width);
            put_face(mesh, v + 1, v + width + 1, v + width);
        }
}

// ---- Shapes ----

static int put_plane(pliant_obstacle_mesh *mesh, const pliant_obstacle *o, const double *low,
                     const double *high)
{
    const double b[3] = {(double)o->b.x, (double)o->b.y, (double)o->b.z};
    const double a[3] = {(double)o->a.x, (double)o->a.y, (double)o->a.z};
    double n[3], u[3], v[3], length = 0, height = 0, reach = 0;
    if (!reserve(mesh, (SQUARE + 1) * (SQUARE + 1), 2 * SQUARE * SQUARE)) return 0;
    rotate(o->rotation, b, n);
    for (int c = 0; c < 3; c++) length += n[c] * n[c];
    for (int c = 0; c < 3; c++) {
        n[c] /= sqrt(length);
        height += n[c] * ((low[c] + high[c]) / 2 - a[c]);
        reach += (high[c] - low[c]) * (high[c] - low[c]) / 4;
    }
    reach = sqrt(reach);
    find_across(n, u, v);
    const int32_t first = mesh->vertex_count;
    for (int j = 0; j <= SQUARE; j++)
        for (int i = 0; i <= SQUARE; i++) {
            const double s = (2.0 * i / SQUARE - 1) * reach, t = (2.0 * j / SQUARE - 1) * reach;
            double p[3];
            for (int c = 0; c < 3; c++)
                p[c] = (low[c] + high[c]) / 2 - height * n[c] + s * u[c] + t * v[c];
            put_vertex(mesh, p[0], p[1], p[2]);
        }
    put_grid(mesh, first, SQUARE + 1, SQUARE + 1);
    return 1;
}

static int put_box(pliant_obstacle_mesh *mesh, const pliant_obstacle *o)
{
    const double half[3] = {(double)o->b.x, (double)o->b.y, (double)o->b.z};
    if (!reserve(mesh, 24, 12)) return 0;
    for (int side = 0; side < 6; side++) {
        const int axis = side / 2, i = (axis + 1) % 3, k = (axis + 2) % 3;
        const double sign = side % 2 ? 1 : -1;
        const int32_t first = mesh->vertex_count;
        for (int corner = 0; corner < 4; corner++) {
            // Counterclockwise from outside: the other way round on the lower side.
            const double s = corner == 1 || corner == 2 ? 1 : -1, t = corner >= 2 ? 1 : -1;
            double x[3], p[3];
            x[axis] = sign * half[axis];
            x[i] = s * sign * half[i];
            x[k] = t * half[k];
            rotate(o->rotation, x, p);
            put_vertex(mesh, p[0] + (double)o->a.x, p[1] + (double)o->a.y, p[2] + (double)o->a.z);
        }
        put_face(mesh, first, first + 1, first + 2);
        put_face(mesh, first, first + 2, first + 3);
    }
    return 1;
}

// The hull of two balls; a ball alone when one is inside the other.
static int put_capsule(pliant_obstacle_mesh *mesh, const pliant_obstacle *o)
{
    double a[3] = {(double)o->a.x, (double)o->a.y, (double)o->a.z}, along[3] = {0, 0, 1};
    double radius[2] = {(double)o->radius, (double)o->radius}, length = 0;
    if (!reserve(mesh, (2 * CAP + 2) * (AROUND + 1), 2 * (2 * CAP + 1) * AROUND)) return 0;
    if (o->kind == PLIANT_OBSTACLE_CAPSULE) {
        const double apart[3] = {(double)o->b.x - a[0], (double)o->b.y - a[1],
                                 (double)o->b.z - a[2]};
        double d[3];
        rotate(o->rotation, apart, d);
        radius[1] = (double)o->radius_b;
        length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
        if (length > fabs(radius[0] - radius[1])) {
            for (int c = 0; c < 3; c++) along[c] = d[c] / length;
        } else {
            if (radius[1] > radius[0])
                for (int c = 0; c < 3; c++) a[c] += d[c];
            radius[0] = radius[1] = fmax(radius[0], radius[1]);
            length = 0;
        }
    }
    double u[3], v[3];
    find_across(along, u, v);
    // The cone touches both balls at this latitude.
    const double right = acos(-1.0) / 2;
    const double seam = length > 0 ? asin((radius[0] - radius[1]) / length) : 0;
    const int32_t first = mesh->vertex_count;
    for (int j = 0; j < 2 * CAP + 2; j++) {
        const int end = j > CAP;
        const double part = (double)(end ? j - CAP - 1 : j) / CAP;
        const double latitude = end ? seam + part * (right - seam) : -right + part * (seam + right);
        const double s = end * length + radius[end] * sin(latitude);
        const double r = radius[end] * cos(latitude);
        for (int i = 0; i <= AROUND; i++) {
            const double angle = 4 * right * i / AROUND, x = r * cos(angle), y = r * sin(angle);
            double p[3];
            for (int c = 0; c < 3; c++) p[c] = a[c] + s * along[c] + x * u[c] + y * v[c];
            put_vertex(mesh, p[0], p[1], p[2]);
        }
    }
    put_grid(mesh, first, 2 * CAP + 2, AROUND + 1);
    return 1;
}

pliant_status pliant_obstacle_mesh_make(pliant_obstacle_mesh *mesh,
                                        const pliant_obstacle *obstacles, int32_t count,
                                        const double *low, const double *high, pliant_error *err)
{
    mesh->vertex_count = mesh->face_count = 0;
    int is_done = 1;
    for (int32_t i = 0; is_done && i < count; i++) {
        const pliant_obstacle *o = &obstacles[i];
        if (o->kind == PLIANT_OBSTACLE_PLANE) is_done = put_plane(mesh, o, low, high);
        else if (o->kind == PLIANT_OBSTACLE_BOX) is_done = put_box(mesh, o);
        else if (o->kind != PLIANT_OBSTACLE_NONE) is_done = put_capsule(mesh, o);
    }
    if (!is_done)
        return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for %d obstacles", (int)count);
    return PLIANT_OK;
}

void pliant_obstacle_mesh_clear(pliant_obstacle_mesh *mesh)
{
    free(mesh->positions);
    free(mesh->faces);
    *mesh = (pliant_obstacle_mesh){0};
}
