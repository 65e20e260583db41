// sliding.c: Newton's method for the point's weights, face by face across the surface.
#include "sliding.h"

#include "pliant/halfedge.h"
#include "vector.h"

#include <math.h>
#include <string.h>

// Of a call: steps of Newton's method, and edges crossed. A hand at 1 m/s crosses a face of 5 mm in
// five steps of 1 kHz; a point that has further to go, as when it slips off an ear, goes on in the
// next step, since every new corner's compliance takes its time (bunny_L4, 30 constraints: without
// the second limit slips took 1.6 ms). Where all faces around a corner send it back there, it
// stays; valences beyond the third limit are not gone round twice.
enum { move_limit = 48, cross_limit = 8, still_limit = 24 };
// The tangential force that is left may be this part of the force: 1 nN of 1 N.
static const double tolerance = 1e-9;
// Smoothed normals that lean over further than this from the face (cosine; 84 degrees) say nothing
// about it; the face's own is taken.
static const double least_cosine = 0.1;

typedef struct view {
    pliant_sliding_face face;
    double edge[2][3];          // x_i - x_0
    double give[2][9];          // C_i - C_0
    double normal_slope[2][3];  // of N by w_i
    double force_slope[2][3];   // of F by w_i
    double tangent[2][3];       // tau_i
    double stiffness[9];        // C^-1
    double rho[2];
    pliant_sliding_state state;
} view;

static void invert(const double *a, double *inverse)
{
    inverse[0] = a[4] * a[8] - a[5] * a[7];
    inverse[1] = a[2] * a[7] - a[1] * a[8];
    inverse[2] = a[1] * a[5] - a[2] * a[4];
    inverse[3] = a[5] * a[6] - a[3] * a[8];
    inverse[4] = a[0] * a[8] - a[2] * a[6];
    inverse[5] = a[2] * a[3] - a[0] * a[5];
    inverse[6] = a[3] * a[7] - a[4] * a[6];
    inverse[7] = a[1] * a[6] - a[0] * a[7];
    inverse[8] = a[0] * a[4] - a[1] * a[3];
    // Positive: 1/k and compliances that are not negative.
    const double scale = 1 / (a[0] * inverse[0] + a[1] * inverse[3] + a[2] * inverse[6]);
    for (int c = 0; c < 9; c++) inverse[c] *= scale;
}

// N and its slopes.
static void smooth_normal(view *v, const double *weights)
{
    const pliant_sliding_face *face = &v->face;
    double flat[3], mean[3];
    vector_cross(v->edge[0], v->edge[1], flat);
    vector_mix(weights, face->normal[0], mean);
    const double length = vector_length(mean), flat_length = vector_length(flat);
    double *normal = v->state.normal;
    memset(v->normal_slope, 0, sizeof v->normal_slope);
    if (!(vector_dot(mean, flat) > least_cosine * length * flat_length) && flat_length > 0) {
        for (int c = 0; c < 3; c++) normal[c] = flat[c] / flat_length;
        return;
    }
    for (int c = 0; c < 3; c++) normal[c] = length > 0 ? mean[c] / length : face->normal[0][c];
    if (!(length > 0)) return;
    for (int i = 0; i < 2; i++) {
        double *slope = v->normal_slope[i];
        vector_subtract(face->normal[i + 1], face->normal[0], slope);
        vector_add(-vector_dot(slope, normal), normal, slope);
        for (int c = 0; c < 3; c++) slope[c] /= length;
    }
}

