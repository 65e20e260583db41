// fracture.c: links that are stretched too far break, and the regions about them are found again.
#include "lattice/fracture.h"

#include "lattice/body.h"
#include "lattice/window.h"
#include "pliant/error.h"
#include "pliant/vector_clones.h"

#include <math.h>
#include <stdlib.h>

enum { IS_STALE = 1, IS_CHANGED = 2, IS_LIGHT = 4 };

// ---- Life ----

static void lay_out(pliant_arena *arena, const pliant_lattice *lattice, int32_t worker_count,
                    pliant_fracture *fracture)
{
    const size_t count = (size_t)lattice->particle_count;
    PLIANT_TAKE(arena, fracture->particle_constants_of, lattice->block_count);
    PLIANT_TAKE(arena, fracture->region_constants_of, lattice->turn_count);
    PLIANT_TAKE(arena, fracture->particle_constants, lattice->block_count);
    PLIANT_TAKE(arena, fracture->region_constants, lattice->turn_count);
    pliant_irregular_lay_out(&fracture->irregular, arena);
    PLIANT_TAKE(arena, fracture->is_listed, lattice->exceptions.count);
    PLIANT_TAKE(arena, fracture->size, count);
    PLIANT_TAKE(arena, fracture->state, count);
    PLIANT_TAKE(arena, fracture->stale, count);
    PLIANT_TAKE(arena, fracture->light, count);
    PLIANT_TAKE(arena, fracture->slab_breaks, lattice->dims[2]);
    PLIANT_TAKE(arena, fracture->reach, 1);
    PLIANT_TAKE(arena, fracture->rows,
                15 * pliant_row_length(lattice->row_blocks) * (size_t)worker_count);
}

// Every irregular region made of its parts. There is a node for every region and for every plate of
// it, so that adding cannot fail.
static void take_apart(const pliant_lattice *lattice, pliant_fracture *fracture)
{
    pliant_irregular_clear(&fracture->irregular);
    for (int32_t i = 0; i < lattice->particle_count; i++) {
        const pliant_region_place place = pliant_lattice_place(lattice, i);
        pliant_links_reach(fracture->links, place.x, place.y, place.z, lattice->half_width,
                           fracture->reach);
        fracture->size[i] = fracture->reach->size;
        if (!fracture->reach->is_regular)
            (void)pliant_irregular_add(&fracture->irregular, &place, fracture->reach,
                                       PLIANT_REGION_APART);
    }
}

pliant_status pliant_fracture_create(const pliant_lattice *lattice, int32_t worker_count,
                                     pliant_fracture **result, pliant_error *err)
{
    pliant_fracture *fracture = calloc(1, sizeof *fracture);
    if (!fracture) return pliant_error_set(err, PLIANT_ERR_MEMORY, "fracture: no memory");
    const int64_t plates = (int64_t)lattice->particle_count * (2 * lattice->half_width + 1);
    pliant_status status = PLIANT_OK;
    if (plates > INT32_MAX)
        status =
            pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                             "fracture: expected at most %d regions at half-width %d, found %d",
                             INT32_MAX / (2 * lattice->half_width + 1), lattice->half_width,
                             lattice->particle_count);
    if (status >= 0) status = pliant_links_copy(lattice->links, &fracture->links, err);
    if (status < 0) goto done;
    fracture->irregular = (pliant_irregular){.half_width = lattice->half_width,
                                             .column_count = lattice->column_count,
                                             .slab_count = lattice->dims[2],
                                             .region_capacity = lattice->particle_count,
                                             .plate_capacity = (int32_t)plates};
    lay_out(&fracture->arena, lattice, worker_count, fracture);
    status = pliant_arena_reserve(&fracture->arena, err);
    if (status < 0) goto done;
    lay_out(&fracture->arena, lattice, worker_count, fracture);
    for (int32_t b = 0; b < lattice->block_count; b++) fracture->particle_constants_of[b] = b;
    for (int32_t t = 0; t < lattice->turn_count; t++) fracture->region_constants_of[t] = t;
    pliant_fracture_mend(fracture, lattice);
done:
    if (status < 0) {
        pliant_fracture_destroy(fracture);
        return status;
    }
    *result = fracture;
    return PLIANT_OK;
}

void pliant_fracture_destroy(pliant_fracture *fracture)
{
    if (!fracture) return;
    pliant_links_destroy(fracture->links);
    pliant_arena_release(&fracture->arena);
    free(fracture);
}

void pliant_fracture_mend(pliant_fracture *fracture, const pliant_lattice *lattice)
{
    pliant_links_restore(fracture->links, lattice->links);
    for (int32_t b = 0; b < lattice->block_count; b++)
        fracture->particle_constants[b] =
            lattice->particle_constants[lattice->particle_constants_of[b]];
    for (int32_t t = 0; t < lattice->turn_count; t++)
        fracture->region_constants[t] = lattice->region_constants[lattice->region_constants_of[t]];
    take_apart(lattice, fracture);
    fracture->cut_count = 0;
}

