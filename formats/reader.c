// reader.c: map a file, check its header and section table, hand out the sections.
#include "pliant/reader.h"

#include "pliant/error.h"
#include "crc32c.h"
#include "table.h"

#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

// Bytes of the file's name that messages repeat; leaves room for the reason.
#define NAME_LIMIT 300

struct pliant_reader {
    const unsigned char *bytes;
    uint64_t size;
    int mapped;  // munmap at close
    int32_t version;
    int32_t section_count;
    uint32_t rest_checksum;
    pliant_section sections[PLIANT_SECTION_LIMIT];
    char paths[PLIANT_SECTION_LIMIT][PLIANT_PATH_LIMIT];
    char name[];
};

// ---- Is it ours? ----

static const unsigned char hdf5_signature[8] = {0x89, 'H', 'D', 'F', '\r', '\n', 0x1a, '\n'};

static int has_hdf5_at(const unsigned char *bytes, uint64_t size, uint64_t offset)
{
    return size >= offset + sizeof hdf5_signature &&
           memcmp(bytes + offset, hdf5_signature, sizeof hdf5_signature) == 0;
}

// Where a plain HDF5 file begins: at 0, or behind a user block of 512 * 2^k bytes; or -1.
static int64_t find_hdf5(const unsigned char *bytes, uint64_t size)
{
    if (has_hdf5_at(bytes, size, 0)) return 0;
    for (uint64_t offset = 512; offset <= 1 << 20; offset *= 2)
        if (has_hdf5_at(bytes, size, offset)) return (int64_t)offset;
    return -1;
}

// A file without our mark: say what it is.
static pliant_status explain(const pliant_reader *r, pliant_error *err)
{
    const int64_t hdf5 = find_hdf5(r->bytes, r->size);
    if (hdf5 == PLIANT_USER_BLOCK && r->bytes[0] == 0)
        return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                "%s: HDF5 with an empty section table: its writer did not finish; "
                                "make it anew with pliant-precompute",
                                r->name);
    if (hdf5 >= 0)
        return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                "%s: HDF5, but without Pliant's section table in front: of another "
                                "program, or repacked by a tool; use the file that "
                                "pliant-precompute wrote",
                                r->name);
    char found[8 * 4 + 1];
    size_t length = 0;
    for (size_t i = 0; i < 8 && i < r->size; i++) {
        const unsigned char c = r->bytes[i];
        length += (size_t)snprintf(found + length, sizeof found - length,
                                   c >= 0x20 && c < 0x7f ? "%c" : "\\x%02x", c);
    }
    return pliant_error_set(err, PLIANT_ERR_FORMAT,
                            "%s: not a Pliant model: expected it to begin with \"PLIANT\", found "
                            "\"%s\"",
                            r->name, found);
}

// The length that HDF5's own superblock (versions 0, 1) states for the file, or 0.
static uint64_t hdf5_size(const pliant_reader *r)
{
    const uint64_t at = PLIANT_USER_BLOCK;
    if (r->size < at + 64 || !has_hdf5_at(r->bytes, r->size, at)) return 0;
    const unsigned char version = r->bytes[at + 8], offset_size = r->bytes[at + 13];
    if (version > 1 || offset_size != 8) return 0;
    uint64_t end;
    memcpy(&end, r->bytes + at + (version == 0 ? 40 : 44), sizeof end);
    return end;
}

