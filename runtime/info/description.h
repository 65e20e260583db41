// description.h: what is in a file, as text for people or as JSON.
#pragma once

#include "definiteness.h"

#include <stdio.h>

// Both write to `stream`; its error state tells whether that worked.
void pliant_description_print(const pliant_contents *contents, FILE *stream);

// `verified`: what --verify has found, which the text then says; NULL: it was not asked for.
void pliant_description_print_json(const pliant_contents *contents, const pliant_definiteness *verified,
                                   FILE *stream);
// --verify has passed: what was looked at, and how definite the model's contact compliance is.
void pliant_description_print_verified(const pliant_contents *contents, const pliant_definiteness *verified,
                                       FILE *stream);

// The numbers that both show, of a model.
typedef struct pliant_mesh_facts {
    double low[3], high[3];  // bounding box
    double volume;
    int32_t source_count;  // vertices of the input mesh
} pliant_mesh_facts;
pliant_mesh_facts pliant_description_mesh(const pliant_model_view *view);

// How large the detail's offsets are: root mean square and largest; tangential parts likewise.
typedef struct pliant_detail_facts {
    double rms, largest, tangential_rms, tangential_largest;
} pliant_detail_facts;
pliant_detail_facts pliant_description_detail(const pliant_model_view *view);

// Faces of a level, were they counted: a quarter of the next finer's.
int32_t pliant_description_level_faces(const pliant_model_view *view, int32_t level);
// Bytes of a level's sections.
uint64_t pliant_description_level_bytes(const pliant_greens_view *greens);
