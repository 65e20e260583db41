// fem_system.c: the finite element method as a discretisation.
//
// Every batch of columns is solved in blocks. A block's solution is looked at where the surface is:
// at free vertices as it is, at held ones through the forces that it takes to hold them. What the
// ranks have of that is summed on the rank that goes on with the column, which finishes it
// (reaction.h).
#include "fem/fem_system.h"

#include "fem/reaction.h"
#include "fem/solver.h"
#include "fem/stiffness.h"
#include "fem/volume.h"
#include "node_memory.h"
#include "refusal.h"
#include "right_hand.h"

#include "pliant/error.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// |K x - b| / |b| of solved columns may be this large. MUMPS reaches 1e-11 on the sample, 1e-9 at a
// Poisson's ratio of 0.499; multigrid stops at 1e-9.
static const double residual_bound = 1e-7;

typedef struct fem_system {
    MPI_Comm comm;  // all ranks
    PetscMPIInt rank, size;
    pliant_solver_groups groups;
    const pliant_problem *problem;
    const pliant_options *options;
    int32_t free_columns, batch;
    int32_t block;        // columns (of three right-hand sides) that are solved for together
    int32_t group_batch;  // the most columns of a batch that a group has
    pliant_tetrahedra *tetrahedra;
    pliant_material materials[PLIANT_REGION_LIMIT + 1];  // by region
    double free_nodes;
    pliant_fem_solver_plan planned;
    pliant_stiffness *stiffness;
    pliant_fem_solver *solver;
    pliant_reaction *reaction;
    // [group_batch][3][3n]: this rank's part of its group's columns; then its share of them, whole
    double *surface;
    double worst;
} fem_system;

// ---- The inside ----

static pliant_status make_inside(fem_system *s, pliant_error *err)
{
    const pliant_options *o = s->options;
    const char *names[PLIANT_REGION_LIMIT];
    for (int32_t k = 0; k < o->region_count; k++) names[k] = o->regions[k].name;
    const pliant_volume_def def = {.surface = s->problem->multires->mesh,
                                   .mesh_name = o->mesh,
                                   .file = o->volume,
                                   .region_count = o->region_count,
                                   .region_names = names,
                                   .growth = o->growth};
    const pliant_status status = pliant_volume_create(&def, &s->tetrahedra, err);
    if (status < 0 || o->order == 1) return status;
    return pliant_tetrahedra_raise(s->tetrahedra, err);
}

// Collective: everybody gets the first rank's tetrahedra.
static PetscErrorCode share_inside(fem_system *s, pliant_error *err)
{
    PetscFunctionBegin;
    pliant_tetrahedra copy = {0};
    if (s->rank == 0) copy = *s->tetrahedra;
    PetscCallMPI(MPI_Bcast(&copy, (int)sizeof copy, MPI_BYTE, 0, s->comm));
    pliant_status status = PLIANT_OK;
    if (s->rank > 0) {
        s->tetrahedra = malloc(sizeof *s->tetrahedra);
        if (!s->tetrahedra) {
            status = pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for the tetrahedra");
        } else {
            *s->tetrahedra = copy;
            s->tetrahedra->nodes = NULL;
            s->tetrahedra->tets = s->tetrahedra->regions = s->tetrahedra->faces =
                s->tetrahedra->ends = NULL;
            status = pliant_tetrahedra_allocate(s->tetrahedra, err);
        }
    }
    PliantCall(s->comm, status, err);
    pliant_tetrahedra *t = s->tetrahedra;
    PetscCallMPI(MPI_Bcast(t->nodes, 3 * t->node_count, MPI_DOUBLE, 0, s->comm));
    PetscCallMPI(MPI_Bcast(t->tets, t->tet_nodes * t->tet_count, MPI_INT32_T, 0, s->comm));
    PetscCallMPI(MPI_Bcast(t->regions, t->tet_count, MPI_INT32_T, 0, s->comm));
    PetscCallMPI(MPI_Bcast(t->faces, t->face_nodes * t->face_count, MPI_INT32_T, 0, s->comm));
    PetscCallMPI(
        MPI_Bcast(t->ends, 2 * (t->node_count - t->corner_count), MPI_INT32_T, 0, s->comm));
    PetscFunctionReturn(0);
}

// Blocks in a row of K, on average, as measured on the sample.
static double row_blocks(int order)
{
    return order == 1 ? 14 : 27;
}

