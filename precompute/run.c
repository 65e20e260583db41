// run.c: one precomputation from its options to its file.
#include "run.h"

#include "discretisation.h"
#include "identity.h"
#include "input.h"
#include "interruption.h"
#include "model_output.h"
#include "node_memory.h"
#include "provenance.h"
#include "remesh/mesh_output.h"
#include "refusal.h"
#include "right_hand.h"

#include "pliant/error.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

// ---- Before the work: can it end well? ----

// The folder of a path, in `folder`.
static void folder_of(const char *path, char *folder, size_t size)
{
    const char *slash = strrchr(path, '/');
    if (!slash) snprintf(folder, size, ".");
    else snprintf(folder, size, "%.*s", (int)(slash == path ? 1 : slash - path), path);
}

static pliant_status check_output(const char *path, pliant_existing existing, pliant_error *err)
{
    struct stat found;
    if (stat(path, &found) == 0) {
        if (!S_ISREG(found.st_mode))
            return pliant_error_set(err, PLIANT_ERR_IO, "%s: is not a regular file", path);
        if (existing == PLIANT_KEEP_EXISTING)
            return pliant_error_set(err, PLIANT_ERR_IO, "%s: exists already; --force replaces it", path);
    }
    char folder[4096];
    folder_of(path, folder, sizeof folder);
    if (access(folder, W_OK | X_OK) != 0)
        return pliant_error_set(err, PLIANT_ERR_IO, "%s: cannot write to folder %s: %s", path, folder, strerror(errno));
    return PLIANT_OK;
}

static void spool_folder(const char *output, char *folder, size_t size)
{
    const char *temporary = getenv("TMPDIR");
    if (temporary && *temporary) snprintf(folder, size, "%s", temporary);
    else folder_of(output, folder, size);
}

// The levels of columns asked for, against those of the mesh.
static pliant_status check_levels(const pliant_problem *p, const pliant_options *options, pliant_error *err)
{
    const int32_t finest = p->multires->level_count - 1;
    if (p->levels.last > finest)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT, "--constraint-levels: expected levels of %s, 0 to %d, found %d",
                                options->mesh, finest, p->levels.last);
    if (p->free_hats->level_offset[p->levels.last + 1] == 0)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "--constraint-levels: expected a level with free vertices of %s, found none of them "
                                "on level %d", options->mesh, p->levels.last);
    if (options->dense && p->levels.last < finest)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "--dense stores columns of the finest level, %d: expected --constraint-levels "
                                "up to it, found up to %d",
                                finest, p->levels.last);
    return PLIANT_OK;
}

// A rank that does nothing yet: measured, most of it libraries.
static const double process_bytes = 48e6;

