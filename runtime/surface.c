// surface.c: read a solution: the whole surface to a level, or chosen vertices (steps (7), (8)).
#include "solver.h"

#include "pliant/vector_clones.h"

#include <string.h>

typedef float row16 __attribute__((vector_size(64)));
typedef float packed8 __attribute__((vector_size(32), aligned(4)));
typedef float packed4 __attribute__((vector_size(16), aligned(4)));

static int32_t find_solved(const pliant_solver *solver, int32_t vertex)
{
    return pliant_constraint_find(solver->solved, solver->solved_count, vertex);
}

// (7) v = W^-1 g up to `level`, in place. What a coarser level needed has been overwritten, so
// another level starts from a new sum.
static void reconstruct(pliant_solver *solver, int32_t d, int32_t level)
{
    pliant_field *field = &solver->fields[d];
    if (field->is_summed && field->reconstructed == level) return;
    pliant_solver_sum(solver, d);
    const pliant_wavelet *wavelet = solver->model->domains[d].wavelet;
    if (field->is_sparse)
        pliant_wavelet_inverse_online_sparse(wavelet, level, field->support, field->g);
    else pliant_wavelet_inverse_online(wavelet, level, field->g);
    field->reconstructed = level;
}

// Scatter rows of four floats to packed vertices. Nodes ascend and most follow each other (the 2143
// free ones of a test body in 65 runs), so go by fours: 0.4 us there, one by one 1.1.
PLIANT_VECTOR_CLONES
static void pack(const float *rows, const int32_t *nodes, int32_t count, pliant_vec3 *u)
{
    int32_t p = 0;
    while (p < count) {
        if (p + 4 <= count && nodes[p + 3] - nodes[p] == 3) {
            row16 four;
            memcpy(&four, rows + 4 * (size_t)p, sizeof four);
            float *to = &u[nodes[p]].x;
            *(packed8 *)to = __builtin_shufflevector(four, four, 0, 1, 2, 4, 5, 6, 8, 9);
            *(packed4 *)(to + 8) = __builtin_shufflevector(four, four, 10, 12, 13, 14);
            p += 4;
        } else {
            memcpy(&u[nodes[p]], rows + 4 * (size_t)p, sizeof *u);
            p++;
        }
    }
}

pliant_status pliant_solver_surface(pliant_solver *solver, int32_t level, pliant_vec3 *u)
{
    const pliant_model *model = solver->model;
    if (level < 0 || level > model->finest_level || !u) return PLIANT_ERR_ARGUMENT;
    const int64_t begin = pliant_clock_ns();
    reconstruct(solver, PLIANT_DOMAIN_FREE, level);

    const int32_t vertex_count = model->hierarchy->vertex_count[level];
    const pliant_model_domain *free_domain = &model->domains[PLIANT_DOMAIN_FREE];
    const pliant_model_domain *fixed_domain = &model->domains[PLIANT_DOMAIN_FIXED];
    pack(solver->fields[PLIANT_DOMAIN_FREE].g, free_domain->nodes,
         free_domain->wavelet->level_offset[level + 1], u);
    const int32_t fixed_count = fixed_domain->wavelet->level_offset[level + 1];
    const uint32_t finest = 1u << model->finest_level;
    if (solver->used_levels[PLIANT_DOMAIN_FIXED] & ~finest)
        for (int32_t p = 0; p < fixed_count; p++)
            u[fixed_domain->nodes[p]] =
                pliant_solver_boundary_value(solver, fixed_domain->nodes[p]);
    else pack(solver->fixed_displacement, fixed_domain->nodes, fixed_count, u);
    // (8) at S the displacement is known: specified at free nodes, solved for at freed ones.
    for (int32_t i = 0; i < solver->solved_count; i++) {
        const int32_t vertex = solver->solved[i].node.vertex;
        if (vertex >= vertex_count) continue;
        u[vertex] = model->domain[vertex] == PLIANT_DOMAIN_FREE
                        ? solver->solved[i].value
                        : pliant_solver_boundary_value(solver, vertex);
    }
    solver->report.surface_ns = pliant_clock_ns() - begin;
    return PLIANT_OK;
}

// ---- Chosen vertices ----

// What is known of v without the rows of `d`: everything outside that domain, and S.
static int32_t find_known(const pliant_solver *solver, int32_t d, int32_t vertex, pliant_vec3 *v)
{
    if (solver->model->domain[vertex] != d) {
        *v = pliant_solver_boundary_value(solver, vertex);
        return 1;
    }
    const int32_t i = find_solved(solver, vertex);
    if (i >= 0) *v = solver->solved[i].value;
    return i >= 0;
}

static pliant_vec3 row_value(const float *row)
{
    return (pliant_vec3){row[0], row[1], row[2]};
}

