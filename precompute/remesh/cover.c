// cover.c: a semi-regular mesh whose vertices live on an arbitrary one.
#include "remesh/cover.h"

#include "remesh/vector.h"

#include "pliant/error.h"

#include <stdlib.h>
#include <string.h>

// A triangle's quality is 4 sqrt(3) area / (sum of squared sides): 1 when equilateral; from 0.3 on
// no angle is under 10 degrees. It is negative where the triangle looks against the surface, and
// lowered already from LEANING (a cosine) on.
static const double leaning = 0.3;
// Smoothing may lower the quality around a vertex, but not under this.
static const double smooth_quality = 0.3;
// Faces under this are improved.
static const double poor_quality = 0.5;
// Faces under this look, or nearly look, against the surface beside them.
static const double turned_quality = 0.02;
// A sweep first moves a vertex to the centre of its share, then by this part of the way to the
// middle of its neighbours: more of it draws vertices off limbs, less leaves thin triangles (tried
// on the bunny's ears: 0, 0.2, 0.5, 1).
static const double smooth_part = 0.2;
// Corners and tips that lie farther off the mesh than this, in diagonals, are reached for.
static const double reached = 0.004;
// Their faces may be this poor at first: neighbours make room. They leave if it stays under the
// other.
static const double reach_quality = 0.15, kept_quality = 0.3;
// What lies so far off the mesh, in diagonals, counts twice; what lies farther, with the square.
static const double tolerated = 0.0015;

static double face_quality(const double *p, const double *q, const double *r, const double *a,
                           const double *b, const double *c)
{
    double n[3], m[3];
    pliant_face_normal(p, q, r, n);
    for (int i = 0; i < 3; i++) m[i] = a[i] + b[i] + c[i];
    const double area = pliant_length(n), size = pliant_length(m);
    const double sides = pliant_squared_distance(p, q) + pliant_squared_distance(q, r) +
                         pliant_squared_distance(r, p);
    if (!(area > 0) || !(size > 0)) return sides > 0 ? 0 : -1;
    const double cosine = pliant_dot(n, m) / (area * size);
    return 2 * sqrt(3.) * area / sides * fmin(cosine / leaning, 1);
}

// The same against the surface's normal where it is closest to the face's centre.
static double quality_beside(const pliant_cover *c, const int32_t *v)
{
    const double *x = c->multires->mesh->vertices;
    const double *p = x + 3 * (size_t)v[0], *q = x + 3 * (size_t)v[1], *r = x + 3 * (size_t)v[2];
    double centre[3], n[3], squared;
    for (int k = 0; k < 3; k++) centre[k] = (p[k] + q[k] + r[k]) / 3;
    const pliant_place at = pliant_face_tree_closest(c->tree, centre, &squared);
    pliant_surface_normal(c->original, &at, n);
    return face_quality(p, q, r, n, n, n);
}

static double quality_of(const pliant_cover *c, int32_t face)
{
    const int32_t *v = c->multires->mesh->faces + 3 * (size_t)face;
    const double *x = c->multires->mesh->vertices, *n = c->normals;
    const double quality =
        face_quality(x + 3 * (size_t)v[0], x + 3 * (size_t)v[1], x + 3 * (size_t)v[2],
                     n + 3 * (size_t)v[0], n + 3 * (size_t)v[1], n + 3 * (size_t)v[2]);
    return c->tree ? fmin(quality, quality_beside(c, v)) : quality;
}

// The worst face around v.
static double quality_around(const pliant_cover *c, int32_t v)
{
    double worst = 1;
    for (int32_t i = c->fan_start[v]; i < c->fan_start[v + 1]; i++)
        worst = fmin(worst, quality_of(c, c->fans[i]));
    return worst;
}

static void place(pliant_cover *c, int32_t v, const pliant_place *at)
{
    c->places[v] = *at;
    pliant_surface_position(c->surface, at, c->multires->mesh->vertices + 3 * (size_t)v);
    pliant_surface_normal(c->surface, at, c->normals + 3 * (size_t)v);
}

// ---- Create ----