// Collective: state what the run will take, and refuse what cannot fit.
static PetscErrorCode plan_memory(MPI_Comm comm, const pliant_problem *p,
                                  const pliant_options *options, const pliant_solve_plan *plan,
                                  const char *folder, const pliant_partial *partial,
                                  pliant_progress *progress, pliant_run_summary *summary,
                                  pliant_error *err)
{
    PetscFunctionBegin;
    PetscMPIInt size, node_size;
    PetscCallMPI(MPI_Comm_size(comm, &size));
    PetscCall(pliant_node_size(comm, &node_size));

    const pliant_level_range levels = p->levels;
    const int32_t solved = pliant_right_hand_count(p, options->blocks);
    summary->solver = plan->solver;
    summary->groups = plan->groups;
    const int all = options->blocks == PLIANT_BLOCKS_ALL;
    const double rows = all ? p->vertex_count : p->free_count;
    double stored = 0;  // columns of all levels
    for (int32_t l = levels.first; l <= levels.last; l++)
        stored += p->free_hats->level_offset[l + 1] + (all ? p->fixed_hats->level_offset[l + 1] : 0);
    // Five groups of interleaved columns for each rank and block, in doubles; one block's coarser
    // levels have theirs beside those of the finest.
    const double work = 5.0 * rows * 9 * PLIANT_COLUMN_GROUP * sizeof(double) * (all ? 2 : 1) * size;
    // What is kept, at the smallest compression seen in practice (GF 10.2: 8 at eps 0.01).
    const double kept = rows * stored * 40 / 6;
    const double needed = plan->matrix_bytes + plan->right_hand_bytes + plan->batch_bytes + work +
                          kept + process_bytes * size;
    summary->memory_bytes = needed;
    const double here = needed * node_size / size, available = pliant_node_available();
    // On disk: the columns that are solved for, kept until the output is there, and coarser ones.
    const int is_spooled = options->compression.eps == 0 || levels.first < levels.last;
    const double finest = p->free_hats->level_offset[levels.last + 1] +
                          (all ? p->fixed_hats->level_offset[levels.last + 1] : 0);
    const double resumable =
        partial ? rows * finest *
                      ((is_spooled ? 44 : 0) + (options->compression.eps > 0 ? 44.0 / 6 : 0))
                : 0;
    const double spool =
        is_spooled ? rows * (partial ? stored - finest : stored) * 44 * node_size / size : 0;
    char output_folder[4096];
    folder_of(options->output, output_folder, sizeof output_folder);

    char dealt[48] = "";
    if (summary->groups > 1) snprintf(dealt, sizeof dealt, ", in %d groups", summary->groups);
    pliant_progress_note(progress,
                         "%d vertices in %d level%s, %d free and %d held; %s on "
                         "%d rank%s (%s%s)",
                         p->vertex_count, p->multires->level_count, p->multires->level_count == 1 ? "" : "s",
                         p->free_count, p->fixed_count, plan->system, size, size == 1 ? "" : "s", plan->solver, dealt);
    if (levels.last < p->multires->level_count - 1)
        pliant_progress_note(progress,
                             "columns of levels %d..%d: %d are solved for instead of %.0f",
                             levels.first, levels.last, solved, rows);
    pliant_progress_note(
        progress, "memory %.3g GB (matrix %.3g, right-hand sides %.3g) of %.1f GB available",
        needed / 1e9, plan->matrix_bytes / 1e9, plan->right_hand_bytes / 1e9, available / 1e9);
    if (partial)
        pliant_progress_note(
            progress,
            "disk: columns up to %.3g GB in %s until the output is there, so that --resume can "
            "go on after an interruption; up to %.3g GB more for a while in %s",
            resumable / 1e9, pliant_partial_folder(partial), spool / 1e9, folder);
    else
        pliant_progress_note(
            progress, "disk: temporary columns up to %.3g GB in %s; an interrupted run begins anew",
            spool / 1e9, folder);
    pliant_status status = PLIANT_OK;
    struct statvfs disk;
    const double to_come = partial ? resumable - pliant_partial_bytes(partial) : 0;
    if (available > 0 && here > available)
        status = pliant_error_set(err, PLIANT_ERR_MEMORY,
                                  "%s: needs %.2f GB of memory on this machine, %.2f GB are available: "
                                  "use more machines or a coarser mesh",
                                  options->mesh, here / 1e9, available / 1e9);
    else if (statvfs(folder, &disk) == 0 && spool > (double)disk.f_bavail * (double)disk.f_frsize)
        status = pliant_error_set(
            err, PLIANT_ERR_IO,
            "%s: needs %.3g GB for temporary columns, %.3g GB are free: set TMPDIR", folder,
            spool / 1e9, (double)disk.f_bavail * (double)disk.f_frsize / 1e9);
    else if (statvfs(output_folder, &disk) == 0 &&
             to_come > (double)disk.f_bavail * (double)disk.f_frsize)
        status = pliant_error_set(
            err, PLIANT_ERR_IO, "%s: needs %.3g GB more for columns, %.3g GB are free",
            output_folder, to_come / 1e9, (double)disk.f_bavail * (double)disk.f_frsize / 1e9);
    PliantCall(comm, status, err);
    PetscFunctionReturn(0);
}

// ---- The work ----

