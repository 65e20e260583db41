// detail_surface.c: evaluate a detail: positions and normals of all its vertices, or of chosen
// ones.
#include "detail.h"

#include "pliant/vector_clones.h"

#include <math.h>
#include <string.h>

// ---- Vectors ----

static inline pliant_vec3 plus(pliant_vec3 a, pliant_vec3 b)
{
    return (pliant_vec3){a.x + b.x, a.y + b.y, a.z + b.z};
}

static inline float dot(pliant_vec3 a, pliant_vec3 b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

static inline pliant_vec3 cross(pliant_vec3 a, pliant_vec3 b)
{
    return (pliant_vec3){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

// scale (a - b)
static inline pliant_vec3 between(pliant_vec3 a, pliant_vec3 b, float scale)
{
    return (pliant_vec3){(a.x - b.x) * scale, (a.y - b.y) * scale, (a.z - b.z) * scale};
}

// A unit vector, or zero of zero.
static inline pliant_vec3 unit(pliant_vec3 n)
{
    const float square = dot(n, n), scale = square > 0 ? 1 / sqrtf(square) : 0;
    return (pliant_vec3){n.x * scale, n.y * scale, n.z * scale};
}

// The normal of the triangle at c, a, b, twice its area long, lengths in typical edges.
static inline pliant_vec3 normal_of(pliant_vec3 c, pliant_vec3 a, pliant_vec3 b, float scale)
{
    return cross(between(a, c, scale), between(b, c, scale));
}

// ---- Positions ----

// Points that are evaluated together, in one array for each number, so that frames vectorise: on
// whole groups, in which the last point is repeated.
enum { BLOCK = 32, GROUP = 16 };
typedef struct block {
    int32_t vertex[BLOCK];
    float point[3][BLOCK], along[3][BLOCK], across[3][BLOCK], offset[3][BLOCK];
} block;

typedef float lanes __attribute__((vector_size(16), aligned(4)));

static lanes load(const float *x)
{
    return *(const lanes *)x;
}

// The limit surface at the block's vertices: three sums of weights (position, along, across, one
// that is not wanted) times a component of u.
PLIANT_VECTOR_CLONES
static void gather(const pliant_detail *d, const pliant_vec3 *u, int32_t count, block *b)
{
    for (int32_t i = 0; i < count; i++) {
        const size_t v = (size_t)b->vertex[i];
        const float *rest = d->rest + 12 * v;
        lanes x = load(rest), y = load(rest + 4), z = load(rest + 8);
        b->offset[0][i] = rest[3];
        b->offset[1][i] = rest[7];
        b->offset[2][i] = rest[11];
        const size_t end = u ? d->offset[v + 1] : d->offset[v];
        for (size_t e = d->offset[v]; e < end; e++) {
            const lanes weight = load(d->weight + 3 * e);
            const pliant_vec3 *from = u + d->column[e];
            x += weight * from->x;
            y += weight * from->y;
            z += weight * from->z;
        }
        const lanes *const sums[3] = {&x, &y, &z};
        for (int c = 0; c < 3; c++) {
            b->point[c][i] = (*sums[c])[0];
            b->along[c][i] = (*sums[c])[1];
            b->across[c][i] = (*sums[c])[2];
        }
    }
}

// Do two tangents have a normal n = t x b that floats can tell? Lengths are relative to those at
// rest. Shrunk to 1e-4 of these, or 1e-5 apart, tangents are not far above the rounding of x + u;
// beyond 1e9, products of squares overflow.
static inline int has_normal(float tt, float bb, float nn)
{
    return nn > 1e-10f * tt * bb && tt > 1e-8f && bb > 1e-8f && tt < 1e18f && bb < 1e18f;
}

// result = point + frame times offset. Returns 0 when some vertex has no frame.
PLIANT_VECTOR_CLONES
static int displace(const block *b, int32_t count, float (*restrict result)[BLOCK])
{
    int bad = 0;
    for (int32_t i = 0; i < count; i++) {
        const float tx = b->along[0][i], ty = b->along[1][i], tz = b->along[2][i];
        const float bx = b->across[0][i], by = b->across[1][i], bz = b->across[2][i];
        const float nx = ty * bz - tz * by, ny = tz * bx - tx * bz, nz = tx * by - ty * bx;
        const float tt = tx * tx + ty * ty + tz * tz, bb = bx * bx + by * by + bz * bz;
        const float nn = nx * nx + ny * ny + nz * nz;
        bad |= !has_normal(tt, bb, nn);
        const float along = 1 / sqrtf(tt), normal = 1 / sqrtf(nn);
        const float ex = tx * along, ey = ty * along, ez = tz * along;
        const float fx = nx * normal, fy = ny * normal, fz = nz * normal;
        const float gx = fy * ez - fz * ey, gy = fz * ex - fx * ez, gz = fx * ey - fy * ex;
        const float o0 = b->offset[0][i], o1 = b->offset[1][i], o2 = b->offset[2][i];
        result[0][i] = b->point[0][i] + o0 * ex + o1 * gx + o2 * fx;
        result[1][i] = b->point[1][i] + o0 * ey + o1 * gy + o2 * fy;
        result[2][i] = b->point[2][i] + o0 * ez + o1 * gz + o2 * fz;
    }
    return !bad;
}

// Where the deformed surface has no normal the frame at rest stands in.
static void repair(const pliant_detail *d, int32_t count, block *b)
{
    for (int32_t i = 0; i < count; i++) {
        const float *rest = d->rest + 12 * (size_t)b->vertex[i];
        const pliant_vec3 t = {b->along[0][i], b->along[1][i], b->along[2][i]};
        const pliant_vec3 s = {b->across[0][i], b->across[1][i], b->across[2][i]};
        const pliant_vec3 n = cross(t, s);
        if (has_normal(dot(t, t), dot(s, s), dot(n, n))) continue;
        for (int c = 0; c < 3; c++) {
            b->along[c][i] = rest[4 * c + 1];
            b->across[c][i] = rest[4 * c + 2];
        }
    }
}

// The block's detailed positions; PLIANT_ROUGH when some had to do with the frame at rest. Places
// from `count` on repeat the last vertex.
static pliant_status place(const pliant_detail *d, const pliant_vec3 *u, int32_t count, block *b,
                           float (*result)[BLOCK])
{
    const int32_t padded = (count + GROUP - 1) / GROUP * GROUP;
    gather(d, u, count, b);
    for (int32_t i = count; i < padded; i++) {
        b->vertex[i] = b->vertex[count - 1];
        for (int c = 0; c < 3; c++) {
            b->point[c][i] = b->point[c][count - 1];
            b->along[c][i] = b->along[c][count - 1];
            b->across[c][i] = b->across[c][count - 1];
            b->offset[c][i] = b->offset[c][count - 1];
        }
    }
    if (displace(b, padded, result)) return PLIANT_OK;
    repair(d, padded, b);
    (void)displace(b, padded, result);
    return PLIANT_ROUGH;
}

static void store(float (*result)[BLOCK], int32_t count, pliant_vec3 *positions)
{
    for (int32_t i = 0; i < count; i++)
        positions[i] = (pliant_vec3){result[0][i], result[1][i], result[2][i]};
}

// ---- Normals ----

// The four children of a face share six vertices, so they are visited together.
PLIANT_VECTOR_CLONES
static void add_normals(const pliant_detail *d, const pliant_vec3 *positions, pliant_vec3 *normals)
{
    const float scale = d->inverse_length;
    for (int32_t f = 0; f < d->info.face_count; f += 4) {
        const int32_t *child = d->faces + 3 * (size_t)f;
        const int32_t c0 = child[0], c1 = child[3], c2 = child[6];
        const int32_t m0 = child[9], m1 = child[10], m2 = child[11];
        const pliant_vec3 x0 = positions[m0], x1 = positions[m1], x2 = positions[m2];
        const pliant_vec3 n0 = normal_of(positions[c0], x0, x2, scale);
        const pliant_vec3 n1 = normal_of(positions[c1], x1, x0, scale);
        const pliant_vec3 n2 = normal_of(positions[c2], x2, x1, scale);
        const pliant_vec3 n3 = normal_of(x0, x1, x2, scale);
        normals[c0] = plus(normals[c0], n0);
        normals[c1] = plus(normals[c1], n1);
        normals[c2] = plus(normals[c2], n2);
        normals[m0] = plus(normals[m0], plus(n3, plus(n0, n1)));
        normals[m1] = plus(normals[m1], plus(n3, plus(n1, n2)));
        normals[m2] = plus(normals[m2], plus(n3, plus(n2, n0)));
    }
}

// One vertex's normal from the places of its neighbours, a block of them at a time.
static pliant_vec3 normal_at(const pliant_detail *d, const pliant_vec3 *u, int32_t vertex,
                             pliant_vec3 position, pliant_status *status)
{
    const int32_t *ring = d->ring + d->ring_offset[vertex];
    const int32_t valence = d->ring_offset[vertex + 1] - d->ring_offset[vertex];
    pliant_vec3 sum = {0, 0, 0}, first = {0, 0, 0}, last = {0, 0, 0};
    for (int32_t begin = 0; begin < valence; begin += BLOCK) {
        const int32_t count = valence - begin < BLOCK ? valence - begin : BLOCK;
        block b;
        float result[3][BLOCK];
        memcpy(b.vertex, ring + begin, (size_t)count * sizeof *ring);
        if (place(d, u, count, &b, result) > 0) *status = PLIANT_ROUGH;
        for (int32_t i = 0; i < count; i++) {
            const pliant_vec3 next = {result[0][i], result[1][i], result[2][i]};
            if (begin + i == 0) first = next;
            else sum = plus(sum, normal_of(position, last, next, d->inverse_length));
            last = next;
        }
    }
    return unit(plus(sum, normal_of(position, last, first, d->inverse_length)));
}

// ---- What the caller asks for ----

pliant_status pliant_detail_evaluate(const pliant_detail *detail, const pliant_vec3 *u,
                                     pliant_vec3 *positions, pliant_vec3 *normals)
{
    if (!detail || !positions) return PLIANT_ERR_ARGUMENT;
    const int32_t n = detail->info.vertex_count;
    pliant_status status = PLIANT_OK;
    for (int32_t begin = 0; begin < n; begin += BLOCK) {
        const int32_t count = n - begin < BLOCK ? n - begin : BLOCK;
        block b;
        float result[3][BLOCK];
        for (int32_t i = 0; i < count; i++) b.vertex[i] = begin + i;
        if (place(detail, u, count, &b, result) > 0) status = PLIANT_ROUGH;
        store(result, count, positions + begin);
    }
    if (!normals) return status;
    memset(normals, 0, (size_t)n * sizeof *normals);
    add_normals(detail, positions, normals);
    for (int32_t v = 0; v < n; v++) normals[v] = unit(normals[v]);
    return status;
}

static int are_vertices(const pliant_detail *d, const int32_t *vertices, int32_t count)
{
    if (count < 0 || (count > 0 && !vertices)) return 0;
    for (int32_t i = 0; i < count; i++)
        if (vertices[i] < 0 || vertices[i] >= d->info.vertex_count) return 0;
    return 1;
}

pliant_status pliant_detail_points(const pliant_detail *detail, const pliant_vec3 *u,
                                   const int32_t *vertices, int32_t count, pliant_vec3 *positions,
                                   pliant_vec3 *normals)
{
    if (!detail || !are_vertices(detail, vertices, count) || (count > 0 && !positions))
        return PLIANT_ERR_ARGUMENT;
    pliant_status status = PLIANT_OK;
    for (int32_t begin = 0; begin < count; begin += BLOCK) {
        const int32_t size = count - begin < BLOCK ? count - begin : BLOCK;
        block b;
        float result[3][BLOCK];
        memcpy(b.vertex, vertices + begin, (size_t)size * sizeof *vertices);
        if (place(detail, u, size, &b, result) > 0) status = PLIANT_ROUGH;
        store(result, size, positions + begin);
    }
    for (int32_t i = 0; normals && i < count; i++)
        normals[i] = normal_at(detail, u, vertices[i], positions[i], &status);
    return status;
}

// Insert into an ascending list without repeats; 0: it is full.
static int insert(int32_t *list, int32_t *count, int32_t capacity, int32_t vertex)
{
    int32_t low = 0, high = *count;
    while (low < high) {
        const int32_t middle = low + (high - low) / 2;
        if (list[middle] < vertex) low = middle + 1;
        else high = middle;
    }
    if (low < *count && list[low] == vertex) return 1;
    if (*count == capacity) return 0;
    memmove(list + low + 1, list + low, (size_t)(*count - low) * sizeof *list);
    list[low] = vertex;
    ++*count;
    return 1;
}

static int insert_row(const pliant_detail *d, int32_t vertex, int32_t *list, int32_t *count,
                      int32_t capacity)
{
    for (size_t e = d->offset[vertex]; e < d->offset[vertex + 1]; e++)
        if (!insert(list, count, capacity, d->column[e])) return 0;
    return 1;
}

pliant_status pliant_detail_support(const pliant_detail *detail, const int32_t *vertices,
                                    int32_t count, int32_t *control, int32_t capacity,
                                    int32_t *control_count)
{
    if (!detail || !are_vertices(detail, vertices, count) || !control_count || capacity < 0 ||
        (capacity > 0 && !control))
        return PLIANT_ERR_ARGUMENT;
    int32_t found = 0;
    for (int32_t i = 0; i < count; i++) {
        const int32_t v = vertices[i];
        int fits = insert_row(detail, v, control, &found, capacity);
        for (int32_t r = detail->ring_offset[v]; fits && r < detail->ring_offset[v + 1]; r++)
            fits = insert_row(detail, detail->ring[r], control, &found, capacity);
        if (!fits) return PLIANT_ERR_CAPACITY;
    }
    *control_count = found;
    return PLIANT_OK;
}

pliant_status pliant_detail_interpolate(const pliant_detail *detail, int32_t width,
                                        const float *values, float *result)
{
    if (!detail || width < 1 || !values || !result) return PLIANT_ERR_ARGUMENT;
    const size_t step = (size_t)width;
    for (int32_t v = 0; v < detail->info.vertex_count; v++) {
        float *sum = result + step * (size_t)v;
        memset(sum, 0, step * sizeof *sum);
        for (size_t e = detail->offset[v]; e < detail->offset[v + 1]; e++) {
            const float *from = values + step * (size_t)detail->column[e];
            const float weight = detail->weight[3 * e];
            for (size_t c = 0; c < step; c++) sum[c] += weight * from[c];
        }
    }
    return PLIANT_OK;
}
