// image.h: a model file as bytes in memory, without HDF5's part, for tests that damage it.
#pragma once

#include "crc32c.h"
#include "table.h"
#include "tiny_model.h"

// Correct the header's recorded size and checksum after a change, so that a reader looks further.
static inline void image_stamp(unsigned char *bytes, size_t size)
{
    pliant_header header;
    if (size < PLIANT_USER_BLOCK) return;
    memcpy(&header, bytes, sizeof header);
    header.file_size = size;
    memcpy(bytes, &header, sizeof header);
    header.checksum = pliant_table_checksum(bytes);
    memcpy(bytes, &header, sizeof header);
}

// Header, table and the sections on pages; to be freed. The last section ends the file.
static inline unsigned char *image_make(const tiny_file *file, size_t *size)
{
    size_t end = PLIANT_USER_BLOCK;
    for (int32_t i = 0; i < file->section_count; i++)
        if (file->sections[i].bytes > 0)
            end = (end + PLIANT_SECTION_ALIGN - 1) / PLIANT_SECTION_ALIGN * PLIANT_SECTION_ALIGN +
                  file->sections[i].bytes;
    unsigned char *bytes = calloc(1, end);
    if (!bytes) abort();
    pliant_span spans[PLIANT_SECTION_LIMIT];
    size_t at = PLIANT_USER_BLOCK;
    for (int32_t i = 0; i < file->section_count; i++) {
        const tiny_section *s = &file->sections[i];
        pliant_entry entry = {
            .type = (uint16_t)s->def.type,
            .rank = (uint16_t)s->def.rank,
            .checksum = pliant_crc32c(0, s->data, s->bytes),
            .shape = {s->def.shape[0], s->def.shape[1], s->def.shape[2]},
        };
        memcpy(entry.path, s->def.path, sizeof entry.path);
        if (s->bytes > 0) {
            at = (at + PLIANT_SECTION_ALIGN - 1) / PLIANT_SECTION_ALIGN * PLIANT_SECTION_ALIGN;
            entry.offset = at;
            memcpy(bytes + at, s->data, s->bytes);
            at += s->bytes;
        }
        spans[i] = (pliant_span){.offset = entry.offset, .bytes = s->bytes};
        memcpy(bytes + sizeof(pliant_header) + (size_t)i * sizeof entry, &entry, sizeof entry);
    }
    const pliant_header header = {
        .magic = {'P', 'L', 'I', 'A', 'N', 'T', 0x1a, '\n'},
        .endian = PLIANT_ENDIAN_MARK,
        .version = PLIANT_FORMAT_VERSION,
        .user_block = PLIANT_USER_BLOCK,
        .entry_size = sizeof(pliant_entry),
        .section_count = (uint32_t)file->section_count,
        .rest_checksum = pliant_table_rest_checksum(bytes, end, spans, file->section_count),
    };
    memcpy(bytes, &header, sizeof header);
    image_stamp(bytes, end);
    *size = end;
    return bytes;
}

// A model and a dense file that need no more than these calls.
static inline unsigned char *image_of_model(int32_t level_count, int supports, size_t *size)
{
    tiny_file file;
    tiny_model_make(level_count, supports, &file);
    unsigned char *bytes = image_make(&file, size);
    tiny_free(&file);
    return bytes;
}

static inline unsigned char *image_of_dense(int supports, size_t *size)
{
    tiny_file file;
    tiny_dense_make(supports, &file);
    unsigned char *bytes = image_make(&file, size);
    tiny_free(&file);
    return bytes;
}