// What a run holds; freed in reverse whatever happened.
typedef struct held {
    pliant_input input;  // of a run without Green's functions
    pliant_problem *problem;
    pliant_lattice_data *lattice;  // on the first rank
    const pliant_discretisation *method;
    void *system;                // the method's
    pliant_greens *greens;
    pliant_dense_output *dense;
    pliant_partial *partial;
} held;

static const char nothing_kept[] = "nothing is kept";

// From here on a signal waits for the work in hand.
static void work_in_hand(const held *h)
{
    pliant_interruption_wait(h->partial ? "--resume will go on from there" : nothing_kept);
}

// Collective. From here on there is no work in hand that a signal could spoil, or none that could
// wait for it.
static PetscErrorCode nothing_in_hand(MPI_Comm comm, const held *h, pliant_error *err)
{
    PetscFunctionBegin;
    const int is_empty = h->partial && !pliant_partial_is_kept(h->partial);
    pliant_interruption_at_once(h->partial ? pliant_partial_text(h->partial) : nothing_kept,
                                is_empty ? pliant_partial_journal(h->partial) : NULL,
                                is_empty ? pliant_partial_folder(h->partial) : NULL);
    // One that came a moment before.
    PliantCall(comm, pliant_interruption_check(err), err);
    PetscFunctionReturn(0);
}

// Collective: where solved columns will wait, with what an interrupted run has left there.
static PetscErrorCode open_partial(MPI_Comm comm, const pliant_options *options,
                                   pliant_progress *progress, held *h, pliant_error *err)
{
    PetscFunctionBegin;
    const pliant_problem *p = h->problem;
    const int32_t level = p->levels.last;
    PetscMPIInt rank;
    PetscCallMPI(MPI_Comm_rank(comm, &rank));
    pliant_partial_def def = {.output = options->output,
                              .row_limit = p->vertex_count,
                              .batch = pliant_greens_batch(comm),
                              .column_count = {p->free_hats->level_offset[level + 1]}};
    if (options->resuming == PLIANT_RESUME) def.wish = PLIANT_PARTIAL_RESUME;
    else if (options->existing == PLIANT_REPLACE_EXISTING) def.wish = PLIANT_PARTIAL_DISCARD;
    if (options->blocks == PLIANT_BLOCKS_ALL)
        def.column_count[1] = p->fixed_hats->level_offset[level + 1];
    pliant_greens_streams(p, options, def.domain);
    char *identity = NULL;
    PliantCall(comm, rank == 0 ? pliant_identity_create(options, p, &identity, err) : PLIANT_OK,
               err);
    def.identity = identity;
    const PetscErrorCode code = pliant_partial_create(comm, &def, progress, &h->partial, err);
    free(identity);
    PetscCall(code);
    // The dense file is written in passing and cannot be taken up again; of several bodies gmsh makes
    // other tetrahedra in every run.
    const int is_varied = options->method == PLIANT_METHOD_FEM && !options->volume &&
                          p->component_count > 1;
    if (options->dense || is_varied) PetscCall(pliant_partial_destroy(&h->partial));
    PetscFunctionReturn(0);
}

// Collective: the operations that PETSc has counted since `*before`, of all ranks; *before becomes
// now.
static PetscErrorCode count_flops(MPI_Comm comm, PetscLogDouble *before, double *flops)
{
    PetscFunctionBegin;
    PetscLogDouble now;
    PetscCall(PetscGetFlops(&now));
    const double mine = now - *before;
    *before = now;
    PetscCallMPI(MPI_Allreduce(&mine, flops, 1, MPI_DOUBLE, MPI_SUM, comm));
    PetscFunctionReturn(0);
}

// Collective: the columns' system, assembled and factored.
static PetscErrorCode make_system(MPI_Comm comm, pliant_progress *progress, pliant_run_summary *s,
                                  held *h, pliant_error *err)
{
    PetscFunctionBegin;
    work_in_hand(h);
    PetscCall(h->method->assemble(h->system, progress, err));
    PetscCallMPI(MPI_Barrier(comm));
    s->times.assemble = pliant_progress_end(progress);
    PetscCall(nothing_in_hand(comm, h, err));
    PetscLogDouble flops;
    PetscCall(PetscGetFlops(&flops));
    PetscCall(h->method->factor(h->system, progress, err));
    s->times.factor = pliant_progress_end(progress);
    PetscCall(count_flops(comm, &flops, &s->factor_flops));
    PetscFunctionReturn(0);
}

