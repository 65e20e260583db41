// fuzz_model.c: libFuzzer target: no bytes make the reader, the views or pliant_model_open
// misbehave.
//
// An input is a model or dense file with its padding squeezed out (a page per section would be
// mostly zeros): a byte for the kind, header and table, then the sections one after the other.
// It is spread out to the pages of the seed's layout, whatever its own table says by now, and the
// header's size and checksum are corrected, or else nothing would get past them.
#include "../formats/image.h"

#include "pliant/dense_view.h"
#include "pliant/model_view.h"
#include "pliant/pliant.h"
#include "pliant/reader.h"

#include <stdio.h>
#include <sys/mman.h>
#include <unistd.h>

// Models without and with supports, dense files likewise, models with detail; with a lattice, and
// with a lattice alone.
static const struct {
    int is_dense, parts;
} kinds[] = {{0, 0},
             {0, TINY_SUPPORTS},
             {1, 0},
             {1, 1},
             {0, TINY_DETAIL},
             {0, TINY_DETAIL | TINY_SUPPORTS},
             {0, TINY_LATTICE},
             {0, TINY_LATTICE | TINY_NO_GREENS}};
#define KIND_COUNT ((int)(sizeof kinds / sizeof *kinds))

typedef struct seed {
    unsigned char *bytes;
    size_t size;
    int32_t span_count;
    pliant_span spans[PLIANT_SECTION_LIMIT + 1];  // ascending: header with table, sections
} seed;

static seed seeds[sizeof kinds / sizeof *kinds];

int LLVMFuzzerInitialize(int *argc, char ***argv);
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void make_seed(int kind, seed *s)
{
    const int parts = kinds[kind].parts;
    s->bytes =
        kinds[kind].is_dense ? image_of_dense(parts, &s->size) : image_of_model(2, parts, &s->size);
    const pliant_header *header = (const pliant_header *)s->bytes;
    const pliant_entry *entries = (const pliant_entry *)(s->bytes + sizeof *header);
    s->spans[s->span_count++] =
        (pliant_span){0, sizeof *header + header->section_count * sizeof *entries};
    for (uint32_t i = 0; i < header->section_count; i++) {
        uint64_t count, bytes;
        if (!pliant_table_bytes((pliant_section_type)entries[i].type, entries[i].rank,
                                entries[i].shape, &count, &bytes))
            abort();
        if (bytes > 0) s->spans[s->span_count++] = (pliant_span){entries[i].offset, bytes};
    }
}

static void save_seed(const char *folder, int kind, const seed *s)
{
    char path[1000];
    snprintf(path, sizeof path, "%s/seed-model-%d", folder, kind);
    FILE *file = fopen(path, "wb");
    if (!file) return;
    fputc(kind, file);
    for (int32_t i = 0; i < s->span_count; i++)
        fwrite(s->bytes + s->spans[i].offset, 1, (size_t)s->spans[i].bytes, file);
    fclose(file);
}

// PLIANT_FUZZ_SEEDS names the folder to leave valid inputs in.
int LLVMFuzzerInitialize(int *argc, char ***argv)
{
    (void)argc;
    (void)argv;
    const char *folder = getenv("PLIANT_FUZZ_SEEDS");
    for (int kind = 0; kind < KIND_COUNT; kind++) {
        make_seed(kind, &seeds[kind]);
        if (folder) save_seed(folder, kind, &seeds[kind]);
    }
    return 0;
}

// The file of an input, to be freed, exactly as long as it is; short inputs are cut files, what is
// left over of long ones stands at the end.
static unsigned char *spread_out(const seed *s, const uint8_t *data, size_t size, size_t *file_size)
{
    size_t total = 0, end = 0;
    for (int32_t i = 0; i < s->span_count && total < size; i++) {
        const size_t part =
            size - total < s->spans[i].bytes ? size - total : (size_t)s->spans[i].bytes;
        end = (size_t)s->spans[i].offset + part;
        total += part;
    }
    if (end < PLIANT_USER_BLOCK && total > sizeof(pliant_header)) end = PLIANT_USER_BLOCK;
    *file_size = end + (size - total);
    unsigned char *bytes = calloc(1, *file_size > 0 ? *file_size : 1);
    if (!bytes) abort();
    size_t at = 0;
    for (int32_t i = 0; i < s->span_count && at < size; i++) {
        const size_t part = size - at < s->spans[i].bytes ? size - at : (size_t)s->spans[i].bytes;
        memcpy(bytes + s->spans[i].offset, data + at, part);
        at += part;
    }
    if (at < size) memcpy(bytes + end, data + at, size - at);
    image_stamp(bytes, *file_size);
    return bytes;
}

