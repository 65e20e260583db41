// script.c: the stream of a contact script: one line in memory, whatever the file's length.
#include "pliant/script.h"

#include "pliant/error.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

struct pliant_script {
    FILE *stream;
    int64_t line;  // of the line read last
    int first;     // no version statement yet
    size_t length;
    char
        text[PLIANT_SCRIPT_LINE_LIMIT + 2];  // room for a carriage return and for one byte too many
    char name[];
};

pliant_status pliant_script_open(const char *path, pliant_script **script, pliant_error *err)
{
    const int standard = strcmp(path, "-") == 0;
    const char *name = standard ? "standard input" : path;
    FILE *stream = standard ? stdin : fopen(path, "rbe");
    struct stat info;
    if (!stream) return pliant_error_set(err, PLIANT_ERR_IO, "%.300s: %s", name, strerror(errno));
    if (fstat(fileno(stream), &info) == 0 && S_ISDIR(info.st_mode)) {
        if (!standard) fclose(stream);
        return pliant_error_set(err, PLIANT_ERR_IO, "%.300s: expected a script, found a directory",
                                name);
    }
    pliant_script *s = calloc(1, sizeof *s + strlen(name) + 1);
    if (!s) {
        if (!standard) fclose(stream);
        return pliant_error_set(err, PLIANT_ERR_MEMORY,
                                "%.300s: expected %zu bytes of memory, found none", name,
                                sizeof *s + strlen(name) + 1);
    }
    strcpy(s->name, name);
    s->stream = stream;
    s->first = 1;
    *script = s;
    return PLIANT_OK;
}

void pliant_script_close(pliant_script *script)
{
    if (!script) return;
    if (script->stream != stdin) fclose(script->stream);
    free(script);
}

// Read the next line without its break ("\n" or "\r\n"); 0 at the end. Of a line that is too long
// the beginning is kept, with a length beyond the limit; the rest is read and dropped.
static int read_line(pliant_script *s)
{
    size_t length = 0;
    int c = getc_unlocked(s->stream);
    if (c == EOF) return 0;
    s->line++;
    for (; c != EOF && c != '\n'; c = getc_unlocked(s->stream))
        if (length < sizeof s->text) s->text[length++] = (char)c;
    if (c == '\n' && length > 0 && s->text[length - 1] == '\r') length--;
    s->length = length;
    return 1;
}

pliant_status pliant_script_next(pliant_script *script, pliant_statement *statement, int *more,
                                 pliant_error *err)
{
    static const char byte_order_mark[] = "\xef\xbb\xbf";
    pliant_statement s = {.kind = PLIANT_STATEMENT_NONE};
    while (s.kind == PLIANT_STATEMENT_NONE) {
        errno = 0;
        if (!read_line(script)) {
            *more = 0;
            if (ferror(script->stream))
                return pliant_error_set(err, PLIANT_ERR_IO, "%.300s: line %lld: %s", script->name,
                                        (long long)script->line + 1, strerror(errno));
            return PLIANT_OK;
        }
        *more = 1;
        const char *text = script->text;
        size_t length = script->length;
        if (script->line == 1 && length >= 3 && memcmp(text, byte_order_mark, 3) == 0)
            text += 3, length -= 3;
        const pliant_status status = pliant_statement_parse(text, length, script->name,
                                                            script->line, script->first, &s, err);
        if (status < 0) return status;
    }
    if (s.kind == PLIANT_STATEMENT_VERSION) script->first = 0;
    *statement = s;
    return PLIANT_OK;
}

pliant_statement_family pliant_script_family(const char *path)
{
    pliant_script *script = NULL;
    pliant_statement s = {.kind = PLIANT_STATEMENT_NONE};
    pliant_statement_family family = PLIANT_FAMILY_COMMON;
    int more = 1;
    if (strcmp(path, "-") == 0 || pliant_script_open(path, &script, NULL) < 0) return family;
    while (family == PLIANT_FAMILY_COMMON && s.kind != PLIANT_STATEMENT_STEP) {
        if (pliant_script_next(script, &s, &more, NULL) < 0 || !more) break;
        family = pliant_statement_family_of(s.kind);
    }
    pliant_script_close(script);
    return family;
}