// Bytes of K, before it is there.
static double matrix_bytes(const fem_system *s)
{
    return 9 * s->free_nodes * row_blocks(s->tetrahedra->order) *
           (sizeof(double) + sizeof(PetscInt));
}

// Of the memory available, for all the factors on a machine.
static const double replica_part = 0.6;

// Collective: would every machine hold its ranks' parts of their groups' factors?
static PetscErrorCode find_fit(const fem_system *s, const pliant_solver_groups *groups, int *fits)
{
    PetscFunctionBegin;
    MPI_Comm machine;
    PetscCallMPI(MPI_Comm_split_type(s->comm, MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL, &machine));
    const double own = (s->planned.bytes + matrix_bytes(s)) / groups->size,
                 available = pliant_node_available();
    double here;
    PetscCallMPI(MPI_Allreduce(&own, &here, 1, MPI_DOUBLE, MPI_SUM, machine));
    PetscCallMPI(MPI_Comm_free(&machine));
    const int mine = available <= 0 || here <= replica_part * available;
    PetscCallMPI(MPI_Allreduce(&mine, fits, 1, MPI_INT, MPI_MIN, s->comm));
    PetscFunctionReturn(0);
}

// Collective: ranks that solve by themselves need not talk while they solve, which is where the
// time goes (1605 right-hand sides at 16600 unknowns took 5.6 s on one rank and 80 s on two
// together, on a machine with other work). So there are as many groups as fit into memory: of one
// rank, of two, of four, ..., of all. Multigrid is for what does not fit even once.
static PetscErrorCode choose_groups(fem_system *s)
{
    PetscFunctionBegin;
    int count = s->options->groups > 0                    ? s->options->groups
                : s->planned.kind == PLIANT_SOLVER_DIRECT ? s->size
                                                          : 1;
    for (int fits = 0;; count /= 2) {
        PetscCall(pliant_solver_groups_create(s->comm, count, &s->groups));
        if (count == 1 || s->options->groups > 0) break;
        PetscCall(find_fit(s, &s->groups, &fits));
        if (fits) break;
        PetscCall(pliant_solver_groups_destroy(&s->groups));
    }
    s->group_batch = pliant_solver_groups_most(&s->groups, s->batch);
    s->block = pliant_fem_solver_block(s->planned.kind, s->groups.size) / 3;
    PetscFunctionReturn(0);
}

static PetscErrorCode create(MPI_Comm comm, const pliant_problem *problem,
                             const pliant_options *options, int32_t batch,
                             pliant_progress *progress, void **system, pliant_error *err)
{
    PetscFunctionBegin;
    fem_system *s;
    PetscCall(PetscNew(&s));
    *system = s;
    s->comm = comm;
    PetscCallMPI(MPI_Comm_rank(comm, &s->rank));
    PetscCallMPI(MPI_Comm_size(comm, &s->size));
    s->problem = problem;
    s->options = options;
    s->free_columns = pliant_right_hand_count(problem, PLIANT_BLOCKS_FREE);
    const int32_t columns = pliant_right_hand_count(problem, options->blocks);
    s->batch = columns < batch ? columns : batch;
    s->materials[0] = options->material;
    for (int32_t k = 0; k < options->region_count; k++)
        s->materials[k + 1] = options->regions[k].material;

    pliant_progress_begin(progress, "mesh", 0);
    PliantCall(comm, s->rank == 0 ? make_inside(s, err) : PLIANT_OK, err);
    PetscCall(share_inside(s, err));
    (void)pliant_progress_end(progress);
    const pliant_tetrahedra *t = s->tetrahedra;
    pliant_progress_note(
        progress, "inside: %d %s tetrahedra with %d nodes, smallest quality %.2g (1: regular)",
        t->tet_count, t->order == 1 ? "linear" : "quadratic", t->node_count,
        pliant_tetrahedra_quality(t));

    // Held: every held vertex and, of quadratic elements, about three times as many midpoints.
    s->free_nodes = t->node_count - (t->order == 1 ? 1.0 : 4.0) * problem->fixed_count;
    s->free_nodes = fmax(s->free_nodes, 1);
    PetscCall(pliant_reaction_create(t, problem->held, &s->reaction));
    double available = pliant_node_available(), least;
    PetscCallMPI(MPI_Allreduce(&available, &least, 1, MPI_DOUBLE, MPI_MIN, comm));
    s->planned = pliant_fem_solver_choose(options->solver, t->order, 3 * s->free_nodes,
                                          9 * s->free_nodes * row_blocks(t->order), least);
    PetscCall(choose_groups(s));
    PetscFunctionReturn(0);
}

