// writer_hdf5.c: write model and dense files through libhdf5, the only source that knows it.
//
// Compiled against the serial and the parallel flavour alike: no MPI call, one rank writes. HDF5
// lays the file out (contiguous, allocated in order, never filled, page-aligned, no times); what
// we add is the user block in front, once HDF5 has closed the file.
#include "pliant/writer.h"

#include "pliant/error.h"
#include "crc32c.h"
#include "table.h"

#include <errno.h>
#include <fcntl.h>
#include <hdf5.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

// One H5Dwrite moves about this much: more than 2 GiB in a call fails in some builds of HDF5, and
// larger slices than these are no faster.
#define SLICE_BYTES ((uint64_t)16 << 20)

// Disk space reserved beyond the sections: attributes and HDF5's own headers.
#define METADATA_BYTES ((uint64_t)256 << 10)

// The skeleton grows in memory by this.
#define SKELETON_STEP ((size_t)64 << 10)

// An attribute must fit into an HDF5 object header message (64 KiB).
#define ATTRIBUTE_LIMIT 60000

typedef struct written_section {
    pliant_section_def def;
    uint64_t count, bytes;  // elements, bytes
    uint64_t written;       // elements so far
    uint64_t offset;
    hid_t set;
} written_section;

struct pliant_writer {
    char *path, *temporary;
    hid_t file;
    int32_t section_count;
    written_section sections[PLIANT_SECTION_LIMIT];
};

// ---- HDF5's own error reports ----

// The library prints its error stack by default; ours go into pliant_error. The setting is the
// process's, so every public function puts it back.
typedef struct report {
    H5E_auto2_t print;
    void *data;
} report;

static report silence(void)
{
    report saved = {0};
    H5Eget_auto2(H5E_DEFAULT, &saved.print, &saved.data);
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
    return saved;
}

static void restore(report saved)
{
    H5Eset_auto2(H5E_DEFAULT, saved.print, saved.data);
}

// Keep the innermost description; of a system error only the system's text.
static herr_t keep_reason(unsigned n, const H5E_error2_t *record, void *data)
{
    (void)n;
    char *reason = data;
    if (reason[0] || !record->desc) return 0;
    const char *system = strstr(record->desc, "error message = '");
    if (system) {
        system += strlen("error message = '");
        snprintf(reason, 200, "%.*s", (int)strcspn(system, "'"), system);
    } else {
        snprintf(reason, 200, "%.190s", record->desc);
    }
    return 0;
}

static pliant_status refuse_hdf5(const pliant_writer *w, const char *what, pliant_error *err)
{
    char reason[200] = "";
    H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, keep_reason, reason);
    return pliant_error_set(err, PLIANT_ERR_IO, "%s: %s: %s", w->path, what,
                            reason[0] ? reason : "refused by HDF5");
}

static pliant_status refuse_system(const char *path, int error, pliant_error *err)
{
    return pliant_error_set(err, PLIANT_ERR_IO, "%.300s: %s", path, strerror(error));
}

// ---- Pieces of HDF5 ----

static hid_t file_type(pliant_section_type type)
{
    switch (type) {
    case PLIANT_F4:
        return H5T_IEEE_F32LE;
    case PLIANT_F8:
        return H5T_IEEE_F64LE;
    case PLIANT_I4:
        return H5T_STD_I32LE;
    case PLIANT_U8:
        return H5T_STD_U64LE;
    case PLIANT_U1:
        return H5T_STD_U8LE;
    }
    return H5I_INVALID_HID;
}

static hid_t memory_type(pliant_section_type type)
{
    switch (type) {
    case PLIANT_F4:
        return H5T_NATIVE_FLOAT;
    case PLIANT_F8:
        return H5T_NATIVE_DOUBLE;
    case PLIANT_I4:
        return H5T_NATIVE_INT32;
    case PLIANT_U8:
        return H5T_NATIVE_UINT64;
    case PLIANT_U1:
        return H5T_NATIVE_UINT8;
    }
    return H5I_INVALID_HID;
}

