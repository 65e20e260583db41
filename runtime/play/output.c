// output.c: a text file that appears under its name whole or not at all.
#include "output.h"

#include "pliant/error.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { BUFFER_SIZE = 1 << 16 };  // bytes: several hundred rows per system call

struct pliant_output {
    FILE *stream;
    int renamed;  // 1: written under a temporary name
    char *path, *temporary;
    char buffer[BUFFER_SIZE];
};

static void destroy(pliant_output *output)
{
    free(output->temporary);
    free(output->path);
    free(output);
}

pliant_status pliant_output_open(const char *path, pliant_output **output, pliant_error *err)
{
    pliant_output *o = calloc(1, sizeof *o);
    const size_t size = strlen(path) + sizeof ".tmp";
    if (o) {
        o->path = strdup(path);
        o->temporary = malloc(size);
    }
    if (!o || !o->path || !o->temporary) {
        if (o) destroy(o);
        return pliant_error_set(err, PLIANT_ERR_MEMORY, "%s: no memory", path);
    }
    snprintf(o->temporary, size, "%s.tmp", path);
    struct stat found;
    if (stat(path, &found) == 0 && S_ISDIR(found.st_mode)) {
        destroy(o);
        return pliant_error_set(err, PLIANT_ERR_IO, "%s: %s", path, strerror(EISDIR));
    }
    o->renamed = stat(path, &found) != 0 || S_ISREG(found.st_mode);
    o->stream = fopen(o->renamed ? o->temporary : path, "we");
    if (!o->stream) {
        const int reason = errno;
        destroy(o);
        return pliant_error_set(err, PLIANT_ERR_IO, "%s: %s", path, strerror(reason));
    }
    setvbuf(o->stream, o->buffer, _IOFBF, sizeof o->buffer);
    *output = o;
    return PLIANT_OK;
}

FILE *pliant_output_stream(const pliant_output *output)
{
    return output->stream;
}

pliant_status pliant_output_check(const pliant_output *output, pliant_error *err)
{
    if (!ferror(output->stream)) return PLIANT_OK;
    return pliant_error_set(err, PLIANT_ERR_IO, "%s: %s", output->path, strerror(errno));
}

pliant_status pliant_output_commit(pliant_output *output, pliant_error *err)
{
    errno = 0;
    const int before = ferror(output->stream);
    const int closed = fclose(output->stream);
    output->stream = NULL;
    int failed = before || closed != 0;
    if (!failed && output->renamed) failed = rename(output->temporary, output->path) != 0;
    pliant_status status = PLIANT_OK;
    if (failed)
        status = pliant_error_set(err, PLIANT_ERR_IO, "%s: %s", output->path,
                                  errno ? strerror(errno) : "write error");
    if (failed && output->renamed) (void)unlink(output->temporary);
    destroy(output);
    return status;
}

void pliant_output_abandon(pliant_output *output)
{
    if (!output) return;
    (void)fclose(output->stream);
    if (output->renamed) (void)unlink(output->temporary);
    destroy(output);
}
