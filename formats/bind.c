// bind.c: the checks that model view and dense view share.
#include "bind.h"

#include "pliant/error.h"

#include <inttypes.h>
#include <math.h>

pliant_status pliant_bind_find(const pliant_reader *reader, const char *path,
                               pliant_section_type type, int32_t rank,
                               const pliant_section **section, pliant_error *err)
{
    const pliant_section *s = pliant_reader_find(reader, path);
    const char *name = pliant_reader_name(reader);
    if (!s)
        return pliant_error_set(err, PLIANT_ERR_MISSING,
                                "%s: %s: expected this section, found none", name, path);
    if (s->type != type || s->rank != rank)
        return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                "%s: %s: expected %s of rank %d, found %s of rank %d", name, path,
                                pliant_section_type_text(type), (int)rank,
                                pliant_section_type_text(s->type), (int)s->rank);
    *section = s;
    return PLIANT_OK;
}

pliant_status pliant_bind_shape(const pliant_reader *reader, const pliant_section *section,
                                const uint64_t extent[3], pliant_error *err)
{
    for (int32_t d = 0; d < section->rank; d++)
        if (section->shape[d] != extent[d])
            return pliant_error_set(
                err, PLIANT_ERR_FORMAT,
                "%s: %s: expected length %" PRIu64 " along axis %d, found %" PRIu64,
                pliant_reader_name(reader), section->path, extent[d], (int)d, section->shape[d]);
    return PLIANT_OK;
}

pliant_status pliant_bind_count(const pliant_reader *reader, const pliant_section *section,
                                int32_t least, int32_t limit, int32_t *count, pliant_error *err)
{
    if (section->shape[0] < (uint64_t)least || section->shape[0] > (uint64_t)limit)
        return pliant_error_set(
            err, PLIANT_ERR_FORMAT, "%s: %s: expected length %d to %d, found %" PRIu64,
            pliant_reader_name(reader), section->path, (int)least, (int)limit, section->shape[0]);
    *count = (int32_t)section->shape[0];
    return PLIANT_OK;
}

// Numbers looked at between two looks at the result: the inner loops have no branch and vectorise.
#define CHUNK 4096

static uint64_t find_wild_float(const float *x, uint64_t count)
{
    for (uint64_t at = 0; at < count; at += CHUNK) {
        const uint64_t end = count - at < CHUNK ? count : at + CHUNK;
        int wild = 0;
        for (uint64_t i = at; i < end; i++) wild |= !(fabsf(x[i]) <= 3.402823466e38f);
        for (uint64_t i = at; wild && i < end; i++)
            if (!isfinite(x[i])) return i;
    }
    return count;
}

static uint64_t find_wild_double(const double *x, uint64_t count)
{
    for (uint64_t at = 0; at < count; at += CHUNK) {
        const uint64_t end = count - at < CHUNK ? count : at + CHUNK;
        int wild = 0;
        for (uint64_t i = at; i < end; i++) wild |= !(fabs(x[i]) <= 1.7976931348623157e308);
        for (uint64_t i = at; wild && i < end; i++)
            if (!isfinite(x[i])) return i;
    }
    return count;
}

pliant_status pliant_bind_finite(const pliant_reader *reader, const pliant_section *section,
                                 pliant_error *err)
{
    const uint64_t wild = section->type == PLIANT_F4
                              ? find_wild_float(section->data, section->count)
                              : find_wild_double(section->data, section->count);
    if (wild == section->count) return PLIANT_OK;
    const double found = section->type == PLIANT_F4 ? ((const float *)section->data)[wild]
                                                    : ((const double *)section->data)[wild];
    return pliant_error_set(err, PLIANT_ERR_FORMAT,
                            "%s: %s: element %" PRIu64 ": expected a finite number, found %g",
                            pliant_reader_name(reader), section->path, wild, found);
}

pliant_status pliant_bind_indices(const pliant_reader *reader, const pliant_section *section,
                                  int64_t low, int64_t high, pliant_order order, pliant_error *err)
{
    const int32_t *x = section->data;
    int64_t bound = low;
    for (uint64_t i = 0; i < section->count; i++) {
        if (x[i] < bound || x[i] >= high)
            return pliant_error_set(
                err, PLIANT_ERR_FORMAT,
                "%s: %s: element %" PRIu64 ": expected %" PRId64 " to %" PRId64 ", found %d",
                pliant_reader_name(reader), section->path, i, bound, high - 1, (int)x[i]);
        if (order == PLIANT_ASCENDING) bound = (int64_t)x[i] + 1;
    }
    return PLIANT_OK;
}