// One box that H5Dwrite can take in one go.
static herr_t write_slice(const written_section *s, const hsize_t *start, const hsize_t *count,
                          const void *data)
{
    herr_t result = -1;
    const hid_t memory = H5Screate_simple(s->def.rank, count, NULL), file = H5Dget_space(s->set);
    if (memory >= 0 && file >= 0 &&
        H5Sselect_hyperslab(file, H5S_SELECT_SET, start, NULL, count, NULL) >= 0)
        result = H5Dwrite(s->set, memory_type(s->def.type), memory, file, H5P_DEFAULT, data);
    if (memory >= 0) H5Sclose(memory);
    if (file >= 0) H5Sclose(file);
    return result;
}

// Let HDF5 write what it holds and close.
static pliant_status close_file(pliant_writer *w, pliant_error *err)
{
    pliant_status status = PLIANT_OK;
    for (int32_t i = 0; i < w->section_count; i++) {
        if (w->sections[i].set >= 0 && H5Dclose(w->sections[i].set) < 0 && status == PLIANT_OK)
            status = refuse_hdf5(w, w->sections[i].def.path, err);
        w->sections[i].set = H5I_INVALID_HID;
    }
    if (w->file >= 0 && H5Fclose(w->file) < 0 && status == PLIANT_OK)
        status = refuse_hdf5(w, "close", err);
    w->file = H5I_INVALID_HID;
    return status;
}

// ---- Create ----

static pliant_status check_definitions(const char *path, const pliant_section_def *sections,
                                       int32_t section_count, pliant_error *err)
{
    if (section_count < 1 || section_count > PLIANT_SECTION_LIMIT)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "%.300s: expected 1 to %d sections, found %d", path,
                                PLIANT_SECTION_LIMIT, (int)section_count);
    for (int32_t i = 0; i < section_count; i++) {
        const pliant_section_def *s = &sections[i];
        uint64_t count, bytes;
        if (s->path[0] != '/' || !memchr(s->path, 0, sizeof s->path) ||
            pliant_section_type_size(s->type) == 0 || s->rank < 1 || s->rank > 3 ||
            !pliant_table_bytes(s->type, s->rank, s->shape, &count, &bytes))
            return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                    "%.300s: section %d: expected an absolute path, a type, rank "
                                    "1..3 and a possible size, found \"%.*s\"",
                                    path, (int)i, PLIANT_PATH_LIMIT - 1, s->path);
    }
    return PLIANT_OK;
}

