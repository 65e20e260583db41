// stiffness.c: the finite element equations of the reference problem, rows over the ranks.
#include "fem/stiffness.h"

#include "fem/element.h"
#include "fem/partition.h"
#include "refusal.h"

#include "pliant/error.h"

#include <stdlib.h>
#include <string.h>

typedef struct assembler {
    const pliant_stiffness_def *def;
    const pliant_tetrahedra *t;
    pliant_stiffness *s;
    uint8_t *is_free;        // [node_count]
    int32_t *held_position;  // [surface_count], -1 at free vertices
    int32_t held_count;
    PetscInt *own_nonzeros, *other_nonzeros;  // blocks in this rank's rows
} assembler;

static int is_own(const pliant_stiffness *s, int32_t node)
{
    const int32_t row = s->row_of_node[node];
    return row >= s->own_begin && row < s->own_end;
}

// ---- Who is free, and in which order ----

// A node in the middle of an edge of the surface is held with both its ends; an edge through the
// inside between two held vertices is free.
static pliant_status find_free(assembler *a, pliant_error *err)
{
    const pliant_tetrahedra *t = a->t;
    const int32_t n = t->surface_count;
    a->is_free = malloc((size_t)t->node_count);
    a->held_position = malloc((size_t)n * sizeof *a->held_position);
    a->s->row_of_node = malloc((size_t)t->node_count * sizeof *a->s->row_of_node);
    if (!a->is_free || !a->held_position || !a->s->row_of_node)
        return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for %d nodes", t->node_count);
    memset(a->is_free, 1, (size_t)t->node_count);
    for (int32_t v = 0; v < n; v++) {
        a->is_free[v] = !a->def->held[v];
        a->held_position[v] = a->def->held[v] ? a->held_count++ : -1;
    }
    for (int32_t f = 0; f < t->face_count; f++) {
        const int32_t *w = t->faces + (size_t)f * t->face_nodes;
        for (int k = 3; k < t->face_nodes; k++)
            if (a->def->held[w[k - 3]] && a->def->held[w[(k - 2) % 3]]) a->is_free[w[k]] = 0;
    }
    return PLIANT_OK;
}

static pliant_status number_nodes(assembler *a, int rank, int size, pliant_error *err)
{
    const pliant_tetrahedra *t = a->t;
    pliant_stiffness *s = a->s;
    int32_t *start = calloc((size_t)size + 1, sizeof *start);
    pliant_status status =
        start ? pliant_partition_nodes(t, a->is_free, size, s->row_of_node, err)
              : pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for %d ranks", size);
    if (status == PLIANT_OK) {
        for (int32_t i = 0; i < t->node_count; i++)
            if (s->row_of_node[i] >= 0) start[s->row_of_node[i] + 1]++;
        for (int r = 0; r < size; r++) start[r + 1] += start[r];
        s->free_count = start[size];
        s->own_begin = start[rank];
        s->own_end = start[rank + 1];
        for (int32_t i = 0; i < t->node_count; i++)
            if (s->row_of_node[i] >= 0) s->row_of_node[i] = start[s->row_of_node[i]]++;
    }
    free(start);
    return status;
}

// ---- The sparsity of own rows ----

