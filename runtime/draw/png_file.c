// png_file.c: a picture into a PNG file, whole or not at all.
#include "png_file.h"

#include "pliant/error.h"

#include <errno.h>
#include <png.h>
#include <setjmp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// libpng calls this and expects it not to return.
static void jump_out(png_structp png, png_const_charp text)
{
    snprintf(png_get_error_ptr(png), sizeof(pliant_error), "%s", text);
    png_longjmp(png, 1);
}

static void ignore(png_structp png, png_const_charp text)
{
    (void)png, (void)text;
}

// Everything that lives across setjmp is the caller's, so that no local is clobbered.
static int write_rows(png_structp png, png_infop info, FILE *stream, int32_t width, int32_t height,
                      const uint8_t *rgb)
{
    if (setjmp(png_jmpbuf(png))) return 0;
    png_init_io(png, stream);
    png_set_IHDR(png, info, (png_uint_32)width, (png_uint_32)height, 8, PNG_COLOR_TYPE_RGB,
                 PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_set_sRGB(png, info, PNG_sRGB_INTENT_PERCEPTUAL);
    png_write_info(png, info);
    for (int32_t y = 0; y < height; y++) png_write_row(png, rgb + 3 * (size_t)y * (size_t)width);
    png_write_end(png, NULL);
    return 1;
}

pliant_status pliant_png_file_write(const char *path, int32_t width, int32_t height,
                                    const uint8_t *rgb, pliant_error *err)
{
    pliant_status status = PLIANT_OK;
    FILE *stream = NULL;
    int made = 0;  // the temporary file is ours
    png_structp png = NULL;
    png_infop info = NULL;
    pliant_error reason = {"libpng refused"};
    const size_t length = strlen(path) + sizeof ".tmp";
    char *temporary = malloc(length);
    if (!temporary) return pliant_error_set(err, PLIANT_ERR_MEMORY, "%s: no memory", path);
    snprintf(temporary, length, "%s.tmp", path);

    stream = fopen(temporary, "wb");
    if (!stream) {
        status =
            pliant_error_set(err, PLIANT_ERR_IO, "%s: cannot write: %s", path, strerror(errno));
        goto done;
    }
    made = 1;
    png = png_create_write_struct(PNG_LIBPNG_VER_STRING, &reason, jump_out, ignore);
    info = png ? png_create_info_struct(png) : NULL;
    if (!info) {
        status = pliant_error_set(err, PLIANT_ERR_MEMORY, "%s: no memory for libpng", path);
        goto done;
    }
    errno = 0;
    if (!write_rows(png, info, stream, width, height, rgb)) {
        status = pliant_error_set(err, PLIANT_ERR_IO, "%s: cannot write: %s", path,
                                  errno ? strerror(errno) : reason.text);
        goto done;
    }
    const int closed = fclose(stream);
    stream = NULL;
    if (closed != 0 || rename(temporary, path) != 0)
        status =
            pliant_error_set(err, PLIANT_ERR_IO, "%s: cannot write: %s", path, strerror(errno));

done:
    if (png) png_destroy_write_struct(&png, info ? &info : NULL);
    if (stream) fclose(stream);
    if (made && status != PLIANT_OK) remove(temporary);
    free(temporary);
    return status;
}