// The first rank's, of any run.
static pliant_status build_lattice(const pliant_options *options, const pliant_multires *multires,
                                   int32_t input_count, pliant_progress *progress, pliant_run_summary *s,
                                   held *h, pliant_error *err)
{
    if (options->lattice_cells == 0) return PLIANT_OK;
    pliant_progress_begin(progress, "lattice", 0);
    const pliant_status status = pliant_lattice_stage_build(options, multires, input_count, progress,
                                                            &h->lattice, &s->lattice, err);
    s->times.lattice = pliant_progress_end(progress);
    return status;
}

// A run without Green's functions: the first rank's alone.
static pliant_status work_alone(const pliant_options *options, const char *command_line,
                                pliant_progress *progress, pliant_run_summary *s, held *h, pliant_error *err)
{
    if (options->fixed_expression || options->fixed_list)
        pliant_progress_note(progress, "--no-greens: the held vertices are not used");
    pliant_progress_begin(progress, "read", 0);
    pliant_status status = pliant_input_read(options, progress, &h->input, err);
    s->times.read = pliant_progress_end(progress);
    if (status < 0) return status;
    const pliant_multires *m = h->input.multires;
    s->vertex_count = m->mesh->vertex_count;
    s->face_count = m->mesh->face_count;
    s->level_count = m->level_count;
    s->component_count = h->input.report.component_count;
    s->volume = pliant_mesh_volume(m->mesh);
    s->remesh = h->input.remesh;
    status = build_lattice(options, m, h->input.vertex_count, progress, s, h, err);
    if (status < 0) return status;

    pliant_progress_begin(progress, "write", 0);
    char temporary[4200];
    snprintf(temporary, sizeof temporary, "%s.tmp", options->output);
    pliant_interruption_at_once(nothing_kept, temporary, NULL);
    char *text = pliant_provenance_text(s, m->mesh, options, command_line);
    if (!text) return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for the provenance");
    status = pliant_lattice_output_file(options->output, m, &options->material, h->lattice, text,
                                        &s->file_bytes, err);
    free(text);
    s->times.write = pliant_progress_end(progress);
    return status;
}

// --mesh-only: the first rank's alone.
static pliant_status work_mesh(const pliant_options *options, pliant_progress *progress,
                               pliant_run_summary *s, held *h, pliant_error *err)
{
    pliant_progress_begin(progress, "remesh", 0);
    pliant_status status = pliant_input_read(options, progress, &h->input, err);
    s->times.read = pliant_progress_end(progress);
    if (status < 0) return status;
    const pliant_multires *m = h->input.multires;
    s->vertex_count = m->mesh->vertex_count;
    s->face_count = m->mesh->face_count;
    s->level_count = m->level_count;
    s->component_count = h->input.report.component_count;
    s->volume = pliant_mesh_volume(m->mesh);
    s->remesh = h->input.remesh;
    pliant_progress_begin(progress, "write", 0);
    status = pliant_mesh_output_write(options->output, m->mesh, err);
    s->times.write = pliant_progress_end(progress);
    struct stat written;
    if (status == PLIANT_OK && stat(options->output, &written) == 0) s->file_bytes = (double)written.st_size;
    return status;
}