// Weights of the corners of fine face `face` in its base face, by its digits to base four.
static void locate(int32_t face, int32_t levels, double corner[3][3])
{
    static const double whole[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    memcpy(corner, whole, sizeof whole);
    for (int32_t l = levels - 1; l >= 0; l--) {
        const int child = (int)(face >> (2 * l)) & 3;
        double middle[3][3], kept[3][3];  // middle[k] of the side from corner k
        for (int k = 0; k < 3; k++)
            for (int i = 0; i < 3; i++) middle[k][i] = (corner[k][i] + corner[(k + 1) % 3][i]) / 2;
        if (child == 3) {
            memcpy(kept, middle, sizeof kept);
        } else {
            memcpy(kept[0], corner[child], sizeof kept[0]);
            memcpy(kept[1], middle[child], sizeof kept[0]);
            memcpy(kept[2], middle[(child + 2) % 3], sizeof kept[0]);
        }
        memcpy(corner, kept, sizeof kept);
    }
}

static void find_fans(pliant_cover *c)
{
    const pliant_mesh *mesh = c->multires->mesh;
    for (int32_t h = 0; h < 3 * mesh->face_count; h++) c->fan_start[mesh->faces[h] + 1]++;
    for (int32_t v = 0; v < mesh->vertex_count; v++) c->fan_start[v + 1] += c->fan_start[v];
    for (int32_t h = 3 * mesh->face_count - 1; h >= 0; h--)
        c->fans[--c->fan_start[mesh->faces[h] + 1]] = h / 3;
    // Filled from behind, every start is that of the vertex before: move them back.
    memmove(c->fan_start, c->fan_start + 1, (size_t)mesh->vertex_count * sizeof *c->fan_start);
    c->fan_start[mesh->vertex_count] = 3 * mesh->face_count;
}

pliant_status pliant_cover_create(const pliant_coarsening *coarsening,
                                  const pliant_surface *surface, int32_t base_count, int32_t levels,
                                  pliant_cover **cover, pliant_error *err)
{
    pliant_mesh *base = NULL;
    pliant_status status = pliant_coarsening_base(coarsening, base_count, &base, err);
    if (status < 0) return status;
    pliant_cover *c = calloc(1, sizeof *c);
    if (!c) status = pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for a remeshed surface");
    else
        status =
            pliant_multires_subdivide(base, levels, PLIANT_SUBDIVIDE_MIDPOINT, &c->multires, err);
    pliant_mesh_destroy(base);
    if (status < 0) goto refused;
    const pliant_mesh *mesh = c->multires->mesh;
    const size_t n = (size_t)mesh->vertex_count;
    c->surface = surface;
    c->places = malloc(n * sizeof *c->places);
    c->normals = malloc(3 * n * sizeof *c->normals);
    c->area = calloc(n, sizeof *c->area);
    c->kept = calloc(n, 1);
    c->centre = calloc(3 * n, sizeof *c->centre);
    c->fan_start = calloc(n + 2, sizeof *c->fan_start);
    c->fans = malloc(3 * (size_t)mesh->face_count * sizeof *c->fans);
    if (!c->places || !c->normals || !c->area || !c->kept || !c->centre || !c->fan_start ||
        !c->fans) {
        status = pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for %d vertices",
                                  mesh->vertex_count);
        goto refused;
    }
    find_fans(c);
    c->diagonal = pliant_surface_diagonal(surface->mesh);
    for (int32_t f = 0; f < mesh->face_count; f++) {
        double corner[3][3];
        locate(f, levels, corner);
        for (int k = 0; k < 3; k++) {
            pliant_place *p = c->places + mesh->faces[3 * (size_t)f + k];
            p->face = f >> (2 * levels);
            memcpy(p->weight, corner[k], sizeof p->weight);
        }
    }
    status = pliant_coarsening_unfold(coarsening, base_count, c->places, mesh->vertex_count, err);
    if (status < 0) goto refused;
    for (int32_t v = 0; v < mesh->vertex_count; v++) {
        const pliant_place at = c->places[v];
        place(c, v, &at);
        c->multires->source_index[v] = -1;
    }
    *cover = c;
    return PLIANT_OK;
refused:
    pliant_cover_destroy(c);
    return status;
}

void pliant_cover_destroy(pliant_cover *cover)
{
    if (!cover) return;
    free(cover->fans);
    free(cover->fan_start);
    free(cover->centre);
    free(cover->kept);
    free(cover->area);
    free(cover->normals);
    free(cover->places);
    pliant_multires_destroy(cover->multires);
    free(cover);
}

// ---- Move ----

// Where areas around v would be even: the faces' centres, weighted by their area and by what their
// corners stand for.
static void middle_of(const pliant_cover *c, int32_t v, double target[3])
{
    const pliant_mesh *mesh = c->multires->mesh;
    double sum = 0;
    target[0] = target[1] = target[2] = 0;
    for (int32_t i = c->fan_start[v]; i < c->fan_start[v + 1]; i++) {
        const int32_t *f = mesh->faces + 3 * (size_t)c->fans[i];
        const double *p = mesh->vertices + 3 * (size_t)f[0], *q = mesh->vertices + 3 * (size_t)f[1],
                     *r = mesh->vertices + 3 * (size_t)f[2];
        double n[3];
        pliant_face_normal(p, q, r, n);
        const double area =
            pliant_length(n) / 2 + (c->area[f[0]] + c->area[f[1]] + c->area[f[2]]) / 6;
        for (int k = 0; k < 3; k++) target[k] += area * (p[k] + q[k] + r[k]) / 3;
        sum += area;
    }
    const double *x = mesh->vertices + 3 * (size_t)v;
    for (int k = 0; k < 3; k++) target[k] = sum > 0 ? target[k] / sum : x[k];
}

