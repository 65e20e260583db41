// face_tree.c: the closest point of a triangle mesh, by a tree of bounding boxes.
//
// This follows: C. Ericson, Real-time collision detection, 2005, section 5.1.5, for the closest
// point of a triangle.
#include "remesh/face_tree.h"

#include "remesh/vector.h"

#include "pliant/error.h"

#include <stdlib.h>
#include <string.h>

enum { LEAF_FACES = 4, DEPTH_LIMIT = 64 };

typedef struct node {
    double low[3], high[3];
    int32_t begin, end;  // into order
    int32_t right;       // the left child follows its parent; 0: a leaf
} node;

struct pliant_face_tree {
    const pliant_mesh *mesh;
    node *nodes;
    int32_t *order;
    double *centres;  // shape [face_count][3]
    int32_t node_count;
};

static const double *corner(const pliant_mesh *mesh, int32_t face, int k)
{
    return mesh->vertices + 3 * (size_t)mesh->faces[3 * (size_t)face + k];
}

// Hoare's selection: order[begin..middle) has the smaller centres along `axis`.
static void halve(pliant_face_tree *t, int32_t begin, int32_t end, int32_t middle, int axis)
{
    int32_t *order = t->order;
    int32_t low = begin, high = end - 1;
    while (low < high) {
        const double pivot = t->centres[3 * (size_t)order[low + (high - low) / 2] + axis];
        int32_t i = low, j = high;
        while (i <= j) {
            while (t->centres[3 * (size_t)order[i] + axis] < pivot) i++;
            while (t->centres[3 * (size_t)order[j] + axis] > pivot) j--;
            if (i > j) break;
            const int32_t swapped = order[i];
            order[i++] = order[j];
            order[j--] = swapped;
        }
        if (middle <= j) high = j;
        else if (middle >= i) low = i;
        else return;
    }
}

// Halves of equal size: the depth is the logarithm of the number of faces.
static int32_t build(pliant_face_tree *t, int32_t begin, int32_t end)
{
    const int32_t index = t->node_count++;
    node *n = t->nodes + index;
    *n = (node){.begin = begin, .end = end};
    double low[3], high[3];
    for (int i = 0; i < 3; i++) {
        n->low[i] = low[i] = INFINITY;
        n->high[i] = high[i] = -INFINITY;
    }
    for (int32_t j = begin; j < end; j++) {
        const double *centre = t->centres + 3 * (size_t)t->order[j];
        for (int i = 0; i < 3; i++) {
            low[i] = fmin(low[i], centre[i]);
            high[i] = fmax(high[i], centre[i]);
            for (int k = 0; k < 3; k++) {
                n->low[i] = fmin(n->low[i], corner(t->mesh, t->order[j], k)[i]);
                n->high[i] = fmax(n->high[i], corner(t->mesh, t->order[j], k)[i]);
            }
        }
    }
    if (end - begin <= LEAF_FACES) return index;
    int axis = 0;
    for (int i = 1; i < 3; i++)
        if (high[i] - low[i] > high[axis] - low[axis]) axis = i;
    const int32_t middle = begin + (end - begin) / 2;
    halve(t, begin, end, middle, axis);
    (void)build(t, begin, middle);
    const int32_t right = build(t, middle, end);
    t->nodes[index].right = right;
    return index;
}

pliant_status pliant_face_tree_create(const pliant_mesh *mesh, pliant_face_tree **tree,
                                      pliant_error *err)
{
    const size_t faces = (size_t)mesh->face_count;
    pliant_face_tree *t = calloc(1, sizeof *t);
    if (t) {
        t->mesh = mesh;
        t->nodes = malloc((2 * faces + 1) * sizeof *t->nodes);
        t->order = malloc((faces + 1) * sizeof *t->order);
        t->centres = malloc((3 * faces + 1) * sizeof *t->centres);
    }
    if (!t || !t->nodes || !t->order || !t->centres) {
        pliant_face_tree_destroy(t);
        return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for a tree of %d faces",
                                mesh->face_count);
    }
    for (int32_t f = 0; f < mesh->face_count; f++) {
        t->order[f] = f;
        for (int i = 0; i < 3; i++)
            t->centres[3 * (size_t)f + i] =
                (corner(mesh, f, 0)[i] + corner(mesh, f, 1)[i] + corner(mesh, f, 2)[i]) / 3;
    }
    (void)build(t, 0, mesh->face_count);
    *tree = t;
    return PLIANT_OK;
}

