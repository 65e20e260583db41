// polygon.c: split a polygon of mesh vertices into triangles.
//
// This follows: G. H. Meisters, Polygons have ears, American Mathematical Monthly 82(6), 1975. Ours
// clips the best-shaped ear first, and takes an ear only when no other corner stands in the closed
// triangle: then a corner in the middle of a straight side never ends in a triangle of no area.
#include "polygon.h"

#include "pliant/error.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>

enum {
    // How often all corners are looked at again because no ear is known, so that time stays
    // quadratic.
    // Stars, combs and spirals of up to 16384 corners never needed it.
    SEARCH_LIMIT = 50,
};
// Twice a triangle's area, in polygons scaled to extent 1: what rounding leaves of a straight
// angle.
#define FLAT_AREA (64 * DBL_EPSILON)

typedef struct corner {
    double x, y; // in the plane of the polygon, extent 1
    int32_t previous, next;
    int32_t number; // the mesh vertex
    int32_t slot;   // in dents, or -1
    double shape;   // of the triangle previous, this, next: 2 area / longest side^2, below 0 reflex
} corner;

typedef struct polygon {
    corner *ring;   // shape [count]
    double *ears;   // shape [count]: the shape of a corner that is an ear, else 0
    int32_t *dents; // the corners that are not convex
    int32_t count, dent_count;
} polygon;

static void cross(const double *a, const double *b, double *c)
{
    c[0] = a[1] * b[2] - a[2] * b[1];
    c[1] = a[2] * b[0] - a[0] * b[2];
    c[2] = a[0] * b[1] - a[1] * b[0];
}