// Tetrahedra by own node; then for each node its neighbours are marked and counted.
static pliant_status count_nonzeros(assembler *a, pliant_error *err)
{
    const pliant_tetrahedra *t = a->t;
    const pliant_stiffness *s = a->s;
    const int32_t own = s->own_end - s->own_begin;
    int64_t *offset = calloc((size_t)own + 2, sizeof *offset);
    int32_t *mark = malloc((size_t)t->node_count * sizeof *mark), *list = NULL;
    a->own_nonzeros = calloc((size_t)own + 1, sizeof *a->own_nonzeros);
    a->other_nonzeros = calloc((size_t)own + 1, sizeof *a->other_nonzeros);
    pliant_status status = PLIANT_OK;
    if (!offset || !mark || !a->own_nonzeros || !a->other_nonzeros) goto memory;
    const size_t entries = (size_t)t->tet_count * (size_t)t->tet_nodes;
    for (size_t k = 0; k < entries; k++)
        if (is_own(s, t->tets[k])) offset[s->row_of_node[t->tets[k]] - s->own_begin + 1]++;
    for (int32_t i = 0; i < own; i++) offset[i + 1] += offset[i];
    list = malloc(((size_t)offset[own] + 1) * sizeof *list);
    if (!list) goto memory;
    for (size_t k = 0; k < entries; k++)
        if (is_own(s, t->tets[k]))
            list[offset[s->row_of_node[t->tets[k]] - s->own_begin]++] =
                (int32_t)(k / (size_t)t->tet_nodes);
    for (int32_t i = 0; i < t->node_count; i++) mark[i] = -1;
    for (int32_t i = 0; i < own; i++)
        for (int64_t q = i ? offset[i - 1] : 0; q < offset[i]; q++)
            for (int k = 0; k < t->tet_nodes; k++) {
                const int32_t node = t->tets[(size_t)list[q] * (size_t)t->tet_nodes + (size_t)k];
                if (mark[node] == i || !a->is_free[node]) continue;
                mark[node] = i;
                if (is_own(s, node)) a->own_nonzeros[i]++;
                else a->other_nonzeros[i]++;
            }
    goto done;
memory:
    status = pliant_error_set(err, PLIANT_ERR_MEMORY,
                              "no memory for the stiffness matrix of %d nodes", t->node_count);
done:
    free(list);
    free(mark);
    free(offset);
    return status;
}

// ---- Elements ----

// One element's blocks between free and held nodes, and between held ones.
static void add_held(assembler *a, const int32_t *nodes,
                     double K[PLIANT_TET_NODES][PLIANT_TET_NODES][3][3])
{
    const pliant_tetrahedra *t = a->t;
    pliant_stiffness *s = a->s;
    for (int j = 0; j < t->tet_nodes; j++) {
        if (a->is_free[nodes[j]]) continue;
        const pliant_following to = pliant_tetrahedra_follow(t, nodes[j]);
        for (int i = 0; i < t->tet_nodes; i++) {
            if (a->is_free[nodes[i]]) {
                for (int q = 0; q < to.count && is_own(s, nodes[i]); q++)
                    pliant_block_columns_add(s->load, s->row_of_node[nodes[i]] - s->own_begin,
                                             to.vertex[q], -to.weight, (const double(*)[3])K[i][j]);
                continue;
            }
            const pliant_following from = pliant_tetrahedra_follow(t, nodes[i]);
            for (int p = 0; p < from.count; p++)
                for (int q = 0; q < to.count; q++)
                    pliant_block_columns_add(s->direct, a->held_position[from.vertex[p]],
                                             to.vertex[q], from.weight * to.weight,
                                             (const double(*)[3])K[i][j]);
        }
    }
}

static void add_body(assembler *a, const int32_t *nodes, double mass)
{
    const pliant_tetrahedra *t = a->t;
    pliant_stiffness *s = a->s;
    for (int i = 0; i < t->tet_nodes; i++) {
        const double share = mass * pliant_element_share(t->tet_nodes, i);
        if (is_own(s, nodes[i])) s->body[s->row_of_node[nodes[i]] - s->own_begin] += share;
        if (a->is_free[nodes[i]]) continue;
        const pliant_following to = pliant_tetrahedra_follow(t, nodes[i]);
        for (int q = 0; q < to.count; q++)
            s->direct_body[a->held_position[to.vertex[q]]] -= to.weight * share;
    }
}

