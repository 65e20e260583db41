// file_bytes.h: a whole file, mapped for reading.
#pragma once

#include "pliant/base.h"

#include <stddef.h>

typedef struct pliant_file_bytes {
    const char *data; // shape [size]; not zero-terminated
    size_t size;
} pliant_file_bytes;

// Map a regular, not empty file. A directory, a device, an empty or unreadable file have their own
// messages, which begin with `name`.
PLIANT_UNUSED_RESULT pliant_status pliant_file_bytes_open(const char *path, const char *name,
                                                          pliant_file_bytes *bytes,
                                                          pliant_error *err);
void pliant_file_bytes_close(pliant_file_bytes *bytes); // also of a zeroed struct

// A file's name for messages: the path as given, or the end of one so long that it would push the
// reason out of the message. Borrowed from `path` or `text`.
enum { PLIANT_FILE_NAME_SIZE = 204 };
const char *pliant_file_bytes_name(const char *path, char text[PLIANT_FILE_NAME_SIZE]);
