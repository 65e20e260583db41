// drawing.c: from a model and a script to a picture file.
#include "drawing.h"

#include "picture.h"
#include "png_file.h"
#include "raster.h"
#include "recorder.h"
#include "recording.h"
#include "scene_drawing.h"
#include "skin.h"

#include "pliant/error.h"
#include "pliant/pliant.h"
#include "pliant/script.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define SINGLE_WIDTH  800  // pixels, of a picture with one panel
#define LEGEND_HEIGHT 90   // pixels

// The size that gives every panel room, when none was asked for: as wide as the default picture,
// its panels a little wider than high, and a line for the legend.
void pliant_drawing_choose_size(pliant_picture_def *picture, int32_t panel_count)
{
    if (picture->width > 0) return;
    const int32_t columns =
        picture->columns > 0 && picture->columns < panel_count ? picture->columns : panel_count;
    const int32_t rows = (panel_count + columns - 1) / columns;
    picture->width = panel_count == 1 ? SINGLE_WIDTH : pliant_picture_default().width;
    const int32_t height = picture->width * rows * 4 / (columns * 5) + LEGEND_HEIGHT;
    picture->height = height < PLIANT_RASTER_SIDE_LIMIT ? height : PLIANT_RASTER_SIDE_LIMIT;
}

// Which steps to draw, from the options: ascending, PLIANT_RECORDING_END for the last.
pliant_status pliant_drawing_choose_steps(const pliant_draw_options *options, int64_t *steps,
                                          int32_t *step_count, pliant_error *err)
{
    int32_t count = 0;
    if (options->sheet_columns && options->step_count == 0) {
        int64_t last = 0;
        const pliant_status status = pliant_recorder_count_steps(options->script, &last, err);
        if (status < 0) return status;
        if (last < 1)
            return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                    "%s: --sheet: the script makes no step", options->script);
        const int64_t panels =
            options->sheet_columns * (options->sheet_rows > 0 ? options->sheet_rows : 1);
        for (int64_t k = 1; k <= panels; k++) {
            // k last / panels without overflow.
            const int64_t step = last / panels * k + last % panels * k / panels;
            if (step > 0 && (count == 0 || step > steps[count - 1])) steps[count++] = step;
        }
    } else {
        if (options->show == PLIANT_SHOW_BOTH && options->step_count <= 1 &&
            !options->sheet_columns && !(options->step_count == 1 && options->steps[0] == 0))
            steps[count++] = 0;
        for (int32_t i = 0; i < options->step_count; i++) steps[count++] = options->steps[i];
        if (options->step_count == 0) steps[count++] = PLIANT_RECORDING_END;
    }
    *step_count = count;
    return PLIANT_OK;
}

static pliant_status make_panels(const pliant_draw_options *options, const pliant_model *model,
                                 int32_t level, pliant_panel *panels, int32_t *panel_count,
                                 pliant_recording **recording, pliant_error *err)
{
    panels[0] = (pliant_panel){.label = "rest"};
    *panel_count = 1;
    if (!options->script || options->show == PLIANT_SHOW_REST) return PLIANT_OK;
    int64_t steps[PLIANT_RECORDING_LIMIT + 1];
    int32_t count = 0;
    pliant_status status = pliant_drawing_choose_steps(options, steps, &count, err);
    if (status < 0) return status;
    status = pliant_recording_create(model, level, options->script, steps, count, recording, err);
    if (status < 0) return status;
    for (int32_t k = 0; k < count; k++) {
        const struct pliant_recorded_state *state = &(*recording)->states[k];
        panels[k] = (pliant_panel){
            .displacement = state->step > 0 ? state->displacement : NULL,
            .marks = state->marks,
            .mark_count = state->mark_count,
        };
        if (state->step == 0) snprintf(panels[k].label, sizeof panels[k].label, "rest");
        else snprintf(panels[k].label, sizeof panels[k].label, "step %lld", (long long)state->step);
    }
    *panel_count = count;
    return PLIANT_OK;
}

// What the detailed surface is held by: where the limit surface weighs held vertices by a half.
static pliant_status hold_detail(const pliant_skin *skin, const uint8_t *held,
                                 int32_t control_count, uint8_t *detail_held, pliant_error *err)
{
    float *values = malloc((size_t)control_count * sizeof *values);
    float *carried = malloc((size_t)skin->vertex_count * sizeof *carried);
    pliant_status status = PLIANT_OK;
    if (!values || !carried)
        status = pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for %d vertices",
                                  skin->vertex_count);
    for (int32_t v = 0; v < control_count && status == PLIANT_OK; v++) values[v] = held[v];
    if (status == PLIANT_OK) status = pliant_detail_interpolate(skin->detail, 1, values, carried);
    for (int32_t v = 0; v < skin->vertex_count && status == PLIANT_OK; v++)
        detail_held[v] = carried[v] >= 0.5f;
    free(carried);
    free(values);
    return status;
}

