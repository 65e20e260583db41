// solver_groups.h: the ranks dealt out to groups. Each group has an operator of its own, assembled
// and factored by itself, and solves for its part of every batch of columns: while columns are
// solved, which is where the time goes, groups do not talk to each other.
#pragma once

#include "pliant/base.h"

#include <petscsys.h>

typedef struct pliant_solver_groups {
    MPI_Comm world, comm;  // all ranks; those of this rank's group, in their order
    PetscMPIInt world_rank, world_size, rank, size;
    int count, index;  // of groups; this rank's
    int *first;  // shape [count + 1]: the world's ranks first[g] .. first[g + 1] - 1 are group g
} pliant_solver_groups;

// Collective: `count` groups (1 to the number of ranks) of neighbouring ranks, as equal as can be.
PetscErrorCode pliant_solver_groups_create(MPI_Comm world, int count, pliant_solver_groups *groups);
// Collective: one group a machine; one for all where a machine's ranks are not neighbours.
PetscErrorCode pliant_solver_groups_create_by_machine(MPI_Comm world, pliant_solver_groups *groups);
// Collective: the same groups, with a life of their own.
PetscErrorCode pliant_solver_groups_duplicate(const pliant_solver_groups *groups,
                                              pliant_solver_groups *copy);
PetscErrorCode pliant_solver_groups_destroy(pliant_solver_groups *groups);  // collective

// Of a batch of `count` columns a group's part is begin .. end - 1, and a rank's share of that.
void pliant_solver_groups_part(const pliant_solver_groups *groups, int32_t count, int group,
                               int32_t *begin, int32_t *end);
void pliant_solver_groups_share(const pliant_solver_groups *groups, int32_t count, int rank,
                                int32_t *begin, int32_t *end);
// The most columns that any group's part of a batch of `count` or fewer has.
int32_t pliant_solver_groups_most(const pliant_solver_groups *groups, int32_t count);

// Collective over the world: what a function that is collective over the group came to, on every
// rank: 0, PLIANT_REFUSED when some group refused (its text in everybody's `err`), else its error.
PetscErrorCode pliant_solver_groups_agree(const pliant_solver_groups *groups, PetscErrorCode code,
                                          pliant_error *err);

// Where part `part` begins of `count` things dealt out in order to `size` parts.
int32_t pliant_column_split(int64_t count, int part, int size);
