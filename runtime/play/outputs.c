// outputs.c: everything that pliant-play writes while it plays, behind one observer.
#include "outputs.h"

#include "csv.h"
#include "frames.h"
#include "report.h"
#include "scene_vtk.h"
#include "skin.h"

#include "pliant/error.h"
#include "pliant/vtk_series.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

struct pliant_outputs {
    const pliant_play_options *options;
    const pliant_model *model;
    int32_t level;
    int is_streaming;  // 1: answer standard input line by line
    int is_typed;      // 1: by a person
    int pipe_closed;
    int64_t refused_count;
    pliant_csv *csv;  // these are NULL when not asked for
    pliant_frames *frames;
    pliant_vtk_series *vtk;
    pliant_scene_vtk *scene_vtk;  // takes vtk over at the first step on a lattice
    int is_widened;               // 1: frames and vtk know of the instances
    pliant_skin *skin;
    pliant_compare *compare;
    pliant_compare_summary compared;
    // Where tractions are known, for vtk: all vertices with supports, else the free ones.
    int32_t *traction_vertex;  // [traction_count]; NULL: vertices 0 .. traction_count-1
    int32_t traction_count;
    pliant_vec3 *known;     // [traction_count]
    pliant_vec3 *traction;  // [surface vertices]
    pliant_vec3 *carried;   // [skin's vertices]: tractions on the detail; NULL without
};

// ---- Life ----

static pliant_status open_vtk(pliant_outputs *o, pliant_error *err)
{
    const int32_t count = pliant_model_level_vertex_count(o->model, o->level);
    o->traction_vertex = malloc(((size_t)count + 1) * sizeof *o->traction_vertex);
    o->known = calloc((size_t)count + 1, sizeof *o->known);
    o->traction = calloc((size_t)count + 1, sizeof *o->traction);
    if (o->skin) o->carried = malloc((size_t)o->skin->vertex_count * sizeof *o->carried);
    if (!o->traction_vertex || !o->known || !o->traction || (o->skin && !o->carried))
        return pliant_error_set(err, PLIANT_ERR_MEMORY, "%s: no memory", o->options->vtk);
    const int has_supports = pliant_model_describe(o->model).has_supports;
    for (int32_t v = 0; v < count; v++)
        if (has_supports || pliant_model_is_free(o->model, v) == 1)
            o->traction_vertex[o->traction_count++] = v;
    pliant_vtk_series_def def = {
        .folder = o->options->vtk,
        .overwrite = o->options->force ? PLIANT_VTK_FOREIGN : PLIANT_VTK_OWN,
        .mesh = {.vertex_count = count,
                 .face_count = pliant_model_level_face_count(o->model, o->level),
                 .positions = pliant_model_positions(o->model),
                 .faces = pliant_model_faces(o->model, o->level)},
    };
    if (o->skin)
        def.mesh = (pliant_vtk_mesh){.vertex_count = o->skin->vertex_count,
                                     .face_count = o->skin->face_count,
                                     .positions = o->skin->rest,
                                     .faces = o->skin->faces};
    return pliant_vtk_series_create(&def, &o->vtk, err);
}

pliant_status pliant_outputs_open(const pliant_play_options *options, const pliant_model *model,
                                  int32_t level, pliant_outputs **outputs, pliant_error *err)
{
    pliant_outputs *o = calloc(1, sizeof *o);
    if (!o) return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for the outputs");
    o->options = options;
    o->model = model;
    o->level = level;
    o->is_streaming = strcmp(options->script, "-") == 0;
    o->is_typed = o->is_streaming && isatty(STDIN_FILENO);
    pliant_status status = PLIANT_OK;
    // The comparison only reads: first, so that a wrong dense file leaves no trace.
    if (options->compare) status = pliant_compare_open(options->compare, model, &o->compare, err);
    if (status >= 0 && options->detail) status = pliant_skin_create(model, level, &o->skin, err);
    if (status >= 0 && options->csv) status = pliant_csv_open(options->csv, &o->csv, err);
    if (status >= 0 && options->frames)
        status = pliant_frames_open(options->frames,
                                    o->skin ? o->skin->vertex_count
                                            : pliant_model_level_vertex_count(model, level),
                                    &o->frames, err);
    if (status >= 0 && options->vtk) status = open_vtk(o, err);
    if (status < 0) {
        pliant_outputs_destroy(o);
        return status;
    }
    *outputs = o;
    return PLIANT_OK;
}