// All but the face's data, at these weights.
static void look(const pliant_sliding_surface *surface, const double *weights, const double *device,
                 view *v)
{
    const pliant_sliding_face *face = &v->face;
    pliant_sliding_state *state = &v->state;
    double compliance[9];
    for (int c = 0; c < 9; c++)
        compliance[c] = (c % 4 == 0 ? surface->give : 0) + weights[0] * face->compliance[0][c] +
                        weights[1] * face->compliance[1][c] + weights[2] * face->compliance[2][c];
    invert(compliance, v->stiffness);
    for (int i = 0; i < 2; i++) {
        vector_subtract(face->place[i + 1], face->place[0], v->edge[i]);
        for (int c = 0; c < 9; c++)
            v->give[i][c] = face->compliance[i + 1][c] - face->compliance[0][c];
    }
    smooth_normal(v, weights);
    vector_mix(weights, face->place[0], state->place);
    double stretch[3];
    vector_subtract(device, state->place, stretch);
    vector_transform(v->stiffness, stretch, state->force);
    state->press = -vector_dot(state->force, state->normal);
    state->depth = -vector_dot(stretch, state->normal);
    state->energy = 0.5 * vector_dot(stretch, state->force);
    for (int i = 0; i < 2; i++) {
        // dF/dw_i = -K (x_i - x_0 + (C_i - C_0) F)
        double lag[3], softened[3];
        vector_transform(v->give[i], state->force, softened);
        for (int c = 0; c < 3; c++) lag[c] = -v->edge[i][c] - softened[c];
        vector_transform(v->stiffness, lag, v->force_slope[i]);
        memcpy(v->tangent[i], v->edge[i], sizeof v->tangent[i]);
        vector_add(-vector_dot(v->edge[i], state->normal), state->normal, v->tangent[i]);
        v->rho[i] = vector_dot(state->force, v->tangent[i]);
    }
}

// d rho_i / d w_j
static double slope(const view *v, int i, int j)
{
    const pliant_sliding_state *state = &v->state;
    return vector_dot(v->force_slope[j], v->tangent[i]) -
           vector_dot(state->force, v->normal_slope[j]) * vector_dot(state->normal, v->edge[i]) +
           state->press * vector_dot(v->normal_slope[j], v->edge[i]);
}

// How far the point would go, in weights 1 and 2, for rho to vanish: by Newton, or where that is
// no way down (the device is deeper than the surface is round) by the springs alone.
static void aim(const view *v, double step[2])
{
    double a = slope(v, 0, 0), b = slope(v, 0, 1), c = slope(v, 1, 0), d = slope(v, 1, 1);
    double determinant = a * d - b * c;
    if (!(a < 0 && determinant > 0)) {
        double pull[2][3];
        for (int i = 0; i < 2; i++) vector_transform(v->stiffness, v->edge[i], pull[i]);
        a = -vector_dot(v->edge[0], pull[0]);
        d = -vector_dot(v->edge[1], pull[1]);
        b = c = -vector_dot(v->edge[0], pull[1]);
        determinant = a * d - b * c;
    }
    step[0] = step[1] = 0;
    if (!(determinant > 0)) return;  // a face without area
    step[0] = -(d * v->rho[0] - b * v->rho[1]) / determinant;
    step[1] = -(a * v->rho[1] - c * v->rho[0]) / determinant;
}

// |rho| as a force: sqrt(rho . G^-1 rho), G_ij = edge_i . edge_j.
static double tangential(const view *v)
{
    const double a = vector_dot(v->edge[0], v->edge[0]), b = vector_dot(v->edge[0], v->edge[1]);
    const double d = vector_dot(v->edge[1], v->edge[1]);
    const double square =
        d * v->rho[0] * v->rho[0] - 2 * b * v->rho[0] * v->rho[1] + a * v->rho[1] * v->rho[1];
    const double determinant = a * d - b * b;
    return determinant > 0 ? sqrt(fmax(square, 0) / determinant) : 0;
}

// Add up to one `step` (in weights, sum 0) within the face: the corner whose weight ran out, or -1.
static int32_t advance(double *weights, const double *step, double *part)
{
    int32_t out = -1;
    *part = 1;
    for (int k = 0; k < 3; k++)
        if (step[k] < 0 && weights[k] < -step[k] * *part) {
            *part = weights[k] / -step[k];
            out = k;
        }
    double sum = 0;
    for (int k = 0; k < 3; k++) {
        weights[k] = k == out ? 0 : fmax(weights[k] + *part * step[k], 0);
        sum += weights[k];
    }
    for (int k = 0; k < 3; k++) weights[k] /= sum;
    return out;
}