// Open PATH.tmp, new and ours alone, with the system's own reason when that cannot be.
static pliant_status claim(const pliant_writer *w, int *file, pliant_error *err)
{
    struct stat info;
    if (stat(w->path, &info) == 0 && !S_ISREG(info.st_mode))
        return pliant_error_set(err, PLIANT_ERR_IO, "%.300s: expected a file to replace, found %s",
                                w->path,
                                S_ISDIR(info.st_mode) ? "a directory" : "a device or a pipe");
    *file = open(w->temporary, O_RDWR | O_CREAT | O_CLOEXEC | O_NONBLOCK, 0666);
    if (*file < 0) return refuse_system(w->temporary, errno, err);
    // HDF5 holds this lock as long as a file is open for writing. No locks here: no check.
    if (flock(*file, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK) return PLIANT_OK;
    close(*file);
    return pliant_error_set(err, PLIANT_ERR_IO, "%.300s: another process is writing it",
                            w->temporary);
}

// Groups and dataset headers, without room for the data yet.
static pliant_status create_sections(pliant_writer *w, pliant_error *err)
{
    pliant_status status = PLIANT_OK;
    const hid_t creation = H5Pcreate(H5P_DATASET_CREATE), link = H5Pcreate(H5P_LINK_CREATE);
    if (creation < 0 || link < 0 || H5Pset_create_intermediate_group(link, 1) < 0 ||
        H5Pset_layout(creation, H5D_CONTIGUOUS) < 0 ||
        H5Pset_alloc_time(creation, H5D_ALLOC_TIME_LATE) < 0 ||
        H5Pset_fill_time(creation, H5D_FILL_TIME_NEVER) < 0 ||
        H5Pset_obj_track_times(creation, 0) < 0)
        status = refuse_hdf5(w, "create", err);
    for (int32_t i = 0; i < w->section_count && status == PLIANT_OK; i++) {
        written_section *s = &w->sections[i];
        hsize_t shape[3];
        for (int d = 0; d < 3; d++) shape[d] = (hsize_t)s->def.shape[d];
        const hid_t space = H5Screate_simple(s->def.rank, shape, NULL);
        if (space >= 0)
            s->set = H5Dcreate2(w->file, s->def.path, file_type(s->def.type), space, link, creation,
                                H5P_DEFAULT);
        if (s->set < 0) status = refuse_hdf5(w, s->def.path, err);
        if (space >= 0) H5Sclose(space);
    }
    if (creation >= 0) H5Pclose(creation);
    if (link >= 0) H5Pclose(link);
    return status;
}

// HDF5's part without the data, in memory: groups and dataset headers close together. (Made in the
// file, where everything stands on pages, each little header would take a page: half a megabyte.)
static pliant_status build_skeleton(pliant_writer *w, void **image, size_t *size, pliant_error *err)
{
    pliant_status status = PLIANT_OK;
    const hid_t creation = H5Pcreate(H5P_FILE_CREATE), access = H5Pcreate(H5P_FILE_ACCESS);
    if (creation >= 0 && access >= 0 && H5Pset_userblock(creation, PLIANT_USER_BLOCK) >= 0 &&
        H5Pset_fapl_core(access, SKELETON_STEP, 0) >= 0 &&
        H5Pset_fclose_degree(access, H5F_CLOSE_STRONG) >= 0)
        w->file = H5Fcreate(w->temporary, H5F_ACC_TRUNC, creation, access);
    if (w->file < 0) status = refuse_hdf5(w, "create", err);
    if (creation >= 0) H5Pclose(creation);
    if (access >= 0) H5Pclose(access);
    if (status == PLIANT_OK) status = create_sections(w, err);
    if (status == PLIANT_OK) {
        // The image begins behind the user block.
        const ssize_t bytes =
            H5Fflush(w->file, H5F_SCOPE_GLOBAL) < 0 ? -1 : H5Fget_file_image(w->file, NULL, 0);
        *image = bytes > 0 ? malloc((size_t)bytes) : NULL;
        if (!*image || H5Fget_file_image(w->file, *image, (size_t)bytes) != bytes)
            status = refuse_hdf5(w, "create", err);
        *size = (size_t)bytes;
    }
    const pliant_status closed = close_file(w, status == PLIANT_OK ? err : NULL);
    return status < 0 ? status : closed;
}

static pliant_status write_at(const pliant_writer *w, int file, const void *data, size_t size,
                              off_t offset, pliant_error *err)
{
    const unsigned char *bytes = data;
    for (size_t done = 0; done < size;) {
        const ssize_t written = pwrite(file, bytes + done, size - done, offset + (off_t)done);
        if (written < 0 && errno == EINTR) continue;
        if (written < 0) return refuse_system(w->temporary, errno, err);
        done += (size_t)written;
    }
    return PLIANT_OK;
}

// Write the skeleton and reserve the disk space for the rest, with our own calls: a full disk is
// refused here, at the start, and HDF5 never meets one. (It cannot close a file that it cannot
// flush, and 1.10 crashes later.) Some file systems cannot reserve; that is no error.
static pliant_status write_skeleton(const pliant_writer *w, int file, const void *image,
                                    size_t size, pliant_error *err)
{
    uint64_t need = PLIANT_USER_BLOCK + size + METADATA_BYTES;
    for (int32_t i = 0; i < w->section_count; i++)
        need += w->sections[i].bytes + PLIANT_SECTION_ALIGN;
    if (ftruncate(file, 0) != 0 || (need <= INT64_MAX && ftruncate(file, (off_t)need) != 0))
        return refuse_system(w->temporary, errno, err);
    if (need > INT64_MAX ||
        (fallocate(file, 0, 0, (off_t)need) != 0 && (errno == ENOSPC || errno == EDQUOT)))
        return pliant_error_set(err, PLIANT_ERR_IO, "%.300s: %" PRIu64 " bytes: %s", w->temporary,
                                need, strerror(need > INT64_MAX ? EFBIG : errno));
    return write_at(w, file, image, size, PLIANT_USER_BLOCK, err);
}

// The first write gives a section its place: one zero does.
static herr_t allocate(const written_section *s)
{
    const hsize_t start[3] = {0}, count[3] = {1, 1, 1};
    const uint64_t zero = 0;
    return write_slice(s, start, count, &zero);
}

// Open the file on disk and give every section its place on pages, in order.
static pliant_status place_sections(pliant_writer *w, pliant_error *err)
{
    pliant_status status = PLIANT_OK;
    const hid_t access = H5Pcreate(H5P_FILE_ACCESS);
    if (access >= 0 && H5Pset_fclose_degree(access, H5F_CLOSE_STRONG) >= 0 &&
        H5Pset_alignment(access, 1, PLIANT_SECTION_ALIGN) >= 0) {
#if H5_VERSION_GE(1, 10, 7)
        // Some network file systems have no locks; that is no reason to refuse.
        H5Pset_file_locking(access, 1, 1);
#endif
        w->file = H5Fopen(w->temporary, H5F_ACC_RDWR, access);
    }
    if (w->file < 0) status = refuse_hdf5(w, "create", err);
    if (access >= 0) H5Pclose(access);
    for (int32_t i = 0; i < w->section_count && status == PLIANT_OK; i++) {
        written_section *s = &w->sections[i];
        s->set = H5Dopen2(w->file, s->def.path, H5P_DEFAULT);
        if (s->set < 0 || (s->count > 0 && allocate(s) < 0)) {
            status = refuse_hdf5(w, s->def.path, err);
            break;
        }
        // HDF5 gives a dataset without elements no place in the file; the table says offset 0.
        const haddr_t offset = s->count > 0 ? H5Dget_offset(s->set) : 0;
        if (offset == HADDR_UNDEF || offset % PLIANT_SECTION_ALIGN != 0)
            status =
                pliant_error_set(err, PLIANT_ERR_IO,
                                 "%s: %s: expected a place on a page of the file, found %" PRIu64,
                                 w->path, s->def.path, (uint64_t)offset);
        s->offset = (uint64_t)offset;
    }
    return status;
}

static pliant_status make_file(pliant_writer *w, int file, pliant_error *err)
{
    void *image = NULL;
    size_t size = 0;
    pliant_status status = build_skeleton(w, &image, &size, err);
    if (status == PLIANT_OK) status = write_skeleton(w, file, image, size, err);
    free(image);
    close(file);  // and our lock, before HDF5 takes its own
    if (status == PLIANT_OK) status = place_sections(w, err);
    return status;
}

static void end(pliant_writer *w)
{
    free(w->path);
    free(w->temporary);
    free(w);
}

pliant_status pliant_writer_create(const char *path, const pliant_section_def *sections,
                                   int32_t section_count, pliant_writer **writer, pliant_error *err)
{
    pliant_status status = check_definitions(path, sections, section_count, err);
    if (status < 0) return status;
    pliant_writer *w = calloc(1, sizeof *w);
    const size_t length = strlen(path);
    if (w) {
        w->path = malloc(length + 1);
        w->temporary = malloc(length + sizeof ".tmp");
    }
    if (!w || !w->path || !w->temporary) {
        if (w) end(w);
        return pliant_error_set(err, PLIANT_ERR_MEMORY,
                                "%.300s: expected %zu bytes of memory, found none", path,
                                sizeof *w);
    }
    memcpy(w->path, path, length + 1);
    memcpy(w->temporary, path, length);
    memcpy(w->temporary + length, ".tmp", sizeof ".tmp");
    w->file = H5I_INVALID_HID;
    w->section_count = section_count;
    for (int32_t i = 0; i < section_count; i++) {
        written_section *s = &w->sections[i];
        s->def = sections[i];
        s->set = H5I_INVALID_HID;
        if (!pliant_table_bytes(s->def.type, s->def.rank, s->def.shape, &s->count, &s->bytes))
            s->count = s->bytes = 0;  // checked above
    }

    int file = -1;
    status = claim(w, &file, err);
    if (status < 0) {
        end(w);
        return status;
    }
    // We close what we open; HDF5's own cleaning at exit only adds a crash after a disk error.
    H5dont_atexit();
    const report saved = silence();
    status = make_file(w, file, err);
    restore(saved);
    if (status < 0) {
        pliant_writer_abandon(w);
        return status;
    }
    *writer = w;
    return PLIANT_OK;
}

// ---- Write ----

static written_section *find(pliant_writer *w, const char *path)
{
    for (int32_t i = 0; i < w->section_count; i++)
        if (strcmp(w->sections[i].def.path, path) == 0) return &w->sections[i];
    return NULL;
}

pliant_status pliant_writer_write(pliant_writer *writer, const char *path, const uint64_t start[3],
                                  const uint64_t count[3], const void *data, pliant_error *err)
{
    written_section *s = find(writer, path);
    if (!s)
        return pliant_error_set(
            err, PLIANT_ERR_ARGUMENT,
            "%.300s: %s: expected a section of the file, found none of this path", writer->path,
            path);
    hsize_t from[3] = {0}, size[3] = {1, 1, 1};
    uint64_t elements = 1, row_bytes = pliant_section_type_size(s->def.type);
    for (int32_t d = 0; d < s->def.rank; d++) {
        if (start[d] > s->def.shape[d] || count[d] > s->def.shape[d] - start[d])
            return pliant_error_set(
                err, PLIANT_ERR_ARGUMENT,
                "%.300s: %s: expected indices below %" PRIu64 " along axis %d, found "
                "%" PRIu64 " from %" PRIu64,
                writer->path, path, s->def.shape[d], (int)d, count[d], start[d]);
        from[d] = (hsize_t)start[d];
        size[d] = (hsize_t)count[d];
        elements *= count[d];
        if (d > 0) row_bytes *= count[d];
    }
    if (elements == 0) return PLIANT_OK;

    const report saved = silence();
    const uint64_t step = row_bytes < SLICE_BYTES ? SLICE_BYTES / row_bytes : 1;
    const unsigned char *bytes = data;
    herr_t result = 0;
    for (uint64_t row = 0; row < count[0] && result >= 0; row += step) {
        from[0] = (hsize_t)(start[0] + row);
        size[0] = (hsize_t)(count[0] - row < step ? count[0] - row : step);
        result = write_slice(s, from, size, bytes + row * row_bytes);
    }
    pliant_status status = PLIANT_OK;
    if (result < 0) status = refuse_hdf5(writer, path, err);
    else s->written += elements;
    restore(saved);
    return status;
}

pliant_status pliant_writer_write_all(pliant_writer *writer, const char *path, const void *data,
                                      pliant_error *err)
{
    const uint64_t start[3] = {0, 0, 0}, none[3] = {0, 0, 0};
    const written_section *s = find(writer, path);
    return pliant_writer_write(writer, path, start, s ? s->def.shape : none, data, err);
}

// ---- Attributes ----

static pliant_status write_attribute(pliant_writer *w, const char *group, const char *name,
                                     hid_t type, hid_t space, hid_t memory, const void *value,
                                     pliant_error *err)
{
    pliant_status status = PLIANT_OK;
    hid_t attribute = H5I_INVALID_HID;
    const hid_t owner = H5Gopen2(w->file, group, H5P_DEFAULT);
    if (owner >= 0 && type >= 0 && space >= 0)
        attribute = H5Acreate2(owner, name, type, space, H5P_DEFAULT, H5P_DEFAULT);
    if (attribute < 0 || H5Awrite(attribute, memory, value) < 0) {
        char what[160];
        snprintf(what, sizeof what, "%.90s: attribute %.40s", group, name);
        status = refuse_hdf5(w, what, err);
    }
    if (attribute >= 0) H5Aclose(attribute);
    if (owner >= 0) H5Gclose(owner);
    return status;
}

static pliant_status write_text(pliant_writer *w, const char *group, const char *name,
                                const char *text, size_t length, pliant_error *err)
{
    if (length > ATTRIBUTE_LIMIT)
        return pliant_error_set(
            err, PLIANT_ERR_ARGUMENT,
            "%.300s: %.90s: attribute %.40s: expected at most %d bytes, found %zu", w->path, group,
            name, ATTRIBUTE_LIMIT, length);
    const report saved = silence();
    const hid_t type = H5Tcopy(H5T_C_S1), space = H5Screate(H5S_SCALAR);
    if (type >= 0) {
        // A fixed length: variable ones need HDF5's global heap, which mapped readers cannot
        // follow.
        H5Tset_size(type, length > 0 ? length : 1);
        H5Tset_strpad(type, H5T_STR_NULLPAD);
        H5Tset_cset(type, H5T_CSET_UTF8);
    }
    const pliant_status status =
        write_attribute(w, group, name, type, space, type, length > 0 ? text : "", err);
    if (type >= 0) H5Tclose(type);
    if (space >= 0) H5Sclose(space);
    restore(saved);
    return status;
}

pliant_status pliant_writer_attribute_text(pliant_writer *writer, const char *group,
                                           const char *name, const char *text, pliant_error *err)
{
    return write_text(writer, group, name, text, strlen(text), err);
}

pliant_status pliant_writer_attribute_number(pliant_writer *writer, const char *group,
                                             const char *name, double value, pliant_error *err)
{
    const report saved = silence();
    const hid_t space = H5Screate(H5S_SCALAR);
    const pliant_status status =
        write_attribute(writer, group, name, H5T_IEEE_F64LE, space, H5T_NATIVE_DOUBLE, &value, err);
    if (space >= 0) H5Sclose(space);
    restore(saved);
    return status;
}

pliant_status pliant_writer_write_summary(pliant_writer *writer, pliant_block_name block,
                                          int32_t level, const double *summary, pliant_error *err)
{
    char path[PLIANT_PATH_LIMIT], group[PLIANT_PATH_LIMIT];
    pliant_section_level_path(block, level, "summary", path);
    pliant_section_level_path(block, level, NULL, group);
    const char *wavelet = summary[PLIANT_SUMMARY_WAVELET] != 0 ? "butterfly" : "linear";
    const char *boundary = summary[PLIANT_SUMMARY_BOUNDARY] != 0 ? "drop" : "zero";
    static const struct {
        const char *name;
        pliant_summary_item item;
    } numbers[] = {
        {"eps", PLIANT_SUMMARY_EPS}, {"lifted", PLIANT_SUMMARY_LIFTED}, {"rms", PLIANT_SUMMARY_RMS},
        {"max", PLIANT_SUMMARY_MAX}, {"factor", PLIANT_SUMMARY_FACTOR},
        {"smallest_eigenvalue", PLIANT_SUMMARY_DEFINITE},
    };
    pliant_status status = pliant_writer_write_all(writer, path, summary, err);
    for (size_t i = 0; i < sizeof numbers / sizeof *numbers && status == PLIANT_OK; i++)
        status = pliant_writer_attribute_number(writer, group, numbers[i].name,
                                                summary[numbers[i].item], err);
    if (status == PLIANT_OK)
        status = pliant_writer_attribute_text(writer, group, "wavelet", wavelet, err);
    if (status == PLIANT_OK)
        status = pliant_writer_attribute_text(writer, group, "boundary", boundary, err);
    return status;
}

pliant_status pliant_writer_write_provenance(pliant_writer *writer, const char *text,
                                             pliant_error *err)
{
    const char *path = "/provenance/text";
    const written_section *s = find(writer, path);
    const size_t length = strlen(text);
    if (!s || s->def.type != PLIANT_U1 || s->def.rank != 1 || length > s->bytes)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "%.300s: %s: expected at most %" PRIu64 " bytes, found %zu",
                                writer->path, path, s ? s->bytes : 0, length);
    char *filled = malloc((size_t)s->bytes + 1);
    if (!filled)
        return pliant_error_set(err, PLIANT_ERR_MEMORY,
                                "%.300s: %s: expected %" PRIu64 " bytes of memory, found none",
                                writer->path, path, s->bytes);
    memcpy(filled, text, length);
    memset(filled + length, '\n', (size_t)s->bytes - length);
    pliant_status status = pliant_writer_write_all(writer, path, filled, err);
    free(filled);

    for (const char *line = text; *line && status == PLIANT_OK;) {
        const size_t bytes = strcspn(line, "\n");
        const char *equals = memmem(line, bytes, " = ", 3);
        char key[64];
        if (equals && equals > line && (size_t)(equals - line) < sizeof key) {
            snprintf(key, sizeof key, "%.*s", (int)(equals - line), line);
            status = write_text(writer, "/provenance", key, equals + 3,
                                bytes - (size_t)(equals + 3 - line), err);
        }
        line += bytes + (line[bytes] == '\n');
    }
    return status;
}

