// camera.c: from the model's space to the picture: a view from a direction, mildly perspective.
#include "camera.h"

#include <math.h>
#include <stddef.h>

// Eye's distance in radii of the scene: a field of view of about 16 degrees, near enough to give
// depth, far enough to leave proportions alone.
#define DISTANCE_RADII 7.0

static double dot(const double *a, const double *b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

pliant_camera pliant_camera_aim(double azimuth, double elevation, const double *points,
                                int32_t count)
{
    const double degree = acos(-1.0) / 180;
    const double ca = cos(azimuth * degree), sa = sin(azimuth * degree);
    const double ce = cos(elevation * degree), se = sin(elevation * degree);
    pliant_camera camera = {
        .right = {-sa, ca, 0},
        .up = {-ca * se, -sa * se, ce},
        .back = {ca * ce, sa * ce, se},
        .scale = 1,
    };
    double low[3], high[3];
    for (int c = 0; c < 3; c++) {
        low[c] = INFINITY;
        high[c] = -INFINITY;
        for (int32_t i = 0; i < count; i++) {
            low[c] = fmin(low[c], points[3 * (size_t)i + c]);
            high[c] = fmax(high[c], points[3 * (size_t)i + c]);
        }
        camera.target[c] = low[c] / 2 + high[c] / 2;
    }
    double radius = 0;
    for (int32_t i = 0; i < count; i++) {
        double r[3];
        for (int c = 0; c < 3; c++) r[c] = points[3 * (size_t)i + c] - camera.target[c];
        radius = fmax(radius, sqrt(dot(r, r)));
    }
    camera.radius = radius;
    camera.distance = radius > 0 ? DISTANCE_RADII * radius : 1;
    return camera;
}

void pliant_camera_fit(pliant_camera *camera, const double *points, int32_t count,
                       const pliant_frame *frame)
{
    camera->scale = 1;
    camera->offset[0] = camera->offset[1] = 0;
    double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
    for (int32_t i = 0; i < count; i++) {
        double seen[3];
        pliant_camera_project(camera, points + 3 * (size_t)i, seen);
        for (int c = 0; c < 2; c++) {
            low[c] = fmin(low[c], seen[c]);
            high[c] = fmax(high[c], seen[c]);
        }
    }
    const double width = high[0] - low[0], height = high[1] - low[1];
    double scale = INFINITY;
    if (width > 0) scale = fmin(scale, frame->width / width);
    if (height > 0) scale = fmin(scale, frame->height / height);
    if (!isfinite(scale)) scale = 1;
    camera->scale = scale;
    camera->offset[0] = frame->x + frame->width / 2 - scale * (low[0] + high[0]) / 2;
    camera->offset[1] = frame->y + frame->height / 2 - scale * (low[1] + high[1]) / 2;
}

void pliant_camera_project(const pliant_camera *camera, const double *point, double *seen)
{
    const double r[3] = {point[0] - camera->target[0], point[1] - camera->target[1],
                         point[2] - camera->target[2]};
    const double nearer = camera->scale / (1 - dot(r, camera->back) / camera->distance);
    seen[0] = camera->offset[0] + nearer * dot(r, camera->right);
    seen[1] = camera->offset[1] - nearer * dot(r, camera->up);
    seen[2] = camera->distance - dot(r, camera->back);
}
