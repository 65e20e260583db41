// sections.c: names and sizes of the section types, and the lists of sections that writers need.
#include "pliant/sections.h"

#include "pliant/error.h"

#include <stdio.h>
#include <string.h>

const char *pliant_block_text(pliant_block_name block)
{
    switch (block) {
    case PLIANT_FREE_FREE:
        return "free-free";
    case PLIANT_FREE_FIXED:
        return "free-fixed";
    case PLIANT_FIXED_FREE:
        return "fixed-free";
    case PLIANT_FIXED_FIXED:
        return "fixed-fixed";
    case PLIANT_BLOCK_COUNT:
        break;
    }
    return "?";
}

size_t pliant_section_type_size(pliant_section_type type)
{
    switch (type) {
    case PLIANT_F4:
        return sizeof(PLIANT_C_F4);
    case PLIANT_F8:
        return sizeof(PLIANT_C_F8);
    case PLIANT_I4:
        return sizeof(PLIANT_C_I4);
    case PLIANT_U8:
        return sizeof(PLIANT_C_U8);
    case PLIANT_U1:
        return sizeof(PLIANT_C_U1);
    }
    return 0;
}

const char *pliant_section_type_text(pliant_section_type type)
{
    switch (type) {
    case PLIANT_F4:
        return "f4";
    case PLIANT_F8:
        return "f8";
    case PLIANT_I4:
        return "i4";
    case PLIANT_U8:
        return "u8";
    case PLIANT_U1:
        return "u1";
    }
    return "unknown type";
}

void pliant_section_level_path(pliant_block_name block, int32_t level, const char *name,
                               char path[PLIANT_PATH_LIMIT])
{
    snprintf(path, PLIANT_PATH_LIMIT, "/greens/%s/level%d%s%s", pliant_block_text(block),
             (int)level, name ? "/" : "", name ? name : "");
}

// The list under construction. `extent` holds the present value of every length.
typedef struct list {
    pliant_section_def *sections;
    int32_t count;
    uint64_t extent[PLIANT_EXTENT_COUNT];
} list;

static void append(list *l, const char *path, pliant_section_type type, int32_t rank,
                   pliant_extent a, pliant_extent b, pliant_extent c)
{
    if (l->count < PLIANT_SECTION_LIMIT) {
        pliant_section_def *s = &l->sections[l->count];
        memset(s, 0, sizeof *s);
        snprintf(s->path, sizeof s->path, "%s", path);
        s->type = type;
        s->rank = rank;
        s->shape[0] = l->extent[a];
        s->shape[1] = l->extent[b];
        s->shape[2] = l->extent[c];
    }
    l->count++;
}

static void set_constants(uint64_t *extent)
{
    extent[PLIANT_EXTENT_1] = 1;
    extent[PLIANT_EXTENT_2] = 2;
    extent[PLIANT_EXTENT_3] = 3;
    extent[PLIANT_EXTENT_8] = 8;
}

static pliant_status finish(const list *l, int32_t *section_count, pliant_error *err)
{
    if (l->count > PLIANT_SECTION_LIMIT)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "sections: expected at most %d in one file, found %d",
                                PLIANT_SECTION_LIMIT, (int)l->count);
    *section_count = l->count;
    return PLIANT_OK;
}

static void append_level(list *l, const pliant_model_layout *layout, pliant_block_name block,
                         int32_t level)
{
    const int32_t *columns = block == PLIANT_FREE_FREE || block == PLIANT_FIXED_FREE
                                 ? layout->free_columns
                                 : layout->fixed_columns;
    char path[PLIANT_PATH_LIMIT];
    l->extent[PLIANT_EXTENT_COLUMNS_1] = (uint64_t)columns[level] + 1;
    l->extent[PLIANT_EXTENT_NNZ] = layout->nnz[block][level];
#define APPEND(field, name, type, rank, a, b, c)                                                   \
    pliant_section_level_path(block, level, name, path);                                           \
    append(l, path, PLIANT_##type, rank, PLIANT_EXTENT_##a, PLIANT_EXTENT_##b, PLIANT_EXTENT_##c);
    PLIANT_LEVEL_SECTIONS(APPEND)
#undef APPEND
}

static pliant_status check_greens(const pliant_model_layout *layout, pliant_error *err)
{
    const int32_t n = layout->vertex_count, m = layout->free_count, k = layout->fixed_count;
    if (!layout->has_greens) return PLIANT_OK;
    if (m < 0 || k < 0 || m > n || k != n - m)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "model layout: expected %d free and fixed nodes, found %d and %d",
                                (int)n, (int)m, (int)k);
    if (layout->level_mask == 0 || layout->level_mask >> layout->level_count != 0)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "model layout: expected stored levels among 0..%d, found mask %#x",
                                (int)layout->level_count - 1, (unsigned)layout->level_mask);
    return PLIANT_OK;
}

