// dense_view.c: bind the sections of a dense file and check them.
#include "pliant/dense_view.h"

#include "pliant/error.h"
#include "bind.h"

#include <string.h>

static int has_supports(const pliant_reader *reader)
{
    int found = 0;
#define LOOK(field, path, type, rank, a, b, c, presence, unit)                                     \
    found |= PLIANT_##presence == PLIANT_WITH_SUPPORTS && pliant_reader_find(reader, path);
    PLIANT_DENSE_SECTIONS(LOOK)
#undef LOOK
    return found;
}

// Neither list may name a vertex of the other; both ascend.
static pliant_status check_disjoint(const pliant_reader *reader, const pliant_dense_view *v,
                                    pliant_error *err)
{
    for (int32_t i = 0, j = 0; i < v->free_count && j < v->fixed_count;) {
        if (v->nodes[i] == v->fixed_nodes[j])
            return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                    "%s: /dense/fixed-nodes: element %d: expected a vertex that is "
                                    "not free, found %d",
                                    pliant_reader_name(reader), (int)j, (int)v->fixed_nodes[j]);
        if (v->nodes[i] < v->fixed_nodes[j]) i++;
        else j++;
    }
    return PLIANT_OK;
}

pliant_status pliant_dense_view_bind(const pliant_reader *reader, pliant_dense_view *view,
                                     pliant_error *err)
{
    if (!pliant_reader_find(reader, "/dense/nodes"))
        return pliant_error_set(err, PLIANT_ERR_MISSING,
                                "%s: not a dense file: expected /dense/nodes, found none",
                                pliant_reader_name(reader));
    pliant_status status;
    pliant_dense_view v;
    memset(&v, 0, sizeof v);
    v.has_supports = has_supports(reader);

    const pliant_section *section;
    status = pliant_bind_find(reader, "/dense/nodes", PLIANT_I4, 1, &section, err);
    if (status == PLIANT_OK)
        status = pliant_bind_count(reader, section, 1, PLIANT_VERTEX_LIMIT, &v.free_count, err);
    if (status == PLIANT_OK && v.has_supports) {
        status = pliant_bind_find(reader, "/dense/fixed-nodes", PLIANT_I4, 1, &section, err);
        if (status == PLIANT_OK)
            status =
                pliant_bind_count(reader, section, 0, PLIANT_VERTEX_LIMIT, &v.fixed_count, err);
    }
    if (status < 0) return status;

    const uint64_t extent[PLIANT_EXTENT_COUNT] = {
        [PLIANT_EXTENT_1] = 1,
        [PLIANT_EXTENT_3] = 3,
        [PLIANT_EXTENT_FREE] = (uint64_t)v.free_count,
        [PLIANT_EXTENT_FIXED] = (uint64_t)v.fixed_count,
        [PLIANT_EXTENT_FREE_3] = 3 * (uint64_t)v.free_count,
        [PLIANT_EXTENT_FIXED_3] = 3 * (uint64_t)v.fixed_count,
    };
#define BIND(field, path, section_type, section_rank, a, b, c, presence, unit)                     \
    if (PLIANT_##presence == PLIANT_ALWAYS || v.has_supports) {                                    \
        const uint64_t shape[3] = {extent[PLIANT_EXTENT_##a], extent[PLIANT_EXTENT_##b],           \
                                   extent[PLIANT_EXTENT_##c]};                                     \
        status =                                                                                   \
            pliant_bind_find(reader, path, PLIANT_##section_type, section_rank, &section, err);    \
        if (status == PLIANT_OK) status = pliant_bind_shape(reader, section, shape, err);          \
        if (status == PLIANT_OK)                                                                   \
            status = section->type == PLIANT_I4                                                    \
                         ? pliant_bind_indices(reader, section, 0, PLIANT_VERTEX_LIMIT,            \
                                               PLIANT_ASCENDING, err)                              \
                         : pliant_bind_finite(reader, section, err);                               \
        if (status < 0) return status;                                                             \
        v.field = section->data;                                                                   \
    }
    PLIANT_DENSE_SECTIONS(BIND)
#undef BIND
    status = check_disjoint(reader, &v, err);
    if (status == PLIANT_OK) *view = v;
    return status;
}