static PetscErrorCode work(MPI_Comm comm, const pliant_options *options, const char *command_line,
                           pliant_progress *progress, pliant_run_summary *s, held *h, pliant_error *err)
{
    PetscFunctionBegin;
    PetscMPIInt rank;
    PetscCallMPI(MPI_Comm_rank(comm, &rank));
    pliant_status status = PLIANT_OK;
    pliant_progress_begin(progress, "read", 0);
    PetscCall(pliant_problem_create(comm, options, progress, &h->problem, err));
    s->times.read = pliant_progress_end(progress);
    const pliant_problem *p = h->problem;
    s->vertex_count = p->vertex_count;
    s->face_count = p->multires->mesh->face_count;
    s->level_count = p->multires->level_count;
    s->free_count = p->free_count;
    s->fixed_count = p->fixed_count;
    s->component_count = p->component_count;
    s->volume = p->volume;
    s->remesh = p->remesh;
    if (p->relief) {
        s->detail_steps = p->relief->step_count;
        s->detail_vertex_count = p->relief->vertex_count[s->detail_steps];
        s->detail = p->relief->size;
    }
    s->levels = p->levels;
    status = check_levels(p, options, err);
    s->misused = status < 0;
    PliantCall(comm, status, err);
    for (int b = 0; b < PLIANT_BLOCK_COUNT; b++)
        for (int32_t l = p->levels.first; l <= p->levels.last; l++)
            s->column_counts[b][l] = pliant_greens_column_count(p, (pliant_block_name)b, l);
    if (rank == 0) status = build_lattice(options, p->multires, p->input_count, progress, s, h, err);
    PliantCall(comm, status, err);

    char folder[4096];
    spool_folder(options->output, folder, sizeof folder);
    PetscCall(open_partial(comm, options, progress, h, err));
    h->method = pliant_discretisation_of(options->method);
    const double begin = pliant_progress_clock();
    PetscCall(h->method->create(comm, p, options, pliant_greens_batch(comm), progress, &h->system, err));
    s->times.inside = pliant_progress_clock() - begin;
    pliant_solve_plan plan;
    PetscCall(h->method->plan(h->system, &plan));
    const int is_whole = h->partial && pliant_partial_is_whole(h->partial);
    if (is_whole) plan.matrix_bytes = plan.right_hand_bytes = plan.batch_bytes = 0;
    PetscCall(plan_memory(comm, p, options, &plan, folder, h->partial, progress, s, err));
    if (!is_whole) PetscCall(make_system(comm, progress, s, h, err));

    work_in_hand(h);
    PetscCall(pliant_greens_create(h->method->groups(h->system), p, options, folder, h->partial,
                                   &h->greens, err));
    if (options->dense)
        PetscCall(pliant_dense_output_create(comm, options->dense, p, options->blocks, &h->dense, err));
    PetscLogDouble flops;
    PetscCall(PetscGetFlops(&flops));
    PetscCall(pliant_greens_solve(h->greens, h->method, h->system, h->dense, progress, err));
    (void)pliant_progress_end(progress);
    s->times.solve = h->greens->solve_seconds;
    s->times.transform = h->greens->transform_seconds;
    PetscCall(count_flops(comm, &flops, &s->solve_flops));
    PetscCall(pliant_node_peak(comm, &s->peak_memory_bytes));
    double worst, residual_bound;
    PetscCall(h->method->residual(h->system, &worst, &residual_bound));
    s->residual = h->greens->residual;
    if (!(s->residual <= residual_bound))
        status = pliant_error_set(
            err, PLIANT_ERR_SINGULAR,
            "%s: the solved columns miss the system by %.1e (expected under %.0e): "
            "the support or the material makes it nearly singular",
            options->mesh, s->residual, residual_bound);
    if (status < 0 && h->partial) pliant_partial_finish(h->partial);  // no use to anybody
    PliantCall(comm, status, err);
    PetscCall(h->method->destroy(&h->system));

    PetscCall(nothing_in_hand(comm, h, err));
    PetscCall(pliant_greens_compress(h->greens, progress, err));
    s->times.compress = pliant_progress_end(progress);
    memcpy(s->results, h->greens->results, sizeof s->results);

    work_in_hand(h);
    pliant_progress_begin(progress, "write", 0);
    char *text = pliant_provenance_text(s, p->multires->mesh, options, command_line);
    PetscErrorCode code = 0;
    if (!text) code = PETSC_ERR_MEM;
    if (code == 0 && h->dense) code = pliant_dense_output_commit(h->dense, err);
    if (code == 0)
        code = pliant_model_output_write(options->output, h->greens, h->lattice, options, text,
                                         progress, &s->file_bytes, err);
    free(text);
    PetscCall(code);
    if (h->partial) pliant_partial_finish(h->partial);
    s->times.write = pliant_progress_end(progress);
    PetscFunctionReturn(0);
}