static PetscErrorCode add_elements(assembler *a)
{
    PetscFunctionBegin;
    const pliant_tetrahedra *t = a->t;
    pliant_stiffness *s = a->s;
    const int count = t->tet_nodes;
    double K[PLIANT_TET_NODES][PLIANT_TET_NODES][3][3];
    double values[9 * PLIANT_TET_NODES * PLIANT_TET_NODES];
    for (int32_t e = 0; e < t->tet_count; e++) {
        const int32_t *nodes = t->tets + (size_t)e * (size_t)count;
        PetscInt rows[PLIANT_TET_NODES], columns[PLIANT_TET_NODES];
        int own = 0, held = 0;
        for (int i = 0; i < count; i++) {
            columns[i] = s->row_of_node[nodes[i]];
            rows[i] = is_own(s, nodes[i]) ? columns[i] : -1;
            own += rows[i] >= 0;
            held += !a->is_free[nodes[i]];
        }
        if (!own && !held) continue;
        double x[4][3];
        for (int k = 0; k < 4; k++) memcpy(x[k], t->nodes + 3 * (size_t)nodes[k], sizeof x[k]);
        const pliant_material *material = &a->def->materials[t->regions[e]];
        const double volume = pliant_element_stiffness(material, x, count, K);
        add_body(a, nodes, material->density * volume);
        if (held) add_held(a, nodes, K);
        if (!own) continue;
        // Negative rows and columns, others' and held ones, are passed over.
        for (int i = 0; i < count; i++)
            for (int j = 0; j < count; j++)
                for (int r = 0; r < 3; r++)
                    memcpy(values + (size_t)((3 * i + r) * 3 * count + 3 * j), K[i][j][r],
                           sizeof K[i][j][r]);
        PetscCall(MatSetValuesBlocked(s->K, count, rows, count, columns, values, ADD_VALUES));
    }
    PetscCall(MatAssemblyBegin(s->K, MAT_FINAL_ASSEMBLY));
    PetscCall(MatAssemblyEnd(s->K, MAT_FINAL_ASSEMBLY));
    PetscFunctionReturn(0);
}

