// surface.c: a lit, coloured triangle surface in a picture, and its soft shadow on the ground.
#include "surface.h"

#include "colour_map.h"
#include "pliant/error.h"

#include <math.h>
#include <stdlib.h>

// Two lights and an ambient term brighter from above, fixed to the camera (right, up, back), so
// that every view is well lit. Strengths were chosen by eye to leave the colour map readable.
static const float key_light[3] = {-0.48f, 0.62f, 0.62f};
static const float fill_light[3] = {0.80f, 0.10f, 0.59f};
#define KEY_STRENGTH    0.70f
#define FILL_STRENGTH   0.20f
#define AMBIENT_BELOW   0.20f
#define AMBIENT_ABOVE   0.36f
#define GLOSS_STRENGTH  0.10f
#define GLOSS_EXPONENT  28.0f
#define HELD_TINT       0.80f
#define SHADOW_STRENGTH 0.50f
#define SHADOW_FADE                                                                                \
    0.25  // height over the ground, in widths of the frame, that casts 1/e of the shadow
#define SHADOW_BLUR 0.015  // radius of each of three box blurs, in widths of the frame
#define MAP_COUNT   512

enum { NORMAL = 0, VALUE = 3, HELD = 4 };  // a corner's attributes

typedef struct material {
    float map[MAP_COUNT + 1][3];
    float held[3];
    float halfway[3];  // between the key light and the viewer
} material;

void pliant_surface_held_colour(float *colour)
{
    pliant_colour_from_oklch(0.64, 0.085, 245, colour);
}

static float dot(const float *a, const float *b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static material make_material(pliant_surface_palette palette)
{
    material m;
    for (int i = 0; i <= MAP_COUNT; i++) {
        const float value = (float)i / MAP_COUNT;
        if (palette == PLIANT_PALETTE_MAP) pliant_colour_map_at(value, m.map[i]);
        else if (palette == PLIANT_PALETTE_HUES)
            pliant_colour_from_oklch(0.80, 0.10, 360 * (double)value, m.map[i]);
        else pliant_colour_from_oklch(0.93, 0.025, 235, m.map[i]);
    }
    pliant_surface_held_colour(m.held);
    const float sum[3] = {key_light[0], key_light[1], key_light[2] + 1};
    for (int c = 0; c < 3; c++) m.halfway[c] = sum[c] / sqrtf(dot(sum, sum));
    return m;
}

static void shade(const void *context, const float *attribute, float *colour)
{
    const material *m = context;
    const float length = sqrtf(dot(attribute, attribute));
    float n[3] = {0, 0, 1};
    if (length > 0)
        for (int c = 0; c < 3; c++) n[c] = attribute[NORMAL + c] / length;
    const float key = fmaxf(dot(n, key_light), 0), fill = fmaxf(dot(n, fill_light), 0);
    const float above = 0.5f + 0.5f * n[1];
    const float light = AMBIENT_BELOW + (AMBIENT_ABOVE - AMBIENT_BELOW) * above +
                        KEY_STRENGTH * key + FILL_STRENGTH * fill;
    const float gloss = GLOSS_STRENGTH * powf(fmaxf(dot(n, m->halfway), 0), GLOSS_EXPONENT);
    const float value = fminf(fmaxf(attribute[VALUE], 0), 1);
    const float *skin = m->map[(int)(value * MAP_COUNT + 0.5f)];
    const float tint = HELD_TINT * fminf(fmaxf(attribute[HELD], 0), 1);
    for (int c = 0; c < 3; c++)
        colour[c] = (skin[c] + tint * (m->held[c] - skin[c])) * light + gloss;
}

static void turn_normal(const pliant_camera *camera, const double *n, double length, float *turned)
{
    const double *axis[3] = {camera->right, camera->up, camera->back};
    for (int c = 0; c < 3; c++)
        turned[c] = (float)((n[0] * axis[c][0] + n[1] * axis[c][1] + n[2] * axis[c][2]) / length);
}

// Vertex normals in the camera's axes: those given, or the sum of the incident triangles' normals,
// each twice its area long. shape [vertex_count][3].
static float *find_normals(const pliant_surface *surface, const pliant_camera *camera)
{
    float *normals = calloc((size_t)surface->vertex_count + 1, 3 * sizeof *normals);
    double *sums = calloc((size_t)surface->vertex_count + 1, 3 * sizeof *sums);
    if (!normals || !sums) {
        free(sums);
        free(normals);
        return NULL;
    }
    for (int32_t f = 0; f < surface->face_count && !surface->normals; f++) {
        const int32_t *v = surface->faces + 3 * (size_t)f;
        const double *a = surface->positions + 3 * (size_t)v[0],
                     *b = surface->positions + 3 * (size_t)v[1],
                     *c = surface->positions + 3 * (size_t)v[2];
        const double p[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]};
        const double q[3] = {c[0] - a[0], c[1] - a[1], c[2] - a[2]};
        const double n[3] = {p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2],
                             p[0] * q[1] - p[1] * q[0]};
        for (int k = 0; k < 3; k++)
            for (int i = 0; i < 3; i++) sums[3 * (size_t)v[k] + i] += n[i];
    }
    for (int32_t i = 0; i < surface->vertex_count; i++) {
        double *n = sums + 3 * (size_t)i;
        if (surface->normals) {
            n[0] = (double)surface->normals[i].x;
            n[1] = (double)surface->normals[i].y;
            n[2] = (double)surface->normals[i].z;
        }
        const double length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        if (length > 0) turn_normal(camera, n, length, normals + 3 * (size_t)i);
    }
    free(sums);
    return normals;
}

