// partial.c: what a run has finished, kept beside its output so that another run can go on from
// there.
#include "partial.h"

#include "identity.h"
#include "interruption.h"
#include "journal.h"
#include "refusal.h"

#include "pliant/error.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

// A column is on the disk for sure so many seconds after it was solved, or with its batch if that
// takes longer: then waiting for the disk costs a percent or two, and a kill no more than these.
static const double default_interval = 5;

enum { RECORD_IDENTITY = 1, RECORD_BEGIN, RECORD_DONE, RECORD_GRAVITY, RECORD_NAME };

typedef struct begin_record {
    int32_t ranks, unused;
    int32_t base[PLIANT_COLUMN_DOMAINS], total[PLIANT_COLUMN_DOMAINS];
} begin_record;

// Followed by the bytes of every rank's file, as uint64_t.
typedef struct done_record {
    int32_t done[PLIANT_COLUMN_DOMAINS];
    double residual;
} done_record;

typedef struct name_record {
    uint64_t device, inode;
} name_record;

struct pliant_partial {
    MPI_Comm comm;
    PetscMPIInt rank, size;
    char folder[PATH_MAX], journal_path[PATH_MAX + 16], text[PATH_MAX + 100];
    char *identity;           // first rank
    pliant_journal *journal;  // first rank
    int is_ours, is_finished;
    int32_t batch;
    // What earlier runs left; the same on all ranks.
    pliant_stretches earlier;
    float *gravity;
    size_t gravity_count;
    // This run's.
    int32_t base[PLIANT_COLUMN_DOMAINS];
    int32_t done[PLIANT_COLUMN_DOMAINS],
        kept[PLIANT_COLUMN_DOMAINS];  // solved; as the journal says
    double residual, last, interval;
    pliant_column_file *own;
    int is_synced;  // the folder's entries are on the disk
};

// ---- The folder ----

static int32_t sum(const int32_t counts[PLIANT_COLUMN_DOMAINS])
{
    return counts[PLIANT_COLUMNS_FREE] + counts[PLIANT_COLUMNS_FIXED];
}

static int folder_path(const char *output, char *folder)
{
    const int length = snprintf(folder, PATH_MAX, "%s.partial", output);
    return length < PATH_MAX - 32;
}

// Remove what is ours in the folder, and the folder when nothing else is in it. The journal goes
// last: while it is there it can be told what the rest was.
static void wipe(const char *folder)
{
    DIR *directory = opendir(folder);
    if (!directory) return;
    for (struct dirent *entry; (entry = readdir(directory));)
        if (strncmp(entry->d_name, "columns.", 8) == 0)
            unlinkat(dirfd(directory), entry->d_name, 0);
    unlinkat(dirfd(directory), "journal", 0);
    closedir(directory);
    rmdir(folder);
}

