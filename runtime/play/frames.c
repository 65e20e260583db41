// frames.c: the surface of every step in one HDF5 file.
#include "frames.h"

#include "pliant/error.h"

#ifdef PLIANT_WITHOUT_HDF5

pliant_status pliant_frames_open(const char *path, int32_t vertex_count, pliant_frames **frames,
                                 pliant_error *err)
{
    (void)vertex_count;
    *frames = NULL;
    return pliant_error_set(err, PLIANT_ERR_MISSING,
                            "%s: this pliant-play was built without HDF5, which --frames needs",
                            path);
}

pliant_status pliant_frames_widen(pliant_frames *frames, int32_t vertex_count, pliant_error *err)
{
    (void)frames, (void)vertex_count;
    return pliant_error_set(err, PLIANT_ERR_MISSING, "built without HDF5");
}

pliant_status pliant_frames_add(pliant_frames *frames, const pliant_vec3 *displacement,
                                const pliant_vec3 *normals, const pliant_step *step,
                                pliant_error *err)
{
    (void)frames, (void)displacement, (void)normals, (void)step;
    return pliant_error_set(err, PLIANT_ERR_MISSING, "built without HDF5");
}

pliant_status pliant_frames_commit(pliant_frames *frames, pliant_error *err)
{
    (void)frames;
    return pliant_error_set(err, PLIANT_ERR_MISSING, "built without HDF5");
}

void pliant_frames_abandon(pliant_frames *frames)
{
    (void)frames;
}

#else

#include "pliant/writer.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { BATCH_BYTES = 4 << 20 };  // read back and written at a time

// What stands before a step's displacements in the spool.
typedef struct step_head {
    uint64_t number;
    double time, solve_us;
} step_head;

struct pliant_frames {
    char *path;
    int spool;  // file descriptor, unlinked
    uint64_t step_count;
    uint64_t vertex_count;
    int has_normals;
    size_t field_size;   // bytes of a step's displacements, or normals
    size_t record_size;  // bytes of one step in the spool: head, displacements, normals
    char *record;
};

static void destroy(pliant_frames *frames)
{
    if (frames->spool >= 0) (void)close(frames->spool);
    free(frames->record);
    free(frames->path);
    free(frames);
}

void pliant_frames_abandon(pliant_frames *frames)
{
    if (frames) destroy(frames);
}

// A file beside `path` that nobody sees and that ends with the process.
static pliant_status open_spool(const char *path, int *spool, pliant_error *err)
{
    struct stat found;
    if (stat(path, &found) == 0 && !S_ISREG(found.st_mode))
        return pliant_error_set(err, PLIANT_ERR_IO, "%s: not a regular file", path);
    const size_t size = strlen(path) + sizeof ".XXXXXX";
    char *name = malloc(size);
    if (!name) return pliant_error_set(err, PLIANT_ERR_MEMORY, "%s: no memory", path);
    snprintf(name, size, "%s.XXXXXX", path);
    *spool = mkstemp(name);
    const int reason = errno;
    if (*spool >= 0) (void)unlink(name);
    free(name);
    if (*spool < 0) return pliant_error_set(err, PLIANT_ERR_IO, "%s: %s", path, strerror(reason));
    return PLIANT_OK;
}

static pliant_status lay_out(pliant_frames *frames, int32_t vertex_count, pliant_error *err)
{
    frames->vertex_count = (uint64_t)vertex_count;
    frames->field_size = (size_t)vertex_count * sizeof(pliant_vec3);
    frames->record_size = sizeof(step_head) + (frames->has_normals ? 2 : 1) * frames->field_size;
    free(frames->record);
    frames->record = malloc(frames->record_size);
    if (!frames->record)
        return pliant_error_set(err, PLIANT_ERR_MEMORY, "%s: no memory for %d vertices",
                                frames->path, (int)vertex_count);
    return PLIANT_OK;
}

pliant_status pliant_frames_widen(pliant_frames *frames, int32_t vertex_count, pliant_error *err)
{
    frames->has_normals = 1;
    return lay_out(frames, vertex_count, err);
}

pliant_status pliant_frames_open(const char *path, int32_t vertex_count, pliant_frames **frames,
                                 pliant_error *err)
{
    pliant_frames *f = calloc(1, sizeof *f);
    if (!f) return pliant_error_set(err, PLIANT_ERR_MEMORY, "%s: no memory", path);
    f->spool = -1;
    f->path = strdup(path);
    pliant_status status = PLIANT_OK;
    if (!f->path) status = pliant_error_set(err, PLIANT_ERR_MEMORY, "%s: no memory", path);
    if (status >= 0) status = lay_out(f, vertex_count, err);
    if (status >= 0) status = open_spool(path, &f->spool, err);
    if (status < 0) {
        destroy(f);
        return status;
    }
    *frames = f;
    return PLIANT_OK;
}

pliant_status pliant_frames_add(pliant_frames *frames, const pliant_vec3 *displacement,
                                const pliant_vec3 *normals, const pliant_step *step,
                                pliant_error *err)
{
    const step_head head = {(uint64_t)step->number, step->time, (double)step->total_ns * 1e-3};
    memcpy(frames->record, &head, sizeof head);
    memcpy(frames->record + sizeof head, displacement, frames->field_size);
    if (frames->has_normals)
        memcpy(frames->record + sizeof head + frames->field_size, normals, frames->field_size);
    for (size_t done = 0; done < frames->record_size;) {
        const ssize_t written =
            write(frames->spool, frames->record + done, frames->record_size - done);
        if (written < 0 && errno == EINTR) continue;
        if (written <= 0)
            return pliant_error_set(err, PLIANT_ERR_IO, "%s: spooling step %lld: %s", frames->path,
                                    (long long)step->number, strerror(errno));
        done += (size_t)written;
    }
    frames->step_count++;
    return PLIANT_OK;
}