static pliant_status check_header(pliant_reader *r, pliant_header *header, pliant_error *err)
{
    if (r->size == 0)
        return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                "%s: empty: expected a model file, found 0 bytes", r->name);
    if (r->size < sizeof header->magic || memcmp(r->bytes, PLIANT_MAGIC, sizeof header->magic) != 0)
        return explain(r, err);
    if (r->size < sizeof *header)
        return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                "%s: truncated: expected at least %d bytes, found %" PRIu64,
                                r->name, PLIANT_USER_BLOCK, r->size);
    memcpy(header, r->bytes, sizeof *header);
    if (header->endian != PLIANT_ENDIAN_MARK)
        return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                "%s: header: expected byte order mark %#x, found %#x", r->name,
                                (unsigned)PLIANT_ENDIAN_MARK, (unsigned)header->endian);
    if (header->version > PLIANT_FORMAT_VERSION)
        return pliant_error_set(err, PLIANT_ERR_VERSION,
                                "%s: newer than this library: expected format version %d or "
                                "older, found %u",
                                r->name, PLIANT_FORMAT_VERSION, (unsigned)header->version);
    if (header->version < 1 || header->user_block != PLIANT_USER_BLOCK ||
        header->entry_size != sizeof(pliant_entry))
        return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                "%s: header: expected version 1.., user block %d, entries of %d "
                                "bytes, found %u, %u, %u",
                                r->name, PLIANT_USER_BLOCK, (int)sizeof(pliant_entry),
                                (unsigned)header->version, (unsigned)header->user_block,
                                (unsigned)header->entry_size);
    if (header->file_size != r->size) {
        if (hdf5_size(r) == r->size)
            return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                    "%s: repacked by another tool: expected %" PRIu64
                                    " bytes, found %" PRIu64 "; use the file that "
                                    "pliant-precompute wrote",
                                    r->name, header->file_size, r->size);
        return pliant_error_set(
            err, PLIANT_ERR_FORMAT, "%s: %s: expected %" PRIu64 " bytes, found %" PRIu64, r->name,
            r->size < header->file_size ? "truncated" : "bytes added at the end", header->file_size,
            r->size);
    }
    if (r->size < PLIANT_USER_BLOCK)
        return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                "%s: truncated: expected at least %d bytes, found %" PRIu64,
                                r->name, PLIANT_USER_BLOCK, r->size);
    const uint32_t checksum = pliant_table_checksum(r->bytes);
    if (header->checksum != checksum)
        return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                "%s: damaged section table: expected checksum %08x, found %08x",
                                r->name, (unsigned)header->checksum, (unsigned)checksum);
    if (header->section_count > PLIANT_SECTION_LIMIT)
        return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                "%s: header: expected at most %d sections, found %u", r->name,
                                PLIANT_SECTION_LIMIT, (unsigned)header->section_count);
    return PLIANT_OK;
}

// ---- The table ----

// Absolute, printable, no blanks, NUL-terminated.
static int is_path(const char path[PLIANT_PATH_LIMIT])
{
    if (path[0] != '/' || !memchr(path, 0, PLIANT_PATH_LIMIT) || path[1] == 0) return 0;
    for (const char *c = path; *c; c++)
        if (*c <= 0x20 || *c >= 0x7f) return 0;
    return 1;
}