// New names in a folder must survive a power cut, too. File systems that cannot are not refused.
static void sync_folder(const char *path)
{
    const int file = open(path, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (file < 0) return;
    fsync(file);
    close(file);
}

// ---- What is there ----

static pliant_status no_memory(pliant_error *err)
{
    return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for columns of an interrupted run");
}

static pliant_status enter_begin(pliant_partial *p, const pliant_journal_record *record,
                                 pliant_error *err)
{
    begin_record b;
    if (record->size != sizeof b) return PLIANT_ERR_FORMAT;
    memcpy(&b, record->bytes, sizeof b);
    return pliant_stretches_add(&p->earlier, b.ranks, b.base, b.total, err);
}

static pliant_status enter_done(pliant_partial *p, const pliant_journal_record *record)
{
    done_record d;
    if (record->size < sizeof d) return PLIANT_ERR_FORMAT;
    memcpy(&d, record->bytes, sizeof d);
    p->residual = d.residual;
    const char *ends = (const char *)record->bytes + sizeof d;
    return pliant_stretches_advance(&p->earlier, d.done, ends, record->size - sizeof d)
               ? PLIANT_OK
               : PLIANT_ERR_FORMAT;
}

// What the journal says. *then is the identity, borrowed from it; NULL: none.
static pliant_status read_journal(pliant_partial *p, const char **then, pliant_error *err)
{
    size_t position = 0;
    *then = NULL;
    for (pliant_journal_record record; pliant_journal_next(p->journal, &position, &record);) {
        pliant_status status = PLIANT_OK;
        const char *text = record.bytes;
        if (record.type == RECORD_IDENTITY && record.size > 0 && text[record.size - 1] == 0)
            *then = text;
        else if (record.type == RECORD_BEGIN) status = enter_begin(p, &record, err);
        else if (record.type == RECORD_DONE) status = enter_done(p, &record);
        else if (record.type == RECORD_GRAVITY) {
            free(p->gravity);
            p->gravity = malloc(record.size + 1);
            if (!p->gravity) return no_memory(err);
            memcpy(p->gravity, record.bytes, record.size);
            p->gravity_count = record.size / sizeof *p->gravity;
        }
        if (status == PLIANT_ERR_FORMAT)
            return pliant_error_set(err, PLIANT_ERR_FORMAT, "%.400s: cannot be understood",
                                    p->journal_path);
        if (status < 0) return status;
    }
    return PLIANT_OK;
}

static void forget(pliant_partial *p)
{
    pliant_stretches_clear(&p->earlier);
    free(p->gravity);
    p->gravity = NULL;
    p->gravity_count = 0;
    p->residual = 0;
}

// The first rank's: an empty folder with a journal that is ours alone.
static pliant_status open_folder(pliant_partial *p, pliant_error *err)
{
    if (mkdir(p->folder, 0777) != 0 && errno != EEXIST)
        return pliant_error_set(err, PLIANT_ERR_IO, "%.400s: cannot make the folder: %s", p->folder,
                                strerror(errno));
    const pliant_status status = pliant_journal_open(p->journal_path, &p->journal, err);
    struct stat found;
    if (status == PLIANT_ERR_IO && lstat(p->journal_path, &found) == 0 && found.st_size == 0)
        unlink(p->journal_path);
    if (status < 0) rmdir(p->folder);  // stays when there is anything in it
    return status;
}

static pliant_status begin_anew(pliant_partial *p, pliant_error *err)
{
    pliant_journal_close(p->journal);
    p->journal = NULL;
    forget(p);
    wipe(p->folder);
    return open_folder(p, err);
}

// The first rank's: open the folder and take up, discard or refuse what is in it.
static pliant_status take_up(pliant_partial *p, const pliant_partial_def *def, pliant_error *err)
{
    const char *then = NULL;
    pliant_status status = open_folder(p, err);
    if (status == PLIANT_OK) status = read_journal(p, &then, err);
    if (status == PLIANT_ERR_FORMAT) {
        if (def->wish == PLIANT_PARTIAL_DISCARD) return begin_anew(p, err);
        const pliant_error inner = *err;
        return pliant_error_set(err, status, "%.400s; --force begins anew", inner.text);
    }
    if (status < 0) return status;
    if (p->earlier.count == 0)
        return then || def->wish == PLIANT_PARTIAL_DISCARD ? begin_anew(p, err) : PLIANT_OK;
    const pliant_stretch *last = &p->earlier.items[p->earlier.count - 1];
    if (!then || sum(last->done) == 0 || def->wish == PLIANT_PARTIAL_DISCARD)
        return begin_anew(p, err);
    if (def->wish == PLIANT_PARTIAL_REFUSE)
        return pliant_error_set(
            err, PLIANT_ERR_ARGUMENT,
            "%.300s: an interrupted run left %d of %d columns: --resume goes on from there, "
            "--force begins anew",
            def->output, sum(last->done), sum(last->total));
    status = pliant_identity_compare(then, p->identity, err);
    if (status < 0) {
        const pliant_error inner = *err;
        return pliant_error_set(
            err, status,
            "%.150s: cannot resume, %.250s: give what it was, or --force to begin anew", p->folder,
            inner.text);
    }
    return PLIANT_OK;
}

// Collective: what there is, and where to go on.
static PetscErrorCode load(pliant_partial *p, pliant_progress *progress, pliant_error *err)
{
    PetscFunctionBegin;
    int64_t size = (int64_t)p->gravity_count;
    PetscCallMPI(MPI_Bcast(&size, 1, MPI_INT64_T, 0, p->comm));
    PetscCallMPI(MPI_Bcast(&p->residual, 1, MPI_DOUBLE, 0, p->comm));
    pliant_status status = PLIANT_OK;
    if (p->rank > 0) {
        p->gravity_count = (size_t)size;
        p->gravity = malloc(((size_t)size + 1) * sizeof *p->gravity);
        if (!p->gravity) status = no_memory(err);
    }
    PliantCall(p->comm, status, err);
    PetscCallMPI(MPI_Bcast(p->gravity, (int)size, MPI_FLOAT, 0, p->comm));
    PetscCall(pliant_stretches_load(p->comm, &p->earlier, err));
    if (p->earlier.count == 0) PetscFunctionReturn(0);
    const pliant_stretch *last = &p->earlier.items[p->earlier.count - 1];
    for (int d = 0; d < PLIANT_COLUMN_DOMAINS; d++) {
        int32_t count = pliant_stretches_columns(&p->earlier, (pliant_column_domain)d);
        if (count > last->done[d]) count = last->done[d];
        if (count < last->done[d])
            pliant_progress_note(progress, "%s: %d columns are damaged and will be solved again",
                                 p->folder, last->done[d] - count);
        // Whole batches of this run's: another number of ranks may have other ones.
        if (count < p->earlier.total[d]) count -= count % p->batch;
        if (d == PLIANT_COLUMNS_FIXED &&
            p->base[PLIANT_COLUMNS_FREE] < p->earlier.total[PLIANT_COLUMNS_FREE])
            count = 0;
        p->base[d] = p->done[d] = p->kept[d] = count;
    }
    PetscFunctionReturn(0);
}

// Collective: do all ranks see the first one's folder?
static PetscErrorCode is_shared(pliant_partial *p, int *shared)
{
    PetscFunctionBegin;
    struct stat found = {0};
    uint64_t inode = 0;
    if (p->rank == 0 && stat(p->journal_path, &found) == 0) inode = found.st_ino;
    PetscCallMPI(MPI_Bcast(&inode, 1, MPI_UINT64_T, 0, p->comm));
    int mine = stat(p->journal_path, &found) == 0 && found.st_ino == inode;
    PetscCallMPI(MPI_Allreduce(&mine, shared, 1, MPI_INT, MPI_MIN, p->comm));
    PetscFunctionReturn(0);
}

PetscErrorCode pliant_partial_create(MPI_Comm comm, const pliant_partial_def *def,
                                     pliant_progress *progress, pliant_partial **partial,
                                     pliant_error *err)
{
    PetscFunctionBegin;
    pliant_partial *p;
    PetscCall(PetscNew(&p));
    *partial = p;
    p->comm = comm;
    PetscCallMPI(MPI_Comm_rank(comm, &p->rank));
    PetscCallMPI(MPI_Comm_size(comm, &p->size));
    p->earlier.row_limit = def->row_limit;
    p->batch = def->batch;
    p->earlier.folder = p->folder;
    memcpy(p->earlier.total, def->column_count, sizeof p->earlier.total);
    memcpy(p->earlier.domain, def->domain, sizeof p->earlier.domain);
    p->interval = default_interval;
    PetscCall(PetscOptionsGetReal(NULL, NULL, "-pliant_journal_seconds", &p->interval, NULL));
    pliant_status status = PLIANT_OK;
    if (!folder_path(def->output, p->folder))
        status =
            pliant_error_set(err, PLIANT_ERR_IO, "%.100s...: the name is too long", def->output);
    snprintf(p->journal_path, sizeof p->journal_path, "%s/journal", p->folder);
    if (p->rank == 0 && status == PLIANT_OK) {
        p->identity = strdup(def->identity);
        status = p->identity ? take_up(p, def, err) : no_memory(err);
    }
    PliantCall(comm, status, err);
    int shared;
    PetscCall(is_shared(p, &shared));
    if (!shared && p->rank == 0 && p->earlier.count > 0)
        status = pliant_error_set(
            err, PLIANT_ERR_IO, "%.400s: not all ranks see this folder: cannot resume", p->folder);
    PliantCall(comm, status, err);
    p->is_ours = 1;
    if (!shared) {
        pliant_progress_note(
            progress, "%s: not all ranks see this folder: the run keeps nothing to resume from",
            p->folder);
        PetscCall(pliant_partial_destroy(partial));
        PetscFunctionReturn(0);
    }
    PetscCall(load(p, progress, err));
    if (sum(p->base) > 0)
        pliant_progress_note(progress, "goes on with %d of %d columns from %s (%.3g GB)",
                             sum(p->base), sum(p->earlier.total), p->folder,
                             pliant_partial_bytes(p) / 1e9);
    PetscFunctionReturn(0);
}

PetscErrorCode pliant_partial_destroy(pliant_partial **partial)
{
    PetscFunctionBegin;
    pliant_partial *p = *partial;
    if (!p) PetscFunctionReturn(0);
    pliant_stretches_clear(&p->earlier);
    pliant_column_file_destroy(p->own);
    // Some file systems keep what is open.
    PetscCallMPI(MPI_Barrier(p->comm));
    if (p->rank == 0 && p->is_ours && (p->is_finished || sum(p->kept) == 0)) wipe(p->folder);
    pliant_journal_close(p->journal);
    forget(p);
    free(p->identity);
    PetscCall(PetscFree(*partial));
    PetscFunctionReturn(0);
}

void pliant_partial_finish(pliant_partial *p)
{
    p->is_finished = 1;
}

// ---- What an earlier run left ----

int pliant_partial_is_whole(const pliant_partial *p)
{
    return sum(p->base) == sum(p->earlier.total) && p->gravity_count > 0;
}

int pliant_partial_is_taken_up(const pliant_partial *p)
{
    return p->is_ours;
}

int pliant_partial_is_kept(const pliant_partial *p)
{
    return !p->is_finished && sum(p->kept) > 0;
}

int32_t pliant_partial_done(const pliant_partial *p, pliant_column_domain domain)
{
    return p->done[domain];
}

int pliant_partial_find(const pliant_partial *p, int32_t stream, int32_t column,
                        pliant_spooled *found)
{
    const int domain = p->earlier.domain[stream];
    return domain >= 0 && column < p->base[domain] &&
           pliant_stretches_find(&p->earlier, stream, column, found);
}

double pliant_partial_residual(const pliant_partial *p)
{
    return p->residual;
}

const char *pliant_partial_folder(const pliant_partial *p)
{
    return p->folder;
}

const char *pliant_partial_journal(const pliant_partial *p)
{
    return p->journal_path;
}

double pliant_partial_bytes(const pliant_partial *p)
{
    double bytes = 0;
    for (int32_t f = 0; f < p->earlier.file_count; f++) bytes += (double)p->earlier.ends[f];
    return bytes;
}

int pliant_partial_gravity(const pliant_partial *p, float *values, size_t count)
{
    if (count == 0 || p->gravity_count != count) return 0;
    memcpy(values, p->gravity, count * sizeof *values);
    return 1;
}

const char *pliant_partial_text(pliant_partial *p)
{
    if (sum(p->kept) == 0)
        snprintf(p->text, sizeof p->text, "no column was finished yet, nothing is kept");
    else
        snprintf(p->text, sizeof p->text,
                 "%d of %d columns are kept: --resume goes on from there (%s)", sum(p->kept),
                 sum(p->earlier.total), p->folder);
    return p->text;
}

// ---- What this run gets done ----

PetscErrorCode pliant_partial_begin(pliant_partial *p, pliant_error *err)
{
    PetscFunctionBegin;
    char path[PATH_MAX + 64];
    pliant_stretches_path(p->folder, p->earlier.count, p->rank, path, sizeof path);
    PliantCall(p->comm, pliant_column_file_create(path, &p->own, err), err);
    pliant_status status = PLIANT_OK;
    if (p->rank == 0) {
        begin_record record = {.ranks = p->size};
        memcpy(record.base, p->base, sizeof record.base);
        memcpy(record.total, p->earlier.total, sizeof record.total);
        if (p->earlier.count == 0)
            status = pliant_journal_append(p->journal, RECORD_IDENTITY, p->identity,
                                           strlen(p->identity) + 1, err);
        if (status == PLIANT_OK)
            status = pliant_journal_append(p->journal, RECORD_BEGIN, &record, sizeof record, err);
    }
    PliantCall(p->comm, status, err);
    p->last = pliant_progress_clock();
    PetscFunctionReturn(0);
}

pliant_column_file *pliant_partial_file(const pliant_partial *p)
{
    return p->own;
}

// First rank: the columns are on the disk; now the journal.
static pliant_status enter_in_journal(pliant_partial *p, const uint64_t *ends, double residual,
                                      pliant_error *err)
{
    const size_t size = sizeof(done_record) + (size_t)p->size * sizeof *ends;
    char *bytes = malloc(size);
    if (!bytes) return no_memory(err);
    done_record record = {.residual = residual};
    memcpy(record.done, p->done, sizeof record.done);
    memcpy(bytes, &record, sizeof record);
    memcpy(bytes + sizeof record, ends, (size_t)p->size * sizeof *ends);
    if (!p->is_synced) {
        char parent[PATH_MAX];
        snprintf(parent, sizeof parent, "%s", p->folder);
        char *slash = strrchr(parent, '/');
        if (slash) slash[slash == parent] = 0;
        sync_folder(p->folder);
        sync_folder(slash ? parent : ".");
        p->is_synced = 1;
    }
    pliant_status status = pliant_journal_append(p->journal, RECORD_DONE, bytes, size, err);
    free(bytes);
    if (status == PLIANT_OK) status = pliant_journal_sync(p->journal, err);
    return status;
}

// Collective.
static PetscErrorCode commit(pliant_partial *p, double residual, pliant_error *err)
{
    PetscFunctionBegin;
    PliantCall(p->comm, pliant_column_file_sync(p->own, err), err);
    uint64_t end = pliant_column_file_bytes(p->own), *ends;
    double worst;
    PetscCall(PetscMalloc1(p->size, &ends));
    PetscCallMPI(MPI_Gather(&end, 1, MPI_UINT64_T, ends, 1, MPI_UINT64_T, 0, p->comm));
    PetscCallMPI(MPI_Reduce(&residual, &worst, 1, MPI_DOUBLE, MPI_MAX, 0, p->comm));
    const pliant_status status = p->rank == 0 ? enter_in_journal(p, ends, worst, err) : PLIANT_OK;
    PetscCall(PetscFree(ends));
    PliantCall(p->comm, status, err);
    memcpy(p->kept, p->done, sizeof p->kept);
    p->last = pliant_progress_clock();
    PetscFunctionReturn(0);
}

PetscErrorCode pliant_partial_advance(pliant_partial *p, pliant_column_domain domain, int32_t done,
                                      double residual, pliant_error *err)
{
    PetscFunctionBegin;
    p->done[domain] = done;
    int is_due = p->rank == 0 && pliant_progress_clock() - p->last >= p->interval, signal;
    PetscCallMPI(MPI_Bcast(&is_due, 1, MPI_INT, 0, p->comm));
    PetscCall(pliant_interruption_agree(p->comm, &signal));
    if (is_due || signal || sum(p->done) == sum(p->earlier.total))
        PetscCall(commit(p, residual, err));
    PliantCall(p->comm, signal ? pliant_error_set(err, PLIANT_ERR_IO, "interrupted") : PLIANT_OK,
               err);
    PetscFunctionReturn(0);
}

PetscErrorCode pliant_partial_store_gravity(pliant_partial *p, const float *values, size_t count,
                                            pliant_error *err)
{
    PetscFunctionBegin;
    pliant_status status = PLIANT_OK;
    if (p->rank == 0) {
        status =
            pliant_journal_append(p->journal, RECORD_GRAVITY, values, count * sizeof *values, err);
        if (status == PLIANT_OK) status = pliant_journal_sync(p->journal, err);
    }
    PliantCall(p->comm, status, err);
    PetscFunctionReturn(0);
}

// ---- The end ----

pliant_status pliant_partial_name(pliant_partial *p, const char *path, pliant_error *err)
{
    struct stat found;
    if (stat(path, &found) != 0)
        return pliant_error_set(err, PLIANT_ERR_IO, "%.400s: %s", path, strerror(errno));
    const name_record record = {(uint64_t)found.st_dev, (uint64_t)found.st_ino};
    return pliant_journal_append(p->journal, RECORD_NAME, &record, sizeof record, err);
}

int pliant_partial_was_finished(const char *output)
{
    char folder[PATH_MAX], path[PATH_MAX + 16];
    struct stat found;
    if (stat(output, &found) != 0 || !folder_path(output, folder)) return 0;
    snprintf(path, sizeof path, "%s/journal", folder);
    pliant_journal *journal = NULL;
    if (access(path, F_OK) != 0) {
        rmdir(folder);  // the last thing to go, where it is there
        return 0;
    }
    if (pliant_journal_open(path, &journal, NULL) < 0) return 0;
    int finished = 0;
    size_t position = 0;
    for (pliant_journal_record record; pliant_journal_next(journal, &position, &record);) {
        name_record name;
        if (record.type != RECORD_NAME || record.size != sizeof name) continue;
        memcpy(&name, record.bytes, sizeof name);
        finished = name.inode == (uint64_t)found.st_ino && name.device == (uint64_t)found.st_dev;
    }
    if (finished) wipe(folder);
    pliant_journal_close(journal);
    return finished;
}
