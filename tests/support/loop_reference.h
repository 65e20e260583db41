// loop_reference.h: Loop subdivision the slow and plain way, for tests of the fast ones.
#pragma once

#include "check.h"
#include "pliant/hierarchy.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// Neighbours of a vertex on a level, in no order: everybody who shares a triangle.
static inline int32_t slow_neighbours(const pliant_hierarchy *h, int32_t level, int32_t vertex,
                                      int32_t *neighbours, int32_t capacity)
{
    int32_t count = 0;
    for (int32_t f = 0; f < h->face_count[level]; f++) {
        const int32_t *c = h->faces[level] + 3 * (size_t)f;
        for (int k = 0; k < 3; k++) {
            // The corner after the vertex: each neighbour comes after it in one triangle.
            if (c[k] != vertex) continue;
            assert_true(count < capacity);
            neighbours[count++] = c[(k + 1) % 3];
        }
    }
    return count;
}

// One step: positions x of `level`, [..][3], to new ones of level + 1; to be freed.
static inline double *slow_loop_step(const pliant_hierarchy *h, int32_t level, const double *x)
{
    const int32_t even = h->vertex_count[level], all = h->vertex_count[level + 1];
    double *y = calloc(3 * (size_t)all, sizeof *y);
    assert_non_null(y);
    for (int32_t v = 0; v < even; v++) {
        int32_t ring[64];
        const int32_t n = slow_neighbours(h, level, v, ring, 64);
        const double c = 3.0 / 8 + 0.25 * cos(2 * acos(-1.0) / n), beta = (0.625 - c * c) / n;
        for (int d = 0; d < 3; d++) {
            y[3 * v + d] = (1 - n * beta) * x[3 * v + d];
            for (int32_t i = 0; i < n; i++) y[3 * v + d] += beta * x[3 * ring[i] + d];
        }
    }
    for (int32_t v = even; v < all; v++) {
        const pliant_stencil *s = h->stencils + (v - h->vertex_count[0]);
        for (int d = 0; d < 3; d++)
            y[3 * v + d] = 0.375 * (x[3 * s->parents[0] + d] + x[3 * s->parents[1] + d]) +
                           0.125 * (x[3 * s->opposite[0] + d] + x[3 * s->opposite[1] + d]);
    }
    return y;
}

// `x` of level `from` refined up to level `to`; to be freed.
static inline double *slow_loop(const pliant_hierarchy *h, int32_t from, int32_t to,
                                const double *x)
{
    const size_t bytes = 3 * (size_t)h->vertex_count[from] * sizeof *x;
    double *y = malloc(bytes);
    assert_non_null(y);
    memcpy(y, x, bytes);
    for (int32_t level = from; level < to; level++) {
        double *next = slow_loop_step(h, level, y);
        free(y);
        y = next;
    }
    return y;
}
