// triangle.c: nearest points and crossings of one triangle.
#include "triangle.h"

#include "vector.h"

#include <string.h>

// On the edge from corner a to corner b.
static void put_on_edge(int a, int b, double part, double weights[3])
{
    memset(weights, 0, 3 * sizeof *weights);
    weights[a] = 1 - part;
    weights[b] = part;
}

// A part of an edge; of one without length, none.
static double ratio(double part, double whole)
{
    return whole > 0 ? part / whole : 0;
}

// By the region of the plane that the point's foot is in: beyond a corner, beyond an edge, inside.
static void find_foot(const double *corners, const double *point, double weights[3])
{
    double ab[3], ac[3], ap[3], bp[3], cp[3];
    vector_subtract(corners + 3, corners, ab);
    vector_subtract(corners + 6, corners, ac);
    vector_subtract(point, corners, ap);
    vector_subtract(point, corners + 3, bp);
    vector_subtract(point, corners + 6, cp);
    const double d1 = vector_dot(ab, ap), d2 = vector_dot(ac, ap);
    const double d3 = vector_dot(ab, bp), d4 = vector_dot(ac, bp);
    const double d5 = vector_dot(ab, cp), d6 = vector_dot(ac, cp);
    const double va = d3 * d6 - d5 * d4, vb = d5 * d2 - d1 * d6, vc = d1 * d4 - d3 * d2;
    if (d1 <= 0 && d2 <= 0) put_on_edge(0, 1, 0, weights);
    else if (d3 >= 0 && d4 <= d3) put_on_edge(1, 0, 0, weights);
    else if (d6 >= 0 && d5 <= d6) put_on_edge(2, 0, 0, weights);
    else if (vc <= 0 && d1 >= 0 && d3 <= 0) put_on_edge(0, 1, ratio(d1, d1 - d3), weights);
    else if (vb <= 0 && d2 >= 0 && d6 <= 0) put_on_edge(0, 2, ratio(d2, d2 - d6), weights);
    else if (va <= 0 && d4 >= d3 && d5 >= d6)
        put_on_edge(1, 2, ratio(d4 - d3, (d4 - d3) + (d5 - d6)), weights);
    else {
        weights[1] = ratio(vb, va + vb + vc);
        weights[2] = ratio(vc, va + vb + vc);
        weights[0] = 1 - weights[1] - weights[2];
    }
}

// The unit normal; 0: there is none.
static int32_t find_normal(const double *corners, double normal[3])
{
    double ab[3], ac[3];
    vector_subtract(corners + 3, corners, ab);
    vector_subtract(corners + 6, corners, ac);
    vector_cross(ab, ac, normal);
    const double length = vector_length(normal);
    if (!(length > 0)) return 0;
    for (int c = 0; c < 3; c++) normal[c] /= length;
    return 1;
}

static double measure_foot(const double *corners, const double *point, const double *weights,
                           double way[3])
{
    double foot[3];
    vector_mix(weights, corners, foot);
    vector_subtract(point, foot, way);
    return vector_length(way);
}

// Of a triangle without area: the nearest of its edges.
static void find_on_edges(const double *corners, const double *point, double weights[3])
{
    double best = INFINITY;
    for (int k = 0; k < 3; k++) {
        const double *begin = corners + 3 * k, *end = corners + 3 * ((k + 1) % 3);
        double edge[3], to[3], candidate[3];
        vector_subtract(end, begin, edge);
        vector_subtract(point, begin, to);
        const double part = ratio(vector_dot(edge, to), vector_dot(edge, edge));
        put_on_edge(k, (k + 1) % 3, fmin(fmax(part, 0), 1), candidate);
        const double distance = measure_foot(corners, point, candidate, to);
        if (distance >= best) continue;
        best = distance;
        memcpy(weights, candidate, sizeof candidate);
    }
}

pliant_nearest pliant_triangle_nearest(const double *corners, const double *point)
{
    pliant_nearest nearest;
    double normal[3], way[3];
    const int32_t has_normal = find_normal(corners, normal);
    if (has_normal) find_foot(corners, point, nearest.weights);
    else find_on_edges(corners, point, nearest.weights);
    nearest.distance = measure_foot(corners, point, nearest.weights, way);
    nearest.side = has_normal ? vector_dot(way, normal) : 0;
    return nearest;
}

int32_t pliant_triangle_crossed(const double *corners, const double *from, const double *to,
                                double slack, double *at, double weights[3])
{
    double normal[3], a[3], b[3];
    if (!find_normal(corners, normal)) return 0;
    vector_subtract(from, corners, a);
    vector_subtract(to, corners, b);
    const double begin = vector_dot(a, normal), end = vector_dot(b, normal);
    if (!(begin >= -slack && end < -slack)) return 0;
    *at = begin > 0 ? begin / (begin - end) : 0;
    double place[3];
    for (int c = 0; c < 3; c++) place[c] = from[c] + *at * (to[c] - from[c]);
    const pliant_nearest nearest = pliant_triangle_nearest(corners, place);
    memcpy(weights, nearest.weights, sizeof nearest.weights);
    return nearest.distance <= slack + (begin < 0 ? -begin : 0);
}
