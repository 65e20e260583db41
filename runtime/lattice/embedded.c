// embedded.c: the surface that a lattice carries.
//
// Eight vertices of one cell go side by side, or as many as it has, straight from the corners'
// coordinates. Tried and lost (bench_embedded): three numbers and a spare of two vertices side by
// side, whether they share a cell or not, and eight vertices of any cells by transposed corners:
// both a third faster with 1.5 vertices a cell, and a third slower from 4 on.
#include "lattice/embedded.h"

#include "lattice/lattice.h"
#include "pliant/error.h"
#include "pliant/vector_clones.h"

#include <stdlib.h>
#include <string.h>

// Where cof(F) N is nothing, this much of N stands alone; elsewhere it is far below round-off.
static const float rest_share = 1e-15f;

// ---- Life ----

static void lay_out(pliant_arena *arena, pliant_embedded *e)
{
    PLIANT_TAKE(arena, e->corner_slot, 8 * (size_t)e->cell_count);
    PLIANT_TAKE(arena, e->first_vertex, e->cell_count + 1);
    PLIANT_TAKE(arena, e->vertex, e->vertex_count);
    // Eight are read at once.
    for (int c = 0; c < 3; c++) {
        PLIANT_TAKE(arena, e->offset[c], (size_t)e->vertex_count + 7);
        PLIANT_TAKE(arena, e->normal[c], (size_t)e->vertex_count + 7);
    }
}

static void place_vertex(const pliant_embedded_def *def, int32_t vertex, int32_t at,
                         pliant_embedded *e)
{
    const float *u = def->tangents + 6 * (size_t)vertex, *v = u + 3;
    const float scale = 1 / def->cell_size / def->cell_size;
    e->vertex[at] = vertex;
    for (int c = 0; c < 3; c++) {
        const int a = (c + 1) % 3, b = (c + 2) % 3;
        e->offset[c][at] = def->offset[3 * (size_t)vertex + c];
        e->normal[c][at] = scale * (u[a] * v[b] - u[b] * v[a]);
    }
}

// `next` has shape [def->cell_count + 1]: vertices counted by cell, then the place of the next.
static void sort_vertices(const pliant_embedded_def *def, int32_t *next, pliant_embedded *e)
{
    int32_t used = 0, first = 0;
    for (int32_t c = 0; c < def->cell_count; c++) {
        const int32_t count = next[c];
        next[c] = first;
        if (count == 0) continue;
        memcpy(e->corner_slot + 8 * (size_t)used, def->corner_slots + 8 * (size_t)c,
               8 * sizeof *e->corner_slot);
        e->first_vertex[used++] = first;
        first += count;
    }
    e->first_vertex[used] = first;
    for (int32_t v = 0; v < def->vertex_count; v++) place_vertex(def, v, next[def->cell[v]]++, e);
}

pliant_status pliant_embedded_create(const pliant_embedded_def *def, pliant_embedded **result,
                                     pliant_error *err)
{
    pliant_status status = PLIANT_ERR_MEMORY;
    pliant_embedded *e = calloc(1, sizeof *e);
    int32_t *counts = calloc((size_t)def->cell_count + 1, sizeof *counts);
    if (!e || !counts) goto done;
    e->vertex_count = def->vertex_count;
    e->rest_share = rest_share * def->cell_size * def->cell_size;  // normals are divided by it
    for (int32_t v = 0; v < def->vertex_count; v++) e->cell_count += counts[def->cell[v]]++ == 0;
    lay_out(&e->arena, e);
    status = pliant_arena_reserve(&e->arena, NULL);
    if (status < 0) goto done;
    lay_out(&e->arena, e);
    sort_vertices(def, counts, e);
done:
    free(counts);
    if (status < 0) {
        pliant_embedded_destroy(e);
        return pliant_error_set(err, status, "lattice: no memory for a surface of %d vertices",
                                (int)def->vertex_count);
    }
    *result = e;
    return PLIANT_OK;
}

void pliant_embedded_destroy(pliant_embedded *embedded)
{
    if (!embedded) return;
    pliant_arena_release(&embedded->arena);
    free(embedded);
}

// ---- Evaluation ----

typedef float row8 __attribute__((vector_size(32)));
typedef int32_t bits8 __attribute__((vector_size(32)));
typedef float packed8 __attribute__((vector_size(32), aligned(4), may_alias));

#define INLINE static inline __attribute__((always_inline))

// 1 / sqrt(a), to about two units in the last place: see polar_block.h.
INLINE void find_inverse_root(const row8 *a, row8 *result)
{
    const row8 half = 0.5f * *a;
    row8 y = (row8)(0x5F375A86 - ((bits8)*a >> 1));
    for (int step = 0; step < 3; step++) y *= 1.5f - half * y * y;
    *result = y;
}

// cof(F) N = N_x F_y x F_z + N_y F_z x F_x + N_z F_x x F_y, of length 1.
INLINE void find_normals(float share, const row8 normal[3], const row8 r[3], const row8 s[3],
                         const row8 t[3], row8 n[3])
{
    row8 length = {0}, inverse;
    for (int c = 0; c < 3; c++) {
        const int a = (c + 1) % 3, b = (c + 2) % 3;
        const row8 sum = normal[0] * (s[a] * t[b] - s[b] * t[a]) +
                         normal[1] * (t[a] * r[b] - t[b] * r[a]) +
                         normal[2] * (r[a] * s[b] - r[b] * s[a]);
        n[c] = sum + share * normal[c];  // last: large terms that cancel would swallow it
        length += n[c] * n[c];
    }
    find_inverse_root(&length, &inverse);
    for (int c = 0; c < 3; c++) n[c] *= inverse;
}

