// remesh.c: a semi-regular mesh, with its levels, of an arbitrary closed one (GF 4.2.1).
#include "remesh/remesh.h"

#include "remesh/cover.h"
#include "remesh/vector.h"

#include "pliant/error.h"

#include <stdlib.h>
#include <string.h>

// The map is as fine as the mesh that it goes to: a coarse one is split (flat) until it has so many
// faces, and so many for every vertex that is asked for.
static const double least_faces = 60000, faces_a_vertex = 8;
static const double most_faces = 4e6;
// Where one mesh is asked for that is small, so many are enough.
static const double few_faces = 8000;
// Bases that are tried, from the smallest: each half as large again.
enum { FIRST_BASE = 12 };
static const double base_step = 1.5;
// Vertices of the finest level, where the tool chooses; of a second round, if none does.
static const double usual_size = 12000, large_size = 26000;
enum { AUTO_LEVEL_LIMIT = 6 };
// So many tries in a row that were no better end the search: what cannot be met is not tried for ever.
enum { PATIENCE = 4 };
// Measured distances are samples: stay this much under the aim, and over the angle.
static const double margin = 0.95;
// A base whose mesh still misses so much after the first sweeps, in diagonals, is given up.
static const double hopeless = 0.04;
enum {
    FIRST_SWEEPS = 6,
    SMOOTH_SWEEPS = 20,
    IMPROVE_SWEEPS = 20,
    TURN_SWEEPS = 20,
    REACH_SWEEPS = 3
};

typedef struct work {
    const pliant_mesh *mesh;
    pliant_surface *original;
    pliant_face_tree *tree;
    pliant_multires *split;  // the same shape in more faces
    pliant_surface *surface;
    pliant_coarsening *coarsening;
    pliant_share *share;
    pliant_cover *best;
    pliant_remesh_report report;  // of the best
    double worst;                 // how far it is from the aims: met when at most 1
    int32_t tried_count;
    int32_t fruitless;  // tries in a row that were no better
} work;

static void release(work *w)
{
    pliant_cover_destroy(w->best);
    pliant_share_destroy(w->share);
    pliant_coarsening_destroy(w->coarsening);
    pliant_surface_destroy(w->surface);
    pliant_multires_destroy(w->split);
    pliant_face_tree_destroy(w->tree);
    pliant_surface_destroy(w->original);
}

// Vertices of the finest level: every level adds one for each of 3/2 edges a face.
static double finest_count(const work *w, double base, int32_t levels)
{
    const double characteristic = w->mesh->vertex_count - w->mesh->face_count / 2;
    return ldexp(base - characteristic, 2 * levels) + characteristic;
}

static pliant_status prepare(work *w, double wanted, pliant_error *err)
{
    pliant_status status = pliant_surface_create(w->mesh, &w->original, err);
    if (status == PLIANT_OK) status = pliant_face_tree_create(w->mesh, &w->tree, err);
    if (status < 0) return status;
    const double faces =
        fmin(fmax(wanted > 0 ? few_faces : least_faces, faces_a_vertex * wanted), most_faces);
    int32_t splits = 0;
    while (ldexp(w->mesh->face_count, 2 * splits) < faces) splits++;
    status = pliant_multires_subdivide(w->mesh, splits, PLIANT_SUBDIVIDE_MIDPOINT, &w->split, err);
    if (status == PLIANT_OK) status = pliant_surface_create(w->split->mesh, &w->surface, err);
    if (status == PLIANT_OK) status = pliant_coarsening_create(w->split->mesh, &w->coarsening, err);
    if (status == PLIANT_OK) status = pliant_share_create(w->surface, &w->share, err);
    return status;
}

// One base and its levels, from start to measure; kept if it is better than what there is.
static pliant_status try_base(work *w, int32_t base, int32_t levels, pliant_error *err)
{
    pliant_cover *cover = NULL;
    pliant_remesh_report r = {.base_vertices = base, .levels = levels};
    pliant_status status =
        pliant_cover_create(w->coarsening, w->surface, base, levels, &cover, err);
    if (status < 0) return status;
    const double missed = pliant_cover_smooth(cover, w->share, FIRST_SWEEPS);
    if (w->best && missed > hopeless) {
        w->tried_count++;
        pliant_cover_destroy(cover);
        return PLIANT_OK;
    }
    (void)pliant_cover_smooth(cover, w->share, SMOOTH_SWEEPS - FIRST_SWEEPS);
    pliant_cover_reach(cover, w->share, REACH_SWEEPS);
    (void)pliant_cover_improve(cover, IMPROVE_SWEEPS);
    (void)pliant_cover_turn(cover, w->original, w->tree, TURN_SWEEPS);
    status = pliant_fit_measure(w->original, w->tree, cover->multires->mesh, &r.fit, err);
    if (status < 0) {
        pliant_cover_destroy(cover);
        return status;
    }
    w->tried_count++;
    double worst = fmax(fmax(r.fit.there, r.fit.back) / (margin * PLIANT_REMESH_DISTANCE),
                        PLIANT_REMESH_ANGLE / (margin * fmax(r.fit.smallest_angle, 1e-3)));
    if (r.fit.flipped_count > 0) worst = fmax(worst, 1) * (1 + r.fit.flipped_count);
    if (w->best && !(worst < w->worst)) {
        w->fruitless++;
        pliant_cover_destroy(cover);
        return PLIANT_OK;
    }
    w->fruitless = 0;
    pliant_cover_destroy(w->best);
    w->best = cover;
    w->worst = worst;
    w->report = r;
    w->report.met = worst <= 1;
    return PLIANT_OK;
}

