// nearest.c: the nearest of a set of points, by a k-d tree.
#include "mesh/nearest.h"

#include "pliant/error.h"

#include <math.h>
#include <stdlib.h>

// Ranges this short are searched point by point.
enum { LEAF_SIZE = 8 };

struct pliant_nearest {
    const double *points;
    int32_t count;
    int32_t *order;  // [count]: point numbers
    uint8_t *axis;   // [count]: of the split whose middle stands at this place
};

static double along(const pliant_nearest *n, int32_t place, int axis)
{
    return n->points[3 * (size_t)n->order[place] + (size_t)axis];
}

static int widest_axis(const pliant_nearest *n, int32_t begin, int32_t end)
{
    int widest = 0;
    double width = -1;
    for (int d = 0; d < 3; d++) {
        double low = INFINITY, high = -INFINITY;
        for (int32_t i = begin; i < end; i++) {
            low = fmin(low, along(n, i, d));
            high = fmax(high, along(n, i, d));
        }
        if (high - low > width) {
            width = high - low;
            widest = d;
        }
    }
    return widest;
}

// Hoare's selection: the middle of begin .. end - 1 takes its place, lower ones stand before it.
static void select_middle(pliant_nearest *n, int32_t begin, int32_t end, int axis)
{
    const int32_t middle = begin + (end - begin) / 2;
    int32_t low = begin, high = end - 1;
    while (low < high) {
        const double pivot = along(n, low + (high - low) / 2, axis);
        int32_t i = low, j = high;
        while (i <= j) {
            while (along(n, i, axis) < pivot) i++;
            while (along(n, j, axis) > pivot) j--;
            if (i > j) break;
            const int32_t swapped = n->order[i];
            n->order[i++] = n->order[j];
            n->order[j--] = swapped;
        }
        if (middle <= j) high = j;
        else if (middle >= i) low = i;
        else return;
    }
}

static void build(pliant_nearest *n, int32_t begin, int32_t end)
{
    while (end - begin > LEAF_SIZE) {
        const int axis = widest_axis(n, begin, end);
        const int32_t middle = begin + (end - begin) / 2;
        select_middle(n, begin, end, axis);
        n->axis[middle] = (uint8_t)axis;
        build(n, begin, middle);
        begin = middle + 1;
    }
}

pliant_status pliant_nearest_create(const double *points, int32_t count, pliant_nearest **nearest,
                                    pliant_error *err)
{
    pliant_nearest *n = calloc(1, sizeof *n);
    if (n) {
        n->points = points;
        n->count = count;
        n->order = malloc((size_t)count * sizeof *n->order);
        n->axis = calloc((size_t)count, 1);
    }
    if (!n || !n->order || !n->axis) {
        pliant_nearest_destroy(n);
        return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for a search tree of %d points",
                                count);
    }
    for (int32_t i = 0; i < count; i++) n->order[i] = i;
    build(n, 0, count);
    *nearest = n;
    return PLIANT_OK;
}

void pliant_nearest_destroy(pliant_nearest *nearest)
{
    if (!nearest) return;
    free(nearest->order);
    free(nearest->axis);
    free(nearest);
}

typedef struct search {
    const pliant_nearest *nearest;
    const double *position;
    double best;  // squared distance
    int32_t found;
} search;

static void consider(search *s, int32_t place)
{
    const int32_t point = s->nearest->order[place];
    double square = 0;
    for (int d = 0; d < 3; d++) {
        const double off = s->nearest->points[3 * (size_t)point + (size_t)d] - s->position[d];
        square += off * off;
    }
    if (square > s->best || (square == s->best && s->found >= 0 && point > s->found)) return;
    s->best = square;
    s->found = point;
}

static void descend(search *s, int32_t begin, int32_t end)
{
    if (end - begin <= LEAF_SIZE) {
        for (int32_t i = begin; i < end; i++) consider(s, i);
        return;
    }
    const int32_t middle = begin + (end - begin) / 2;
    const int axis = s->nearest->axis[middle];
    const double off = s->position[axis] - along(s->nearest, middle, axis);
    consider(s, middle);
    if (off <= 0) descend(s, begin, middle);
    else descend(s, middle + 1, end);
    if (off * off > s->best) return;
    if (off <= 0) descend(s, middle + 1, end);
    else descend(s, begin, middle);
}

int32_t pliant_nearest_find(const pliant_nearest *nearest, const double position[3])
{
    search s = {nearest, position, INFINITY, -1};
    descend(&s, 0, nearest->count);
    return s.found;
}