void pliant_fracture_copy(pliant_fracture *to, const pliant_fracture *from,
                          const pliant_lattice *lattice)
{
    pliant_links_restore(to->links, from->links);
    memcpy(to->particle_constants, from->particle_constants,
           (size_t)lattice->block_count * sizeof *to->particle_constants);
    memcpy(to->region_constants, from->region_constants,
           (size_t)lattice->turn_count * sizeof *to->region_constants);
    memcpy(to->size, from->size, (size_t)lattice->particle_count * sizeof *to->size);
    pliant_irregular_copy(&to->irregular, &from->irregular);
    to->cut_count = from->cut_count;
}

// ---- Which links ----

// Positions of row (y, z) about the body's origin, in three padded rows.
PLIANT_INLINE void load_positions(const pliant_body *body, int32_t y, int32_t z, float *rows)
{
    const pliant_lattice *lattice = body->lattice;
    const size_t length = pliant_row_length(lattice->row_blocks);
    const int32_t is_inside = y >= 0 && y < lattice->dims[1] && z < lattice->dims[2];
    const int32_t *block_at =
        lattice->block_at +
        (is_inside ? ((size_t)z * lattice->dims[1] + y) * lattice->row_blocks : 0);
    for (int32_t k = 0; k < lattice->row_blocks; k++) {
        float *to = rows + PLIANT_ROW_PAD + 8 * k;
        const float *x =
            is_inside && block_at[k] >= 0 ? body->x + (size_t)block_at[k] * 3 * PLIANT_LANES : NULL;
        for (int c = 0; c < 3; c++) {
            pliant_f8 offset = {0};
            if (x) offset = pliant_f8_load(x + 8 * c) - pliant_f8_all(body->origin[c]);
            pliant_f8_store(to + c * length, offset);
        }
    }
}

// Of rows (y, z), (y + 1, z), (y - 1, z + 1), (y, z + 1), (y + 1, z + 1): where a link ends.
static int32_t row_of_step(const int32_t step[3])
{
    return step[2] == 0 ? step[1] : 3 + step[1];
}

// The links along d from the block's eight particles on that are too long, of those that hold.
PLIANT_INLINE uint32_t too_long(const pliant_body *body, const pliant_links *links,
                                const float *rows, const int32_t *place, int32_t d)
{
    const size_t length = pliant_row_length(body->lattice->row_blocks);
    int32_t step[3];
    pliant_link_direction(d, step);
    const float *from = rows + PLIANT_ROW_PAD + 8 * place[0];
    const float *to = from + row_of_step(step) * 3 * length + step[0];
    const float stretch = (1 + body->strain_limit) * body->lattice->cell_size;
    const float limit =
        stretch * stretch * (float)(step[0] * step[0] + step[1] * step[1] + step[2] * step[2]);
    pliant_f8 square = {0};
    for (int c = 0; c < 3; c++) {
        const pliant_f8 along = pliant_f8_load(to + c * length) - pliant_f8_load(from + c * length);
        square += along * along;
    }
    const pliant_bits8 longer = square > pliant_f8_all(limit);
    uint32_t bits = 0;
    for (int k = 0; k < PLIANT_LANES; k++) bits |= (uint32_t)(longer[k] & 1) << k;
    return bits ? bits & pliant_links_row(links, 8 * place[0], place[1], place[2], d) : 0;
}

// Look through a slab; with `cut`, break what is too long and say who is to be looked at again.
static void look_again(pliant_fracture *fracture, const pliant_lattice *lattice, const int32_t *at,
                       int32_t *stale_count);

PLIANT_INLINE int64_t search_slab(const pliant_body *body, int32_t z, float *rows, int32_t cut,
                                  int32_t *stale_count)
{
    const pliant_lattice *lattice = body->lattice;
    pliant_fracture *fracture = body->fracture;
    const size_t length = pliant_row_length(lattice->row_blocks);
    int64_t found = 0;
    int32_t loaded = -1;
    for (int32_t b = lattice->slab_first[z]; b < lattice->slab_first[z + 1]; b++) {
        const int32_t *place = lattice->block_place + 3 * (size_t)b;
        if (place[1] != loaded) {
            loaded = place[1];
            for (int32_t k = 0; k < 5; k++)
                load_positions(body, loaded + (k < 2 ? k : k - 3), z + (k >= 2),
                               rows + k * 3 * length);
        }
        for (int32_t d = 0; d < PLIANT_LINK_DIRECTIONS; d++) {
            uint32_t bits = too_long(body, fracture->links, rows, place, d);
            found += __builtin_popcount(bits);
            for (; cut && bits; bits &= bits - 1) {
                int32_t at[3] = {8 * place[0] + __builtin_ctz(bits), place[1], z}, step[3];
                pliant_links_cut(fracture->links, at[0], at[1], at[2], d);
                look_again(fracture, lattice, at, stale_count);
                pliant_link_direction(d, step);
                for (int c = 0; c < 3; c++) at[c] += step[c];
                look_again(fracture, lattice, at, stale_count);
            }
        }
    }
    return found;
}

PLIANT_VECTOR_CLONES
static int32_t slab_breaks(const pliant_body *body, int32_t z, float *rows)
{
    return search_slab(body, z, rows, 0, NULL) > 0;
}