static PetscErrorCode destroy(void **system)
{
    PetscFunctionBegin;
    fem_system *s = *system;
    if (!s) PetscFunctionReturn(0);
    PetscCall(PetscFree(s->surface));
    PetscCall(pliant_reaction_destroy(&s->reaction));
    PetscCall(pliant_fem_solver_destroy(&s->solver));
    PetscCall(pliant_stiffness_destroy(&s->stiffness));
    pliant_tetrahedra_destroy(s->tetrahedra);
    PetscCall(pliant_solver_groups_destroy(&s->groups));
    PetscCall(PetscFree(*system));
    PetscFunctionReturn(0);
}

// gmsh's libraries, on the first rank.
static const double gmsh_bytes = 45e6;

static PetscErrorCode plan(const void *system, pliant_solve_plan *out)
{
    PetscFunctionBegin;
    const fem_system *s = system;
    const pliant_tetrahedra *t = s->tetrahedra;
    const double unknowns = 3 * s->free_nodes, matrix = matrix_bytes(s) + s->planned.bytes;
    const double responses = 72.0 * s->reaction->rim_count * s->problem->vertex_count;
    const double mesh = (24.0 + 8) * t->node_count + 4.0 * (t->tet_nodes + 1) * t->tet_count;
    *out = (pliant_solve_plan){
        .solver = pliant_fem_solver_name(s->planned.kind),
        .groups = s->groups.count,
        .matrix_bytes = matrix * s->groups.count + (mesh + responses) * s->size +
                        gmsh_bytes,
        // Every rank has its part of a batch's columns at the surface.
        .batch_bytes = 8 * (9.0 * s->problem->vertex_count * s->group_batch * s->size +
                            4 * unknowns * 3 * s->block * s->groups.count)};
    snprintf(out->system, sizeof out->system, "about %.0f unknowns in %d %s tetrahedra", unknowns,
             t->tet_count, t->order == 1 ? "linear" : "quadratic");
    PetscFunctionReturn(0);
}

static const pliant_solver_groups *groups(const void *system)
{
    const fem_system *s = system;
    return &s->groups;
}

// ---- Assembly ----

static PetscErrorCode assemble(void *system, pliant_progress *progress, pliant_error *err)
{
    PetscFunctionBegin;
    fem_system *s = system;
    const pliant_problem *p = s->problem;
    pliant_progress_begin(progress, "assemble", 0);
    pliant_status status = PLIANT_OK;
    for (int32_t k = 0; k <= s->options->region_count && status == PLIANT_OK; k++)
        status = pliant_material_check(&s->materials[k], err);
    PliantCall(s->comm, status, err);
    const pliant_stiffness_def def = {s->tetrahedra, s->materials, p->held};
    PetscCall(pliant_solver_groups_agree(
        &s->groups, pliant_stiffness_create(s->groups.comm, &def, &s->stiffness, err), err));
    PetscCall(PetscMalloc1((size_t)s->group_batch * 9 * (size_t)p->vertex_count, &s->surface));
    PetscFunctionReturn(0);
}

// ---- Columns ----

// What a column is made of: a hat of the free or the held domain, a unit acceleration, or the
// traction of one vertex of the rim.
typedef struct hat {
    int32_t count;            // nodes
    const int32_t *position;  // in `nodes`
    const double *weight;
    const int32_t *nodes;  // the domain's vertices
    enum { HAT_LOAD, HAT_BODY, HAT_RIM } kind;
} hat;

static hat hat_of(const fem_system *s, int32_t column)
{
    const pliant_problem *p = s->problem;
    const int fixed = column >= s->free_columns;
    const pliant_hats *hats = fixed ? p->fixed_hats : p->free_hats;
    const int32_t level = p->levels.last, k = fixed ? column - s->free_columns : column;
    const int32_t begin = hats->offset[level][k];
    return (hat){.count = hats->offset[level][k + 1] - begin,
                 .position = hats->position[level] + begin,
                 .weight = hats->weight[level] + begin,
                 .nodes = fixed ? p->fixed_nodes : p->free_nodes};
}

// y[3 row + r + c ld] += weight block[r][c] over a block column.
static void add_column(const pliant_block_columns *columns, int32_t vertex, double weight,
                       double *y, size_t ld)
{
    for (int64_t e = columns->offset[vertex]; e < columns->offset[vertex + 1]; e++) {
        const double *block = columns->block + 9 * e;
        for (int r = 0; r < 3; r++)
            for (int c = 0; c < 3; c++)
                y[3 * (size_t)columns->row[e] + (size_t)r + (size_t)c * ld] +=
                    weight * block[3 * r + c];
    }
}