static int32_t deepest(const work *w, int32_t base, double size)
{
    int32_t levels = 1;
    while (levels < AUTO_LEVEL_LIMIT && finest_count(w, base, levels + 1) <= size) levels++;
    return levels;
}

// From the smallest base on, until one meets the aims, or several in a row are no better than those
// before.
static pliant_status choose(work *w, int32_t levels, pliant_error *err)
{
    const int32_t least = pliant_coarsening_least(w->coarsening),
                  most = w->split->mesh->vertex_count;
    const double sizes[] = {usual_size, large_size};
    for (int round = 0; round < 2; round++) {
        w->fruitless = 0;
        double base = least > FIRST_BASE ? least : most < FIRST_BASE ? most : FIRST_BASE;
        for (; base <= most; base = ceil(base_step * base)) {
            const int32_t n = (int32_t)base;
            const int32_t l = levels >= 0 ? levels : deepest(w, n, sizes[round]);
            if (finest_count(w, n, l) > sizes[round] && w->best) break;
            if (w->fruitless >= PATIENCE) break;
            // The second round has nothing new for what the first did as deeply.
            if (round == 1 && finest_count(w, n, l) <= sizes[0]) continue;
            const pliant_status status = try_base(w, n, l, err);
            if (status < 0 || w->worst <= 1) return status;
        }
    }
    return PLIANT_OK;
}

// The vertex of the input that is nearest to each, unless another is nearer to that.
static void name_sources(const work *w, const pliant_multires *m, double *distance, int32_t *owner)
{
    for (int32_t v = 0; v < w->mesh->vertex_count; v++) owner[v] = -1;
    for (int32_t v = 0; v < m->mesh->vertex_count; v++) {
        const double *x = m->mesh->vertices + 3 * (size_t)v;
        double squared;
        const pliant_place at = pliant_face_tree_closest(w->tree, x, &squared);
        int32_t nearest = -1;
        double least = INFINITY;
        for (int k = 0; k < 3; k++) {
            const int32_t corner = w->mesh->faces[3 * (size_t)at.face + k];
            const double d = pliant_squared_distance(w->mesh->vertices + 3 * (size_t)corner, x);
            if (d < least) {
                least = d;
                nearest = corner;
            }
        }
        m->source_index[v] = -1;
        if (owner[nearest] >= 0 && !(least < distance[nearest])) continue;
        if (owner[nearest] >= 0) m->source_index[owner[nearest]] = -1;
        owner[nearest] = v;
        distance[nearest] = least;
        m->source_index[v] = nearest;
    }
}

static pliant_status find_sources(const work *w, const pliant_multires *m, pliant_error *err)
{
    const size_t n = (size_t)w->mesh->vertex_count;
    double *distance = malloc(n * sizeof *distance);
    int32_t *owner = malloc(n * sizeof *owner);
    pliant_status status = PLIANT_OK;
    if (!distance || !owner)
        status = pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for %zu vertices", n);
    else name_sources(w, m, distance, owner);
    free(owner);
    free(distance);
    return status;
}

pliant_status pliant_remesh(const pliant_mesh *mesh, const pliant_remesh_def *def,
                            pliant_multires **multires, pliant_remesh_report *report,
                            pliant_error *err)
{
    work w = {.mesh = mesh};
    double wanted = 0;
    if (def->base_vertices > 0) {
        wanted = finest_count(&w, def->base_vertices, def->levels > 0 ? def->levels : 0);
        if (wanted > INT32_MAX / 8)
            return pliant_error_set(
                err, PLIANT_ERR_ARGUMENT,
                "%d base vertices and %d levels make %.3g vertices, expected at most %d",
                def->base_vertices, def->levels, wanted, INT32_MAX / 8);
    }
    pliant_status status = prepare(&w, wanted, err);
    if (status == PLIANT_OK && def->base_vertices > 0) {
        const int32_t least = pliant_coarsening_least(w.coarsening),
                      most = w.split->mesh->vertex_count;
        if (def->base_vertices < least || def->base_vertices > most)
            status = pliant_error_set(
                err, PLIANT_ERR_ARGUMENT,
                "base vertices: expected from %d, what the shape allows, to %d, found %d", least,
                most, def->base_vertices);
        else
            status = try_base(
                &w, def->base_vertices,
                def->levels >= 0 ? def->levels : deepest(&w, def->base_vertices, usual_size), err);
    } else if (status == PLIANT_OK) {
        status = choose(&w, def->levels, err);
    }
    if (status == PLIANT_OK) status = find_sources(&w, w.best->multires, err);
    if (status == PLIANT_OK) {
        *report = w.report;
        report->tried_count = w.tried_count;
        *multires = w.best->multires;
        w.best->multires = NULL;
    }
    release(&w);
    return status;
}
