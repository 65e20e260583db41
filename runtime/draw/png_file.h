// png_file.h: a picture into a PNG file, whole or not at all.
#pragma once

#include "pliant/base.h"

// `rgb` has shape [height][width][3], sRGB bytes. Written to "path.tmp", then renamed over `path`.
PLIANT_UNUSED_RESULT pliant_status pliant_png_file_write(const char *path, int32_t width,
                                                         int32_t height, const uint8_t *rgb,
                                                         pliant_error *err);