static pliant_status check_entry(pliant_reader *r, int32_t i, pliant_error *err)
{
    pliant_entry entry;
    memcpy(&entry, r->bytes + sizeof(pliant_header) + (size_t)i * sizeof entry, sizeof entry);
    if (!is_path(entry.path))
        return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                "%s: section %d: expected a printable path, found something else",
                                r->name, (int)i);
    memcpy(r->paths[i], entry.path, sizeof entry.path);
    const char *path = r->paths[i];
    for (int32_t j = 0; j < i; j++)
        if (strcmp(path, r->paths[j]) == 0)
            return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                    "%s: %s: expected one section of this path, found two", r->name,
                                    path);

    const pliant_section_type type = (pliant_section_type)entry.type;
    if (pliant_section_type_size(type) == 0)
        return pliant_error_set(err, PLIANT_ERR_FORMAT, "%s: %s: expected type 1..5, found %d",
                                r->name, path, (int)entry.type);
    if (entry.rank < 1 || entry.rank > 3)
        return pliant_error_set(err, PLIANT_ERR_FORMAT, "%s: %s: expected rank 1..3, found %d",
                                r->name, path, (int)entry.rank);
    for (int32_t d = entry.rank; d < 3; d++)
        if (entry.shape[d] != 1)
            return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                    "%s: %s: expected length 1 beyond rank %d, found %" PRIu64,
                                    r->name, path, (int)entry.rank, entry.shape[d]);
    uint64_t count, bytes;
    if (!pliant_table_bytes(type, entry.rank, entry.shape, &count, &bytes))
        return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                "%s: %s: expected a size that a file can have, found %" PRIu64
                                " x %" PRIu64 " x %" PRIu64,
                                r->name, path, entry.shape[0], entry.shape[1], entry.shape[2]);
    if (count == 0) {
        if (entry.offset != 0 || entry.checksum != 0)
            return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                    "%s: %s: expected offset 0 of an empty section, found %" PRIu64,
                                    r->name, path, entry.offset);
    } else if (entry.offset < PLIANT_USER_BLOCK || entry.offset % PLIANT_SECTION_ALIGN != 0) {
        return pliant_error_set(
            err, PLIANT_ERR_FORMAT,
            "%s: %s: expected an offset of %d or more on a page, found %" PRIu64, r->name, path,
            PLIANT_USER_BLOCK, entry.offset);
    } else if (entry.offset > r->size || bytes > r->size - entry.offset) {
        return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                "%s: %s: expected to end within %" PRIu64 " bytes, found %" PRIu64
                                " bytes at %" PRIu64,
                                r->name, path, r->size, bytes, entry.offset);
    }
    for (int32_t j = 0; j < i && count > 0; j++) {
        const pliant_section *other = &r->sections[j];
        if (other->count > 0 && entry.offset < other->offset + other->bytes &&
            other->offset < entry.offset + bytes)
            return pliant_error_set(err, PLIANT_ERR_FORMAT, "%s: %s overlaps %s at %" PRIu64,
                                    r->name, path, other->path, entry.offset);
    }
    r->sections[i] = (pliant_section){
        .path = path,
        .type = type,
        .rank = entry.rank,
        .shape = {entry.shape[0], entry.shape[1], entry.shape[2]},
        .count = count,
        .bytes = bytes,
        .offset = entry.offset,
        .checksum = entry.checksum,
        .data = r->bytes + entry.offset,
    };
    return PLIANT_OK;
}

static pliant_status check(pliant_reader *r, pliant_error *err)
{
    pliant_header header;
    pliant_status status = check_header(r, &header, err);
    if (status < 0) return status;
    r->version = (int32_t)header.version;
    r->rest_checksum = header.rest_checksum;
    for (int32_t i = 0; i < (int32_t)header.section_count; i++) {
        status = check_entry(r, i, err);
        if (status < 0) return status;
        r->section_count = i + 1;
    }
    return PLIANT_OK;
}

// ---- Open, close ----

static pliant_status create(const char *name, const void *bytes, uint64_t size, int mapped,
                            pliant_reader **reader, pliant_error *err)
{
    size_t length = strlen(name);
    if (length > NAME_LIMIT) name += length - NAME_LIMIT, length = NAME_LIMIT;
    pliant_reader *r = calloc(1, sizeof *r + length + 1);
    if (!r)
        return pliant_error_set(err, PLIANT_ERR_MEMORY,
                                "%s: expected %zu bytes of memory, found none", name,
                                sizeof *r + length + 1);
    memcpy(r->name, name, length);
    r->bytes = bytes;
    r->size = size;
    pliant_status status = check(r, err);
    if (status < 0) {
        free(r);
        return status;
    }
    r->mapped = mapped;
    *reader = r;
    return PLIANT_OK;
}

static pliant_status refuse(const char *path, int error, pliant_error *err)
{
    return pliant_error_set(err, PLIANT_ERR_IO, "%.*s: %s", NAME_LIMIT, path, strerror(error));
}

// What the path leads to when it is no regular file.
static const char *kind(mode_t mode)
{
    if (S_ISDIR(mode)) return "a directory";
    if (S_ISFIFO(mode)) return "a pipe";
    if (S_ISSOCK(mode)) return "a socket";
    return "a device";
}