// Tractions as nodal forces.
static void add_faces(assembler *a)
{
    static const double identity[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    const pliant_tetrahedra *t = a->t;
    pliant_stiffness *s = a->s;
    for (int32_t f = 0; f < t->face_count; f++) {
        const int32_t *nodes = t->faces + (size_t)f * (size_t)t->face_nodes;
        const double area = pliant_tetrahedra_face_area(t, f);
        for (int k = 0; k < 3; k++) {
            const int is_held = !a->is_free[nodes[k]];
            for (int i = 0; i < t->face_nodes; i++) {
                const double force = area * pliant_element_face_share(t->face_nodes, i, k);
                if (is_own(s, nodes[i]))
                    pliant_block_columns_add(is_held ? s->rim_load : s->load,
                                             s->row_of_node[nodes[i]] - s->own_begin, nodes[k],
                                             force, identity);
                if (a->is_free[nodes[i]] || is_held) continue;
                const pliant_following to = pliant_tetrahedra_follow(t, nodes[i]);
                for (int q = 0; q < to.count; q++)
                    pliant_block_columns_add(s->direct, a->held_position[to.vertex[q]], nodes[k],
                                             -to.weight * force, identity);
            }
        }
    }
}

// ---- Together ----

static pliant_status prepare(assembler *a, int rank, int size, pliant_error *err)
{
    pliant_status status = find_free(a, err);
    if (status == PLIANT_OK) status = number_nodes(a, rank, size, err);
    if (status == PLIANT_OK) status = count_nonzeros(a, err);
    if (status == PLIANT_OK)
        status = pliant_block_columns_create(a->t->surface_count, &a->s->load, err);
    if (status == PLIANT_OK)
        status = pliant_block_columns_create(a->t->surface_count, &a->s->direct, err);
    if (status == PLIANT_OK)
        status = pliant_block_columns_create(a->t->surface_count, &a->s->rim_load, err);
    if (status < 0) return status;
    a->s->body = calloc((size_t)(a->s->own_end - a->s->own_begin) + 1, sizeof *a->s->body);
    a->s->direct_body = calloc((size_t)a->held_count + 1, sizeof *a->s->direct_body);
    if (!a->s->body || !a->s->direct_body)
        return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for %d nodes", a->t->node_count);
    return PLIANT_OK;
}

static PetscErrorCode fill(MPI_Comm comm, assembler *a, pliant_error *err)
{
    PetscFunctionBegin;
    pliant_stiffness *s = a->s;
    const PetscInt own = 3 * (PetscInt)(s->own_end - s->own_begin);
    PetscCall(MatCreate(comm, &s->K));
    PetscCall(MatSetSizes(s->K, own, own, PETSC_DETERMINE, PETSC_DETERMINE));
    PetscCall(MatSetType(s->K, MATAIJ));
    PetscCall(MatSetBlockSize(s->K, 3));
    PetscCall(MatXAIJSetPreallocation(s->K, 3, a->own_nonzeros, a->other_nonzeros, NULL, NULL));
    PetscCall(MatSetOption(s->K, MAT_NEW_NONZERO_ALLOCATION_ERR, PETSC_TRUE));
    PetscCall(MatSetOption(s->K, MAT_SYMMETRIC, PETSC_TRUE));
    PetscCall(MatSetOption(s->K, MAT_SPD, PETSC_TRUE));
    PetscCall(add_elements(a));
    add_faces(a);
    pliant_status status = pliant_block_columns_finish(s->load, err);
    if (status == PLIANT_OK) status = pliant_block_columns_finish(s->direct, err);
    if (status == PLIANT_OK) status = pliant_block_columns_finish(s->rim_load, err);
    PliantCall(comm, status, err);

    double *x;
    PetscCall(VecCreate(comm, &s->coordinates));
    PetscCall(VecSetSizes(s->coordinates, own, PETSC_DETERMINE));
    PetscCall(VecSetBlockSize(s->coordinates, 3));
    PetscCall(VecSetType(s->coordinates, VECSTANDARD));
    PetscCall(VecGetArrayWrite(s->coordinates, &x));
    for (int32_t i = 0; i < a->t->node_count; i++)
        if (is_own(s, i))
            memcpy(x + 3 * (size_t)(s->row_of_node[i] - s->own_begin), a->t->nodes + 3 * (size_t)i,
                   3 * sizeof *x);
    PetscCall(VecRestoreArrayWrite(s->coordinates, &x));
    PetscFunctionReturn(0);
}

PetscErrorCode pliant_stiffness_create(MPI_Comm comm, const pliant_stiffness_def *def,
                                       pliant_stiffness **stiffness, pliant_error *err)
{
    PetscFunctionBegin;
    PetscMPIInt rank, size;
    PetscCallMPI(MPI_Comm_rank(comm, &rank));
    PetscCallMPI(MPI_Comm_size(comm, &size));
    PetscCall(PetscNew(stiffness));
    assembler a = {.def = def, .t = def->tetrahedra, .s = *stiffness};
    PetscErrorCode code = pliant_refusal_agree(comm, prepare(&a, rank, size, err), err);
    if (code == 0) code = fill(comm, &a, err);
    free(a.other_nonzeros);
    free(a.own_nonzeros);
    free(a.held_position);
    free(a.is_free);
    PetscCall(code);
    PetscFunctionReturn(0);
}

PetscErrorCode pliant_stiffness_destroy(pliant_stiffness **stiffness)
{
    PetscFunctionBegin;
    pliant_stiffness *s = *stiffness;
    if (!s) PetscFunctionReturn(0);
    free(s->direct_body);
    free(s->body);
    pliant_block_columns_destroy(s->rim_load);
    pliant_block_columns_destroy(s->direct);
    pliant_block_columns_destroy(s->load);
    free(s->row_of_node);
    PetscCall(VecDestroy(&s->coordinates));
    PetscCall(MatDestroy(&s->K));
    PetscCall(PetscFree(*stiffness));
    PetscFunctionReturn(0);
}
