// pieces.c: what of a body still holds together.
#include "lattice/body.h"
#include "model.h"

static const pliant_links *links_of(const pliant_body *body)
{
    return body->fracture ? body->fracture->links : body->lattice->links;
}

// The least particle that is known to hold on to p; what lies between is halved on the way.
static int32_t find_root(int32_t *parent, int32_t p)
{
    while (parent[p] != p) p = parent[p] = parent[parent[p]];
    return p;
}

int32_t pliant_body_pieces(const pliant_body *body, int32_t *piece)
{
    const pliant_lattice *lattice = body->lattice;
    const pliant_links *links = links_of(body);
    for (int32_t p = 0; p < lattice->particle_count; p++) piece[p] = p;
    for (int32_t p = 0; p < lattice->particle_count; p++) {
        const int32_t *at = lattice->places + 3 * (size_t)p;
        for (uint32_t mask = pliant_links_mask(links, at[0], at[1], at[2]); mask;
             mask &= mask - 1) {
            int32_t step[3];
            pliant_link_direction(__builtin_ctz(mask), step);
            const int32_t q =
                pliant_links_particle(links, at[0] + step[0], at[1] + step[1], at[2] + step[2]);
            const int32_t a = find_root(piece, p), b = find_root(piece, q);
            piece[a > b ? a : b] = a > b ? b : a;
        }
    }
    // Roots are the least of their pieces, so that each is counted before it is referred to.
    int32_t count = 0;
    for (int32_t p = 0; p < lattice->particle_count; p++)
        piece[p] = piece[p] == p ? count++ : piece[piece[p]];
    return count;
}

int32_t pliant_body_is_torn(const pliant_body *body, int32_t vertex)
{
    const pliant_lattice *lattice = body->lattice;
    const pliant_model *model = lattice->model;
    if (!model || vertex < 0 || vertex >= model->view.vertex_count) return -1;
    const int32_t *at = lattice->cells + 3 * (size_t)model->view.lattice_vertex_cell[vertex];
    return !pliant_links_is_whole(links_of(body), at[0], at[1], at[2]);
}