pliant_status pliant_reader_open(const char *path, pliant_reader **reader, pliant_error *err)
{
    pliant_status status;
    void *bytes = MAP_FAILED;
    uint64_t size = 0;
    struct stat info;
    // O_NONBLOCK: a pipe without a writer is to be refused, not waited for.
    const int file = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (file < 0) return refuse(path, errno, err);
    if (fstat(file, &info) != 0) {
        status = refuse(path, errno, err);
        goto done;
    }
    if (!S_ISREG(info.st_mode)) {
        status = pliant_error_set(err, PLIANT_ERR_IO, "%.*s: expected a file, found %s", NAME_LIMIT,
                                  path, kind(info.st_mode));
        goto done;
    }
    size = (uint64_t)info.st_size;
    if (size == 0) {
        status = create(path, "", 0, 0, reader, err);
        goto done;
    }
    bytes = mmap(NULL, (size_t)size, PROT_READ, MAP_SHARED, file, 0);
    if (bytes == MAP_FAILED) {
        status = refuse(path, errno, err);
        goto done;
    }
    status = create(path, bytes, size, 1, reader, err);
done:
    if (status < 0 && bytes != MAP_FAILED) munmap(bytes, (size_t)size);
    close(file);
    return status;
}

pliant_status pliant_reader_open_memory(const void *bytes, size_t size, const char *name,
                                        pliant_reader **reader, pliant_error *err)
{
    if ((uintptr_t)bytes % 16 != 0)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "%.*s: expected bytes aligned to 16, found %p", NAME_LIMIT, name,
                                bytes);
    return create(name, bytes, size, 0, reader, err);
}

void pliant_reader_close(pliant_reader *reader)
{
    if (!reader) return;
    if (reader->mapped) munmap((void *)(uintptr_t)reader->bytes, (size_t)reader->size);
    free(reader);
}

// ---- Use ----

const char *pliant_reader_name(const pliant_reader *reader)
{
    return reader->name;
}

uint64_t pliant_reader_size(const pliant_reader *reader)
{
    return reader->size;
}

int32_t pliant_reader_version(const pliant_reader *reader)
{
    return reader->version;
}

int32_t pliant_reader_section_count(const pliant_reader *reader)
{
    return reader->section_count;
}

const pliant_section *pliant_reader_section(const pliant_reader *reader, int32_t i)
{
    return i >= 0 && i < reader->section_count ? &reader->sections[i] : NULL;
}

const pliant_section *pliant_reader_find(const pliant_reader *reader, const char *path)
{
    for (int32_t i = 0; i < reader->section_count; i++)
        if (strcmp(reader->sections[i].path, path) == 0) return &reader->sections[i];
    return NULL;
}

pliant_status pliant_reader_verify(const pliant_reader *reader, pliant_error *err)
{
    pliant_span spans[PLIANT_SECTION_LIMIT];
    for (int32_t i = 0; i < reader->section_count; i++) {
        const pliant_section *s = &reader->sections[i];
        const uint32_t checksum = pliant_crc32c(0, s->data, (size_t)s->bytes);
        if (checksum != s->checksum)
            return pliant_error_set(
                err, PLIANT_ERR_FORMAT, "%s: %s: damaged: expected checksum %08x, found %08x",
                reader->name, s->path, (unsigned)s->checksum, (unsigned)checksum);
        spans[i] = (pliant_span){.offset = s->offset, .bytes = s->bytes};
    }
    const uint32_t rest =
        pliant_table_rest_checksum(reader->bytes, reader->size, spans, reader->section_count);
    if (rest != reader->rest_checksum)
        return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                "%s: HDF5's own part: damaged or edited: expected checksum %08x, "
                                "found %08x",
                                reader->name, (unsigned)reader->rest_checksum, (unsigned)rest);
    return PLIANT_OK;
}