// ---- Commit, abandon ----

// Header and table of a finished file whose bytes are `file`, for its first PLIANT_USER_BLOCK
// bytes.
static void lay_out(const pliant_writer *w, const unsigned char *file, uint64_t size,
                    unsigned char *block)
{
    pliant_header header = {
        .endian = PLIANT_ENDIAN_MARK,
        .version = PLIANT_FORMAT_VERSION,
        .file_size = size,
        .user_block = PLIANT_USER_BLOCK,
        .entry_size = sizeof(pliant_entry),
        .section_count = (uint32_t)w->section_count,
    };
    pliant_span spans[PLIANT_SECTION_LIMIT];
    memcpy(header.magic, PLIANT_MAGIC, sizeof header.magic);
    memset(block, 0, PLIANT_USER_BLOCK);
    for (int32_t i = 0; i < w->section_count; i++) {
        const written_section *s = &w->sections[i];
        pliant_entry entry = {
            .type = (uint16_t)s->def.type,
            .rank = (uint16_t)s->def.rank,
            .checksum = pliant_crc32c(0, file + s->offset, (size_t)s->bytes),
            .shape = {1, 1, 1},
            .offset = s->offset,
        };
        snprintf(entry.path, sizeof entry.path, "%s", s->def.path);
        for (int32_t d = 0; d < s->def.rank; d++) entry.shape[d] = s->def.shape[d];
        memcpy(block + sizeof header + (size_t)i * sizeof entry, &entry, sizeof entry);
        spans[i] = (pliant_span){.offset = s->offset, .bytes = s->bytes};
    }
    header.rest_checksum = pliant_table_rest_checksum(file, size, spans, w->section_count);
    memcpy(block, &header, sizeof header);
    header.checksum = pliant_table_checksum(block);
    memcpy(block, &header, sizeof header);
}

