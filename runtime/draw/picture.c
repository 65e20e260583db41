// picture.c: the whole picture: one panel for each state of a body, and a legend.
#include "picture.h"

#include "camera.h"
#include "colour_map.h"
#include "label.h"
#include "paint.h"
#include "pliant/error.h"
#include "surface.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define SAMPLES         3       // along a pixel's side
#define GAP             0.035   // around the panels, in heights of the picture
#define ARROW_GAP       0.09    // the same when arrows need room
#define ARROW_LENGTH    0.26    // in radii of the scene
#define ARROW_THICKNESS 0.009   // in sides of the panel's frame
#define ARROW_HEAD      3.6     // in thicknesses
#define PATCH_REACH     0.15    // in radii of the scene: marks nearer to each other share an arrow
#define DOT_RADIUS      0.0045  // of a contact's vertices, in sides of the panel's frame

typedef struct layout {
    double dot;  // pixels to a dot of the font
    double gap;
    int32_t columns, rows;
    double panel_width, panel_height;
    double legend_y;
    int32_t has_legend;
} layout;

typedef struct palette {
    float paper[3], ink[3], halo[3];
} palette;

pliant_picture_def pliant_picture_default(void)
{
    return (pliant_picture_def){
        .width = 1200, .height = 640, .azimuth = -60, .elevation = 18, .magnify = 1};
}

static palette make_palette(void)
{
    palette p;
    pliant_colour_from_oklch(0.975, 0.004, 250, p.paper);
    pliant_colour_from_oklch(0.32, 0.04, 255, p.ink);
    pliant_colour_from_oklch(1, 0, 0, p.halo);
    return p;
}

static layout lay_out(const pliant_picture_def *def, const pliant_body_shape *shape,
                      const pliant_panel *panels, int32_t panel_count)
{
    layout l = {0};
    int32_t mark_count = 0;
    for (int32_t k = 0; k < panel_count; k++) {
        if (panels[k].displacement && !shape->hue) l.has_legend = 1;
        if (panels[k].mark_count > mark_count) mark_count = panels[k].mark_count;
    }
    l.columns = def->columns > 0 && def->columns < panel_count ? def->columns : panel_count;
    l.rows = (panel_count + l.columns - 1) / l.columns;
    // Whole pixels to a dot keep the letters even.
    l.dot = fmax(1, floor(fmin(def->width / 400.0, def->height / 270.0)));
    l.gap = (mark_count > 0 ? ARROW_GAP : GAP) * def->height;
    const double legend = l.has_legend ? 4.2 * PLIANT_LABEL_HEIGHT * l.dot : 0;
    l.legend_y = def->height - legend;
    l.panel_width = (double)def->width / l.columns;
    l.panel_height = l.legend_y / l.rows;
    return l;
}

static pliant_frame frame_of(const layout *l, int32_t panel)
{
    const double label = 2.2 * PLIANT_LABEL_HEIGHT * l->dot;
    const double gap = fmin(l->gap, fmin(l->panel_width, l->panel_height) / 8);
    return (pliant_frame){
        .x = (panel % l->columns) * l->panel_width + gap,
        .y = (panel / l->columns) * l->panel_height + gap,
        .width = fmax(l->panel_width - 2 * gap, 1),
        .height = fmax(l->panel_height - 2 * gap - label, 1),
    };
}

// The next larger of 1, 1.5, 2, 2.5, 3, 4, 5, 6, 8 times a power of ten.
static double round_up(double value)
{
    static const double steps[] = {1, 1.5, 2, 2.5, 3, 4, 5, 6, 8, 10};
    if (!(value > 0)) return 1;
    const double power = pow(10, floor(log10(value)));
    for (size_t i = 0; i < sizeof steps / sizeof *steps; i++)
        if (steps[i] * power >= value * (1 - 1e-6)) return steps[i] * power;
    return 10 * power;
}