// Over to the face across the edge opposite to corner `out`. Returns the edge, as the new face's
// half-edge.
static int32_t cross_edge(const pliant_sliding_surface *surface, pliant_sliding_point *point,
                          int32_t out)
{
    const int32_t h = 3 * point->face + (out + 1) % 3;
    const int32_t twin = surface->twin[h];
    const double from = point->weights[(out + 1) % 3], to = point->weights[(out + 2) % 3];
    point->face = twin / 3;
    point->weights[twin % 3] = to;
    point->weights[(twin % 3 + 1) % 3] = from;
    point->weights[(twin % 3 + 2) % 3] = 0;
    return twin;
}

// A point which either face of an edge sends back to the other belongs on the edge: its step
// along the half-edge `h` of its face. Returns the part of rho that acts there, as a force.
static double aim_along(const view *v, int32_t h, double step[3])
{
    const int32_t begin = h % 3, end = (h + 1) % 3;
    double direction[3] = {0, 0, 0};
    direction[begin] = -1;
    direction[end] = 1;
    double edge[3];
    vector_subtract(v->face.place[end], v->face.place[begin], edge);
    double rho = 0, rate = 0;
    for (int i = 0; i < 2; i++) {
        rho += direction[i + 1] * v->rho[i];
        for (int j = 0; j < 2; j++) rate += direction[i + 1] * slope(v, i, j) * direction[j + 1];
    }
    if (!(rate < 0)) {
        double pull[3];
        vector_transform(v->stiffness, edge, pull);
        rate = -vector_dot(edge, pull);
    }
    for (int k = 0; k < 3; k++) step[k] = -rho / rate * direction[k];
    const double length = vector_length(edge);
    return length > 0 ? fabs(rho) / length : 0;
}

void pliant_sliding_look(const pliant_sliding_surface *surface, const pliant_sliding_point *point,
                         const double *device, pliant_sliding_state *state)
{
    view v;
    surface->fetch(surface->context, point->face, &v.face);
    look(surface, point->weights, device, &v);
    *state = v.state;
}

int32_t pliant_sliding_move(const pliant_sliding_surface *surface, pliant_sliding_point *point,
                            const double *device, pliant_sliding_state *state)
{
    view v;
    surface->fetch(surface->context, point->face, &v.face);
    int32_t moved = 0;
    int32_t entry = -1;      // the half-edge over which the present face was entered just now
    int32_t is_on_edge = 0;  // 1: and which its face on either side sends the point back to
    int32_t crossed = 0;     // edges, on the way somewhere
    int32_t still = 0;       // moves on end that went nowhere: round and round a corner
    for (int32_t move = 0;; move++) {
        look(surface, point->weights, device, &v);
        const double hold = surface->friction * fmax(v.state.press, 0);
        double step[3], pull;
        if (is_on_edge) {
            pull = aim_along(&v, entry, step);
        } else {
            pull = tangential(&v);
            aim(&v, step + 1);
            step[0] = -step[1] - step[2];
        }
        if (!(pull > hold + tolerance * vector_length(v.state.force))) break;
        if (move == move_limit || crossed == cross_limit || still == still_limit) break;
        for (int k = 0; k < 3; k++) step[k] *= (pull - hold) / pull;
        double part;
        const int32_t out = advance(point->weights, step, &part);
        moved |= part > 0;
        still = part > 0 ? 0 : still + 1;
        const int32_t edge = out < 0 ? -1 : 3 * point->face + (out + 1) % 3;
        if (edge >= 0 && edge == entry && part == 0 && !is_on_edge) {
            is_on_edge = 1;
            continue;
        }
        is_on_edge = 0;
        entry = -1;
        if (out < 0) continue;
        crossed += part > 0;
        entry = cross_edge(surface, point, out);
        surface->fetch(surface->context, point->face, &v.face);
    }
    *state = v.state;
    return moved;
}