pliant_status pliant_surface_draw(const pliant_surface *surface, const pliant_camera *camera,
                                  pliant_raster *raster, pliant_error *err)
{
    float *normals = find_normals(surface, camera);
    if (!normals)
        return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for the normals of %d vertices",
                                surface->vertex_count);
    const material skin = make_material(surface->palette);
    for (int32_t f = 0; f < surface->face_count; f++) {
        pliant_raster_corner corner[3];
        for (int k = 0; k < 3; k++) {
            const size_t v = (size_t)surface->faces[3 * (size_t)f + k];
            double seen[3];
            pliant_camera_project(camera, surface->positions + 3 * v, seen);
            const float *n = normals + 3 * v;
            corner[k] = (pliant_raster_corner){
                .x = (float)seen[0],
                .y = (float)seen[1],
                .depth = (float)seen[2],
                .attribute = {n[0], n[1], n[2], surface->value ? surface->value[v] : 0,
                              surface->held ? (float)surface->held[v] : 0},
            };
        }
        pliant_raster_triangle(raster, corner, shade, &skin);
    }
    free(normals);
    return PLIANT_OK;
}

// The shadow's strength is the first attribute.
static void cast(const void *context, const float *attribute, float *colour)
{
    (void)context;
    colour[0] = attribute[0];
}

// Average each entry of a line with its neighbours up to `radius` away; outside is 0.
static void blur_line(float *line, size_t stride, int32_t count, int32_t radius, float *scratch)
{
    for (int32_t i = 0; i < count; i++) scratch[i] = line[(size_t)i * stride];
    float sum = 0;
    for (int32_t i = 0; i < radius && i < count; i++) sum += scratch[i];
    for (int32_t i = 0; i < count; i++) {
        if (i + radius < count) sum += scratch[i + radius];
        if (i - radius - 1 >= 0) sum -= scratch[i - radius - 1];
        line[(size_t)i * stride] = sum / (float)(2 * radius + 1);
    }
}

pliant_status pliant_surface_shade_ground(const pliant_surface *surface,
                                          const pliant_camera *camera, const double *ground,
                                          const pliant_frame *frame, pliant_raster *raster,
                                          pliant_error *err)
{
    const double towards =
        ground[0] * camera->back[0] + ground[1] * camera->back[1] + ground[2] * camera->back[2];
    if (!(towards > 0) || !(ground[2] > 0)) return PLIANT_OK;
    const int32_t width = raster->width, height = raster->height;
    const double unit = frame->width / camera->scale;  // the frame's width in lengths
    pliant_raster *mask = NULL;
    float *scratch = malloc((size_t)(width > height ? width : height) * sizeof *scratch);
    pliant_status status = PLIANT_OK;
    if (!scratch) {
        status = pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for the shadow");
        goto done;
    }
    status = pliant_raster_create(width, height, 1, &mask, err);
    if (status < 0) goto done;
    pliant_raster_clear(mask, (const float[3]){0, 0, 0});
    for (int32_t f = 0; f < surface->face_count; f++) {
        pliant_raster_corner corner[3];
        for (int k = 0; k < 3; k++) {
            const double *p = surface->positions + 3 * (size_t)surface->faces[3 * (size_t)f + k];
            const double z = (ground[3] - ground[0] * p[0] - ground[1] * p[1]) / ground[2];
            const double h = fmax(p[2] - z, 0);
            double seen[3];
            pliant_camera_project(camera, (const double[3]){p[0], p[1], z}, seen);
            // The lowest part casts the darkest shadow, so let it win.
            corner[k] =
                (pliant_raster_corner){.x = (float)seen[0],
                                       .y = (float)seen[1],
                                       .depth = (float)h,
                                       .attribute = {(float)exp(-h / (SHADOW_FADE * unit))}};
        }
        pliant_raster_triangle(mask, corner, cast, NULL);
    }
    // Three box blurs come close to a Gaussian.
    const int32_t radius = (int32_t)ceil(SHADOW_BLUR * frame->width);
    for (int pass = 0; pass < 3; pass++) {
        for (int32_t y = 0; y < height; y++)
            blur_line(mask->colour + 3 * (size_t)y * (size_t)width, 3, width, radius, scratch);
        for (int32_t x = 0; x < width; x++)
            blur_line(mask->colour + 3 * (size_t)x, 3 * (size_t)width, height, radius, scratch);
    }
    const size_t samples = (size_t)raster->samples, columns = (size_t)width * samples;
    for (size_t y = (size_t)raster->top * samples; y < (size_t)raster->bottom * samples; y++)
        for (size_t x = (size_t)raster->left * samples; x < (size_t)raster->right * samples; x++) {
            const size_t pixel = (y / samples) * (size_t)width + x / samples;
            const float light = 1 - SHADOW_STRENGTH * fminf(fmaxf(mask->colour[3 * pixel], 0), 1);
            for (size_t c = 0; c < 3; c++) raster->colour[3 * (y * columns + x) + c] *= light;
        }

done:
    pliant_raster_destroy(mask);
    free(scratch);
    return status;
}
