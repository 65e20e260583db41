// solver_groups.c: the ranks dealt out to groups.
#include "solver_groups.h"

#include "refusal.h"

#include <string.h>

int32_t pliant_column_split(int64_t count, int part, int size)
{
    return (int32_t)(count * part / size);
}

// Collective: `colour` ascends with the ranks, from 0 without gaps.
static PetscErrorCode create(MPI_Comm world, int colour, pliant_solver_groups *groups)
{
    PetscFunctionBegin;
    *groups = (pliant_solver_groups){.world = world, .index = colour};
    PetscCallMPI(MPI_Comm_rank(world, &groups->world_rank));
    PetscCallMPI(MPI_Comm_size(world, &groups->world_size));
    PetscCallMPI(MPI_Comm_split(world, colour, groups->world_rank, &groups->comm));
    PetscCallMPI(MPI_Comm_rank(groups->comm, &groups->rank));
    PetscCallMPI(MPI_Comm_size(groups->comm, &groups->size));
    int *colours;
    PetscCall(PetscMalloc1(groups->world_size, &colours));
    PetscCallMPI(MPI_Allgather(&colour, 1, MPI_INT, colours, 1, MPI_INT, world));
    groups->count = colours[groups->world_size - 1] + 1;
    PetscCall(PetscMalloc1(groups->count + 1, &groups->first));
    for (int r = groups->world_size - 1; r >= 0; r--) groups->first[colours[r]] = r;
    groups->first[groups->count] = groups->world_size;
    PetscCall(PetscFree(colours));
    PetscFunctionReturn(0);
}

PetscErrorCode pliant_solver_groups_create(MPI_Comm world, int count, pliant_solver_groups *groups)
{
    PetscFunctionBegin;
    PetscMPIInt rank, size;
    PetscCallMPI(MPI_Comm_rank(world, &rank));
    PetscCallMPI(MPI_Comm_size(world, &size));
    PetscAssert(count >= 1 && count <= size, world, PETSC_ERR_ARG_OUTOFRANGE,
                "%d groups of %d ranks", count, size);
    int colour = 0;
    while (pliant_column_split(size, colour + 1, count) <= rank) colour++;
    PetscCall(create(world, colour, groups));
    PetscFunctionReturn(0);
}

PetscErrorCode pliant_solver_groups_create_by_machine(MPI_Comm world, pliant_solver_groups *groups)
{
    PetscFunctionBegin;
    PetscMPIInt rank, size, first;
    MPI_Comm machine;
    PetscCallMPI(MPI_Comm_rank(world, &rank));
    PetscCallMPI(MPI_Comm_size(world, &size));
    PetscCallMPI(MPI_Comm_split_type(world, MPI_COMM_TYPE_SHARED, rank, MPI_INFO_NULL, &machine));
    PetscCallMPI(MPI_Allreduce(&rank, &first, 1, MPI_INT, MPI_MIN, machine));
    PetscCallMPI(MPI_Comm_free(&machine));
    // A machine is known by its first rank.
    int *firsts;
    PetscCall(PetscMalloc1(size, &firsts));
    PetscCallMPI(MPI_Allgather(&first, 1, MPI_INT, firsts, 1, MPI_INT, world));
    int colour = 0, are_neighbours = 1;
    for (int r = 1; r < size; r++) {
        if (firsts[r] != firsts[r - 1] && firsts[r] != r) are_neighbours = 0;
        if (r <= rank && firsts[r] == r) colour++;
    }
    PetscCall(PetscFree(firsts));
    PetscCall(create(world, are_neighbours ? colour : 0, groups));
    PetscFunctionReturn(0);
}

PetscErrorCode pliant_solver_groups_duplicate(const pliant_solver_groups *groups,
                                              pliant_solver_groups *copy)
{
    PetscFunctionBegin;
    PetscCall(create(groups->world, groups->index, copy));
    PetscFunctionReturn(0);
}

PetscErrorCode pliant_solver_groups_destroy(pliant_solver_groups *groups)
{
    PetscFunctionBegin;
    if (!groups->first) PetscFunctionReturn(0);
    PetscCall(PetscFree(groups->first));
    PetscCallMPI(MPI_Comm_free(&groups->comm));
    *groups = (pliant_solver_groups){0};
    PetscFunctionReturn(0);
}

// By ranks, so that a larger group has more.
void pliant_solver_groups_part(const pliant_solver_groups *groups, int32_t count, int group,
                               int32_t *begin, int32_t *end)
{
    *begin = pliant_column_split(count, groups->first[group], groups->world_size);
    *end = pliant_column_split(count, groups->first[group + 1], groups->world_size);
}

void pliant_solver_groups_share(const pliant_solver_groups *groups, int32_t count, int rank,
                                int32_t *begin, int32_t *end)
{
    int group = 0;
    while (groups->first[group + 1] <= rank) group++;
    const int first = groups->first[group], size = groups->first[group + 1] - first;
    int32_t from, to;
    pliant_solver_groups_part(groups, count, group, &from, &to);
    *begin = from + pliant_column_split(to - from, rank - first, size);
    *end = from + pliant_column_split(to - from, rank - first + 1, size);
}

int32_t pliant_solver_groups_most(const pliant_solver_groups *groups, int32_t count)
{
    int32_t most = 1;
    for (int g = 0; g < groups->count; g++) {
        // Rounded up, as a part of fewer columns may be by one larger than its portion.
        const int64_t ranks = groups->first[g + 1] - groups->first[g];
        const int32_t part =
            (int32_t)((count * ranks + groups->world_size - 1) / groups->world_size);
        if (part > most) most = part;
    }
    return most;
}

PetscErrorCode pliant_solver_groups_agree(const pliant_solver_groups *groups, PetscErrorCode code,
                                          pliant_error *err)
{
    PetscFunctionBegin;
    if (code && code != PLIANT_REFUSED) PetscCall(code);
    // The group has agreed on the text already; that of the first group wins.
    PetscCall(pliant_refusal_agree(groups->world, code ? PLIANT_ERR_MEMORY : PLIANT_OK, err));
    PetscFunctionReturn(0);
}
