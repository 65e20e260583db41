// raster.c: triangles into a supersampled picture with a depth buffer.
//
// This follows: J. Pineda, A parallel algorithm for polygon rasterization, SIGGRAPH 1988, with the
// usual rule that a sample on an edge belongs to the triangle on one side of it only.
#include "raster.h"

#include "pliant/error.h"

#include <math.h>
#include <stdlib.h>

#define SUBSTEPS    256      // of a sample's step: exact for the coordinates below in int64_t
#define FAR_OUTSIDE 65536.0  // pixels: further out, a triangle is left out

pliant_status pliant_raster_create(int32_t width, int32_t height, int32_t samples,
                                   pliant_raster **raster, pliant_error *err)
{
    if (width < 1 || height < 1 || width > PLIANT_RASTER_SIDE_LIMIT ||
        height > PLIANT_RASTER_SIDE_LIMIT || samples < 1 || samples > 8)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "picture of %d x %d pixels with %d samples: expected 1 to %d "
                                "pixels and 1 to 8 samples",
                                width, height, samples, PLIANT_RASTER_SIDE_LIMIT);
    const size_t count = (size_t)width * (size_t)samples * (size_t)height * (size_t)samples;
    pliant_raster *r = calloc(1, sizeof *r);
    if (r) {
        r->colour = malloc(3 * count * sizeof *r->colour);
        r->depth = malloc(count * sizeof *r->depth);
    }
    if (!r || !r->colour || !r->depth) {
        pliant_raster_destroy(r);
        return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for %d x %d pixels", width,
                                height);
    }
    r->width = width;
    r->height = height;
    r->samples = samples;
    r->right = width;
    r->bottom = height;
    *raster = r;
    return PLIANT_OK;
}

void pliant_raster_destroy(pliant_raster *raster)
{
    if (!raster) return;
    free(raster->depth);
    free(raster->colour);
    free(raster);
}

void pliant_raster_clear(pliant_raster *raster, const float *colour)
{
    const size_t count = (size_t)raster->width * (size_t)raster->height * (size_t)raster->samples *
                         (size_t)raster->samples;
    for (size_t i = 0; i < count; i++) {
        for (int c = 0; c < 3; c++) raster->colour[3 * i + (size_t)c] = colour[c];
        raster->depth[i] = INFINITY;
    }
}

// Twice the signed area of (a, b, p), in squared substeps.
static int64_t edge(const int64_t *a, const int64_t *b, int64_t x, int64_t y)
{
    return (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]);
}

// Samples on the edge a-b belong to this triangle (whose inside has edge() > 0) when the edge runs
// one way and to its neighbour when it runs the other way, as the neighbour sees it.
static int64_t owns_edge(const int64_t *a, const int64_t *b)
{
    return b[1] > a[1] || (b[1] == a[1] && b[0] > a[0]) ? 0 : -1;
}

static int32_t clamp(int64_t value, int32_t low, int32_t high)
{
    return value < low ? low : value > high ? high : (int32_t)value;
}

