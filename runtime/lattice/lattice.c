// lattice.c: one lattice with one half-width, laid out for the step.
#include "lattice/lattice.h"
#include "lattice/region_layout.h"

#include "lattice/surface.h"
#include "model.h"
#include "pliant/error.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// ---- Layout ----

static void lay_out(pliant_arena *arena, pliant_lattice *lattice)
{
    const int32_t *dims = lattice->dims;
    const size_t table = (size_t)dims[2] * dims[1] * lattice->row_blocks;
    PLIANT_TAKE(arena, lattice->places, 3 * (size_t)lattice->particle_count);
    PLIANT_TAKE(arena, lattice->cells, 3 * (size_t)lattice->cell_count);
    PLIANT_TAKE(arena, lattice->rest, 3 * (size_t)lattice->particle_count);
    PLIANT_TAKE(arena, lattice->slot, lattice->particle_count);
    PLIANT_TAKE(arena, lattice->block_at, table);
    PLIANT_TAKE(arena, lattice->block_place, 3 * (size_t)lattice->block_count);
    PLIANT_TAKE(arena, lattice->block_particles, lattice->block_count);
    PLIANT_TAKE(arena, lattice->slab_first, dims[2] + 1);
    PLIANT_TAKE(arena, lattice->slab_rows, 2 * (size_t)dims[2]);
    PLIANT_TAKE(arena, lattice->column_at, (size_t)dims[1] * lattice->row_blocks);
    PLIANT_TAKE(arena, lattice->columns, (size_t)dims[1] * lattice->row_blocks);
    PLIANT_TAKE(arena, lattice->lane_mass, (size_t)lattice->block_count * PLIANT_LANES);
    PLIANT_TAKE(arena, lattice->lane_inverse, (size_t)lattice->block_count * PLIANT_LANES);
    PLIANT_TAKE(arena, lattice->particle_constants_of, lattice->block_count);
}

static int32_t count_blocks(const pliant_lattice_shape *shape)
{
    int32_t count = 0;
    const int32_t *p = shape->particles;
    for (int32_t i = 0; i < shape->particle_count; i++, p += 3)
        count +=
            i == 0 || p[0] / PLIANT_LANES != p[-3] / PLIANT_LANES || p[1] != p[-2] || p[2] != p[-1];
    return count;
}

static void place_blocks(pliant_lattice *lattice, const pliant_lattice_def *def)
{
    const int32_t *dims = lattice->dims;
    memset(lattice->block_at, -1,
           (size_t)dims[2] * dims[1] * lattice->row_blocks * sizeof *lattice->block_at);
    int32_t block = -1;
    for (int32_t i = 0; i < lattice->particle_count; i++) {
        const int32_t *p = lattice->places + 3 * (size_t)i;
        int32_t *at = lattice->block_at + ((size_t)p[2] * dims[1] + p[1]) * lattice->row_blocks +
                      p[0] / PLIANT_LANES;
        if (*at < 0) {
            *at = ++block;
            lattice->block_particles[block] = i;
            int32_t *place = lattice->block_place + 3 * (size_t)block;
            place[0] = p[0] / PLIANT_LANES, place[1] = p[1], place[2] = p[2];
        }
        const int32_t lane = p[0] % PLIANT_LANES;
        lattice->slot[i] = block * 3 * PLIANT_LANES + lane;
        lattice->lane_mass[block * PLIANT_LANES + lane] = def->mass[i];
        lattice->lane_inverse[block * PLIANT_LANES + lane] = 1 / def->mass[i];
        lattice->mass += def->mass[i];
        for (int c = 0; c < 3; c++)
            lattice->rest[3 * (size_t)i + c] = (float)(lattice->origin[c] + def->cell_size * p[c]);
    }
}

static void place_slabs(pliant_lattice *lattice)
{
    for (int32_t z = 0, b = 0; z < lattice->dims[2]; z++) {
        lattice->slab_first[z] = b;
        int32_t *rows = lattice->slab_rows + 2 * z;
        for (; b < lattice->block_count && lattice->block_place[3 * b + 2] == z; b++) {
            if (rows[1] == 0) rows[0] = lattice->block_place[3 * b + 1];
            rows[1] = lattice->block_place[3 * b + 1] + 1;
        }
    }
    lattice->slab_first[lattice->dims[2]] = lattice->block_count;
}

static void place_columns(pliant_lattice *lattice)
{
    const int32_t count = lattice->dims[1] * lattice->row_blocks;
    memset(lattice->column_at, -1, (size_t)count * sizeof *lattice->column_at);
    for (int32_t b = 0; b < lattice->block_count; b++) {
        const int32_t *place = lattice->block_place + 3 * (size_t)b;
        int32_t *at = lattice->column_at + place[1] * lattice->row_blocks + place[0];
        if (*at < 0) {
            *at = lattice->column_count++;
            lattice->columns[*at] =
                (pliant_lattice_column){.x = place[0], .y = place[1], .z = place[2]};
        }
        lattice->columns[*at].length = place[2] - lattice->columns[*at].z + 1;
    }
    for (int32_t c = 0; c < lattice->column_count; c++) {
        lattice->columns[c].first_site = lattice->site_count;
        lattice->columns[c].first_turn = lattice->turn_count;
        lattice->site_count += lattice->columns[c].length + 2 * lattice->half_width;
        lattice->turn_count += lattice->columns[c].length;
    }
}

