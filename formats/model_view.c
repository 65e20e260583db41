// model_view.c: bind the sections of a model file, and check every shape and every index.
#include "pliant/model_view.h"

#include "pliant/error.h"
#include "pliant/utf8.h"
#include "bind.h"
#include "lattice_check.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

// A model under construction: its sections and the lengths that shapes are made of.
typedef struct binding {
    const pliant_reader *reader;
    const char *name;
    pliant_model_view *view;
    int is_there[PLIANT_PRESENCE_COUNT];
    uint64_t extent[PLIANT_EXTENT_COUNT];
#define DECLARE(field, ...) const pliant_section *field;
    struct {
        PLIANT_MODEL_SECTIONS(DECLARE)
    } section;
    struct {
        PLIANT_LEVEL_SECTIONS(DECLARE)
    } part;  // of the level being bound
#undef DECLARE
} binding;

// ---- Sections and counts ----

static pliant_status find_sections(binding *b, pliant_error *err)
{
    pliant_status status;
#define FIND(field, path, type, rank, extent0, extent1, extent2, presence, unit)                   \
    if (b->is_there[PLIANT_##presence]) {                                                          \
        status = pliant_bind_find(b->reader, path, PLIANT_##type, rank, &b->section.field, err);   \
        if (status < 0) return status;                                                             \
        b->view->field = b->section.field->data;                                                   \
    }
    PLIANT_MODEL_SECTIONS(FIND)
#undef FIND
    return PLIANT_OK;
}

static pliant_status count_all(binding *b, pliant_error *err)
{
    pliant_model_view *v = b->view;
    int32_t batches_1 = 0;
    // Sections that are absent count nothing.
    const struct {
        const pliant_section *section;
        int32_t least, limit, *count;
        pliant_extent extent;
    } counts[] = {
        {b->section.vertices, 1, PLIANT_VERTEX_LIMIT, &v->vertex_count, PLIANT_EXTENT_VERTICES},
        {b->section.faces, 1, PLIANT_FACE_LIMIT, &v->face_count, PLIANT_EXTENT_FACES},
        {b->section.level_vertex_count, 1, PLIANT_LEVEL_LIMIT + 1, &v->level_count,
         PLIANT_EXTENT_LEVELS},
        {b->section.free_nodes, 1, PLIANT_VERTEX_LIMIT, &v->free_count, PLIANT_EXTENT_FREE},
        {b->section.fixed_nodes, 0, PLIANT_VERTEX_LIMIT, &v->fixed_count, PLIANT_EXTENT_FIXED},
        {b->section.lattice_cells, 1, PLIANT_LATTICE_LIMIT, &v->lattice_cell_count,
         PLIANT_EXTENT_CELLS},
        {b->section.lattice_particles, 8, PLIANT_LATTICE_LIMIT, &v->lattice_particle_count,
         PLIANT_EXTENT_PARTICLES},
        {b->section.lattice_region_nodes, 0, PLIANT_LATTICE_LIMIT, &v->lattice_region_node_count,
         PLIANT_EXTENT_REGION_NODES},
        {b->section.lattice_plate_nodes, 0, PLIANT_VERTEX_LIMIT, &v->lattice_plate_node_count,
         PLIANT_EXTENT_PLATE_NODES},
        {b->section.lattice_batch_face_offset, 2, PLIANT_FACE_LIMIT + 1, &batches_1,
         PLIANT_EXTENT_BATCHES_1},
        {b->section.lattice_batch_points, 8, INT32_MAX, &v->lattice_batch_point_count,
         PLIANT_EXTENT_BATCH_POINTS},
    };
    for (size_t i = 0; i < sizeof counts / sizeof *counts; i++) {
        if (!counts[i].section) continue;
        const pliant_status status = pliant_bind_count(
            b->reader, counts[i].section, counts[i].least, counts[i].limit, counts[i].count, err);
        if (status < 0) return status;
        b->extent[counts[i].extent] = (uint64_t)*counts[i].count;
    }
    if (batches_1 > 0) v->lattice_batch_count = batches_1 - 1;
    b->extent[PLIANT_EXTENT_1] = 1;
    b->extent[PLIANT_EXTENT_2] = 2;
    b->extent[PLIANT_EXTENT_3] = 3;
    b->extent[PLIANT_EXTENT_8] = 8;
    b->extent[PLIANT_EXTENT_OFFSETS] = (uint64_t)v->level_count + 1;
    b->extent[PLIANT_EXTENT_TEXT] = v->provenance_bytes = b->section.provenance->shape[0];
    return PLIANT_OK;
}

// The half-width says how long the nodes of regions and plates are.
static pliant_status count_lattice(binding *b, pliant_error *err)
{
    if (!b->is_there[PLIANT_WITH_LATTICE]) return PLIANT_OK;
    const uint64_t shape[3] = {PLIANT_LATTICE_SUMMARY_COUNT, 1, 1};
    const pliant_status status =
        pliant_bind_shape(b->reader, b->section.lattice_summary, shape, err);
    if (status < 0) return status;
    const int32_t w = b->view->lattice_summary[PLIANT_LATTICE_HALF_WIDTH];
    if (w < 1 || w > PLIANT_LATTICE_WIDTH_LIMIT)
        return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                "%s: /lattice/summary: element %d (half-width): expected 1 to %d, "
                                "found %d",
                                b->name, PLIANT_LATTICE_HALF_WIDTH, PLIANT_LATTICE_WIDTH_LIMIT,
                                (int)w);
    b->view->lattice_half_width = w;
    b->extent[PLIANT_EXTENT_REGION_ROW] = 2 * (uint64_t)w + 2;
    b->extent[PLIANT_EXTENT_PLATE_ROW] = 2 * (uint64_t)w + 4;
    return PLIANT_OK;
}

// |K(0)| < |K(1)| < ... = n; with it the number of odd vertices is known.
static pliant_status check_level_counts(binding *b, pliant_error *err)
{
    const pliant_model_view *v = b->view;
    const pliant_status status =
        pliant_bind_indices(b->reader, b->section.level_vertex_count, 1,
                            (int64_t)v->vertex_count + 1, PLIANT_ASCENDING, err);
    if (status < 0) return status;
    const int32_t last = v->level_vertex_count[v->level_count - 1];
    if (last != v->vertex_count)
        return pliant_error_set(
            err, PLIANT_ERR_FORMAT,
            "%s: /mesh/level_count: finest level: expected %d vertices, found %d", b->name,
            (int)v->vertex_count, (int)last);
    b->extent[PLIANT_EXTENT_ODD] = (uint64_t)(v->vertex_count - v->level_vertex_count[0]);
    return PLIANT_OK;
}

// Detail: level_count[0] = n, and every level has a vertex more for each edge of the one before.
static pliant_status check_detail_counts(binding *b, pliant_error *err)
{
    pliant_model_view *v = b->view;
    if (!b->is_there[PLIANT_WITH_DETAIL]) return PLIANT_OK;
    int32_t levels = 0;
    pliant_status status = pliant_bind_count(b->reader, b->section.detail_level_count, 2,
                                             PLIANT_LEVEL_LIMIT + 2 - v->level_count, &levels, err);
    if (status == PLIANT_OK)
        status = pliant_bind_count(b->reader, b->section.detail_offset, 1, PLIANT_VERTEX_LIMIT,
                                   &v->detail_vertex_count, err);
    if (status < 0) return status;
    v->detail_steps = levels - 1;
    b->extent[PLIANT_EXTENT_STEPS_1] = (uint64_t)levels;
    b->extent[PLIANT_EXTENT_DETAIL] = (uint64_t)v->detail_vertex_count;
    int64_t expected = v->vertex_count, faces = v->face_count;
    for (int32_t i = 0; i < levels; i++) {
        const int32_t found = v->detail_level_count[i];
        if (faces > PLIANT_FACE_LIMIT)
            return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                    "%s: /detail/level_count: element %d: expected at most %d "
                                    "faces, found %" PRId64,
                                    b->name, (int)i, PLIANT_FACE_LIMIT, faces);
        if (found != expected)
            return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                    "%s: /detail/level_count: element %d: expected %" PRId64
                                    " vertices, found %d",
                                    b->name, (int)i, expected, (int)found);
        expected += faces / 2 * 3;
        faces *= 4;
    }
    const int32_t last = v->detail_level_count[v->detail_steps];
    if (last == v->detail_vertex_count) return PLIANT_OK;
    return pliant_error_set(err, PLIANT_ERR_FORMAT,
                            "%s: /detail/offset: expected length %d along axis 0, found %d",
                            b->name, (int)last, (int)v->detail_vertex_count);
}