void pliant_face_tree_destroy(pliant_face_tree *tree)
{
    if (!tree) return;
    free(tree->centres);
    free(tree->order);
    free(tree->nodes);
    free(tree);
}

static double box_distance(const node *n, const double *x)
{
    double sum = 0;
    for (int i = 0; i < 3; i++) {
        const double d = fmax(fmax(n->low[i] - x[i], x[i] - n->high[i]), 0);
        sum += d * d;
    }
    return sum;
}

// On the side from corner i to corner j, at share t.
static void on_side(int i, int j, double t, double weight[3])
{
    weight[0] = weight[1] = weight[2] = 0;
    weight[i] = 1 - t;
    weight[j] = t;
}

void pliant_triangle_closest(const double *a, const double *b, const double *c, const double *x,
                             double weight[3])
{
    double ab[3], ac[3], ax[3], bx[3], cx[3];
    pliant_subtract(b, a, ab);
    pliant_subtract(c, a, ac);
    pliant_subtract(x, a, ax);
    pliant_subtract(x, b, bx);
    pliant_subtract(x, c, cx);
    const double d1 = pliant_dot(ab, ax), d2 = pliant_dot(ac, ax), d3 = pliant_dot(ab, bx),
                 d4 = pliant_dot(ac, bx), d5 = pliant_dot(ab, cx), d6 = pliant_dot(ac, cx);
    if (d1 <= 0 && d2 <= 0) {
        on_side(0, 1, 0, weight);
        return;
    }
    if (d3 >= 0 && d4 <= d3) {
        on_side(1, 2, 0, weight);
        return;
    }
    if (d6 >= 0 && d5 <= d6) {
        on_side(2, 0, 0, weight);
        return;
    }
    const double vc = d1 * d4 - d3 * d2, vb = d5 * d2 - d1 * d6, va = d3 * d6 - d5 * d4;
    if (vc <= 0 && d1 >= 0 && d3 <= 0) on_side(0, 1, d1 / (d1 - d3), weight);
    else if (vb <= 0 && d2 >= 0 && d6 <= 0) on_side(0, 2, d2 / (d2 - d6), weight);
    else if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0)
        on_side(1, 2, (d4 - d3) / (d4 - d3 + d5 - d6), weight);
    else {
        const double sum = va + vb + vc;
        weight[0] = va / sum;
        weight[1] = vb / sum;
        weight[2] = vc / sum;
    }
}

pliant_place pliant_face_tree_closest(const pliant_face_tree *tree, const double x[3],
                                      double *squared)
{
    pliant_place best = {0};
    double least = INFINITY;
    struct {
        int32_t index;
        double distance;
    } stack[DEPTH_LIMIT];
    int size = 0;
    stack[size].index = 0;
    stack[size++].distance = box_distance(tree->nodes, x);
    while (size > 0) {
        size--;
        if (stack[size].distance >= least) continue;
        const int32_t index = stack[size].index;
        const node *n = tree->nodes + index;
        if (n->right == 0) {
            for (int32_t j = n->begin; j < n->end; j++) {
                const double *p[3];
                for (int k = 0; k < 3; k++) p[k] = corner(tree->mesh, tree->order[j], k);
                pliant_place at = {.face = tree->order[j]};
                pliant_triangle_closest(p[0], p[1], p[2], x, at.weight);
                double q[3];
                for (int i = 0; i < 3; i++)
                    q[i] = at.weight[0] * p[0][i] + at.weight[1] * p[1][i] + at.weight[2] * p[2][i];
                const double d = pliant_squared_distance(q, x);
                if (!(d < least)) continue;
                least = d;
                best = at;
            }
            continue;
        }
        const double left = box_distance(tree->nodes + index + 1, x),
                     right = box_distance(tree->nodes + n->right, x);
        const int left_first = left <= right;
        // The nearer one on top.
        stack[size].index = left_first ? n->right : index + 1;
        stack[size++].distance = left_first ? right : left;
        stack[size].index = left_first ? index + 1 : n->right;
        stack[size++].distance = left_first ? left : right;
    }
    *squared = least;
    return best;
}