INLINE void store(const row8 rows[3], const int32_t *vertices, int32_t count, pliant_vec3 *to)
{
    float numbers[3][8];
    memcpy(numbers, rows, sizeof numbers);
    // Unrolled, gcc 12 would shuffle the numbers out of registers one by one.
#pragma GCC unroll 1
    for (int32_t k = 0; k < count; k++)
        to[vertices[k]] = (pliant_vec3){numbers[0][k], numbers[1][k], numbers[2][k]};
}

// One coordinate of eight vertices at offsets (r, s, t) of a cell, and its slopes along them, from
// the cell's corners.
INLINE void interpolate(const float *x, const int32_t slots[8], const row8 *r, const row8 *s,
                        const row8 *t, row8 *at, row8 *dr, row8 *ds, row8 *dt)
{
    row8 low[4], slope[4];  // the edges along r, by s and t
    for (int k = 0; k < 4; k++) {
        const row8 from = x[slots[2 * k]] - (row8){0}, to = x[slots[2 * k + 1]] - (row8){0};
        slope[k] = to - from;
        low[k] = from + *r * slope[k];
    }
    const row8 across[2] = {low[1] - low[0], low[3] - low[2]};
    const row8 near = low[0] + *s * across[0], far = low[2] + *s * across[1];
    const row8 slope_near = slope[0] + *s * (slope[1] - slope[0]);
    const row8 slope_far = slope[2] + *s * (slope[3] - slope[2]);
    *dt = far - near;
    *at = near + *t * *dt;
    *ds = across[0] + *t * (across[1] - across[0]);
    *dr = slope_near + *t * (slope_far - slope_near);
}

// Eight vertices of a cell from place `at` on, of which `count` are wanted.
INLINE void evaluate_group(const pliant_embedded *e, const float *x, const int32_t *slots,
                           int32_t at, int32_t count, pliant_vec3 *positions, pliant_vec3 *normals)
{
    const row8 r = *(const packed8 *)(e->offset[0] + at);
    const row8 s = *(const packed8 *)(e->offset[1] + at);
    const row8 t = *(const packed8 *)(e->offset[2] + at);
    row8 place[3], dr[3], ds[3], dt[3], normal[3], n[3];
    for (int c = 0; c < 3; c++)
        interpolate(x + PLIANT_LANES * c, slots, &r, &s, &t, &place[c], &dr[c], &ds[c], &dt[c]);
    if (positions) store(place, e->vertex + at, count, positions);
    if (normals) {
        for (int c = 0; c < 3; c++) normal[c] = *(const packed8 *)(e->normal[c] + at);
        find_normals(e->rest_share, normal, dr, ds, dt, n);
        store(n, e->vertex + at, count, normals);
    }
}

INLINE int32_t find_cell(const pliant_embedded *e, int32_t place)
{
    int32_t low = 0, high = e->cell_count;
    while (high - low > 1) {
        const int32_t middle = low + (high - low) / 2;
        if (e->first_vertex[middle] <= place) low = middle;
        else high = middle;
    }
    return low;
}

INLINE void evaluate(const pliant_embedded *e, const float *x, int32_t first, int32_t last,
                     pliant_vec3 *positions, pliant_vec3 *normals)
{
    int32_t cell = find_cell(e, first);
    for (int32_t at = first; at < last;) {
        const int32_t cell_end = e->first_vertex[cell + 1], end = cell_end < last ? cell_end : last;
        const int32_t count = end - at < 8 ? end - at : 8;
        evaluate_group(e, x, e->corner_slot + 8 * (size_t)cell, at, count, positions, normals);
        at += count;
        cell += at == cell_end;
    }
}

PLIANT_VECTOR_CLONES
static void evaluate_positions(const pliant_embedded *e, const float *x, int32_t first,
                               int32_t last, pliant_vec3 *positions)
{
    evaluate(e, x, first, last, positions, NULL);
}

PLIANT_VECTOR_CLONES
static void evaluate_normals(const pliant_embedded *e, const float *x, int32_t first, int32_t last,
                             pliant_vec3 *normals)
{
    evaluate(e, x, first, last, NULL, normals);
}

PLIANT_VECTOR_CLONES
static void evaluate_both(const pliant_embedded *e, const float *x, int32_t first, int32_t last,
                          pliant_vec3 *positions, pliant_vec3 *normals)
{
    evaluate(e, x, first, last, positions, normals);
}

void pliant_embedded_evaluate(const pliant_embedded *e, const float *x, int32_t first, int32_t last,
                              pliant_vec3 *positions, pliant_vec3 *normals)
{
    if (first >= last) return;
    if (positions && normals) evaluate_both(e, x, first, last, positions, normals);
    else if (positions) evaluate_positions(e, x, first, last, positions);
    else if (normals) evaluate_normals(e, x, first, last, normals);
}