void pliant_outputs_destroy(pliant_outputs *outputs)
{
    if (!outputs) return;
    pliant_scene_vtk_abandon(outputs->scene_vtk);
    pliant_vtk_series_abandon(outputs->vtk);
    pliant_frames_abandon(outputs->frames);
    pliant_csv_abandon(outputs->csv);
    pliant_compare_close(outputs->compare);
    pliant_skin_destroy(outputs->skin);
    free(outputs->carried);
    free(outputs->traction);
    free(outputs->known);
    free(outputs->traction_vertex);
    free(outputs);
}

pliant_status pliant_outputs_commit(pliant_outputs *outputs, const pliant_player *player,
                                    pliant_error *err)
{
    pliant_status status = PLIANT_OK;
    // Commit ends a file's life whatever it returns; those after a refusal stay for destroy.
    if (outputs->csv) {
        pliant_csv *csv = outputs->csv;
        outputs->csv = NULL;
        status = pliant_csv_commit(csv, player, err);
    }
    if (status >= 0 && outputs->frames) {
        pliant_frames *frames = outputs->frames;
        outputs->frames = NULL;
        status = pliant_frames_commit(frames, err);
    }
    if (status >= 0 && outputs->vtk) {
        pliant_vtk_series *vtk = outputs->vtk;
        outputs->vtk = NULL;
        status = pliant_vtk_series_commit(vtk, err);
    }
    if (status >= 0 && outputs->scene_vtk) {
        pliant_scene_vtk *vtk = outputs->scene_vtk;
        outputs->scene_vtk = NULL;
        status = pliant_scene_vtk_commit(vtk, err);
    }
    return status;
}

// ---- Standard output ----

pliant_status pliant_outputs_flush(pliant_outputs *outputs, pliant_error *err)
{
    errno = 0;
    if (fflush(stdout) == 0 && !ferror(stdout)) return PLIANT_OK;
    if (errno == EPIPE) outputs->pipe_closed = 1;
    return pliant_error_set(err, PLIANT_ERR_IO, "standard output: %s",
                            errno ? strerror(errno) : "write error");
}

// ---- What happens ----

static pliant_status add_vtk(pliant_outputs *o, pliant_player *player, const pliant_step *step,
                             pliant_error *err)
{
    const pliant_status status = pliant_solver_tractions(
        pliant_player_solver(player), o->traction_vertex, o->traction_count, o->known);
    if (status < 0)
        return pliant_error_set(err, status, "%s: tractions of step %lld: %s", o->options->vtk,
                                (long long)step->number, pliant_status_name(status));
    for (int32_t i = 0; i < o->traction_count; i++)
        o->traction[o->traction_vertex[i]] = o->known[i];
    if (!o->skin)
        return pliant_vtk_series_add(o->vtk, step->time, pliant_player_surface(player), o->traction,
                                     NULL, err);
    (void)!pliant_detail_interpolate(o->skin->detail, 3, &o->traction->x, &o->carried->x);
    return pliant_vtk_series_add(o->vtk, step->time, o->skin->displacement, o->carried,
                                 o->skin->normals, err);
}