// Walk by d unless that spoils the faces around. 1: walked.
static int try_walk(pliant_cover *c, int32_t v, const double d[3])
{
    const double before = quality_around(c, v);
    const pliant_place old = c->places[v], moved = pliant_surface_walk(c->surface, &old, d);
    place(c, v, &moved);
    if (quality_around(c, v) >= fmin(before, smooth_quality)) return 1;
    place(c, v, &old);
    return 0;
}

// How far a point is from the faces around v, squared.
static double miss(const pliant_cover *c, int32_t v, const double *x)
{
    const pliant_mesh *mesh = c->multires->mesh;
    double least = INFINITY;
    for (int32_t i = c->fan_start[v]; i < c->fan_start[v + 1]; i++) {
        const int32_t *f = mesh->faces + 3 * (size_t)c->fans[i];
        const double *p[3];
        double w[3], q[3];
        for (int k = 0; k < 3; k++) p[k] = mesh->vertices + 3 * (size_t)f[k];
        pliant_triangle_closest(p[0], p[1], p[2], x, w);
        for (int k = 0; k < 3; k++) q[k] = w[0] * p[0][k] + w[1] * p[1][k] + w[2] * p[2][k];
        least = fmin(least, pliant_squared_distance(q, x));
    }
    return least;
}

// Every vertex's share of the surface: its size and its centre. What the mesh misses weighs more.
// Returns the most that it misses, in diagonals.
static double weigh_shares(pliant_cover *c, pliant_share *share)
{
    const pliant_mesh *mesh = c->multires->mesh, *fine = c->surface->mesh;
    const size_t n = (size_t)mesh->vertex_count;
    pliant_share_out(share, c->places, mesh->vertices, mesh->vertex_count);
    memset(c->area, 0, n * sizeof *c->area);
    memset(c->centre, 0, 3 * n * sizeof *c->centre);
    const double scale = 1 / (tolerated * tolerated * c->diagonal * c->diagonal);
    double largest = 0;
    for (int32_t v = 0; v < fine->vertex_count; v++) {
        const int32_t owner = share->owner[v];
        if (owner < 0) continue;
        const double *x = fine->vertices + 3 * (size_t)v;
        const double missed = miss(c, owner, x);
        const double weight = share->areas[v] * (1 + missed * scale);
        largest = fmax(largest, missed);
        c->area[owner] += weight;
        for (int k = 0; k < 3; k++) c->centre[3 * (size_t)owner + k] += weight * x[k];
    }
    for (size_t i = 0; i < n; i++)
        for (int k = 0; k < 3; k++)
            c->centre[3 * i + k] =
                c->area[i] > 0 ? c->centre[3 * i + k] / c->area[i] : mesh->vertices[3 * i + k];
    return sqrt(largest) / c->diagonal;
}

double pliant_cover_smooth(pliant_cover *cover, pliant_share *share, int32_t sweeps)
{
    pliant_cover *c = cover;
    const int32_t n = c->multires->mesh->vertex_count;
    const double *x = c->multires->mesh->vertices;
    double missed = 0;
    for (int32_t sweep = 0; sweep < sweeps; sweep++) {
        missed = weigh_shares(c, share);
        double d[3];
        for (int32_t v = 0; v < n; v++) {
            pliant_subtract(c->centre + 3 * (size_t)v, x + 3 * (size_t)v, d);
            (void)try_walk(c, v, d);
        }
        for (int32_t i = 0; i < n; i++) {
            // To and fro, so that no direction is preferred.
            const int32_t v = sweep % 2 ? n - 1 - i : i;
            middle_of(c, v, d);
            for (int k = 0; k < 3; k++) d[k] = smooth_part * (d[k] - x[3 * (size_t)v + k]);
            (void)try_walk(c, v, d);
        }
    }
    return missed;
}

void pliant_cover_reach(pliant_cover *cover, pliant_share *share, int32_t sweeps)
{
    pliant_cover *c = cover;
    const pliant_mesh *mesh = c->multires->mesh, *fine = c->surface->mesh;
    const double least = reached * reached * c->diagonal * c->diagonal;
    for (int32_t sweep = 0; sweep < sweeps; sweep++) {
        pliant_share_out(share, c->places, mesh->vertices, mesh->vertex_count);
        // The farthest of every share; area holds how far, and centre which.
        for (int32_t v = 0; v < mesh->vertex_count; v++) {
            c->area[v] = least;
            c->centre[3 * (size_t)v] = -1;
        }
        for (int32_t v = 0; v < fine->vertex_count; v++) {
            const int32_t owner = share->owner[v];
            const double missed = owner < 0 ? 0 : miss(c, owner, fine->vertices + 3 * (size_t)v);
            if (owner < 0 || !(missed > c->area[owner])) continue;
            c->area[owner] = missed;
            c->centre[3 * (size_t)owner] = v;
        }
        int32_t moved = 0;
        for (int32_t v = 0; v < mesh->vertex_count; v++) {
            const int32_t far = (int32_t)c->centre[3 * (size_t)v];
            if (far < 0) continue;
            const pliant_place old = c->places[v];
            pliant_place at = {.face = share->side[far] / 3};
            at.weight[share->side[far] % 3] = 1;
            const double before = quality_around(c, v);
            place(c, v, &at);
            if (quality_around(c, v) >= fmin(before, reach_quality)) {
                c->kept[v] = 1;
                moved++;
            } else {
                place(c, v, &old);
            }
        }
        if (moved == 0) break;
    }
}