static pliant_status check_lattice(const pliant_lattice_layout *l, pliant_error *err)
{
    if (l->cell_count == 0) return PLIANT_OK;
    const struct {
        const char *name;
        int32_t found, least, most;
    } counts[] = {
        {"cells", l->cell_count, 1, PLIANT_LATTICE_LIMIT},
        {"particles", l->particle_count, 8, PLIANT_LATTICE_LIMIT},
        {"half-width", l->half_width, 1, PLIANT_LATTICE_WIDTH_LIMIT},
        {"region nodes", l->region_node_count, 0, l->particle_count},
        {"plate nodes", l->plate_node_count, 0, PLIANT_VERTEX_LIMIT},
        {"batches", l->batch_count, 1, PLIANT_FACE_LIMIT},
        {"batch points", l->batch_point_count, 8, INT32_MAX},
    };
    for (size_t i = 0; i < sizeof counts / sizeof *counts; i++)
        if (counts[i].found < counts[i].least || counts[i].found > counts[i].most)
            return pliant_error_set(
                err, PLIANT_ERR_ARGUMENT, "model layout: lattice: %s: expected %d to %d, found %d",
                counts[i].name, (int)counts[i].least, (int)counts[i].most, (int)counts[i].found);
    return PLIANT_OK;
}

static void set_lattice(uint64_t *extent, const pliant_lattice_layout *l)
{
    extent[PLIANT_EXTENT_CELLS] = (uint64_t)l->cell_count;
    extent[PLIANT_EXTENT_PARTICLES] = (uint64_t)l->particle_count;
    extent[PLIANT_EXTENT_REGION_NODES] = (uint64_t)l->region_node_count;
    extent[PLIANT_EXTENT_PLATE_NODES] = (uint64_t)l->plate_node_count;
    extent[PLIANT_EXTENT_REGION_ROW] = 2 * (uint64_t)l->half_width + 2;
    extent[PLIANT_EXTENT_PLATE_ROW] = 2 * (uint64_t)l->half_width + 4;
    extent[PLIANT_EXTENT_BATCHES_1] = (uint64_t)l->batch_count + 1;
    extent[PLIANT_EXTENT_BATCH_POINTS] = (uint64_t)l->batch_point_count;
}

