// journal.c: a file of records that grows at its end and is true to the last whole record.
#include "journal.h"

#include "checksum.h"

#include "pliant/error.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

// At the file's begin; the digit is the version of heads and of the order of bytes within records.
static const char magic[8] = "PLIANTJ1";

typedef struct record_head {
    int32_t type;
    uint32_t size;
    uint64_t checksum;  // of type, size and place, then of the bytes
} record_head;

_Static_assert(sizeof(record_head) == 16, "on disk");

// No record is larger: what claims to be is damaged.
static const uint32_t largest_record = 1u << 30;

struct pliant_journal {
    char *path;
    int file;
    char *text;    // what was read: whole records
    size_t bytes;  // of them
    off_t end;     // of the file
};

static pliant_status refuse(const pliant_journal *j, const char *what, pliant_error *err)
{
    return pliant_error_set(err, PLIANT_ERR_IO, "%.400s: cannot %s: %s", j->path, what,
                            strerror(errno));
}

// Records begin at multiples of eight.
static size_t padded(size_t size)
{
    return (size + 7) / 8 * 8;
}

// The place is part of it, so that a record that lay elsewhere is none.
static uint64_t record_checksum(int32_t type, uint32_t size, uint64_t place, const void *bytes)
{
    const uint64_t head[3] = {(uint64_t)(uint32_t)type, size, place};
    return pliant_checksum(pliant_checksum(0, head, sizeof head), bytes, size);
}

// The whole record at `at`, or 0.
static int whole_record(const char *text, size_t bytes, size_t at, pliant_journal_record *record)
{
    record_head head;
    if (bytes < at || bytes - at < sizeof head) return 0;
    memcpy(&head, text + at, sizeof head);
    if (head.size > largest_record || bytes - at - sizeof head < padded(head.size)) return 0;
    if (head.checksum != record_checksum(head.type, head.size, at, text + at + sizeof head))
        return 0;
    *record = (pliant_journal_record){
        .type = head.type, .size = head.size, .bytes = text + at + sizeof head};
    return 1;
}

static pliant_status read_all(pliant_journal *j, pliant_error *err)
{
    struct stat found;
    if (fstat(j->file, &found) != 0) return refuse(j, "read", err);
    if (!S_ISREG(found.st_mode))
        return pliant_error_set(err, PLIANT_ERR_FORMAT, "%.400s: is not a regular file", j->path);
    const size_t size = (size_t)found.st_size;
    j->text = malloc(size + 8);
    if (!j->text)
        return pliant_error_set(err, PLIANT_ERR_MEMORY, "%.400s: no memory to read it", j->path);
    for (size_t done = 0; done < size;) {
        const ssize_t count = pread(j->file, j->text + done, size - done, (off_t)done);
        if (count < 0 && errno == EINTR) continue;
        if (count <= 0) return refuse(j, "read", err);
        done += (size_t)count;
    }
    if (memcmp(j->text, magic, size < sizeof magic ? size : sizeof magic) != 0)
        return pliant_error_set(err, PLIANT_ERR_FORMAT, "%.400s: is not a journal of this version",
                                j->path);
    size_t end = size < sizeof magic ? 0 : sizeof magic;
    pliant_journal_record record;
    while (end > 0 && whole_record(j->text, size, end, &record))
        end += sizeof(record_head) + padded(record.size);
    j->bytes = end;
    j->end = (off_t)end;
    if (end < size && ftruncate(j->file, (off_t)end) != 0)
        return refuse(j, "cut the torn end of it off", err);
    return PLIANT_OK;
}

static pliant_status write_all(pliant_journal *j, const void *bytes, size_t size, pliant_error *err)
{
    const char *from = bytes;
    for (size_t done = 0; done < size;) {
        const ssize_t count = pwrite(j->file, from + done, size - done, j->end + (off_t)done);
        if (count < 0 && errno == EINTR) continue;
        if (count <= 0) return refuse(j, "write", err);
        done += (size_t)count;
    }
    j->end += (off_t)size;
    return PLIANT_OK;
}

pliant_status pliant_journal_open(const char *path, pliant_journal **journal, pliant_error *err)
{
    pliant_journal *j = calloc(1, sizeof *j);
    if (j) j->path = strdup(path);
    if (!j || !j->path) {
        free(j);
        return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for a journal");
    }
    pliant_status status = PLIANT_OK;
    j->file = open(path, O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0666);
    if (j->file < 0) status = refuse(j, "open", err);
    // A file system that cannot lock is not refused.
    else if (flock(j->file, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK)
        status = pliant_error_set(err, PLIANT_ERR_ARGUMENT, "%.400s: another run is at work on it",
                                  path);
    if (status == PLIANT_OK) status = read_all(j, err);
    if (status == PLIANT_OK && j->end == 0) status = write_all(j, magic, sizeof magic, err);
    if (status < 0) {
        pliant_journal_close(j);
        return status;
    }
    *journal = j;
    return PLIANT_OK;
}

void pliant_journal_close(pliant_journal *j)
{
    if (!j) return;
    if (j->file >= 0) close(j->file);
    free(j->text);
    free(j->path);
    free(j);
}

pliant_status pliant_journal_append(pliant_journal *j, int32_t type, const void *bytes, size_t size,
                                    pliant_error *err)
{
    if (size > largest_record)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "%.400s: a record of %zu bytes is too large", j->path, size);
    const record_head head = {type, (uint32_t)size,
                              record_checksum(type, (uint32_t)size, (uint64_t)j->end, bytes)};
    // One write: a whole record or a torn tail.
    char *record = calloc(sizeof head + padded(size), 1);
    if (!record)
        return pliant_error_set(err, PLIANT_ERR_MEMORY, "%.400s: no memory for a record", j->path);
    memcpy(record, &head, sizeof head);
    if (size > 0) memcpy(record + sizeof head, bytes, size);
    const pliant_status status = write_all(j, record, sizeof head + padded(size), err);
    free(record);
    return status;
}

pliant_status pliant_journal_sync(pliant_journal *j, pliant_error *err)
{
    return fsync(j->file) == 0 ? PLIANT_OK : refuse(j, "write", err);
}

int pliant_journal_next(const pliant_journal *j, size_t *position, pliant_journal_record *record)
{
    if (*position == 0) *position = sizeof magic;
    if (!whole_record(j->text, j->bytes, *position, record)) return 0;
    *position += sizeof(record_head) + padded(record->size);
    return 1;
}
