// camera.h: from the model's space to the picture: a view from a direction, mildly perspective.
//
// z is up. Azimuth 0 looks from +x, 90 from +y; elevation 90 looks straight down.
#pragma once

#include "pliant/base.h"

typedef struct pliant_camera {
    double right[3], up[3], back[3];  // unit vectors; back points from the scene to the viewer
    double target[3];                 // what the camera looks at
    double radius;                    // of the scene around the target
    double distance;                  // of the eye from the target
    double scale;                     // pixels per unit of length at the target
    double offset[2];                 // pixels: where the target appears
} pliant_camera;

// A rectangle of the picture, in pixels.
typedef struct pliant_frame {
    double x, y, width, height;
} pliant_frame;

// Look at a cloud of points, shape [count][3], from a direction in degrees, from far enough away to
// have all of it in front.
pliant_camera pliant_camera_aim(double azimuth, double elevation, const double *points,
                                int32_t count);

// Scale and shift the view so that the points just fill the frame, centred.
void pliant_camera_fit(pliant_camera *camera, const double *points, int32_t count,
                       const pliant_frame *frame);

// Where a point appears: seen[0], seen[1] in pixels (y down), seen[2] depth, larger farther away.
void pliant_camera_project(const pliant_camera *camera, const double *point, double *seen);