// Where the panel's vertices are drawn, and how far they moved: positions[n][3], moved[n].
static pliant_status deform(const pliant_body_shape *shape, const pliant_panel *panel,
                            double magnify, double *positions, float *moved, pliant_error *err)
{
    for (int32_t v = 0; v < shape->vertex_count; v++) {
        double u[3] = {0, 0, 0};
        if (panel->displacement) {
            u[0] = (double)panel->displacement[v].x;
            u[1] = (double)panel->displacement[v].y;
            u[2] = (double)panel->displacement[v].z;
        }
        moved[v] = (float)sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2]);
        for (int c = 0; c < 3; c++) {
            const double p = shape->rest[3 * (size_t)v + c] + magnify * u[c];
            if (!(fabs(p) < 1e30))
                return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                        "%s: vertex %d: expected a finite displacement, found %g",
                                        panel->label, v, u[c]);
            positions[3 * (size_t)v + c] = p;
        }
    }
    return PLIANT_OK;
}

// ---- Contacts ----

// Marks near each other that go the same way, together.
typedef struct patch {
    int32_t count;
    double centre[3], direction[3], normal[3];  // sums over the marks
    int32_t middle;                             // vertex nearest to the centre: carries the arrow
    double distance;                            // squared, of the middle from the centre
} patch;

static double dot(const double *a, const double *b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static int32_t root_of(int32_t *group, int32_t i)
{
    while (group[i] != i) i = group[i] = group[group[i]];
    return i;
}

static void add_normal(const double *positions, const int32_t *v, double *sum)
{
    const double *a = positions + 3 * (size_t)v[0], *b = positions + 3 * (size_t)v[1],
                 *c = positions + 3 * (size_t)v[2];
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        sum[i] += (b[j] - a[j]) * (c[k] - a[k]) - (b[k] - a[k]) * (c[j] - a[j]);
    }
}

static void subtract(const double *a, const double *b, double *difference)
{
    for (int c = 0; c < 3; c++) difference[c] = a[c] - b[c];
}

// group[i] becomes the first mark of the patch of mark i; patches[] is filled at first marks.
// mark_of is scratch, shape [vertex_count].
static void find_patches(const pliant_body_shape *shape, const pliant_panel *panel,
                         const double *positions, double reach, int32_t *mark_of, int32_t *group,
                         patch *patches)
{
    const pliant_mark *marks = panel->marks;
    for (int32_t i = 0; i < panel->mark_count; i++) {
        group[i] = i;
        for (int32_t j = 0; j < i; j++) {
            double apart[3];
            subtract(shape->rest + 3 * (size_t)marks[i].vertex,
                     shape->rest + 3 * (size_t)marks[j].vertex, apart);
            if (dot(apart, apart) > reach * reach) continue;
            if (dot(marks[i].direction, marks[j].direction) < 0) continue;
            const int32_t a = root_of(group, i), b = root_of(group, j);
            group[a > b ? a : b] = a < b ? a : b;
        }
    }
    for (int32_t v = 0; v < shape->vertex_count; v++) mark_of[v] = -1;
    for (int32_t i = 0; i < panel->mark_count; i++) {
        group[i] = root_of(group, i);
        mark_of[marks[i].vertex] = i;
        patch *p = &patches[group[i]];
        if (group[i] == i) *p = (patch){.distance = INFINITY};
        p->count++;
        for (int c = 0; c < 3; c++) {
            p->centre[c] += positions[3 * (size_t)marks[i].vertex + c];
            p->direction[c] += marks[i].direction[c];
        }
    }
    for (int32_t f = 0; f < shape->face_count; f++)
        for (int k = 0; k < 3; k++) {
            const int32_t *v = shape->faces + 3 * (size_t)f;
            if (mark_of[v[k]] >= 0) add_normal(positions, v, patches[group[mark_of[v[k]]]].normal);
        }
    for (int32_t i = 0; i < panel->mark_count; i++) {
        patch *p = &patches[group[i]];
        double apart[3];
        for (int c = 0; c < 3; c++)
            apart[c] = positions[3 * (size_t)marks[i].vertex + c] - p->centre[c] / p->count;
        if (dot(apart, apart) >= p->distance) continue;
        p->distance = dot(apart, apart);
        p->middle = marks[i].vertex;
    }
}

