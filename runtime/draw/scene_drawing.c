// scene_drawing.c: from a model and a script that plays its lattice to a picture file.
#include "scene_drawing.h"

#include "picture.h"
#include "png_file.h"
#include "recorder.h"
#include "scene_recording.h"

#include "pliant/error.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// Hues of instances that follow each other are this much of the circle apart, so that neighbours
// are told apart: the golden ratio's fraction, which never comes near where it was.
static const double hue_step = 0.6180339887498949;

// All instances as one body.
typedef struct stage {
    double *rest;    // [vertex_count][3]
    int32_t *faces;  // [face_count][3]
    float *hue;      // [vertex_count]; NULL: one instance, coloured by how far it moved
    pliant_body_shape shape;
    double low[3], high[3];       // of all states' surfaces
    pliant_surroundings *around;  // [state count]
    int32_t state_count;
} stage;

static void strike(stage *s)
{
    for (int32_t k = 0; s->around && k < s->state_count; k++) {
        pliant_obstacle_mesh_clear(&s->around[k].planes);
        pliant_obstacle_mesh_clear(&s->around[k].solids);
    }
    free(s->around);
    free(s->hue);
    free(s->faces);
    free(s->rest);
}

static pliant_status set_up(stage *s, const pliant_model *model,
                            const pliant_scene_recording *recording, pliant_error *err)
{
    const int32_t finest = pliant_model_describe(model).level_count - 1;
    const size_t copies = (size_t)recording->instance_count,
                 total = (size_t)recording->vertex_count;
    const size_t n = total / copies;
    const size_t face_count = (size_t)pliant_model_level_face_count(model, finest);
    const int32_t *faces = pliant_model_faces(model, finest);
    *s = (stage){.state_count = recording->count};
    if (face_count > INT32_MAX / 3 / copies)
        return pliant_error_set(err, PLIANT_ERR_CAPACITY, "%zu instances of %zu faces", copies,
                                face_count);
    s->rest = malloc(3 * total * sizeof *s->rest);
    s->faces = malloc(3 * copies * face_count * sizeof *s->faces + 1);
    s->around = calloc((size_t)recording->count, sizeof *s->around);
    if (copies > 1) s->hue = malloc(total * sizeof *s->hue);
    if (!s->rest || !s->faces || !s->around || (copies > 1 && !s->hue))
        return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for %zu instances", copies);
    for (size_t i = 0; i < copies; i++) {
        memcpy(s->rest + 3 * n * i, pliant_model_positions(model), 3 * n * sizeof *s->rest);
        for (size_t k = 0; k < 3 * face_count; k++)
            s->faces[3 * face_count * i + k] = faces[k] + (int32_t)(n * i);
        const double turns = hue_step * (double)i;
        for (size_t v = 0; s->hue && v < n; v++) s->hue[n * i + v] = (float)(turns - floor(turns));
    }
    s->shape = (pliant_body_shape){.vertex_count = recording->vertex_count,
                                   .face_count = (int32_t)(copies * face_count),
                                   .rest = s->rest,
                                   .faces = s->faces,
                                   .hue = s->hue};
    return PLIANT_OK;
}

// The region that planes are shown around: what all surfaces take up in all states.
static void bound(stage *s, const pliant_scene_recording *recording)
{
    for (int c = 0; c < 3; c++) {
        s->low[c] = INFINITY;
        s->high[c] = -INFINITY;
    }
    for (int32_t k = 0; k < recording->count; k++)
        for (size_t v = 0; v < (size_t)recording->vertex_count; v++) {
            const pliant_vec3 u = recording->states[k].displacement[v];
            const double x[3] = {s->rest[3 * v] + (double)u.x, s->rest[3 * v + 1] + (double)u.y,
                                 s->rest[3 * v + 2] + (double)u.z};
            for (int c = 0; c < 3; c++) {
                s->low[c] = fmin(s->low[c], x[c]);
                s->high[c] = fmax(s->high[c], x[c]);
            }
        }
}

