// node_memory.c: memory that all ranks of one machine see, and waiting without spinning.
#include "node_memory.h"

#include <dlfcn.h>
#include <fcntl.h>
#include <malloc.h>
#include <math.h>
#include <sched.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <time.h>
#include <unistd.h>

// Between two looks at a barrier; short against the shortest batch (tens of milliseconds).
static const long look_every_ns = 200000;

PetscErrorCode pliant_node_memory_create(MPI_Comm node, size_t bytes, pliant_node_memory *memory,
                                         int *ok)
{
    PetscFunctionBegin;
    *memory = (pliant_node_memory){.bytes = bytes, .file = -1};
    PetscMPIInt rank, size;
    PetscCallMPI(MPI_Comm_rank(node, &rank));
    PetscCallMPI(MPI_Comm_size(node, &size));

    // The first rank makes an anonymous file; the others open it through /proc.
    long owner[2] = {(long)getpid(), -1};
    if (rank == 0) {
        memory->file = memfd_create("pliant-dense", MFD_CLOEXEC);
        if (memory->file >= 0 && ftruncate(memory->file, (off_t)bytes) != 0) {
            close(memory->file);
            memory->file = -1;
        }
        owner[1] = memory->file;
    }
    PetscCallMPI(MPI_Bcast(owner, 2, MPI_LONG, 0, node));
    int file = memory->file;
    if (rank > 0 && owner[1] >= 0) {
        char path[64];
        snprintf(path, sizeof path, "/proc/%ld/fd/%ld", owner[0], owner[1]);
        file = open(path, O_RDWR | O_CLOEXEC);
    }
    if (file >= 0) {
        void *map = mmap(NULL, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
        memory->values = map == MAP_FAILED ? NULL : map;
        if (rank > 0) close(file);
    }
    int mine = memory->values != NULL;
    PetscCallMPI(MPI_Allreduce(&mine, ok, 1, MPI_INT, MPI_MIN, node));
    if (!*ok) pliant_node_memory_destroy(memory);
    PetscFunctionReturn(0);
}

void pliant_node_memory_destroy(pliant_node_memory *memory)
{
    if (memory->values) munmap(memory->values, memory->bytes);
    if (memory->file >= 0) close(memory->file);
    *memory = (pliant_node_memory){.file = -1};
}

PetscErrorCode pliant_node_wait(MPI_Comm comm)
{
    PetscFunctionBegin;
    MPI_Request request;
    PetscCallMPI(MPI_Ibarrier(comm, &request));
    for (int done = 0;;) {
        PetscCallMPI(MPI_Test(&request, &done, MPI_STATUS_IGNORE));
        if (done) break;
        nanosleep(&(struct timespec){0, look_every_ns}, NULL);
    }
    PetscFunctionReturn(0);
}

PetscErrorCode pliant_node_widen(MPI_Comm node, int leader)
{
    PetscFunctionBegin;
    cpu_set_t mine, all;
    CPU_ZERO(&mine);
    if (sched_getaffinity(0, sizeof mine, &mine) != 0) CPU_ZERO(&mine);
    PetscCallMPI(MPI_Allreduce(&mine, &all, (int)sizeof mine, MPI_BYTE, MPI_BOR, node));
    if (leader && CPU_COUNT(&all) > 0) (void)sched_setaffinity(0, sizeof all, &all);
    PetscFunctionReturn(0);
}

PetscErrorCode pliant_node_size(MPI_Comm comm, PetscMPIInt *size)
{
    PetscFunctionBegin;
    MPI_Comm node;
    PetscCallMPI(MPI_Comm_split_type(comm, MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL, &node));
    PetscCallMPI(MPI_Comm_size(node, size));
    PetscCallMPI(MPI_Comm_free(&node));
    PetscFunctionReturn(0);
}

void pliant_node_threads(int threads)
{
    // Only OpenBLAS's name for it is looked up; another BLAS keeps its own setting.
    void (*set)(int) = (void (*)(int))(uintptr_t)dlsym(RTLD_DEFAULT, "openblas_set_num_threads");
    if (set) set(threads);
}

void pliant_node_keep_heap(double bytes)
{
#ifdef __GLIBC__
    (void)mallopt(M_MMAP_MAX, 0);
    (void)mallopt(M_TRIM_THRESHOLD, -1);
#endif
    // Nothing of it is touched, so that it costs no memory.
    char *heap = malloc((size_t)bytes);
    const uintptr_t page = 1 << 21, begin = ((uintptr_t)heap + page - 1) / page * page,
                    end = (uintptr_t)heap + (uintptr_t)bytes;
    if (heap && begin < end) (void)madvise((void *)begin, end - begin, MADV_HUGEPAGE);
    free(heap);
}

// The first number in a file, or -1.
static double number_in(const char *path, const char *key)
{
    FILE *file = fopen(path, "r");
    if (!file) return -1;
    char line[256];
    double value = -1;
    while (fgets(line, sizeof line, file))
        if (strncmp(line, key, strlen(key)) == 0 && sscanf(line + strlen(key), "%lf", &value) == 1) break;
    fclose(file);
    return value;
}

PetscErrorCode pliant_node_peak(MPI_Comm comm, double *bytes)
{
    PetscFunctionBegin;
    const double most = number_in("/proc/self/status", "VmHWM:"),
                 shared = number_in("/proc/self/status", "RssShmem:");
    double own = 1024 * (fmax(most, 0) - fmax(shared, 0)), here = 1024 * fmax(shared, 0), once;
    PetscMPIInt rank;
    MPI_Comm node;
    PetscCallMPI(MPI_Comm_split_type(comm, MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL, &node));
    PetscCallMPI(MPI_Comm_rank(node, &rank));
    // Every rank sees all of it in the end, or the part that it has touched.
    PetscCallMPI(MPI_Allreduce(&here, &once, 1, MPI_DOUBLE, MPI_MAX, node));
    PetscCallMPI(MPI_Comm_free(&node));
    if (rank == 0) own += once;
    PetscCallMPI(MPI_Allreduce(&own, bytes, 1, MPI_DOUBLE, MPI_SUM, comm));
    PetscFunctionReturn(0);
}

double pliant_node_available(void)
{
    PetscReal told = 0;
    PetscBool is_told = PETSC_FALSE;
    (void)PetscOptionsGetReal(NULL, NULL, "-pliant_memory", &told, &is_told);
    if (is_told) return 1e9 * told;
    double available = 1024 * number_in("/proc/meminfo", "MemAvailable:");
    const double limit = number_in("/sys/fs/cgroup/memory.max", "");
    const double used = number_in("/sys/fs/cgroup/memory.current", "");
    if (limit > 0 && used >= 0 && (available < 0 || limit - used < available)) available = limit - used;
    return available;
}