static void fill_right(const fem_system *s, const hat *h, double *B, size_t ld)
{
    const pliant_stiffness *k = s->stiffness;
    for (int c = 0; c < 3; c++) memset(B + (size_t)c * ld, 0, ld * sizeof *B);
    for (int32_t e = 0; e < h->count; e++)
        add_column(h->kind == HAT_RIM ? k->rim_load : k->load, h->nodes[h->position[e]],
                   h->weight[e], B, ld);
    for (int32_t i = 0; h->kind == HAT_BODY && i < k->own_end - k->own_begin; i++)
        for (int c = 0; c < 3; c++) B[3 * (size_t)i + (size_t)c + (size_t)c * ld] = k->body[i];
}

// This rank's part of three columns at the surface, from its rows of the solution.
static void look_at_surface(const fem_system *s, const double *X, size_t ld, double *surface)
{
    const pliant_problem *p = s->problem;
    const pliant_stiffness *k = s->stiffness;
    const size_t rows = 3 * (size_t)p->vertex_count;
    memset(surface, 0, 3 * rows * sizeof *surface);
    for (int32_t v = 0; v < p->vertex_count; v++) {
        const int32_t row = k->row_of_node[v] - k->own_begin;
        if (!p->held[v] && row >= 0 && row < k->own_end - k->own_begin)
            for (size_t c = 0; c < 3; c++)
                memcpy(surface + c * rows + 3 * (size_t)v, X + c * ld + 3 * (size_t)row,
                       3 * sizeof *X);
        // C^T K_Ff u_f: the transpose of the right-hand sides' blocks, which have a minus.
        for (int64_t e = p->held[v] ? k->load->offset[v] : k->load->offset[v + 1];
             e < k->load->offset[v + 1]; e++) {
            const double *block = k->load->block + 9 * e, *x = X + 3 * (size_t)k->load->row[e];
            for (size_t c = 0; c < 3; c++)
                for (size_t r = 0; r < 3; r++)
                    for (size_t q = 0; q < 3; q++)
                        surface[c * rows + 3 * (size_t)v + r] -= block[3 * q + r] * x[c * ld + q];
        }
    }
}

// What a column adds to the forces at held vertices directly; `columns` are whole.
static PetscErrorCode add_direct(const fem_system *s, const hat *h, double *columns)
{
    PetscFunctionBegin;
    const pliant_problem *p = s->problem;
    const pliant_stiffness *k = s->stiffness;
    const size_t rows = 3 * (size_t)p->vertex_count, forces = 3 * (size_t)p->fixed_count;
    double *R;
    PetscCall(PetscCalloc1(3 * forces + 1, &R));
    for (int32_t e = 0; e < h->count; e++)
        add_column(k->direct, h->nodes[h->position[e]], h->weight[e], R, forces);
    for (int32_t i = 0; i < p->fixed_count; i++)
        for (size_t c = 0; c < 3; c++) {
            if (h->kind == HAT_BODY) R[c * forces + 3 * (size_t)i + c] += k->direct_body[i];
            for (size_t r = 0; r < 3; r++)
                columns[c * rows + 3 * (size_t)p->fixed_nodes[i] + r] +=
                    R[c * forces + 3 * (size_t)i + r];
        }
    PetscCall(PetscFree(R));
    PetscFunctionReturn(0);
}

// Collective: |K x - b| / |b| of the first right-hand side.
static PetscErrorCode test_block(fem_system *s, Mat B, Mat X)
{
    PetscFunctionBegin;
    Vec b, x, difference;
    PetscReal size, off;
    PetscCall(MatDenseGetColumnVecRead(B, 0, &b));
    PetscCall(MatDenseGetColumnVecRead(X, 0, &x));
    PetscCall(VecDuplicate(b, &difference));
    PetscCall(MatMult(s->stiffness->K, x, difference));
    PetscCall(VecAXPY(difference, -1, b));
    PetscCall(VecNorm(difference, NORM_2, &off));
    PetscCall(VecNorm(b, NORM_2, &size));
    PetscCall(VecDestroy(&difference));
    PetscCall(MatDenseRestoreColumnVecRead(X, 0, &x));
    PetscCall(MatDenseRestoreColumnVecRead(B, 0, &b));
    if (size > 0) s->worst = fmax(s->worst, off / size);
    PetscFunctionReturn(0);
}