// What a file says of detail is evaluated: the exact size of every array shows one element too far.
static void evaluate_detail(const pliant_model *model, int32_t level)
{
    pliant_error err;
    pliant_detail *detail;
    if (pliant_detail_create(model, level, &detail, &err) < 0) {
        if (strchr(err.text, '\n')) abort();
        return;
    }
    const pliant_detail_info info = pliant_detail_describe(detail);
    const size_t n = (size_t)info.vertex_count, controls = (size_t)info.control_count;
    pliant_vec3 *u = calloc(controls, sizeof *u), *positions = malloc(n * sizeof *positions);
    pliant_vec3 *normals = malloc(n * sizeof *normals);
    int32_t *support = malloc(controls * sizeof *support);
    int32_t support_count = 0;
    const int32_t last = info.vertex_count - 1;
    if (!u || !positions || !normals || !support) abort();
    u[0].x = u[controls - 1].y = 1;
    if (pliant_detail_evaluate(detail, u, positions, normals) < 0) abort();
    if (pliant_detail_points(detail, u, &last, 1, positions, normals) < 0) abort();
    if (pliant_detail_support(detail, &last, 1, support, info.control_count, &support_count) < 0)
        abort();
    if (pliant_detail_interpolate(detail, 3, &u[0].x, &positions[0].x) < 0) abort();
    free(support);
    free(normals);
    free(positions);
    free(u);
    pliant_detail_destroy(detail);
}

// What binding lets through must do for a body: laid out as stored, and with regions found anew.
static void move_lattice(const pliant_model *model, int32_t half_width)
{
    pliant_error err;
    pliant_lattice *lattice;
    pliant_body *body;
    if (pliant_lattice_create(model, half_width, &lattice, &err) < 0) {
        if (strchr(err.text, '\n')) abort();
        return;
    }
    const pliant_lattice_info info = pliant_lattice_describe(lattice);
    const size_t n = (size_t)info.vertex_count;
    pliant_vec3 *positions = malloc(n * sizeof *positions), *normals = malloc(n * sizeof *normals);
    if (!positions || !normals) abort();
    if (pliant_body_create(lattice, NULL, &body, &err) == PLIANT_OK) {
        for (int step = 0; step < 2; step++)
            if (pliant_body_step(body, 0.01f) < 0) abort();
        if (pliant_body_surface(body, positions, normals) < 0) abort();
        pliant_body_destroy(body);
    }
    for (int32_t v = 0; v < info.vertex_count; v++) {
        pliant_vertex_weights weights;
        if (pliant_lattice_vertex(lattice, v, &weights) < 0) abort();
        for (int k = 0; k < 8; k++)
            if (weights.particle[k] < 0 || weights.particle[k] >= info.particle_count) abort();
    }
    for (int32_t b = 0; b < info.batch_count; b++) {
        pliant_lattice_batch batch;
        if (pliant_lattice_find_batch(lattice, b, &batch) < 0) abort();
        if (batch.particle_count > PLIANT_BATCH_PARTICLES) abort();
    }
    free(normals);
    free(positions);
    pliant_lattice_destroy(lattice);
}

// Through the library's front door, from a file that lives in memory.
static void open_model(const unsigned char *bytes, size_t size)
{
    char path[64];
    pliant_error err;
    pliant_model *model;
    const int file = memfd_create("model", MFD_CLOEXEC);
    if (file < 0 || write(file, bytes, size) != (ssize_t)size) abort();
    snprintf(path, sizeof path, "/proc/self/fd/%d", file);
    if (pliant_model_open(path, &model, &err) == PLIANT_OK) {
        for (int32_t level = 0; level < 2; level++) evaluate_detail(model, level);
        for (int32_t half_width = 0; half_width < 3; half_width += 2)
            move_lattice(model, half_width);
        pliant_model_close(model);
    }
    close(file);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size < 1 || size > 100000) return 0;
    size_t file_size;
    unsigned char *bytes = spread_out(&seeds[data[0] % KIND_COUNT], data + 1, size - 1, &file_size);
    pliant_reader *reader;
    pliant_error err;
    if (pliant_reader_open_memory(bytes, file_size, "fuzz", &reader, &err) == PLIANT_OK) {
        pliant_model_view model;
        pliant_dense_view dense;
        const pliant_status bound = pliant_model_view_bind(reader, &model, &err);
        if (pliant_dense_view_bind(reader, &dense, &err) == PLIANT_OK && dense.free_count < 1)
            abort();
        if (pliant_reader_verify(reader, &err) < 0 && strchr(err.text, '\n')) abort();
        pliant_reader_close(reader);
        if (bound == PLIANT_OK) open_model(bytes, file_size);
    }
    free(bytes);
    return 0;
}