// The instances of a lattice are known at the first step.
static pliant_status widen(pliant_outputs *o, const pliant_player *player, pliant_error *err)
{
    pliant_status status = PLIANT_OK;
    o->is_widened = 1;
    if (o->frames)
        status = pliant_frames_widen(o->frames, pliant_player_surface_count(player), err);
    if (status < 0 || !o->vtk) return status;
    pliant_vtk_series *surface = o->vtk;
    o->vtk = NULL;
    return pliant_scene_vtk_create(o->model, player, surface, o->options->vtk,
                                   o->options->force ? PLIANT_VTK_FOREIGN : PLIANT_VTK_OWN,
                                   o->options->particles ? PLIANT_SCENE_VTK_PARTICLES
                                                         : PLIANT_SCENE_VTK_SURFACES,
                                   &o->scene_vtk, err);
}

static pliant_status write_scene(pliant_outputs *o, const pliant_player *player,
                                 const pliant_step *step, pliant_error *err)
{
    pliant_status status = o->is_widened ? PLIANT_OK : widen(o, player, err);
    const pliant_vec3 *normals =
        pliant_instances_normals(pliant_scene_instances(pliant_player_scene(player)));
    if (status >= 0 && o->frames)
        status = pliant_frames_add(o->frames, pliant_player_surface(player), normals, step, err);
    if (status >= 0 && o->scene_vtk) status = pliant_scene_vtk_add(o->scene_vtk, step->time, err);
    return status;
}

static pliant_status write_greens(pliant_outputs *o, pliant_player *player, const pliant_step *step,
                                  pliant_error *err)
{
    const pliant_vec3 *surface = pliant_player_surface(player);
    pliant_status status = PLIANT_OK;
    if (o->skin) pliant_skin_move(o->skin, surface);
    if (o->frames)
        status = pliant_frames_add(o->frames, o->skin ? o->skin->displacement : surface, NULL, step,
                                   err);
    if (status >= 0 && o->vtk) status = add_vtk(o, player, step, err);
    return status;
}

static pliant_status stepped(void *context, pliant_player *player, const pliant_step *step,
                             pliant_error *err)
{
    pliant_outputs *o = context;
    pliant_status status = PLIANT_OK;
    if (step->number % o->options->every == 0) {
        if (o->csv) status = pliant_csv_add(o->csv, player, step, err);
        if (status >= 0)
            status = step->kind == PLIANT_PLAY_LATTICE ? write_scene(o, player, step, err)
                                                       : write_greens(o, player, step, err);
    }
    if (status >= 0 && o->compare) status = pliant_compare_add(o->compare, player, err);
    if (status < 0 || !o->is_streaming) return status;
    if (o->options->json) pliant_report_write_step_json(player, step, stdout);
    else if (!o->options->quiet) pliant_report_write_step(player, step, stdout);
    else return PLIANT_OK;
    return pliant_outputs_flush(o, err);
}

static pliant_status expected(void *context, const pliant_expectation *expectation,
                              pliant_error *err)
{
    pliant_outputs *o = context;
    if (!o->is_streaming) return PLIANT_OK;
    if (o->options->json) pliant_report_write_expectation_json(expectation, stdout);
    else if (!o->options->quiet) pliant_report_write_expectation(expectation, stdout);
    else return PLIANT_OK;
    return pliant_outputs_flush(o, err);
}

static int refused(void *context, const pliant_error *reason)
{
    pliant_outputs *o = context;
    if (!o->is_typed) return 0;
    fprintf(stderr, "pliant-play: %s\n", reason->text);
    o->refused_count++;
    return 1;
}

pliant_observer pliant_outputs_observer(pliant_outputs *outputs)
{
    return (pliant_observer){outputs, stepped, expected, refused};
}

// ---- What can be read ----

int64_t pliant_outputs_refused_count(const pliant_outputs *outputs)
{
    return outputs->refused_count;
}

int pliant_outputs_pipe_closed(const pliant_outputs *outputs)
{
    return outputs->pipe_closed;
}

const pliant_compare_summary *pliant_outputs_compared(pliant_outputs *outputs)
{
    if (!outputs->compare) return NULL;
    outputs->compared = pliant_compare_result(outputs->compare);
    return outputs->compared.step_count ? &outputs->compared : NULL;
}