// Have a plan for these positions, if that is quicker than the whole transform. A plan costs some
// ten times its run, so a set that is new is planned at once only when it is small, else when it
// comes a second time (probes do, every frame).
static int32_t plan_query(pliant_solver *solver, int32_t d, const int32_t *positions, int32_t count)
{
    pliant_field *field = &solver->fields[d];
    if (count > solver->query_capacity) return 0;
    const int32_t is_known =
        field->query_count == count &&
        memcmp(field->query_positions, positions, (size_t)count * sizeof *positions) == 0;
    if (is_known && field->query_is_planned) return 1;
    if (!is_known) {
        memcpy(field->query_positions, positions, (size_t)count * sizeof *positions);
        field->query_count = count;
        field->query_is_planned = 0;
        if (count > solver->query_at_once) return 0;
    }
    pliant_reconstruction_build(&field->plan, &solver->scratch.domain[d], positions, count,
                                field->query_slots);
    field->query_is_planned = 1;
    return 1;
}

// v at chosen vertices, of the quantity that lives on the rows of `d`.
static void evaluate(pliant_solver *solver, int32_t d, const int32_t *vertices, int32_t count,
                     pliant_vec3 *v)
{
    const pliant_model *model = solver->model;
    pliant_field *field = &solver->fields[d];
    int32_t *positions = solver->query_scratch;
    int32_t asked = 0;
    for (int32_t i = 0; i < count; i++) {
        const int32_t vertex = vertices ? vertices[i] : i;
        if (find_known(solver, d, vertex, &v[i])) continue;
        if (asked < solver->query_capacity) positions[asked] = model->position[vertex];
        asked++;
    }
    if (asked == 0) return;

    const float *rows = field->g;
    const int32_t is_whole = field->is_summed && field->reconstructed == model->finest_level;
    const int32_t is_selective = !is_whole && plan_query(solver, d, positions, asked);
    if (is_selective) {
        pliant_solver_sum(solver, d);
        pliant_reconstruction_run(&field->plan, field->g, solver->scratch.blocks);
        rows = solver->scratch.blocks;
    } else {
        reconstruct(solver, d, model->finest_level);
    }
    for (int32_t i = 0, k = 0; i < count; i++) {
        const int32_t vertex = vertices ? vertices[i] : i;
        pliant_vec3 ignored;
        if (find_known(solver, d, vertex, &ignored)) continue;
        const int32_t row = is_selective ? field->query_slots[k++] : model->position[vertex];
        v[i] = row_value(rows + 4 * (size_t)row);
    }
}

static pliant_status check_vertices(const pliant_solver *solver, const int32_t *vertices,
                                    int32_t count, const pliant_vec3 *values)
{
    const int32_t n = solver->model->vertex_count;
    if (count < 0 || (count > 0 && !values) || (!vertices && count > n)) return PLIANT_ERR_ARGUMENT;
    if (vertices)
        for (int32_t i = 0; i < count; i++)
            if (vertices[i] < 0 || vertices[i] >= n) return PLIANT_ERR_ARGUMENT;
    return PLIANT_OK;
}

pliant_status pliant_solver_displacements(pliant_solver *solver, const int32_t *vertices,
                                          int32_t count, pliant_vec3 *u)
{
    const pliant_status status = check_vertices(solver, vertices, count, u);
    if (status < 0) return status;
    evaluate(solver, PLIANT_DOMAIN_FREE, vertices, count, u);
    return PLIANT_OK;
}

pliant_status pliant_solver_tractions(pliant_solver *solver, const int32_t *vertices, int32_t count,
                                      pliant_vec3 *p)
{
    const pliant_status status = check_vertices(solver, vertices, count, p);
    if (status < 0) return status;
    if (solver->domain_count < 2)
        for (int32_t i = 0; i < count; i++)
            if (solver->model->domain[vertices ? vertices[i] : i] == PLIANT_DOMAIN_FIXED)
                return PLIANT_ERR_MISSING;
    evaluate(solver, PLIANT_DOMAIN_FIXED, vertices, count, p);
    return PLIANT_OK;
}

// What the traction solved for at a member of S comes to; zero at freed nodes.
static pliant_vec3 member_force(const pliant_solver *solver, int32_t i)
{
    const pliant_model *model = solver->model;
    const pliant_node node = solver->solved[i].node;
    if (model->domain[node.vertex] != PLIANT_DOMAIN_FREE) return (pliant_vec3){0, 0, 0};
    const float area = (float)model->node_areas[node.level][node.vertex];
    const pliant_vec3 p = solver->reference[i];
    return (pliant_vec3){area * p.x, area * p.y, area * p.z};
}

pliant_vec3 pliant_solver_contact_force(const pliant_solver *solver)
{
    double force[3] = {0};
    for (int32_t i = 0; i < solver->solved_count; i++) {
        const pliant_vec3 f = member_force(solver, i);
        force[0] += (double)f.x, force[1] += (double)f.y, force[2] += (double)f.z;
    }
    return (pliant_vec3){(float)force[0], (float)force[1], (float)force[2]};
}

pliant_vec3 pliant_solver_node_force(const pliant_solver *solver, pliant_node node)
{
    const int32_t i = find_solved(solver, node.vertex);
    return i >= 0 && solver->solved[i].node.level == node.level ? member_force(solver, i)
                                                                : (pliant_vec3){0, 0, 0};
}