// A push ends with its point on the patch; a pull begins there.
static void draw_arrow(const pliant_camera *camera, const palette *colours, const patch *contact,
                       const double *at, double thickness, pliant_raster *raster)
{
    const double size = sqrt(dot(contact->direction, contact->direction));
    if (!(size > 0)) return;
    const int pull = dot(contact->direction, contact->normal) > 0;
    double ends[2][3], seen[2][3];
    for (int c = 0; c < 3; c++) {
        const double step = ARROW_LENGTH * camera->radius * contact->direction[c] / size;
        ends[0][c] = pull ? at[c] : at[c] - step;
        ends[1][c] = pull ? at[c] + step : at[c];
    }
    for (int k = 0; k < 2; k++) pliant_camera_project(camera, ends[k], seen[k]);
    // A halo beneath makes the arrow stand out on any colour.
    const double head = ARROW_HEAD * thickness;
    pliant_paint_arrow(raster, seen[0][0], seen[0][1], seen[1][0], seen[1][1], thickness, head,
                       0.6 * thickness, colours->halo);
    pliant_paint_arrow(raster, seen[0][0], seen[0][1], seen[1][0], seen[1][1], thickness, head, 0,
                       colours->ink);
}

static pliant_status draw_marks(const pliant_body_shape *shape, const pliant_panel *panel,
                                const double *positions, const pliant_camera *camera,
                                const palette *colours, const pliant_frame *frame,
                                pliant_raster *raster, pliant_error *err)
{
    if (panel->mark_count == 0) return PLIANT_OK;
    pliant_status status = PLIANT_OK;
    const size_t count = (size_t)panel->mark_count;
    int32_t *mark_of = malloc((size_t)shape->vertex_count * sizeof *mark_of);
    int32_t *group = malloc(count * sizeof *group);
    patch *patches = malloc(count * sizeof *patches);
    if (!mark_of || !group || !patches) {
        status = pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for the marks");
        goto done;
    }
    find_patches(shape, panel, positions, PATCH_REACH * camera->radius, mark_of, group, patches);
    const double side = fmin(frame->width, frame->height);
    for (int32_t i = 0; i < panel->mark_count; i++) {
        double seen[3];
        pliant_camera_project(camera, positions + 3 * (size_t)panel->marks[i].vertex, seen);
        // Nearer by a little, or the surface that it lies on would hide half of it.
        pliant_paint_disc(raster, seen[0], seen[1], seen[2] - 0.03 * camera->radius,
                          fmax(DOT_RADIUS * side, 1), colours->ink);
    }
    for (int32_t i = 0; i < panel->mark_count; i++)
        if (group[i] == i)
            draw_arrow(camera, colours, &patches[i], positions + 3 * (size_t)patches[i].middle,
                       fmax(ARROW_THICKNESS * side, 1), raster);

done:
    free(patches);
    free(group);
    free(mark_of);
    return status;
}

// ---- Legend ----

static void draw_centred(pliant_raster *raster, const char *text, double x, double y, double dot,
                         const float *colour)
{
    pliant_label_draw(raster, text, floor(x - pliant_label_width(text) * dot / 2), floor(y), dot,
                      colour);
}

