// embedded.c: the surface that a lattice carries.
//
// Two vertices go side by side, three numbers and a spare each: what a vertex needs then comes from
// memory as it lies there, whether the two share a cell or not. Tried and lost: lanes across the
// vertices of one cell (few cells hold eight); four side by side (80 ns a vertex instead of 8 with
// AVX2, because gcc 12 shuffles vectors that the machine has not number by number).
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
    // A group of two is read whole.
    PLIANT_TAKE(arena, e->offset, 4 * ((size_t)e->vertex_count + 1));
    PLIANT_TAKE(arena, e->normal, 4 * ((size_t)e->vertex_count + 1));
}

static void place_vertex(const pliant_embedded_def *def, int32_t vertex, int32_t at,
                         pliant_embedded *e)
{
    const float *u = def->tangents + 6 * (size_t)vertex, *v = u + 3;
    const float scale = 1 / def->cell_size / def->cell_size;
    e->vertex[at] = vertex;
    for (int c = 0; c < 3; c++) {
        const int a = (c + 1) % 3, b = (c + 2) % 3;
        e->offset[4 * (size_t)at + c] = def->offset[3 * (size_t)vertex + c];
        e->normal[4 * (size_t)at + c] = scale * (u[a] * v[b] - u[b] * v[a]);
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

typedef float row4 __attribute__((vector_size(16)));
typedef float row8 __attribute__((vector_size(32)));  // two vertices: x, y, z, 0
typedef int32_t bits8 __attribute__((vector_size(32)));
typedef float packed8 __attribute__((vector_size(32), aligned(16), may_alias));

#define INLINE static inline __attribute__((always_inline))

// Of a cell, in its offsets (r, s, t) from its least corner:
//     x = c0 + r c1 + s c2 + r s c3 + t (c4 + r c5 + s c6 + r s c7)
typedef struct cell_polynomial {
    row4 c[8];
} cell_polynomial;

INLINE row4 load_corner(const float *x, int32_t slot)
{
    return (row4){x[slot], x[slot + PLIANT_LANES], x[slot + 2 * PLIANT_LANES], 0};
}

INLINE void find_polynomial(const float *x, const int32_t *slots, cell_polynomial *p)
{
    row4 corner[8];
    for (int k = 0; k < 8; k++) corner[k] = load_corner(x, slots[k]);
    const row4 r = corner[1] - corner[0], r_s = corner[3] - corner[2];
    const row4 r_t = corner[5] - corner[4], r_st = corner[7] - corner[6];
    const row4 s = corner[2] - corner[0], s_t = corner[6] - corner[4];
    p->c[0] = corner[0];
    p->c[1] = r;
    p->c[2] = s;
    p->c[3] = r_s - r;
    p->c[4] = corner[4] - corner[0];
    p->c[5] = r_t - r;
    p->c[6] = s_t - s;
    p->c[7] = (r_st - r_t) - (r_s - r);
}

// Component `c` of each vertex, in all its places.
#define SPREAD(a, c)                                                                               \
    __builtin_shufflevector((a), (a), (c), (c), (c), (c), 4 + (c), 4 + (c), 4 + (c), 4 + (c))
// (y, z, x) of each vertex.
#define TURN(a)    __builtin_shufflevector((a), (a), 1, 2, 0, 3, 5, 6, 4, 7)
#define JOIN(a, b) __builtin_shufflevector((a), (b), 0, 1, 2, 3, 4, 5, 6, 7)

// 1 / sqrt(a), to about two units in the last place: see polar_block.h.
INLINE void find_inverse_root(const row8 *a, row8 *result)
{
    const row8 half = 0.5f * *a;
    row8 y = (row8)(0x5F375A86 - ((bits8)*a >> 1));
    for (int step = 0; step < 3; step++) y *= 1.5f - half * y * y;
    *result = y;
}

INLINE void find_normals(float share, const row8 *normal, const row8 *r, const row8 *s,
                         const row8 *t, row8 *result)
{
    // cof(F) N = N_x F_y x F_z + N_y F_z x F_x + N_z F_x x F_y; a cross product is a x (y, z, x) of
    // b less the opposite, turned once more.
    const row8 r_turned = TURN(*r), s_turned = TURN(*s), t_turned = TURN(*t);
    const row8 sum = SPREAD(*normal, 0) * (*s * t_turned - s_turned * *t) +
                     SPREAD(*normal, 1) * (*t * r_turned - t_turned * *r) +
                     SPREAD(*normal, 2) * (*r * s_turned - r_turned * *s);
    const row8 n = TURN(sum) + share * *normal;
    const row8 square = n * n, turned = TURN(square);
    const row8 length = square + turned + TURN(turned);
    row8 inverse;
    find_inverse_root(&length, &inverse);
    *result = n * inverse;
}

INLINE void store(const row8 *rows, const int32_t *vertices, int32_t count, pliant_vec3 *to)
{
    const float *from = (const float *)rows;
    for (int32_t k = 0; k < count; k++)
        to[vertices[k]] = (pliant_vec3){from[4 * k], from[4 * k + 1], from[4 * k + 2]};
}

// Two vertices from place `at` on, of which `count` are wanted.
INLINE void evaluate_group(const pliant_embedded *e, const row8 c[8], int32_t at, int32_t count,
                           pliant_vec3 *positions, pliant_vec3 *normals)
{
    const row8 offset = *(const packed8 *)(e->offset + 4 * (size_t)at);
    const row8 r = SPREAD(offset, 0), s = SPREAD(offset, 1), t = SPREAD(offset, 2);
    const row8 dr = c[1] + s * c[3] + t * (c[5] + s * c[7]);
    if (positions) {
        const row8 x = c[0] + s * c[2] + t * (c[4] + s * c[6]) + r * dr;
        store(&x, e->vertex + at, count, positions);
    }
    if (normals) {
        const row8 normal = *(const packed8 *)(e->normal + 4 * (size_t)at);
        const row8 ds = c[2] + r * c[3] + t * (c[6] + r * c[7]);
        const row8 dt = c[4] + r * c[5] + s * (c[6] + r * c[7]);
        row8 n;
        find_normals(e->rest_share, &normal, &dr, &ds, &dt, &n);
        store(&n, e->vertex + at, count, normals);
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

// Two vertices lie in one cell or in two, and the next two begin in the last or after it.
INLINE void evaluate(const pliant_embedded *e, const float *x, int32_t first, int32_t last,
                     pliant_vec3 *positions, pliant_vec3 *normals)
{
    cell_polynomial cells[2];
    int32_t cell = find_cell(e, first);
    find_polynomial(x, e->corner_slot + 8 * (size_t)cell, &cells[cell % 2]);
    for (int32_t at = first; at < last; at += 2) {
        const int32_t count = last - at < 2 ? 1 : 2;
        const cell_polynomial *of[2];
        row8 c[8];
        for (int32_t k = 0; k < 2; k++) {
            if (k < count && at + k >= e->first_vertex[cell + 1]) {
                cell++;
                find_polynomial(x, e->corner_slot + 8 * (size_t)cell, &cells[cell % 2]);
            }
            of[k] = &cells[cell % 2];
        }
        for (int j = 0; j < 8; j++) c[j] = JOIN(of[0]->c[j], of[1]->c[j]);
        evaluate_group(e, c, at, count, positions, normals);
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