static pliant_status check_shapes(const binding *b, pliant_error *err)
{
    pliant_status status;
#define CHECK(field, path, type, rank, extent0, extent1, extent2, presence, unit)                  \
    if (b->is_there[PLIANT_##presence]) {                                                          \
        const uint64_t shape[3] = {b->extent[PLIANT_EXTENT_##extent0],                             \
                                   b->extent[PLIANT_EXTENT_##extent1],                             \
                                   b->extent[PLIANT_EXTENT_##extent2]};                            \
        status = pliant_bind_shape(b->reader, b->section.field, shape, err);                       \
        if (status < 0) return status;                                                             \
    }
    PLIANT_MODEL_SECTIONS(CHECK)
#undef CHECK
    return PLIANT_OK;
}

// ---- Contents ----

static pliant_status check_material(const binding *b, pliant_error *err)
{
    const double *x = b->view->material;
    if (x[0] > 0 && x[1] > -1 && x[1] < 0.5 && x[2] >= 0) return PLIANT_OK;
    return pliant_error_set(
        err, PLIANT_ERR_FORMAT,
        "%s: /material: expected young > 0, poisson in (-1, 0.5), density >= 0, "
        "found %g, %g, %g",
        b->name, x[0], x[1], x[2]);
}

// The parents of a vertex of level l + 1 are two different vertices of level l.
static pliant_status check_parents(const binding *b, pliant_error *err)
{
    const pliant_model_view *v = b->view;
    const int32_t *count = v->level_vertex_count;
    for (int32_t level = 1; level < v->level_count; level++) {
        for (int32_t vertex = count[level - 1]; vertex < count[level]; vertex++) {
            const int32_t *p = v->parents + 2 * (size_t)(vertex - count[0]);
            if (p[0] >= 0 && p[1] >= 0 && p[0] < count[level - 1] && p[1] < count[level - 1] &&
                p[0] != p[1])
                continue;
            return pliant_error_set(
                err, PLIANT_ERR_FORMAT,
                "%s: /mesh/parents: vertex %d of level %d: expected two vertices "
                "below %d, found %d and %d",
                b->name, (int)vertex, (int)level, (int)count[level - 1], (int)p[0], (int)p[1]);
        }
    }
    return PLIANT_OK;
}

// Free and fixed nodes are ascending; together every vertex is there once.
static pliant_status check_membership(const binding *b, pliant_error *err)
{
    const pliant_model_view *v = b->view;
    int32_t i = 0, j = 0;
    for (int32_t vertex = 0; vertex < v->vertex_count; vertex++) {
        const int is_free = i < v->free_count && v->free_nodes[i] == vertex;
        const int is_fixed = j < v->fixed_count && v->fixed_nodes[j] == vertex;
        if (is_free + is_fixed != 1)
            return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                    "%s: /domains: vertex %d: expected in one domain, found in %d",
                                    b->name, (int)vertex, is_free + is_fixed);
        i += is_free;
        j += is_fixed;
    }
    if (i == v->free_count && j == v->fixed_count) return PLIANT_OK;
    return pliant_error_set(err, PLIANT_ERR_FORMAT,
                            "%s: /domains: expected %d nodes in all, found %" PRId64, b->name,
                            (int)v->vertex_count, (int64_t)v->free_count + v->fixed_count);
}

// level_offset[l]: how many of the nodes are vertices of levels coarser than l.
static pliant_status check_level_offsets(const binding *b, const pliant_section *section,
                                         const int32_t *nodes, int32_t count, pliant_error *err)
{
    const pliant_model_view *v = b->view;
    const int32_t *offset = section->data;
    int32_t position = 0;
    for (int32_t level = 0; level <= v->level_count; level++) {
        const int32_t end = level == 0 ? 0 : v->level_vertex_count[level - 1];
        while (position < count && nodes[position] < end) position++;
        if (offset[level] != position)
            return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                    "%s: %s: element %d: expected %d, found %d", b->name,
                                    section->path, (int)level, (int)position, (int)offset[level]);
    }
    return PLIANT_OK;
}

static pliant_status check_domains(const binding *b, pliant_error *err)
{
    const pliant_model_view *v = b->view;
    const int64_t n = v->vertex_count;
    if (!v->has_greens) return PLIANT_OK;
    pliant_status status =
        pliant_bind_indices(b->reader, b->section.free_nodes, 0, n, PLIANT_ASCENDING, err);
    if (status == PLIANT_OK)
        status =
            pliant_bind_indices(b->reader, b->section.fixed_nodes, 0, n, PLIANT_ASCENDING, err);
    if (status == PLIANT_OK) status = check_membership(b, err);
    if (status == PLIANT_OK)
        status =
            check_level_offsets(b, b->section.free_level_offset, v->free_nodes, v->free_count, err);
    if (status == PLIANT_OK)
        status = check_level_offsets(b, b->section.fixed_level_offset, v->fixed_nodes,
                                     v->fixed_count, err);
    return status;
}

// The model's vertices come first, and from the same vertices of the input.
static pliant_status check_detail_source(const binding *b, pliant_error *err)
{
    const pliant_model_view *v = b->view;
    if (!b->is_there[PLIANT_WITH_DETAIL]) return PLIANT_OK;
    const pliant_status status = pliant_bind_indices(b->reader, b->section.detail_source_index, -1,
                                                     (int64_t)INT32_MAX + 1, PLIANT_ANY_ORDER, err);
    if (status < 0) return status;
    for (int32_t i = 0; i < v->vertex_count; i++)
        if (v->detail_source_index[i] != v->source_index[i])
            return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                    "%s: /detail/source_index: element %d: expected %d as in "
                                    "/mesh/source_index, found %d",
                                    b->name, (int)i, (int)v->source_index[i],
                                    (int)v->detail_source_index[i]);
    return PLIANT_OK;
}

// UTF-8 without control characters: tools print it.
static pliant_status check_text(const binding *b, pliant_error *err)
{
    const char *text = b->section.provenance->data;
    const size_t length = (size_t)b->view->provenance_bytes;
    size_t wrong = pliant_utf8_check(text, length);
    for (size_t i = 0; i < wrong; i++)
        if (((unsigned char)text[i] < 0x20 && text[i] != '\n' && text[i] != '\t') ||
            text[i] == 0x7f)
            wrong = i;
    if (wrong == length) return PLIANT_OK;
    return pliant_error_set(err, PLIANT_ERR_FORMAT,
                            "%s: /provenance/text: byte %zu: expected UTF-8 text, found 0x%02x",
                            b->name, wrong, (unsigned char)text[wrong]);
}

static pliant_status check_contents(const binding *b, pliant_error *err)
{
    const int64_t n = b->view->vertex_count;
    const pliant_section *finite[] = {b->section.vertices, b->section.material,
                                      b->section.gravity_free, b->section.gravity_fixed,
                                      b->section.detail_offset};
    pliant_status status = PLIANT_OK;
    for (size_t i = 0; i < sizeof finite / sizeof *finite && status == PLIANT_OK; i++)
        if (finite[i]) status = pliant_bind_finite(b->reader, finite[i], err);
    if (status == PLIANT_OK)
        status = pliant_bind_indices(b->reader, b->section.faces, 0, n, PLIANT_ANY_ORDER, err);
    if (status == PLIANT_OK)
        status = pliant_bind_indices(b->reader, b->section.source_index, -1, (int64_t)INT32_MAX + 1,
                                     PLIANT_ANY_ORDER, err);
    if (status == PLIANT_OK) status = check_material(b, err);
    if (status == PLIANT_OK) status = check_parents(b, err);
    if (status == PLIANT_OK) status = check_domains(b, err);
    if (status == PLIANT_OK) status = check_detail_source(b, err);
    if (status == PLIANT_OK) status = check_text(b, err);
    return status;
}

// ---- Green's functions ----

// Is any section of this level of this block in the file?
static int is_stored(const pliant_reader *reader, pliant_block_name block, int32_t level)
{
    char path[PLIANT_PATH_LIMIT];
    int found = 0;
#define LOOK(field, name, ...)                                                                     \
    pliant_section_level_path(block, level, name, path);                                           \
    found |= pliant_reader_find(reader, path) != NULL;
    PLIANT_LEVEL_SECTIONS(LOOK)
#undef LOOK
    return found;
}

// Is this a section of the table that is there under that condition?
static int has_presence(const char *path, pliant_presence wanted)
{
    int found = 0;
#define LOOK(field, section_path, type, rank, a, b, c, presence, unit)                             \
    found |= PLIANT_##presence == wanted && strcmp(path, section_path) == 0;
    PLIANT_MODEL_SECTIONS(LOOK)
#undef LOOK
    for (pliant_block_name block = PLIANT_FREE_FIXED;
         wanted == PLIANT_WITH_SUPPORTS && block < PLIANT_BLOCK_COUNT; block++) {
        char group[PLIANT_PATH_LIMIT];
        const int length = snprintf(group, sizeof group, "/greens/%s/", pliant_block_text(block));
        found |= strncmp(path, group, (size_t)length) == 0;
    }
    found |= wanted == PLIANT_WITH_GREENS && strncmp(path, "/greens/", strlen("/greens/")) == 0;
    return found;
}

// One such section asks for all of them.
static int has_any(const pliant_reader *reader, pliant_presence wanted)
{
    for (int32_t i = 0; i < pliant_reader_section_count(reader); i++)
        if (has_presence(pliant_reader_section(reader, i)->path, wanted)) return 1;
    return 0;
}

static pliant_status check_summary(const binding *b, pliant_error *err)
{
    const pliant_section *s = b->part.summary;
    const double *x = s->data;
    static const pliant_summary_item flags[] = {PLIANT_SUMMARY_WAVELET, PLIANT_SUMMARY_LIFTED,
                                                PLIANT_SUMMARY_BOUNDARY};
    const pliant_status status = pliant_bind_finite(b->reader, s, err);
    if (status < 0) return status;
    for (size_t i = 0; i < sizeof flags / sizeof *flags; i++)
        if (x[flags[i]] != 0 && x[flags[i]] != 1)
            return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                    "%s: %s: element %d: expected 0 or 1, found %g", b->name,
                                    s->path, (int)flags[i], x[flags[i]]);
    return PLIANT_OK;
}

// Compressed columns: offsets from 0 to nnz that never fall, rows ascending within a column.
static pliant_status check_columns(const binding *b, const pliant_greens_view *g, pliant_error *err)
{
    const pliant_section *offsets = b->part.column_offset, *rows = b->part.row;
    uint64_t begin = 0;
    for (int32_t c = 0; c <= g->column_count; c++) {
        const uint64_t end = g->column_offset[c];
        const int is_end = c == 0 || c == g->column_count;
        const uint64_t least = c == g->column_count ? g->nnz : begin;
        if (end < least || end > (c == 0 ? 0 : g->nnz))
            return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                    "%s: %s: element %d: expected %s %" PRIu64 ", found %" PRIu64,
                                    b->name, offsets->path, (int)c,
                                    is_end || end > g->nnz ? (is_end ? "exactly" : "at most")
                                                           : "at least",
                                    c == 0 ? 0 : (is_end || end > g->nnz ? g->nnz : begin), end);
        int64_t bound = 0;
        for (uint64_t i = begin; i < end; i++) {
            if (g->row[i] < bound || g->row[i] >= g->row_count)
                return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                        "%s: %s: element %" PRIu64 " (column %d): expected %" PRId64
                                        " to %d, found %d",
                                        b->name, rows->path, i, (int)c - 1, bound,
                                        (int)g->row_count - 1, (int)g->row[i]);
            bound = (int64_t)g->row[i] + 1;
        }
        begin = end;
    }
    return PLIANT_OK;
}