static void draw_legend(pliant_raster *raster, const layout *l, const palette *colours,
                        int has_held, double range, double magnify)
{
    const double letter = PLIANT_LABEL_HEIGHT * l->dot;
    const double width = floor(fmin(0.36 * raster->width, 100 * letter));
    const double left = floor((raster->width - width) / 2), top = floor(l->legend_y + 0.7 * letter);
    for (int32_t x = 0; x < (int32_t)width; x++) {
        float colour[3];
        pliant_colour_map_at((float)((x + 0.5) / width), colour);
        pliant_paint_rectangle(raster, left + x, top, 1, letter, colour);
    }
    char text[64];
    for (int k = 0; k <= 2; k++) {
        const double x = left + floor(width * k / 2);
        pliant_paint_rectangle(raster, x - floor(l->dot / 2), top + letter, l->dot, 0.4 * letter,
                               colours->ink);
        snprintf(text, sizeof text, "%.3g", range * k / 2);
        draw_centred(raster, text, x, top + 1.7 * letter, l->dot, colours->ink);
    }
    pliant_label_draw(raster, "displacement",
                      left - (pliant_label_width("displacement") + 6) * l->dot, top, l->dot,
                      colours->ink);
    const double key = left + width + 6 * l->dot;
    if (has_held) {
        float held[3];
        pliant_surface_held_colour(held);
        pliant_paint_rectangle(raster, key, top, letter, letter, held);
        pliant_label_draw(raster, "held", key + letter + 3 * l->dot, top, l->dot, colours->ink);
    }
    if (magnify != 1) {
        snprintf(text, sizeof text, "drawn %gx", magnify);
        pliant_label_draw(raster, text, key + letter + 33 * l->dot, top, l->dot, colours->ink);
    }
}

// ---- Surroundings ----

// Draw to a panel's part of the picture only, less a margin; without a layout everywhere.
static void clip(pliant_raster *raster, const layout *l, int32_t panel)
{
    const double margin = l ? l->gap / 4 : 0;
    const double left = l ? panel % l->columns * l->panel_width + margin : 0;
    const double top = l ? panel / l->columns * l->panel_height + margin : 0;
    raster->left = (int32_t)left;
    raster->top = (int32_t)top;
    raster->right = l ? (int32_t)(left + l->panel_width - 2 * margin) : raster->width;
    raster->bottom = l ? (int32_t)(top + l->panel_height - 2 * margin) : raster->height;
}

static pliant_surface surface_of(const pliant_obstacle_mesh *mesh)
{
    return (pliant_surface){.vertex_count = mesh->vertex_count,
                            .face_count = mesh->face_count,
                            .positions = mesh->positions,
                            .faces = mesh->faces,
                            .palette = PLIANT_PALETTE_ICE};
}

// Planes, what stands and lies on the first of them in shadow, then the rest. NULL: nothing.
static pliant_status draw_surroundings(const pliant_surroundings *around,
                                       const pliant_surface *bodies, const pliant_camera *camera,
                                       const pliant_frame *frame, pliant_raster *raster,
                                       pliant_error *err)
{
    if (!around) return PLIANT_OK;
    const pliant_surface planes = surface_of(&around->planes);
    const pliant_surface solids = surface_of(&around->solids);
    const pliant_surface *const shadows[] = {bodies, &solids};
    pliant_status status = pliant_surface_draw(&planes, camera, raster, err);
    for (int i = 0; status >= 0 && i < 2; i++)
        status =
            pliant_surface_shade_ground(shadows[i], camera, around->ground, frame, raster, err);
    return status < 0 ? status : pliant_surface_draw(&solids, camera, raster, err);
}

// ---- Picture ----

static pliant_status check(const pliant_picture_def *def, const pliant_body_shape *shape,
                           const pliant_panel *panels, int32_t panel_count, pliant_error *err)
{
    if (panel_count < 1 || shape->vertex_count < 1)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT, "picture of %d panels and %d vertices",
                                panel_count, shape->vertex_count);
    if (!isfinite(def->azimuth) || !(fabs(def->elevation) <= 90) || !isfinite(def->magnify) ||
        !(def->range >= 0) || !isfinite(def->range))
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "view %g,%g, magnify %g, range %g: expected finite numbers, an "
                                "elevation of -90 to 90 and a range of 0 or more",
                                def->azimuth, def->elevation, def->magnify, def->range);
    for (int32_t k = 0; k < panel_count; k++)
        for (int32_t i = 0; i < panels[k].mark_count; i++)
            if (panels[k].marks[i].vertex < 0 || panels[k].marks[i].vertex >= shape->vertex_count)
                return pliant_error_set(err, PLIANT_ERR_ARGUMENT, "mark: vertex %d of %d",
                                        panels[k].marks[i].vertex, shape->vertex_count);
    return PLIANT_OK;
}