// Collective: a refusal is an interruption, or leaves something to resume from: `err` says so.
static PetscErrorCode tell_of_partial(MPI_Comm comm, pliant_partial *partial, pliant_run_summary *s,
                                      pliant_error *err)
{
    PetscFunctionBegin;
    const pliant_error inner = *err;
    PetscCall(pliant_interruption_agree(comm, &s->signal));
    if (s->signal)
        pliant_error_set(err, PLIANT_ERR_IO, "interrupted: %.480s",
                         partial ? pliant_partial_text(partial) : nothing_kept);
    else if (partial && pliant_partial_is_taken_up(partial) && pliant_partial_is_kept(partial))
        pliant_error_set(err, PLIANT_ERR_IO, "%.250s; %.250s", inner.text,
                         pliant_partial_text(partial));
    PetscFunctionReturn(0);
}

PetscErrorCode pliant_run(MPI_Comm comm, const pliant_options *options, const char *command_line,
                          pliant_progress *progress, pliant_run_summary *summary, pliant_error *err)
{
    PetscFunctionBegin;
    held h = {0};
    *summary = (pliant_run_summary){.solver = ""};
    PetscMPIInt rank;
    PetscCallMPI(MPI_Comm_rank(comm, &rank));
    PetscCallMPI(MPI_Comm_size(comm, &summary->ranks));
    const double begin = pliant_progress_clock();
    pliant_status status = PLIANT_OK;
    if (rank == 0 && options->resuming == PLIANT_RESUME &&
        options->existing == PLIANT_KEEP_EXISTING)
        summary->was_finished = pliant_partial_was_finished(options->output);
    PetscCallMPI(MPI_Bcast(&summary->was_finished, 1, MPI_INT, 0, comm));
    if (summary->was_finished) PetscFunctionReturn(0);
    if (options->groups > summary->ranks) {
        summary->misused = 1;
        status = pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                  "--groups: expected at most the %d rank%s, found %d",
                                  summary->ranks, summary->ranks == 1 ? "" : "s", options->groups);
    } else if (rank == 0) {
        status = check_output(options->output, options->existing, err);
        if (status == PLIANT_OK && options->dense) status = check_output(options->dense, options->existing, err);
        if (status == PLIANT_OK && options->product == PLIANT_PRODUCT_MESH)
            status = work_mesh(options, progress, summary, &h, err);
        else if (status == PLIANT_OK && options->greens == PLIANT_GREENS_NONE)
            status = work_alone(options, command_line, progress, summary, &h, err);
    }
    PetscErrorCode code = pliant_refusal_agree(comm, status, err);
    if (code == 0 && options->product == PLIANT_PRODUCT_MODEL && options->greens == PLIANT_GREENS_SOLVE)
        code = work(comm, options, command_line, progress, summary, &h, err);
    summary->times.total = pliant_progress_clock() - begin;
    if (code == PLIANT_REFUSED) PetscCall(tell_of_partial(comm, h.partial, summary, err));
    PetscCall(pliant_dense_output_destroy(&h.dense));
    PetscCall(pliant_greens_destroy(&h.greens));
    // After an error of one rank's own the others may be anywhere: no waiting for them.
    if (code == 0 || code == PLIANT_REFUSED) PetscCall(pliant_partial_destroy(&h.partial));
    if (h.method) PetscCall(h.method->destroy(&h.system));
    pliant_lattice_data_destroy(h.lattice);
    PetscCall(pliant_problem_destroy(&h.problem));
    pliant_input_release(&h.input);
    PetscCall(code);
    PetscFunctionReturn(0);
}