static double dot(const double *a, const double *b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

// Twice the area along the unit normal over the longest side squared.
static double triangle_shape(double p[4][3], int a, int b, int c, const double *normal)
{
    double e[3][3], n[3];
    for (int k = 0; k < 3; k++) {
        e[0][k] = p[b][k] - p[a][k];
        e[1][k] = p[c][k] - p[b][k];
        e[2][k] = p[a][k] - p[c][k];
    }
    cross(e[0], e[1], n);
    const double longest = fmax(dot(e[0], e[0]), fmax(dot(e[1], e[1]), dot(e[2], e[2])));
    return longest > 0 ? dot(n, normal) / longest : 0;
}

static void split_quad(const double *vertices, const int32_t *corners, int32_t *triangles)
{
    // Scaled to extent 1 about the first corner, so that no square overflows.
    double p[4][3], extent = 0;
    for (int k = 0; k < 4; k++)
        for (int c = 0; c < 3; c++) {
            p[k][c] = vertices[3 * (size_t)corners[k] + c] - vertices[3 * (size_t)corners[0] + c];
            extent = fmax(extent, fabs(p[k][c]));
        }
    for (int k = 0; k < 4; k++)
        for (int c = 0; c < 3; c++) p[k][c] = extent > 0 ? p[k][c] / extent : 0;
    double across[3], along[3], normal[3];
    for (int c = 0; c < 3; c++) {
        across[c] = p[2][c] - p[0][c];
        along[c] = p[3][c] - p[1][c];
    }
    cross(across, along, normal); // its length does not matter for the comparison
    const double first =
        fmin(triangle_shape(p, 0, 1, 2, normal), triangle_shape(p, 0, 2, 3, normal));
    const double second =
        fmin(triangle_shape(p, 0, 1, 3, normal), triangle_shape(p, 1, 2, 3, normal));
    static const int pattern[2][6] = {{0, 1, 2, 0, 2, 3}, {0, 1, 3, 1, 2, 3}};
    for (int k = 0; k < 6; k++) triangles[k] = corners[pattern[second > first][k]];
}

// Project along the axis that the normal is closest to: coordinates are kept, not mixed, so corners
// on a line stay on a line. Returns 0 when the polygon has no plane.
static int project(const double *vertices, const int32_t *corners, int32_t count, corner *ring)
{
    const double *origin = vertices + 3 * (size_t)corners[0];
    double extent = 0, normal[3] = {0, 0, 0};
    for (int32_t i = 0; i < count; i++)
        for (int c = 0; c < 3; c++)
            extent = fmax(extent, fabs(vertices[3 * (size_t)corners[i] + c] - origin[c]));
    if (!(extent > 0) || !isfinite(extent)) return 0;
    // Newell's normal: the sum of cross products about the origin.
    for (int32_t i = 0; i < count; i++) {
        const double *p = vertices + 3 * (size_t)corners[i];
        const double *q = vertices + 3 * (size_t)corners[i + 1 < count ? i + 1 : 0];
        double a[3], b[3], n[3];
        for (int c = 0; c < 3; c++) {
            a[c] = (p[c] - origin[c]) / extent;
            b[c] = (q[c] - origin[c]) / extent;
        }
        cross(a, b, n);
        for (int c = 0; c < 3; c++) normal[c] += n[c];
    }
    int axis = 0;
    for (int c = 1; c < 3; c++)
        if (fabs(normal[c]) > fabs(normal[axis])) axis = c;
    if (!(fabs(normal[axis]) > FLAT_AREA)) return 0;
    const int forward = normal[axis] > 0;
    const int x = (axis + (forward ? 1 : 2)) % 3, y = (axis + (forward ? 2 : 1)) % 3;
    for (int32_t i = 0; i < count; i++) {
        const double *p = vertices + 3 * (size_t)corners[i];
        ring[i] = (corner){.x = (p[x] - origin[x]) / extent,
                           .y = (p[y] - origin[y]) / extent,
                           .previous = i > 0 ? i - 1 : count - 1,
                           .next = i + 1 < count ? i + 1 : 0,
                           .number = corners[i],
                           .slot = -1};
    }
    return 1;
}

static double area(const corner *a, const corner *b, const corner *c)
{
    return (b->x - a->x) * (c->y - a->y) - (b->y - a->y) * (c->x - a->x);
}

static double squared(const corner *a, const corner *b)
{
    return (a->x - b->x) * (a->x - b->x) + (a->y - b->y) * (a->y - b->y);
}

static int same_place(const corner *a, const corner *b)
{
    return a->x == b->x && a->y == b->y;
}

static void remove_dent(polygon *p, corner *b)
{
    const int32_t moved = p->dents[--p->dent_count];
    p->dents[b->slot] = moved;
    p->ring[moved].slot = b->slot;
    b->slot = -1;
}

// Measure a corner anew and keep the list of dents.
static void measure(polygon *p, int32_t i)
{
    corner *b = p->ring + i;
    const corner *a = p->ring + b->previous, *c = p->ring + b->next;
    const double longest = fmax(squared(a, b), fmax(squared(b, c), squared(c, a)));
    const double twice = area(a, b, c);
    b->shape = longest > 0 && fabs(twice) > FLAT_AREA ? twice / longest : 0;
    if (b->shape > 0 && b->slot >= 0) {
        remove_dent(p, b);
    } else if (!(b->shape > 0) && b->slot < 0) {
        b->slot = p->dent_count;
        p->dents[p->dent_count++] = i;
    }
}

// Of all corners a dent enters a triangle first, so only dents are looked at.
static int is_ear(const polygon *p, int32_t i)
{
    const corner *b = p->ring + i, *a = p->ring + b->previous, *c = p->ring + b->next;
    if (!(b->shape > 0)) return 0;
    for (int32_t k = 0; k < p->dent_count; k++) {
        const corner *d = p->ring + p->dents[k];
        if (area(a, b, d) >= -FLAT_AREA && area(b, c, d) >= -FLAT_AREA &&
            area(c, a, d) >= -FLAT_AREA && !same_place(d, a) && !same_place(d, b) &&
            !same_place(d, c))
            return 0;
    }
    return 1;
}

static void look_for_ear(polygon *p, int32_t i)
{
    p->ears[i] = is_ear(p, i) ? p->ring[i].shape : 0;
}

static int32_t best_ear(const polygon *p)
{
    int32_t best = -1;
    double shape = 0;
    for (int32_t i = 0; i < p->count; i++)
        if (p->ears[i] > shape) {
            shape = p->ears[i];
            best = i;
        }
    return best;
}

// Clipping a corner can free an ear elsewhere, and what crosses itself may have none: then look at
// all that are left, from `at` on, and take the widest angle if there is none.
static int32_t search_again(polygon *p, int32_t at, int32_t left, int *searches)
{
    int32_t widest = at;
    for (int32_t k = 0, i = at; k < left; k++, i = p->ring[i].next) {
        if (*searches < SEARCH_LIMIT) look_for_ear(p, i);
        if (p->ring[i].shape > p->ring[widest].shape) widest = i;
    }
    ++*searches;
    const int32_t best = best_ear(p);
    return best < 0 ? widest : best;
}

static void clip_ears(polygon *p, int32_t *triangles)
{
    for (int32_t i = 0; i < p->count; i++) measure(p, i);
    for (int32_t i = 0; i < p->count; i++) look_for_ear(p, i);
    int32_t at = 0;
    int searches = 0;
    for (int32_t left = p->count; left > 3; left--) {
        int32_t clipped = best_ear(p);
        if (clipped < 0) clipped = search_again(p, at, left, &searches);
        corner *b = p->ring + clipped;
        const int32_t a = b->previous, c = b->next;
        *triangles++ = p->ring[a].number;
        *triangles++ = b->number;
        *triangles++ = p->ring[c].number;
        p->ears[clipped] = 0;
        if (b->slot >= 0) remove_dent(p, b); // only where the polygon crosses itself
        p->ring[a].next = c;
        p->ring[c].previous = a;
        measure(p, a);
        measure(p, c);
        look_for_ear(p, a);
        look_for_ear(p, c);
        at = c;
    }
    for (int k = 0; k < 3; k++, at = p->ring[at].next) *triangles++ = p->ring[at].number;
}

pliant_status pliant_polygon_split(const double *vertices, const int32_t *corners, int32_t count,
                                   int32_t *triangles, pliant_error *err)
{
    if (count == 3) {
        for (int k = 0; k < 3; k++) triangles[k] = corners[k];
        return PLIANT_OK;
    }
    if (count == 4) {
        split_quad(vertices, corners, triangles);
        return PLIANT_OK;
    }
    polygon p = {.count = count};
    p.ring = malloc((size_t)count * (sizeof *p.ring + sizeof *p.ears + sizeof *p.dents));
    if (!p.ring)
        return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for a polygon of %d corners",
                                count);
    p.ears = (double *)(p.ring + count);
    p.dents = (int32_t *)(p.ears + count);
    if (project(vertices, corners, count, p.ring)) {
        clip_ears(&p, triangles);
    } else {
        for (int32_t i = 0; i + 2 < count; i++) {
            triangles[3 * (size_t)i] = corners[0];
            triangles[3 * (size_t)i + 1] = corners[i + 1];
            triangles[3 * (size_t)i + 2] = corners[i + 2];
        }
    }
    free(p.ring);
    return PLIANT_OK;
}