pliant_status pliant_picture_draw(const pliant_picture_def *def, const pliant_body_shape *shape,
                                  const pliant_panel *panels, int32_t panel_count, uint8_t *rgb,
                                  pliant_error *err)
{
    pliant_status status = check(def, shape, panels, panel_count, err);
    if (status < 0) return status;
    pliant_raster *raster = NULL;
    const size_t n = (size_t)shape->vertex_count;
    // Every panel's positions, so that one camera frames them all.
    double *positions = malloc(n * 3 * (size_t)panel_count * sizeof *positions);
    float *moved = malloc(n * (size_t)panel_count * sizeof *moved);
    if (!positions || !moved || n * (size_t)panel_count > INT32_MAX) {
        status = pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for %d panels of %d vertices",
                                  panel_count, shape->vertex_count);
        goto done;
    }
    status = pliant_raster_create(def->width, def->height, SAMPLES, &raster, err);
    if (status < 0) goto done;

    for (int32_t k = 0; k < panel_count; k++) {
        status = deform(shape, &panels[k], def->magnify, positions + 3 * n * (size_t)k,
                        moved + n * (size_t)k, err);
        if (status < 0) goto done;
    }
    double range = def->range;
    if (range == 0) {
        for (size_t i = 0; i < n * (size_t)panel_count; i++) range = fmax(range, (double)moved[i]);
        range = round_up(range);
    }
    for (size_t i = 0; i < n * (size_t)panel_count; i++)
        moved[i] = (float)((double)moved[i] / range);
    double ground[4] = {0, 0, 1, INFINITY};
    for (size_t v = 0; v < n; v++) ground[3] = fmin(ground[3], shape->rest[3 * v + 2]);

    const palette colours = make_palette();
    const layout l = lay_out(def, shape, panels, panel_count);
    const int32_t all = (int32_t)n * panel_count;
    double corners[8][3];
    for (int i = 0; i < 8; i++)
        for (int c = 0; c < 3; c++) corners[i][c] = def->region[c + 3 * (i >> c & 1)];
    const double *seen = def->has_region ? corners[0] : positions;
    const int32_t seen_count = def->has_region ? 8 : all;
    pliant_camera camera = pliant_camera_aim(def->azimuth, def->elevation, seen, seen_count);
    pliant_raster_clear(raster, colours.paper);
    for (int32_t k = 0; k < panel_count; k++) {
        const pliant_frame frame = frame_of(&l, k);
        pliant_camera_fit(&camera, seen, seen_count, &frame);
        const pliant_surface surface = {
            .vertex_count = shape->vertex_count,
            .face_count = shape->face_count,
            .positions = positions + 3 * n * (size_t)k,
            .faces = shape->faces,
            .value = shape->hue ? shape->hue : moved + n * (size_t)k,
            .held = shape->held,
            .normals = panels[k].normals,
            .palette = shape->hue ? PLIANT_PALETTE_HUES : PLIANT_PALETTE_MAP,
        };
        if (panels[k].around || def->has_region) clip(raster, &l, k);
        status = draw_surroundings(panels[k].around, &surface, &camera, &frame, raster, err);
        if (status >= 0 && !panels[k].around)
            status = pliant_surface_shade_ground(&surface, &camera, ground, &frame, raster, err);
        if (status >= 0) status = pliant_surface_draw(&surface, &camera, raster, err);
        clip(raster, NULL, 0);
        if (status < 0) goto done;
        status = draw_marks(shape, &panels[k], surface.positions, &camera, &colours, &frame, raster,
                            err);
        if (status < 0) goto done;
        draw_centred(raster, panels[k].label, frame.x + frame.width / 2,
                     frame.y + frame.height + 1.2 * PLIANT_LABEL_HEIGHT * l.dot, l.dot,
                     colours.ink);
    }
    if (l.has_legend) draw_legend(raster, &l, &colours, shape->held != NULL, range, def->magnify);
    pliant_raster_resolve(raster, rgb);

done:
    pliant_raster_destroy(raster);
    free(moved);
    free(positions);
    return status;
}