// The obstacles of one state: planes apart from solids. Shadows fall on the first plane that is
// seen from above.
static pliant_status surround(stage *s, const struct pliant_scene_state *state,
                              pliant_surroundings *around, pliant_error *err)
{
    pliant_obstacle *sorted = malloc(((size_t)state->obstacle_count + 1) * sizeof *sorted);
    if (!sorted) return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for the obstacles");
    int32_t plane_count = 0, solid_count = 0;
    for (int32_t i = 0; i < state->obstacle_count; i++)
        if (state->obstacles[i].kind == PLIANT_OBSTACLE_PLANE)
            sorted[plane_count++] = state->obstacles[i];
    pliant_status status =
        pliant_obstacle_mesh_make(&around->planes, sorted, plane_count, s->low, s->high, err);
    for (int32_t i = 0; i < state->obstacle_count; i++)
        if (state->obstacles[i].kind != PLIANT_OBSTACLE_PLANE)
            sorted[solid_count++] = state->obstacles[i];
    if (status >= 0)
        status =
            pliant_obstacle_mesh_make(&around->solids, sorted, solid_count, s->low, s->high, err);
    free(sorted);
    if (status < 0 || around->planes.face_count == 0) return status;
    // Through three corners of its first triangle.
    const double *a = around->planes.positions + 3 * (size_t)around->planes.faces[0];
    const double *b = around->planes.positions + 3 * (size_t)around->planes.faces[1];
    const double *c = around->planes.positions + 3 * (size_t)around->planes.faces[2];
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        around->ground[i] = (b[j] - a[j]) * (c[k] - a[k]) - (b[k] - a[k]) * (c[j] - a[j]);
        around->ground[3] += around->ground[i] * a[i];
    }
    return PLIANT_OK;
}

static pliant_status draw(const pliant_draw_options *options, const stage *s,
                          const pliant_scene_recording *recording, pliant_error *err)
{
    pliant_panel panels[PLIANT_RECORDING_LIMIT + 1];
    for (int32_t k = 0; k < recording->count; k++) {
        const struct pliant_scene_state *state = &recording->states[k];
        panels[k] = (pliant_panel){.displacement = state->displacement,
                                   .normals = state->normals,
                                   .around = &s->around[k]};
        if (state->step == 0) snprintf(panels[k].label, sizeof panels[k].label, "start");
        else snprintf(panels[k].label, sizeof panels[k].label, "step %lld", (long long)state->step);
    }
    pliant_picture_def picture = options->picture;
    picture.columns = options->sheet_columns;
    pliant_drawing_choose_size(&picture, recording->count);
    uint8_t *rgb = malloc(3 * (size_t)picture.width * (size_t)picture.height);
    if (!rgb)
        return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for %d x %d pixels",
                                picture.width, picture.height);
    pliant_status status =
        pliant_picture_draw(&picture, &s->shape, panels, recording->count, rgb, err);
    if (status >= 0)
        status = pliant_png_file_write(options->output, picture.width, picture.height, rgb, err);
    free(rgb);
    return status;
}

pliant_status pliant_scene_drawing_make(const pliant_draw_options *options,
                                        const pliant_model *model, pliant_error *err)
{
    if (options->detail || options->level >= 0)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "%s: %s is about Green's functions: this play is of a lattice",
                                options->model, options->detail ? "--detail" : "--level");
    int64_t steps[PLIANT_RECORDING_LIMIT + 1];
    int32_t count = 0;
    pliant_scene_recording *recording = NULL;
    stage s = {0};
    pliant_status status = pliant_drawing_choose_steps(options, steps, &count, err);
    if (status >= 0)
        status =
            pliant_scene_recording_create(model, options->script, steps, count, &recording, err);
    if (status >= 0) status = set_up(&s, model, recording, err);
    if (status >= 0) bound(&s, recording);
    for (int c = 0; c < 3 && options->picture.has_region; c++) {
        s.low[c] = options->picture.region[c];
        s.high[c] = options->picture.region[c + 3];
    }
    for (int32_t k = 0; status >= 0 && k < count; k++)
        status = surround(&s, &recording->states[k], &s.around[k], err);
    if (status >= 0) status = draw(options, &s, recording, err);
    strike(&s);
    pliant_scene_recording_destroy(recording);
    return status;
}