// What belongs to regions is kept column by column, as the sums along z come by.
static pliant_status place_turns(pliant_lattice *lattice, pliant_error *err)
{
    PLIANT_TAKE(&lattice->turn_arena, lattice->turn_block, lattice->turn_count);
    PLIANT_TAKE(&lattice->turn_arena, lattice->region_constants_of, lattice->turn_count);
    const pliant_status status = pliant_arena_reserve(&lattice->turn_arena, err);
    if (status < 0) return status;
    PLIANT_TAKE(&lattice->turn_arena, lattice->turn_block, lattice->turn_count);
    PLIANT_TAKE(&lattice->turn_arena, lattice->region_constants_of, lattice->turn_count);
    for (int32_t c = 0; c < lattice->column_count; c++) {
        const pliant_lattice_column *column = &lattice->columns[c];
        for (int32_t s = 0; s < column->length; s++)
            lattice->turn_block[column->first_turn + s] =
                lattice->block_at[((size_t)(column->z + s) * lattice->dims[1] + column->y) *
                                      lattice->row_blocks +
                                  column->x];
    }
    return PLIANT_OK;
}

// ---- Life ----

pliant_status pliant_lattice_build(const pliant_lattice_def *def, pliant_lattice **result,
                                   pliant_error *err)
{
    pliant_lattice *lattice = calloc(1, sizeof *lattice);
    if (!lattice) return pliant_error_set(err, PLIANT_ERR_MEMORY, "lattice: no memory");
    pliant_status status = pliant_links_create(&def->shape, &lattice->links, err);
    if (status < 0) goto done;
    memcpy(lattice->dims, def->shape.dims, sizeof lattice->dims);
    memcpy(lattice->origin, def->origin, sizeof lattice->origin);
    lattice->half_width = def->regions->half_width;
    lattice->row_blocks = (lattice->dims[0] + PLIANT_LANES - 1) / PLIANT_LANES;
    lattice->particle_count = def->shape.particle_count;
    lattice->cell_count = def->shape.cell_count;
    lattice->cell_size = (float)def->cell_size;
    lattice->region_count = def->regions->region_count;
    lattice->irregular_count = def->regions->region_node_count;
    lattice->component_count = def->component_count;
    lattice->is_shell = def->is_shell;
    lattice->block_count = count_blocks(&def->shape);
    lay_out(&lattice->arena, lattice);
    status = pliant_arena_reserve(&lattice->arena, err);
    if (status < 0) goto done;
    lay_out(&lattice->arena, lattice);
    memcpy(lattice->places, def->shape.particles,
           3 * (size_t)lattice->particle_count * sizeof *lattice->places);
    memcpy(lattice->cells, def->shape.cells,
           3 * (size_t)lattice->cell_count * sizeof *lattice->cells);
    place_blocks(lattice, def);
    place_slabs(lattice);
    place_columns(lattice);
    status = place_turns(lattice, err);
    if (status < 0) goto done;
    status = pliant_lattice_lay_out_regions(lattice, def);
    if (status == PLIANT_ERR_FORMAT)
        (void)pliant_error_set(err, status,
                               "lattice: expected regions that lack each other or neither, found a "
                               "region that lacks a particle alone");
    else if (status < 0)
        (void)pliant_error_set(err, status, "lattice: no memory for %d particles",
                               lattice->particle_count);
done:
    if (status < 0) {
        pliant_lattice_destroy(lattice);
        return status;
    }
    *result = lattice;
    return PLIANT_OK;
}

void pliant_lattice_destroy(pliant_lattice *lattice)
{
    if (!lattice) return;
    pliant_arena_release(&lattice->arena);
    pliant_arena_release(&lattice->turn_arena);
    pliant_arena_release(&lattice->particle_arena);
    pliant_arena_release(&lattice->region_arena);
    pliant_arena_release(&lattice->exceptions_arena);
    pliant_arena_release(&lattice->items_arena);
    pliant_arena_release(&lattice->irregular_arena);
    pliant_links_destroy(lattice->links);
    pliant_surface_detach(lattice);
    free(lattice);
}

// ---- From a model ----