static pliant_status stamp(const pliant_writer *w, pliant_error *err)
{
    pliant_status status = PLIANT_OK;
    unsigned char block[PLIANT_USER_BLOCK];
    void *bytes = MAP_FAILED;
    struct stat info;
    size_t size = 0;
    const int file = open(w->temporary, O_RDWR | O_CLOEXEC);
    if (file < 0) return refuse_system(w->temporary, errno, err);
    if (fstat(file, &info) != 0) goto refused;
    size = (size_t)info.st_size;
    for (int32_t i = 0; i < w->section_count; i++) {
        const written_section *s = &w->sections[i];
        if (s->offset + s->bytes <= size) continue;
        status = pliant_error_set(err, PLIANT_ERR_IO,
                                  "%s: %s: expected %" PRIu64 " bytes in the file, found %zu",
                                  w->temporary, s->def.path, s->offset + s->bytes, size);
        goto done;
    }
    bytes = mmap(NULL, size, PROT_READ, MAP_SHARED, file, 0);
    if (bytes == MAP_FAILED) goto refused;
    lay_out(w, bytes, size, block);
    status = write_at(w, file, block, sizeof block, 0, err);
    if (status == PLIANT_OK && fsync(file) != 0) goto refused;
    goto done;
refused:
    status = refuse_system(w->temporary, errno, err);
done:
    if (bytes != MAP_FAILED) munmap(bytes, size);
    if (close(file) != 0 && status == PLIANT_OK) status = refuse_system(w->temporary, errno, err);
    return status;
}