// Draw the detailed surface in place of the one it goes with: the body's shape, and every panel's
// displacements. `dressed`, to be freed, takes these and who is held.
static pliant_status dress(pliant_skin *skin, pliant_body_shape *shape, pliant_panel *panels,
                           int32_t panel_count, void **dressed, pliant_error *err)
{
    const size_t n = (size_t)skin->vertex_count, count = (size_t)panel_count;
    pliant_vec3 *moved = malloc(count * n * sizeof *moved + n);
    if (!moved)
        return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for %d panels of %d vertices",
                                panel_count, skin->vertex_count);
    *dressed = moved;
    uint8_t *held = (uint8_t *)(moved + count * n);
    const pliant_status status = hold_detail(skin, shape->held, shape->vertex_count, held, err);
    if (status < 0) return status;
    for (size_t k = 0; k < count; k++, moved += n) {
        if (!panels[k].displacement) continue;
        pliant_skin_move(skin, panels[k].displacement);
        memcpy(moved, skin->displacement, n * sizeof *moved);
        panels[k].displacement = moved;
    }
    *shape = (pliant_body_shape){.vertex_count = skin->vertex_count,
                                 .face_count = skin->face_count,
                                 .rest = skin->rest,
                                 .faces = skin->faces,
                                 .held = held};
    return PLIANT_OK;
}

pliant_status pliant_drawing_make(const pliant_draw_options *options, pliant_error *err)
{
    pliant_model *model = NULL;
    pliant_recording *recording = NULL;
    pliant_skin *skin = NULL;
    void *dressed = NULL;
    uint8_t *held = NULL, *rgb = NULL;
    pliant_status status = pliant_model_open(options->model, &model, err);
    if (status < 0) return status;
    const pliant_model_info info = pliant_model_describe(model);
    const int32_t level = options->level < 0 ? info.level_count - 1 : options->level;
    if (level >= info.level_count) {
        status = pliant_error_set(err, PLIANT_ERR_ARGUMENT, "%s: --level %d: expected 0 to %d",
                                  options->model, level, info.level_count - 1);
        goto done;
    }
    // Without Green's functions no vertex is free or fixed.
    const int has_greens = info.free_count + info.fixed_count > 0;
    const int is_played = options->script && options->show != PLIANT_SHOW_REST;
    if (is_played && (options->lattice || !has_greens ||
                      pliant_script_family(options->script) == PLIANT_FAMILY_LATTICE)) {
        status = pliant_scene_drawing_make(options, model, err);
        goto done;
    }
    if (options->detail) {
        status = pliant_skin_create(model, level, &skin, err);
        if (status < 0) goto done;
    }
    pliant_panel panels[PLIANT_RECORDING_LIMIT + 1];
    int32_t panel_count = 0;
    status = make_panels(options, model, level, panels, &panel_count, &recording, err);
    if (status < 0) goto done;

    pliant_body_shape shape = {
        .vertex_count = pliant_model_level_vertex_count(model, level),
        .face_count = pliant_model_level_face_count(model, level),
        .rest = pliant_model_positions(model),
        .faces = pliant_model_faces(model, level),
    };
    pliant_picture_def picture = options->picture;
    picture.columns = options->sheet_columns;
    pliant_drawing_choose_size(&picture, panel_count);
    const size_t pixels = (size_t)picture.width * (size_t)picture.height;
    held = malloc((size_t)shape.vertex_count + 1);
    rgb = malloc(3 * pixels);
    if (!held || !rgb) {
        status = pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for %d x %d pixels",
                                  picture.width, picture.height);
        goto done;
    }
    for (int32_t v = 0; v < shape.vertex_count; v++)
        held[v] = has_greens && pliant_model_is_free(model, v) == 0;
    shape.held = held;
    if (skin) status = dress(skin, &shape, panels, panel_count, &dressed, err);
    if (status < 0) goto done;
    status = pliant_picture_draw(&picture, &shape, panels, panel_count, rgb, err);
    if (status < 0) goto done;
    status = pliant_png_file_write(options->output, picture.width, picture.height, rgb, err);

done:
    free(rgb);
    free(held);
    free(dressed);
    pliant_skin_destroy(skin);
    pliant_recording_destroy(recording);
    pliant_model_close(model);
    return status;
}