// Two directions across n.
static void tangents(const double *n, double *u, double *v)
{
    const double pole[3] = {fabs(n[0]) < 0.6, fabs(n[0]) >= 0.6, 0};
    pliant_cross(n, pole, u);
    pliant_normalize(u);
    pliant_cross(n, u, v);
}

// Try places around v; keep the best. 1: moved.
static int search(pliant_cover *c, int32_t v)
{
    enum { DIRECTIONS = 8, RINGS = 4 };
    const double *x = c->multires->mesh->vertices;
    double best = quality_around(c, v), size = 0, u[3], w[3], d[3];
    const double start = best;
    const pliant_place old = c->places[v];
    pliant_place chosen = old;
    for (int32_t i = c->fan_start[v]; i < c->fan_start[v + 1]; i++)
        for (int k = 0; k < 3; k++)
            size =
                fmax(size, sqrt(pliant_squared_distance(
                               x + 3 * (size_t)c->multires->mesh->faces[3 * (size_t)c->fans[i] + k],
                               x + 3 * (size_t)v)));
    tangents(c->normals + 3 * (size_t)v, u, w);
    middle_of(c, v, d);
    pliant_subtract(d, x + 3 * (size_t)v, d);
    for (int trial = 0; trial <= DIRECTIONS * RINGS; trial++) {
        if (trial > 0) {
            const double angle = (trial - 1) % DIRECTIONS * 2 * acos(-1.0) / DIRECTIONS;
            const double radius = ldexp(size, -1 - (trial - 1) / DIRECTIONS);
            for (int k = 0; k < 3; k++) d[k] = radius * (cos(angle) * u[k] + sin(angle) * w[k]);
        }
        const pliant_place at = pliant_surface_walk(c->surface, &old, d);
        place(c, v, &at);
        const double quality = quality_around(c, v);
        if (!(quality > best)) continue;
        best = quality;
        chosen = at;
    }
    place(c, v, &chosen);
    return best > start;
}

int32_t pliant_cover_improve(pliant_cover *cover, int32_t sweeps)
{
    pliant_cover *c = cover;
    const int32_t n = c->multires->mesh->vertex_count;
    for (int32_t sweep = 0; sweep < sweeps; sweep++) {
        int32_t moved = 0;
        for (int32_t i = 0; i < n; i++) {
            const int32_t v = sweep % 2 ? n - 1 - i : i;
            const double quality = quality_around(c, v);
            // A kept vertex waits half of the sweeps for its neighbours.
            if (c->kept[v] && (quality >= kept_quality || 2 * sweep < sweeps)) continue;
            if (quality < poor_quality) moved += search(c, v);
        }
        if (moved == 0 && 2 * sweep >= sweeps) break;
    }
    int32_t poor = 0;
    for (int32_t f = 0; f < c->multires->mesh->face_count; f++)
        poor += quality_of(c, f) < poor_quality;
    return poor;
}

int32_t pliant_cover_turn(pliant_cover *cover, const pliant_surface *original,
                          const pliant_face_tree *tree, int32_t sweeps)
{
    pliant_cover *c = cover;
    const pliant_mesh *mesh = c->multires->mesh;
    int32_t turned = 0;
    c->original = original;
    c->tree = tree;
    for (int32_t sweep = 0; sweep < sweeps; sweep++) {
        turned = 0;
        int32_t moved = 0;
        for (int32_t f = 0; f < mesh->face_count; f++) {
            const int32_t *v = mesh->faces + 3 * (size_t)f;
            if (quality_beside(c, v) >= turned_quality) continue;
            turned++;
            // The neighbours may have to make room.
            for (int k = 0; k < 3; k++)
                for (int32_t i = c->fan_start[v[k]]; i < c->fan_start[v[k] + 1]; i++)
                    for (int j = 0; j < 3; j++)
                        moved += search(c, mesh->faces[3 * (size_t)c->fans[i] + j]);
        }
        if (moved == 0) break;
    }
    c->tree = NULL;
    return turned;
}