// Regions of another half-width than the file's are found again.
static pliant_status find_regions(const pliant_model_view *view, const pliant_lattice_shape *shape,
                                  int32_t half_width, pliant_regions **found,
                                  pliant_regions *stored, pliant_error *err)
{
    if (half_width != 0 && half_width != view->lattice_half_width)
        return pliant_regions_create(shape, half_width, found, err);
    int32_t region_count = 0;
    for (int32_t i = 0; i < view->lattice_particle_count; i++)
        region_count += view->lattice_region_share[i] == i;
    // What the file maps is only read.
    *stored = (pliant_regions){
        .half_width = view->lattice_half_width,
        .particle_count = view->lattice_particle_count,
        .region_count = region_count,
        .size = (int32_t *)view->lattice_region_size,
        .share = (int32_t *)view->lattice_region_share,
        .region_node_count = view->lattice_region_node_count,
        .plate_node_count = view->lattice_plate_node_count,
        .region_nodes = (int32_t *)view->lattice_region_nodes,
        .plate_nodes = (int32_t *)view->lattice_plate_nodes,
    };
    return PLIANT_OK;
}

pliant_status pliant_lattice_create(const pliant_model *model, int32_t half_width,
                                    pliant_lattice **result, pliant_error *err)
{
    if (!model || !result)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "pliant_lattice_create: expected a model and a place, found NULL");
    const char *name = pliant_reader_name(model->reader);
    const pliant_model_view *view = &model->view;
    if (view->lattice_particle_count == 0)
        return pliant_error_set(
            err, PLIANT_ERR_MISSING,
            "%s: expected a lattice, found Green's functions alone (pliant-precompute --lattice "
            "makes one)",
            name);
    if (half_width < 0 || half_width > PLIANT_LATTICE_WIDTH_LIMIT)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "half-width: expected 1 to %d, or 0 for the file's, found %d",
                                PLIANT_LATTICE_WIDTH_LIMIT, half_width);
    pliant_lattice_def def = {
        .shape = {.dims = {view->lattice_dims[0], view->lattice_dims[1], view->lattice_dims[2]},
                  .particle_count = view->lattice_particle_count,
                  .cell_count = view->lattice_cell_count,
                  .particles = view->lattice_particles,
                  .cells = view->lattice_cells},
        .mass = view->lattice_mass,
        .cell_size = view->lattice_frame[PLIANT_LATTICE_CELL_SIZE],
        .component_count = view->lattice_summary[PLIANT_LATTICE_COMPONENT_COUNT],
        .is_shell = view->lattice_summary[PLIANT_LATTICE_IS_SHELL],
    };
    for (int c = 0; c < 3; c++) def.origin[c] = view->lattice_frame[PLIANT_LATTICE_ORIGIN + c];
    pliant_error reason = {""};
    pliant_regions *found = NULL, stored;
    pliant_status status = find_regions(view, &def.shape, half_width, &found, &stored, &reason);
    def.regions = found ? found : &stored;
    pliant_lattice *lattice = NULL;
    if (status >= 0) status = pliant_lattice_build(&def, &lattice, &reason);
    pliant_regions_destroy(found);
    if (status >= 0) status = pliant_surface_attach(lattice, model, &reason);
    if (status < 0) {
        pliant_lattice_destroy(lattice);
        return pliant_error_set(err, status, "%s: %.400s", name, reason.text);
    }
    *result = lattice;
    return PLIANT_OK;
}

// ---- Questions ----

pliant_lattice_info pliant_lattice_describe(const pliant_lattice *lattice)
{
    const pliant_model_view *view = lattice->model ? &lattice->model->view : NULL;
    return (pliant_lattice_info){
        .particle_count = lattice->particle_count,
        .cell_count = lattice->cell_count,
        .component_count = lattice->component_count,
        .half_width = lattice->half_width,
        .region_count = lattice->region_count,
        .irregular_count = lattice->irregular_count,
        .is_shell = lattice->is_shell,
        .dims = {lattice->dims[0], lattice->dims[1], lattice->dims[2]},
        .vertex_count = view ? view->vertex_count : 0,
        .face_count = view ? view->face_count : 0,
        .batch_count = view ? view->lattice_batch_count : 0,
        .cell_size = (double)lattice->cell_size,
        .mass = lattice->mass,
    };
}

double pliant_lattice_particle_mass(const pliant_lattice *lattice, int32_t particle)
{
    if (particle < 0 || particle >= lattice->particle_count) return 0;
    const int32_t slot = lattice->slot[particle], block = slot / (3 * PLIANT_LANES);
    return (double)lattice->lane_mass[block * PLIANT_LANES + slot % PLIANT_LANES];
}

const float *pliant_lattice_positions(const pliant_lattice *lattice)
{
    return lattice->rest;
}

int32_t pliant_lattice_nearest(const pliant_lattice *lattice, const double *position)
{
    int32_t nearest = 0;
    double least = INFINITY;
    for (int32_t i = 0; i < lattice->particle_count; i++) {
        double distance = 0;
        for (int c = 0; c < 3; c++) {
            const double d = lattice->rest[3 * (size_t)i + c] - position[c];
            distance += d * d;
        }
        if (distance < least) least = distance, nearest = i;
    }
    return nearest;
}
