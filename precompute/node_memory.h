// node_memory.h: memory that all ranks of one machine see, and waiting without spinning.
#pragma once

#include <petscsys.h>

#include <stddef.h>

typedef struct pliant_node_memory {
    double *values;
    size_t bytes;
    int file;  // memfd of the rank that made it, else -1
} pliant_node_memory;

// Collective over the ranks of one machine: one zeroed block that every rank maps. Not in /dev/shm,
// which containers keep at 64 MB. *ok is 0 on every rank when one of them could not map it.
PetscErrorCode pliant_node_memory_create(MPI_Comm node, size_t bytes, pliant_node_memory *memory,
                                         int *ok);
void pliant_node_memory_destroy(pliant_node_memory *memory);

// Collective: a barrier that sleeps between looks, so that a rank at work may use every core.
PetscErrorCode pliant_node_wait(MPI_Comm comm);

// Collective over the ranks of one machine: let the calling rank's threads run on every core that
// any of the ranks was bound to, and let its BLAS use `threads` threads. No effect on others.
PetscErrorCode pliant_node_widen(MPI_Comm node, int leader);
void pliant_node_threads(int threads);

// Let malloc keep what is freed, and give it `bytes` of address space on huge pages to carve from.
// For sparse solvers, which allocate and free hundreds of megabytes for every block of right-hand
// sides and walk through gigabytes: two ranks with 418 million factor entries each solved 3.5 columns
// a second without and 11.6 with it, where page tables are costly (a virtual machine).
void pliant_node_keep_heap(double bytes);

// Collective: the number of comm's ranks on this machine.
PetscErrorCode pliant_node_size(MPI_Comm comm, PetscMPIInt *size);

// Collective: the most memory that comm's ranks have had, all together, with what they share counted
// once a machine as it is now: to be asked while it is still there. 0 where the system does not tell.
PetscErrorCode pliant_node_peak(MPI_Comm comm, double *bytes);

// Bytes that this machine can still give: MemAvailable, or less where the control group says so;
// PETSC_OPTIONS="-pliant_memory GB" overrules.
double pliant_node_available(void);
