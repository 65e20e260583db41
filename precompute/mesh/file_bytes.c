// file_bytes.c: a whole file, mapped for reading.
//
// Mapped, not read: a sparse file of a terabyte costs nothing until somebody looks at its pages.
#include "file_bytes.h"

#include "pliant/error.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

pliant_status pliant_file_bytes_open(const char *path, const char *name, pliant_file_bytes *bytes,
                                     pliant_error *err)
{
    // O_NONBLOCK: opening a pipe must not wait for a writer.
    const int file = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (file < 0)
        return pliant_error_set(err, PLIANT_ERR_IO, "%s: cannot open: %s", name, strerror(errno));
    pliant_status status = PLIANT_OK;
    struct stat about;
    if (fstat(file, &about) != 0)
        status = pliant_error_set(err, PLIANT_ERR_IO, "%s: cannot open: %s", name, strerror(errno));
    else if (S_ISDIR(about.st_mode))
        status = pliant_error_set(err, PLIANT_ERR_IO, "%s: is a directory, expected a file", name);
    else if (!S_ISREG(about.st_mode))
        status = pliant_error_set(err, PLIANT_ERR_IO, "%s: is not a regular file", name);
    else if (about.st_size == 0)
        status = pliant_error_set(err, PLIANT_ERR_FORMAT, "%s: the file is empty", name);
    if (status == PLIANT_OK) {
        void *data = mmap(NULL, (size_t)about.st_size, PROT_READ, MAP_PRIVATE, file, 0);
        if (data == MAP_FAILED)
            status =
                pliant_error_set(err, PLIANT_ERR_IO, "%s: cannot read: %s", name, strerror(errno));
        else *bytes = (pliant_file_bytes){.data = data, .size = (size_t)about.st_size};
    }
    close(file);
    return status;
}

void pliant_file_bytes_close(pliant_file_bytes *bytes)
{
    if (bytes->data) munmap((void *)bytes->data, bytes->size);
    *bytes = (pliant_file_bytes){0};
}

const char *pliant_file_bytes_name(const char *path, char text[PLIANT_FILE_NAME_SIZE])
{
    const size_t length = strlen(path), kept = PLIANT_FILE_NAME_SIZE - 4;
    if (length <= kept) return path;
    snprintf(text, PLIANT_FILE_NAME_SIZE, "...%s", path + length - kept);
    return text;
}