// Collective over the group: columns of a block, into this rank's part at the surface. *status
// takes a refusal, which all ranks have to agree on.
static PetscErrorCode solve_block(fem_system *s, const hat *hats, int32_t count, double *surface,
                                  pliant_status *status, pliant_error *err)
{
    PetscFunctionBegin;
    const size_t own = 3 * (size_t)(s->stiffness->own_end - s->stiffness->own_begin);
    const size_t rows = 3 * (size_t)s->problem->vertex_count;
    Mat B, X;
    double *right;
    const double *solution;
    int converged;
    PetscCall(MatCreateDense(s->groups.comm, (PetscInt)own, PETSC_DECIDE, PETSC_DETERMINE,
                             3 * count, NULL, &B));
    PetscCall(MatDuplicate(B, MAT_DO_NOT_COPY_VALUES, &X));
    PetscCall(MatDenseGetArrayWrite(B, &right));
    for (int32_t k = 0; k < count; k++) fill_right(s, &hats[k], right + 3 * (size_t)k * own, own);
    PetscCall(MatDenseRestoreArrayWrite(B, &right));
    for (int i = 0; i < 2; i++) {
        PetscCall(MatAssemblyBegin(i ? X : B, MAT_FINAL_ASSEMBLY));
        PetscCall(MatAssemblyEnd(i ? X : B, MAT_FINAL_ASSEMBLY));
    }
    PetscCall(pliant_fem_solver_solve(s->solver, B, X, &converged));
    PetscCall(test_block(s, B, X));
    PetscCall(MatDenseGetArrayRead(X, &solution));
    for (int32_t k = 0; k < count; k++)
        look_at_surface(s, solution + 3 * (size_t)k * own, own, surface + 3 * (size_t)k * rows);
    PetscCall(MatDenseRestoreArrayRead(X, &solution));
    PetscCall(MatDestroy(&X));
    PetscCall(MatDestroy(&B));
    if (!converged)
        *status = pliant_error_set(
            err, PLIANT_ERR_SINGULAR,
            "%s: multigrid does not converge: try --solver direct, --order 1 or better triangles",
            s->options->mesh);
    PetscFunctionReturn(0);
}

// Collective: what tractions of the rim's vertices do beyond it, on every rank.
static PetscErrorCode solve_rim(fem_system *s, pliant_error *err)
{
    PetscFunctionBegin;
    static const int32_t self = 0;
    static const double one = 1;
    const size_t rows = 3 * (size_t)s->problem->vertex_count;
    const int32_t rim_count = s->reaction->rim_count;
    double *responses;
    PetscCall(PetscCalloc1(3 * (size_t)rim_count * rows + 1, &responses));
    // Groups take turns.
    pliant_status status = PLIANT_OK;
    PetscErrorCode code = 0;
    for (int32_t first = 0, turn = 0; first < rim_count && code == 0; first += s->block, turn++) {
        if (turn % s->groups.count != s->groups.index) continue;
        const int32_t count = rim_count - first < s->block ? rim_count - first : s->block;
        hat *hats;
        PetscCall(PetscMalloc1(count, &hats));
        for (int32_t k = 0; k < count; k++)
            hats[k] = (hat){.count = 1,
                            .position = &self,
                            .weight = &one,
                            .nodes = s->reaction->rim + first + k,
                            .kind = HAT_RIM};
        code = solve_block(s, hats, count, responses + 3 * (size_t)first * rows, &status, err);
        PetscCall(PetscFree(hats));
    }
    if (code == 0) code = pliant_refusal_agree(s->comm, status, err);
    for (int32_t k = 0; k < rim_count && code == 0; k++)
        PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, responses + 3 * (size_t)k * rows, (int)(3 * rows),
                                   MPI_DOUBLE, MPI_SUM, s->comm));
    if (code) PetscCall(PetscFree(responses));
    PetscCall(code);
    PetscCall(pliant_reaction_couple(s->reaction, responses));
    PetscFunctionReturn(0);
}