static pliant_status read_record(pliant_frames *frames, uint64_t step, pliant_error *err)
{
    for (size_t done = 0; done < frames->record_size;) {
        const ssize_t count =
            pread(frames->spool, frames->record + done, frames->record_size - done,
                  (off_t)(step * frames->record_size + done));
        if (count < 0 && errno == EINTR) continue;
        if (count <= 0)
            return pliant_error_set(err, PLIANT_ERR_IO, "%s: reading the spool back: %s",
                                    frames->path, count == 0 ? "it is short" : strerror(errno));
        done += (size_t)count;
    }
    return PLIANT_OK;
}

// One batch of steps, taken apart into the columns that the datasets want.
typedef struct batch {
    uint64_t capacity;
    uint64_t *number;
    double *time, *solve_us;
    char *displacement, *normal;  // normal: NULL without
} batch;

static pliant_status write_batch(pliant_writer *writer, const pliant_frames *frames, const batch *b,
                                 uint64_t first, uint64_t count, pliant_error *err)
{
    const uint64_t start[3] = {first, 0, 0};
    const uint64_t extent[3] = {count, frames->vertex_count, 3};
    pliant_status status =
        pliant_writer_write(writer, "/displacement", start, extent, b->displacement, err);
    if (status >= 0 && b->normal)
        status = pliant_writer_write(writer, "/normal", start, extent, b->normal, err);
    if (status >= 0) status = pliant_writer_write(writer, "/step", start, extent, b->number, err);
    if (status >= 0) status = pliant_writer_write(writer, "/time", start, extent, b->time, err);
    if (status >= 0)
        status = pliant_writer_write(writer, "/solve_us", start, extent, b->solve_us, err);
    return status;
}

static pliant_status copy_spool(pliant_frames *frames, pliant_writer *writer, pliant_error *err)
{
    const size_t field_size = frames->field_size;
    batch b = {.capacity = 1 + BATCH_BYTES / frames->record_size};
    b.number = malloc(b.capacity * sizeof *b.number);
    b.time = malloc(b.capacity * sizeof *b.time);
    b.solve_us = malloc(b.capacity * sizeof *b.solve_us);
    b.displacement = malloc(b.capacity * field_size + 1);
    if (frames->has_normals) b.normal = malloc(b.capacity * field_size + 1);
    pliant_status status = PLIANT_OK;
    if (!b.number || !b.time || !b.solve_us || !b.displacement ||
        (frames->has_normals && !b.normal))
        status = pliant_error_set(err, PLIANT_ERR_MEMORY, "%s: no memory for a batch of %llu steps",
                                  frames->path, (unsigned long long)b.capacity);
    for (uint64_t first = 0; status >= 0 && first < frames->step_count; first += b.capacity) {
        const uint64_t rest = frames->step_count - first;
        const uint64_t count = rest < b.capacity ? rest : b.capacity;
        for (uint64_t i = 0; status >= 0 && i < count; i++) {
            status = read_record(frames, first + i, err);
            if (status < 0) break;
            step_head head;
            memcpy(&head, frames->record, sizeof head);
            b.number[i] = head.number;
            b.time[i] = head.time;
            b.solve_us[i] = head.solve_us;
            memcpy(b.displacement + i * field_size, frames->record + sizeof head, field_size);
            if (b.normal)
                memcpy(b.normal + i * field_size, frames->record + sizeof head + field_size,
                       field_size);
        }
        if (status >= 0) status = write_batch(writer, frames, &b, first, count, err);
    }
    free(b.normal);
    free(b.displacement);
    free(b.solve_us);
    free(b.time);
    free(b.number);
    return status;
}

pliant_status pliant_frames_commit(pliant_frames *frames, pliant_error *err)
{
    const uint64_t steps = frames->step_count;
    const pliant_section_def sections[] = {
        {.path = "/displacement",
         .type = PLIANT_F4,
         .rank = 3,
         .shape = {steps, frames->vertex_count, 3}},
        {.path = "/step", .type = PLIANT_U8, .rank = 1, .shape = {steps, 1, 1}},
        {.path = "/time", .type = PLIANT_F8, .rank = 1, .shape = {steps, 1, 1}},
        {.path = "/solve_us", .type = PLIANT_F8, .rank = 1, .shape = {steps, 1, 1}},
        {.path = "/normal",
         .type = PLIANT_F4,
         .rank = 3,
         .shape = {steps, frames->vertex_count, 3}},
    };
    const int32_t section_count = frames->has_normals ? 5 : 4;
    pliant_writer *writer = NULL;
    pliant_status status =
        pliant_writer_create(frames->path, sections, section_count, &writer, err);
    if (status >= 0) {
        status = copy_spool(frames, writer, err);
        if (status >= 0) status = pliant_writer_commit(writer, err);
        else pliant_writer_abandon(writer);
    }
    destroy(frames);
    return status;
}

#endif