static pliant_status bind_level(binding *b, pliant_block_name block, int32_t level,
                                pliant_error *err)
{
    const pliant_model_view *v = b->view;
    pliant_greens_view *g = &b->view->greens[block][level];
    const int free_rows = block == PLIANT_FREE_FREE || block == PLIANT_FREE_FIXED;
    const int free_columns = block == PLIANT_FREE_FREE || block == PLIANT_FIXED_FREE;
    g->row_count = free_rows ? v->free_count : v->fixed_count;
    g->column_count = (free_columns ? v->free_level_offset : v->fixed_level_offset)[level + 1];
    b->extent[PLIANT_EXTENT_COLUMNS_1] = (uint64_t)g->column_count + 1;

    char path[PLIANT_PATH_LIMIT];
    pliant_status status;
#define BIND(field, name, type, rank, extent0, extent1, extent2)                                   \
    pliant_section_level_path(block, level, name, path);                                           \
    status = pliant_bind_find(b->reader, path, PLIANT_##type, rank, &b->part.field, err);          \
    if (status < 0) return status;                                                                 \
    g->field = b->part.field->data;
    PLIANT_LEVEL_SECTIONS(BIND)
#undef BIND
    b->extent[PLIANT_EXTENT_NNZ] = g->nnz = b->part.row->shape[0];
#define CHECK(field, name, type, rank, extent0, extent1, extent2)                                  \
    {                                                                                              \
        const uint64_t shape[3] = {b->extent[PLIANT_EXTENT_##extent0],                             \
                                   b->extent[PLIANT_EXTENT_##extent1],                             \
                                   b->extent[PLIANT_EXTENT_##extent2]};                            \
        status = pliant_bind_shape(b->reader, b->part.field, shape, err);                          \
        if (status < 0) return status;                                                             \
    }
    PLIANT_LEVEL_SECTIONS(CHECK)
#undef CHECK
    status = check_summary(b, err);
    if (status == PLIANT_OK) status = check_columns(b, g, err);
    if (status == PLIANT_OK) status = pliant_bind_finite(b->reader, b->part.block, err);
    return status;
}

// A level is stored for the free-free block alone or, with supports, for all four blocks.
static pliant_status bind_greens(binding *b, pliant_error *err)
{
    const pliant_model_view *v = b->view;
    int stored = 0;
    if (!v->has_greens) return PLIANT_OK;
    for (int32_t level = 0; level < v->level_count; level++) {
        int any = 0;
        for (pliant_block_name block = 0; block < PLIANT_BLOCK_COUNT; block++)
            any |= is_stored(b->reader, block, level);
        const pliant_block_name last = v->has_supports ? PLIANT_FIXED_FIXED : PLIANT_FREE_FREE;
        for (pliant_block_name block = 0; any && block <= last; block++) {
            const pliant_status status = bind_level(b, block, level, err);
            if (status < 0) return status;
        }
        stored += any;
    }
    if (stored > 0) return PLIANT_OK;
    return pliant_error_set(err, PLIANT_ERR_MISSING,
                            "%s: /greens/free-free: expected the columns of a level among 0 to %d, "
                            "found none",
                            b->name, (int)v->level_count - 1);
}

pliant_status pliant_model_view_bind(const pliant_reader *reader, pliant_model_view *view,
                                     pliant_error *err)
{
    const char *name = pliant_reader_name(reader);
    if (!pliant_reader_find(reader, "/mesh/vertices"))
        return pliant_error_set(
            err, PLIANT_ERR_MISSING, "%s: not a model: expected /mesh/vertices, found %s", name,
            pliant_reader_find(reader, "/dense/nodes") ? "a dense file" : "none");
    pliant_model_view v;
    memset(&v, 0, sizeof v);
    v.has_supports = has_any(reader, PLIANT_WITH_SUPPORTS);
    v.has_greens = v.has_supports || has_any(reader, PLIANT_WITH_GREENS);
    binding b = {.reader = reader,
                 .name = name,
                 .view = &v,
                 .is_there = {[PLIANT_ALWAYS] = 1,
                              [PLIANT_WITH_SUPPORTS] = v.has_supports,
                              [PLIANT_WITH_DETAIL] = has_any(reader, PLIANT_WITH_DETAIL),
                              [PLIANT_WITH_GREENS] = v.has_greens,
                              [PLIANT_WITH_LATTICE] = has_any(reader, PLIANT_WITH_LATTICE)}};
    if (!v.has_greens && !b.is_there[PLIANT_WITH_LATTICE])
        return pliant_error_set(err, PLIANT_ERR_MISSING,
                                "%s: expected Green's functions or a lattice, found a mesh only",
                                name);
    pliant_status status = find_sections(&b, err);
    if (status == PLIANT_OK) status = count_all(&b, err);
    if (status == PLIANT_OK) status = count_lattice(&b, err);
    if (status == PLIANT_OK) status = check_level_counts(&b, err);
    if (status == PLIANT_OK) status = check_detail_counts(&b, err);
    if (status == PLIANT_OK) status = check_shapes(&b, err);
    if (status == PLIANT_OK) status = check_contents(&b, err);
    if (status == PLIANT_OK && b.is_there[PLIANT_WITH_LATTICE])
        status = pliant_lattice_check(name, &v, v.lattice_dims, err);
    if (status == PLIANT_OK) status = bind_greens(&b, err);
    if (status == PLIANT_OK) *view = v;
    return status;
}