pliant_status pliant_model_layout_sections(const pliant_model_layout *layout,
                                           pliant_section_def *sections, int32_t *section_count,
                                           pliant_error *err)
{
    if (layout->level_count < 1 || layout->level_count > PLIANT_LEVEL_LIMIT + 1)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT, "levels: expected 1 to %d, found %d",
                                PLIANT_LEVEL_LIMIT + 1, (int)layout->level_count);
    const int32_t n = layout->vertex_count, m = layout->free_count, k = layout->fixed_count;
    if (n < 1 || n > PLIANT_VERTEX_LIMIT || layout->face_count < 1 ||
        layout->face_count > PLIANT_FACE_LIMIT || layout->base_count < 1 || layout->base_count > n)
        return pliant_error_set(
            err, PLIANT_ERR_ARGUMENT,
            "model layout: counts disagree: %d vertices, %d faces, %d base vertices", (int)n,
            (int)layout->face_count, (int)layout->base_count);
    pliant_status status = check_greens(layout, err);
    if (status == PLIANT_OK) status = check_lattice(&layout->lattice, err);
    if (status < 0) return status;
    if (!layout->has_greens && layout->lattice.cell_count == 0)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "model layout: expected Green's functions or a lattice, found "
                                "neither");
    if (layout->detail_steps != 0 &&
        (layout->detail_steps < 0 ||
         layout->detail_steps > PLIANT_LEVEL_LIMIT + 1 - layout->level_count ||
         layout->detail_vertex_count <= n || layout->detail_vertex_count > PLIANT_VERTEX_LIMIT))
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "model layout: detail: expected 1 to %d steps and %d to %d "
                                "vertices, found %d and %d",
                                PLIANT_LEVEL_LIMIT + 1 - (int)layout->level_count, (int)n + 1,
                                PLIANT_VERTEX_LIMIT, (int)layout->detail_steps,
                                (int)layout->detail_vertex_count);

    list l = {.sections = sections};
    set_constants(l.extent);
    l.extent[PLIANT_EXTENT_VERTICES] = (uint64_t)n;
    l.extent[PLIANT_EXTENT_FACES] = (uint64_t)layout->face_count;
    l.extent[PLIANT_EXTENT_LEVELS] = (uint64_t)layout->level_count;
    l.extent[PLIANT_EXTENT_OFFSETS] = (uint64_t)layout->level_count + 1;
    l.extent[PLIANT_EXTENT_ODD] = (uint64_t)(n - layout->base_count);
    l.extent[PLIANT_EXTENT_FREE] = (uint64_t)m;
    l.extent[PLIANT_EXTENT_FIXED] = (uint64_t)k;
    l.extent[PLIANT_EXTENT_TEXT] = layout->text_bytes;
    l.extent[PLIANT_EXTENT_DETAIL] = (uint64_t)layout->detail_vertex_count;
    l.extent[PLIANT_EXTENT_STEPS_1] = (uint64_t)layout->detail_steps + 1;
    set_lattice(l.extent, &layout->lattice);

    const int has_supports = layout->has_greens && layout->has_supports;
    const int is_there[PLIANT_PRESENCE_COUNT] = {
        [PLIANT_ALWAYS] = 1,
        [PLIANT_WITH_SUPPORTS] = has_supports,
        [PLIANT_WITH_DETAIL] = layout->detail_steps > 0,
        [PLIANT_WITH_GREENS] = layout->has_greens,
        [PLIANT_WITH_LATTICE] = layout->lattice.cell_count > 0,
    };
#define APPEND(field, path, type, rank, a, b, c, presence, unit)                                   \
    if (is_there[PLIANT_##presence])                                                               \
        append(&l, path, PLIANT_##type, rank, PLIANT_EXTENT_##a, PLIANT_EXTENT_##b,                \
               PLIANT_EXTENT_##c);
    PLIANT_MODEL_SECTIONS(APPEND)
#undef APPEND
    const pliant_block_name last = has_supports ? PLIANT_FIXED_FIXED : PLIANT_FREE_FREE;
    for (pliant_block_name block = PLIANT_FREE_FREE; layout->has_greens && block <= last; block++)
        for (int32_t level = 0; level < layout->level_count; level++)
            if (layout->level_mask >> level & 1) append_level(&l, layout, block, level);
    return finish(&l, section_count, err);
}

pliant_status pliant_dense_layout_sections(int32_t free_count, int32_t fixed_count,
                                           pliant_section_def *sections, int32_t *section_count,
                                           pliant_error *err)
{
    if (free_count < 1 || free_count > PLIANT_VERTEX_LIMIT || fixed_count > PLIANT_VERTEX_LIMIT)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "dense layout: expected 1 to %d nodes, found %d free, %d fixed",
                                PLIANT_VERTEX_LIMIT, (int)free_count, (int)fixed_count);
    list l = {.sections = sections};
    const uint64_t k = fixed_count < 0 ? 0 : (uint64_t)fixed_count;
    set_constants(l.extent);
    l.extent[PLIANT_EXTENT_FREE] = (uint64_t)free_count;
    l.extent[PLIANT_EXTENT_FREE_3] = 3 * (uint64_t)free_count;
    l.extent[PLIANT_EXTENT_FIXED] = k;
    l.extent[PLIANT_EXTENT_FIXED_3] = 3 * k;
#define APPEND(field, path, type, rank, a, b, c, presence, unit)                                   \
    if (PLIANT_##presence == PLIANT_ALWAYS || fixed_count >= 0)                                    \
        append(&l, path, PLIANT_##type, rank, PLIANT_EXTENT_##a, PLIANT_EXTENT_##b,                \
               PLIANT_EXTENT_##c);
    PLIANT_DENSE_SECTIONS(APPEND)
#undef APPEND
    return finish(&l, section_count, err);
}
