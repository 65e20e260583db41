// tiny_write.h: write the tiny model with the real writer, and look at files, for the tests.
#pragma once

#include "check.h"

#include "pliant/writer.h"
#include "tiny_model.h"

#include <sys/stat.h>
#include <unistd.h>

// A path in this test's own folder under TMPDIR or /tmp; static, good until the 16th next call.
static inline const char *scratch(const char *name)
{
    static char paths[16][512];
    static int next, owner;
    if (!owner) owner = (int)getpid();  // children of a test use its folder
    const char *folder = getenv("TMPDIR");
    char *path = paths[next++ % 16];
    snprintf(path, sizeof paths[0], "%s/pliant-test-%d", folder ? folder : "/tmp", owner);
    mkdir(path, 0777);
    const size_t length = strlen(path);
    snprintf(path + length, sizeof paths[0] - length, "/%s", name);
    return path;
}

// Remove the folder and what the test left in it.
static inline int scratch_clean(void **state)
{
    (void)state;
    char command[600];
    snprintf(command, sizeof command, "rm -rf '%s'", scratch(""));
    return system(command) == 0 ? 0 : -1;
}

static inline pliant_status tiny_create(const tiny_file *file, const char *path,
                                        pliant_writer **writer, pliant_error *err)
{
    pliant_section_def defs[PLIANT_SECTION_LIMIT];
    for (int32_t i = 0; i < file->section_count; i++) defs[i] = file->sections[i].def;
    return pliant_writer_create(path, defs, file->section_count, writer, err);
}

// All sections, summaries with their attributes, provenance with its.
static inline pliant_status tiny_write(const tiny_file *file, const char *path, pliant_error *err)
{
    pliant_writer *writer;
    pliant_status status = tiny_create(file, path, &writer, err);
    if (status < 0) return status;
    for (int32_t i = 0; i < file->section_count && status == PLIANT_OK; i++) {
        const tiny_section *s = &file->sections[i];
        int block, level, end = 0;
        for (block = 0; block < PLIANT_BLOCK_COUNT && !end; block++) {
            char form[64];
            snprintf(form, sizeof form, "/greens/%s/level%%d/summary%%n",
                     pliant_block_text((pliant_block_name)block));
            if (sscanf(s->def.path, form, &level, &end) == 1 && end > 0) break;
        }
        if (end > 0)
            status = pliant_writer_write_summary(writer, (pliant_block_name)block, level, s->data, err);
        else if (strcmp(s->def.path, "/provenance/text") == 0)
            status = pliant_writer_write_provenance(writer, tiny_provenance, err);
        else
            status = pliant_writer_write_all(writer, s->def.path, s->data, err);
    }
    if (status == PLIANT_OK) return pliant_writer_commit(writer, err);
    pliant_writer_abandon(writer);
    return status;
}

// The whole file; to be freed.
static inline unsigned char *load(const char *path, size_t *size)
{
    FILE *file = fopen(path, "rb");
    *size = 0;
    assert_non_null(file);
    fseek(file, 0, SEEK_END);
    *size = (size_t)ftell(file);
    rewind(file);
    unsigned char *bytes = malloc(*size + 1);
    assert_non_null(bytes);
    assert_int_equal(fread(bytes, 1, *size, file), *size);
    fclose(file);
    return bytes;
}

static inline void save(const char *path, const void *bytes, size_t size)
{
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(bytes, 1, size, file), size);
    assert_int_equal(fclose(file), 0);
}

static inline int exists(const char *path)
{
    struct stat info;
    return lstat(path, &info) == 0;
}

// The text holds the part; prints both when it does not.
static inline void check_contains(const char *text, const char *part)
{
    if (!strstr(text, part)) fail_msg("expected \"%s\" in \"%s\"", part, text);
}
