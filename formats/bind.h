// bind.h: the checks that model view and dense view share.
//
// Every refusal names the file, the section, the element, what was expected and what was found.
#pragma once

#include "pliant/reader.h"

// Find a section and check its type and rank. PLIANT_ERR_MISSING when it is absent.
PLIANT_UNUSED_RESULT pliant_status pliant_bind_find(const pliant_reader *reader, const char *path,
                                                    pliant_section_type type, int32_t rank,
                                                    const pliant_section **section,
                                                    pliant_error *err);
// Check shape[d] == extent[d], d < rank.
PLIANT_UNUSED_RESULT pliant_status pliant_bind_shape(const pliant_reader *reader,
                                                     const pliant_section *section,
                                                     const uint64_t extent[3], pliant_error *err);
// Read a count from shape[0], refused beyond `limit` or below `least`.
PLIANT_UNUSED_RESULT pliant_status pliant_bind_count(const pliant_reader *reader,
                                                     const pliant_section *section, int32_t least,
                                                     int32_t limit, int32_t *count,
                                                     pliant_error *err);
// Every number (f4 or f8) finite.
PLIANT_UNUSED_RESULT pliant_status pliant_bind_finite(const pliant_reader *reader,
                                                      const pliant_section *section,
                                                      pliant_error *err);
// i4: low <= x[i] < high, and x[i] > x[i - 1] where `ascending` says so.
typedef enum pliant_order {
    PLIANT_ANY_ORDER,
    PLIANT_ASCENDING,
} pliant_order;
PLIANT_UNUSED_RESULT pliant_status pliant_bind_indices(const pliant_reader *reader,
                                                       const pliant_section *section, int64_t low,
                                                       int64_t high, pliant_order order,
                                                       pliant_error *err);