static PetscErrorCode factor(void *system, pliant_progress *progress, pliant_error *err)
{
    PetscFunctionBegin;
    fem_system *s = system;
    pliant_progress_begin(progress, "factor", 0);
    // One thread a rank: ranks that each took all cores would be in each other's way (four times as
    // slow, two ranks on two cores).
    pliant_node_threads(1);
    // The blocks of right-hand sides and solutions, and CHOLMOD's three copies of them.
    pliant_node_keep_heap(s->planned.bytes + 6 * 8.0 * 3 * s->free_nodes * 3 * s->block);
    int singular;
    PetscCall(pliant_fem_solver_create(s->planned.kind, s->stiffness->K, s->stiffness->coordinates,
                                       &s->solver, &singular));
    pliant_status status = PLIANT_OK;
    if (singular)
        status = pliant_error_set(
            err, PLIANT_ERR_SINGULAR,
            "%s: the finite element system cannot be factored: hold more of the surface, or, where "
            "memory is short, try --solver multigrid",
            s->options->mesh);
    PliantCall(s->comm, status, err);
    PetscCall(solve_rim(s, err));
    PetscFunctionReturn(0);
}

// Collective: `hats` of a batch, shared out as whole columns.
static PetscErrorCode solve_hats(fem_system *s, const hat *hats, int32_t count,
                                 pliant_column_share *share, pliant_error *err)
{
    PetscFunctionBegin;
    const size_t rows = 3 * (size_t)s->problem->vertex_count;
    *share = (pliant_column_share){.ld = rows};
    pliant_solver_groups_share(&s->groups, count, s->rank, &share->begin, &share->end);
    int32_t begin, end;
    pliant_solver_groups_part(&s->groups, count, s->groups.index, &begin, &end);
    pliant_status status = PLIANT_OK;
    for (int32_t first = begin; first < end; first += s->block) {
        const int32_t size = end - first < s->block ? end - first : s->block;
        PetscCall(solve_block(s, hats + first, size,
                              s->surface + 3 * (size_t)(first - begin) * rows, &status, err));
    }
    PliantCall(s->comm, status, err);
    double *own = s->surface + 3 * (size_t)(share->begin - begin) * rows;
    share->columns = own;
    // A column at a time: counts stay far below MPI's limits.
    for (int member = 0; member < s->groups.size && s->groups.size > 1; member++) {
        int32_t from, to;
        pliant_solver_groups_share(&s->groups, count, s->groups.first[s->groups.index] + member,
                                   &from, &to);
        for (int32_t k = from; k < to; k++) {
            double *column = s->surface + 3 * (size_t)(k - begin) * rows;
            PetscCallMPI(MPI_Reduce(s->groups.rank == member ? MPI_IN_PLACE : column, column,
                                    (int)(3 * rows), MPI_DOUBLE, MPI_SUM, member, s->groups.comm));
        }
    }
    for (int32_t k = share->begin; k < share->end; k++)
        PetscCall(add_direct(s, &hats[k], own + 3 * (size_t)(k - share->begin) * rows));
    PetscCall(pliant_reaction_finish(s->reaction, 3 * (share->end - share->begin), own));
    PetscFunctionReturn(0);
}

static PetscErrorCode solve(void *system, int32_t first, int32_t count, pliant_column_share *share,
                            pliant_error *err)
{
    PetscFunctionBegin;
    fem_system *s = system;
    PetscCheck(count <= s->batch, s->comm, PETSC_ERR_ARG_SIZ, "batch of %d columns, room for %d",
               count, s->batch);
    hat *hats;
    PetscCall(PetscMalloc1(count, &hats));
    for (int32_t k = 0; k < count; k++) hats[k] = hat_of(s, first + k);
    const PetscErrorCode code = solve_hats(s, hats, count, share, err);
    PetscCall(PetscFree(hats));
    PetscCall(code);
    PetscFunctionReturn(0);
}

static PetscErrorCode solve_gravity(void *system, pliant_column_share *share, pliant_error *err)
{
    PetscFunctionBegin;
    const hat body = {.kind = HAT_BODY};
    PetscCall(solve_hats(system, &body, 1, share, err));
    PetscFunctionReturn(0);
}

static PetscErrorCode residual(const void *system, double *worst, double *bound)
{
    PetscFunctionBegin;
    const fem_system *s = system;
    PetscCallMPI(MPI_Allreduce(&s->worst, worst, 1, MPI_DOUBLE, MPI_MAX, s->comm));
    *bound = residual_bound;
    PetscFunctionReturn(0);
}

const pliant_discretisation pliant_fem_system = {
    .name = "fem",
    .create = create,
    .plan = plan,
    .groups = groups,
    .assemble = assemble,
    .factor = factor,
    .solve = solve,
    .solve_gravity = solve_gravity,
    .residual = residual,
    .destroy = destroy,
};
