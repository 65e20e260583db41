// vertex_tree.c: which vertices may be near a tool: a tree of balls over their rest positions.
#include "vertex_tree.h"

#include <math.h>

// A distance costs about as much as testing a vertex, so leaves are small.
enum { leaf_size = 8 };

void pliant_vertex_tree_lay_out(pliant_arena *arena, int32_t count, pliant_vertex_tree *tree)
{
    tree->count = count;
    tree->leaf_count = 1;
    while ((int64_t)tree->leaf_count * leaf_size < count) tree->leaf_count *= 2;
    PLIANT_TAKE(arena, tree->vertices, count);
    PLIANT_TAKE(arena, tree->begin, (size_t)tree->leaf_count + 1);
    PLIANT_TAKE(arena, tree->ball, 8 * (size_t)tree->leaf_count);
}

// The ball about the middle of the box; no smaller than it must be by half at worst.
static void bound(const double *positions, const int32_t *vertices, int32_t count, double *ball)
{
    ball[3] = -1;
    if (count == 0) return;
    double low[3], high[3];
    for (int c = 0; c < 3; c++) low[c] = high[c] = positions[3 * (size_t)vertices[0] + (size_t)c];
    for (int32_t i = 1; i < count; i++)
        for (int c = 0; c < 3; c++) {
            low[c] = fmin(low[c], positions[3 * (size_t)vertices[i] + (size_t)c]);
            high[c] = fmax(high[c], positions[3 * (size_t)vertices[i] + (size_t)c]);
        }
    double square = 0;
    for (int c = 0; c < 3; c++) ball[c] = low[c] + (high[c] - low[c]) / 2;
    for (int32_t i = 0; i < count; i++) {
        const double *x = positions + 3 * (size_t)vertices[i];
        square =
            fmax(square, (x[0] - ball[0]) * (x[0] - ball[0]) + (x[1] - ball[1]) * (x[1] - ball[1]) +
                             (x[2] - ball[2]) * (x[2] - ball[2]));
    }
    ball[3] = sqrt(square);
}

static void swap(int32_t *a, int32_t *b)
{
    const int32_t kept = *a;
    *a = *b;
    *b = kept;
}

// Order so that the first `rank` are the ones that lie lowest along coordinate c (Hoare's select).
static void split(const double *positions, int32_t *vertices, int32_t count, int32_t rank, int c)
{
    int32_t begin = 0, end = count - 1;
    while (begin < end) {
        const double pivot = positions[3 * (size_t)vertices[begin + (end - begin) / 2] + (size_t)c];
        int32_t i = begin, j = end;
        while (i <= j) {
            while (positions[3 * (size_t)vertices[i] + (size_t)c] < pivot) i++;
            while (positions[3 * (size_t)vertices[j] + (size_t)c] > pivot) j--;
            if (i <= j) swap(&vertices[i++], &vertices[j--]);
        }
        if (rank <= j) end = j;
        else if (rank >= i) begin = i;
        else return;
    }
}

static int longest_side(const double *positions, const int32_t *vertices, int32_t count)
{
    double most = -1;
    int longest = 0;
    for (int c = 0; c < 3; c++) {
        double low = INFINITY, high = -INFINITY;
        for (int32_t i = 0; i < count; i++) {
            low = fmin(low, positions[3 * (size_t)vertices[i] + (size_t)c]);
            high = fmax(high, positions[3 * (size_t)vertices[i] + (size_t)c]);
        }
        if (high - low > most) most = high - low, longest = c;
    }
    return longest;
}

// Vertices begin .. begin + count - 1 belong to `node`, at a depth with leaf_count / leaves nodes.
static void build(pliant_vertex_tree *tree, const double *positions, int32_t node, int32_t leaves,
                  int32_t begin, int32_t count)
{
    int32_t *vertices = tree->vertices + begin;
    bound(positions, vertices, count, tree->ball + 4 * (size_t)node);
    if (leaves == 1) {
        tree->begin[node - tree->leaf_count] = begin;
        return;
    }
    const int32_t half = count / 2;
    if (half > 0) split(positions, vertices, count, half, longest_side(positions, vertices, count));
    build(tree, positions, 2 * node, leaves / 2, begin, half);
    build(tree, positions, 2 * node + 1, leaves / 2, begin + half, count - half);
}

void pliant_vertex_tree_build(pliant_vertex_tree *tree, const int32_t *vertices,
                              const double *positions)
{
    for (int32_t i = 0; i < tree->count; i++) tree->vertices[i] = vertices[i];
    tree->begin[tree->leaf_count] = tree->count;
    build(tree, positions, 1, tree->leaf_count, 0, tree->count);
}

int32_t pliant_vertex_tree_near(const pliant_vertex_tree *tree, const pliant_tool_shape *shape,
                                double reach, int32_t *found)
{
    // Depth first; heap order needs no stack: up until this was a left child, then to its sibling.
    int32_t node = 1, count = 0;
    for (;;) {
        const double *ball = tree->ball + 4 * (size_t)node;
        double ignored[3];
        const int32_t is_near =
            ball[3] >= 0 && pliant_tool_shape_distance(shape, ball, ignored) <= reach + ball[3];
        if (is_near && node < tree->leaf_count) {
            node *= 2;
            continue;
        }
        if (is_near) {
            const int32_t leaf = node - tree->leaf_count;
            for (int32_t i = tree->begin[leaf]; i < tree->begin[leaf + 1]; i++)
                found[count++] = tree->vertices[i];
        }
        while (node & 1) node /= 2;
        if (node == 0) return count;
        node++;
    }
}