// The renamed entry must survive a power cut, too. File systems that cannot are not refused.
static void sync_folder(const char *path)
{
    const char *slash = strrchr(path, '/');
    char *folder = slash ? strndup(path, slash == path ? 1 : (size_t)(slash - path)) : strdup(".");
    if (!folder) return;
    const int file = open(folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (file >= 0) {
        fsync(file);
        close(file);
    }
    free(folder);
}

pliant_status pliant_writer_commit(pliant_writer *writer, pliant_error *err)
{
    pliant_status status = PLIANT_OK;
    for (int32_t i = 0; i < writer->section_count && status == PLIANT_OK; i++) {
        const written_section *s = &writer->sections[i];
        if (s->written != s->count)
            status = pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                      "%.300s: %s: expected %" PRIu64
                                      " elements written, found %" PRIu64,
                                      writer->path, s->def.path, s->count, s->written);
    }
    if (status == PLIANT_OK) {
        const report saved = silence();
        status = close_file(writer, err);
        restore(saved);
    }
    if (status == PLIANT_OK) status = stamp(writer, err);
    if (status == PLIANT_OK && rename(writer->temporary, writer->path) != 0)
        status = refuse_system(writer->path, errno, err);
    if (status < 0) {
        pliant_writer_abandon(writer);
        return status;
    }
    sync_folder(writer->path);
    end(writer);
    return PLIANT_OK;
}

void pliant_writer_abandon(pliant_writer *writer)
{
    if (!writer) return;
    const report saved = silence();
    if (close_file(writer, NULL) < 0) H5Eclear2(H5E_DEFAULT);
    restore(saved);
    unlink(writer->temporary);
    end(writer);
}