static void search_task(void *context, int32_t z, int32_t worker)
{
    pliant_body *body = context;
    float *rows =
        body->fracture->rows + 15 * pliant_row_length(body->lattice->row_blocks) * (size_t)worker;
    body->fracture->slab_breaks[z] = (uint8_t)slab_breaks(body, z, rows);
}

// ---- What changes ----

// Mark the particles of the window of `at` with `flag` and list those that were not.
static void mark_window(pliant_fracture *fracture, const pliant_lattice *lattice, const int32_t *at,
                        uint8_t flag, int32_t *list, int32_t *count)
{
    const int32_t w = lattice->half_width;
    for (int32_t z = at[2] - w; z <= at[2] + w; z++)
        for (int32_t y = at[1] - w; y <= at[1] + w; y++)
            for (int32_t x = at[0] - w; x <= at[0] + w; x++) {
                const int32_t p = pliant_links_particle(lattice->links, x, y, z);
                if (p < 0 || fracture->state[p] & flag) continue;
                fracture->state[p] |= flag;
                list[(*count)++] = p;
            }
}

static void look_again(pliant_fracture *fracture, const pliant_lattice *lattice, const int32_t *at,
                       int32_t *stale_count)
{
    mark_window(fracture, lattice, at, IS_STALE, fracture->stale, stale_count);
}

// The members of a region, as it now is. A set that has shrunk has another size, and sets only
// shrink.
static void find_region(pliant_fracture *fracture, const pliant_lattice *lattice, int32_t particle)
{
    const pliant_region_place place = pliant_lattice_place(lattice, particle);
    pliant_links_reach(fracture->links, place.x, place.y, place.z, lattice->half_width,
                       fracture->reach);
    if (fracture->reach->size == fracture->size[particle]) return;
    fracture->size[particle] = fracture->reach->size;
    fracture->state[particle] |= IS_CHANGED;
    pliant_irregular_remove(&fracture->irregular, &place);
    (void)pliant_irregular_add(&fracture->irregular, &place, fracture->reach, PLIANT_REGION_APART);
    pliant_particle_constants *constants = &fracture->particle_constants[place.block];
    const float mass = lattice->lane_mass[place.block * PLIANT_LANES + place.lane];
    constants->share[place.lane] = mass / (float)fracture->reach->size;
    constants->inverse_size[place.lane] = 1 / (float)fracture->reach->size;
}

// M_r and c0_r from the members' m~.
static void weigh_region(pliant_fracture *fracture, const pliant_lattice *lattice, int32_t particle)
{
    const int32_t w = lattice->half_width;
    const pliant_region_place place = pliant_lattice_place(lattice, particle);
    pliant_links_reach(fracture->links, place.x, place.y, place.z, w, fracture->reach);
    double mass = 0, offset[3] = {0};
    for (int32_t z = 0; z <= 2 * w; z++)
        for (int32_t y = 0; y <= 2 * w; y++)
            for (uint32_t rest = fracture->reach->member[z][y]; rest; rest &= rest - 1) {
                const int32_t dx = __builtin_ctz(rest) - w, x = place.x + dx;
                const int32_t block =
                    lattice->block_at[((size_t)(place.z + z - w) * lattice->dims[1] + place.y + y -
                                       w) *
                                          lattice->row_blocks +
                                      x / PLIANT_LANES];
                const double share =
                    (double)fracture->particle_constants[block].share[x % PLIANT_LANES];
                mass += share;
                offset[0] += share * dx;
                offset[1] += share * (y - w);
                offset[2] += share * (z - w);
            }
    pliant_region_constants *constants = &fracture->region_constants[place.turn];
    constants->inverse_mass[place.lane] = (float)(1 / mass);
    for (int c = 0; c < 3; c++) constants->offset[c][place.lane] = (float)(offset[c] / mass);
}

int64_t pliant_fracture_break(pliant_body *body)
{
    const pliant_lattice *lattice = body->lattice;
    pliant_fracture *fracture = body->fracture;
    pliant_team_run(body->team, lattice->dims[2], search_task, body);
    int64_t cut = 0;
    int32_t stale_count = 0, light_count = 0;
    for (int32_t z = 0; z < lattice->dims[2]; z++)
        if (fracture->slab_breaks[z]) cut += search_slab(body, z, fracture->rows, 1, &stale_count);
    if (cut == 0) return 0;
    for (int32_t i = 0; i < stale_count; i++) find_region(fracture, lattice, fracture->stale[i]);
    for (int32_t i = 0; i < stale_count; i++)
        if (fracture->state[fracture->stale[i]] & IS_CHANGED)
            mark_window(fracture, lattice, lattice->places + 3 * (size_t)fracture->stale[i],
                        IS_LIGHT, fracture->light, &light_count);
    for (int32_t i = 0; i < light_count; i++) weigh_region(fracture, lattice, fracture->light[i]);
    for (int32_t i = 0; i < stale_count; i++) fracture->state[fracture->stale[i]] = 0;
    for (int32_t i = 0; i < light_count; i++) fracture->state[fracture->light[i]] = 0;
    fracture->cut_count += cut;
    return cut;
}