void pliant_raster_triangle(pliant_raster *raster, const pliant_raster_corner *corners,
                            pliant_raster_shader *shader, const void *context)
{
    const int32_t columns = raster->width * raster->samples;
    int64_t p[3][2];
    for (int k = 0; k < 3; k++) {
        // Written so that NaN is left out, too.
        if (!(fabs((double)corners[k].x) < FAR_OUTSIDE && fabs((double)corners[k].y) < FAR_OUTSIDE))
            return;
        p[k][0] = llround((double)corners[k].x * raster->samples * SUBSTEPS);
        p[k][1] = llround((double)corners[k].y * raster->samples * SUBSTEPS);
    }
    const int64_t area = edge(p[0], p[1], p[2][0], p[2][1]);
    if (area == 0) return;
    const int v[3] = {0, area > 0 ? 1 : 2, area > 0 ? 2 : 1};
    const int64_t *a = p[v[0]], *b = p[v[1]], *c = p[v[2]];
    const int64_t bias[3] = {owns_edge(b, c), owns_edge(c, a), owns_edge(a, b)};

    int64_t low[2], high[2];
    for (int k = 0; k < 2; k++) {
        low[k] = a[k] < b[k] ? a[k] : b[k];
        if (c[k] < low[k]) low[k] = c[k];
        high[k] = a[k] > b[k] ? a[k] : b[k];
        if (c[k] > high[k]) high[k] = c[k];
    }
    // Sample i lies at (i + 1/2) SUBSTEPS; division rounds towards zero, so take one more each way.
    const int32_t left = raster->left * raster->samples, right = raster->right * raster->samples;
    const int32_t top = raster->top * raster->samples, bottom = raster->bottom * raster->samples;
    const int32_t first_column = clamp(low[0] / SUBSTEPS - 1, left, right);
    const int32_t last_column = clamp(high[0] / SUBSTEPS + 1, left - 1, right - 1);
    const int32_t first_row = clamp(low[1] / SUBSTEPS - 1, top, bottom);
    const int32_t last_row = clamp(high[1] / SUBSTEPS + 1, top - 1, bottom - 1);

    const double whole = 1.0 / (double)llabs(area);
    const int overlay = corners[0].depth == -INFINITY;
    for (int32_t row = first_row; row <= last_row; row++) {
        const int64_t y = (int64_t)row * SUBSTEPS + SUBSTEPS / 2;
        for (int32_t column = first_column; column <= last_column; column++) {
            const int64_t x = (int64_t)column * SUBSTEPS + SUBSTEPS / 2;
            const int64_t e[3] = {edge(b, c, x, y), edge(c, a, x, y), edge(a, b, x, y)};
            if (e[0] + bias[0] < 0 || e[1] + bias[1] < 0 || e[2] + bias[2] < 0) continue;
            float weight[3];
            for (int k = 0; k < 3; k++) weight[v[k]] = (float)((double)e[k] * whole);
            float depth = -INFINITY;
            if (!overlay)
                depth = weight[0] * corners[0].depth + weight[1] * corners[1].depth +
                        weight[2] * corners[2].depth;
            const size_t at = (size_t)row * (size_t)columns + (size_t)column;
            if (!(depth <= raster->depth[at])) continue;
            raster->depth[at] = depth;
            float attribute[PLIANT_RASTER_ATTRIBUTES];
            for (int k = 0; k < PLIANT_RASTER_ATTRIBUTES; k++)
                attribute[k] = weight[0] * corners[0].attribute[k] +
                               weight[1] * corners[1].attribute[k] +
                               weight[2] * corners[2].attribute[k];
            shader(context, attribute, raster->colour + 3 * at);
        }
    }
}

// Linear light to sRGB (IEC 61966-2-1), rounded to a byte.
static uint8_t encode(float light)
{
    const double x = light <= 0 ? 0 : light >= 1 ? 1 : (double)light;
    const double s = x <= 0.0031308 ? 12.92 * x : 1.055 * pow(x, 1 / 2.4) - 0.055;
    return (uint8_t)(s * 255 + 0.5);
}

void pliant_raster_resolve(const pliant_raster *raster, uint8_t *rgb)
{
    const size_t samples = (size_t)raster->samples;
    const size_t columns = (size_t)raster->width * samples;
    const float share = 1.0f / (float)(samples * samples);
    for (size_t y = 0; y < (size_t)raster->height; y++)
        for (size_t x = 0; x < (size_t)raster->width; x++)
            for (size_t c = 0; c < 3; c++) {
                float sum = 0;
                for (size_t j = 0; j < samples; j++)
                    for (size_t i = 0; i < samples; i++)
                        sum +=
                            raster->colour[3 * ((y * samples + j) * columns + x * samples + i) + c];
                rgb[3 * (y * (size_t)raster->width + x) + c] = encode(sum * share);
            }
}
