// fuzz_script.c: libFuzzer target: no bytes make the script parser misbehave.
//
// The input is a whole script. Every line goes to the parser as an exact copy; what it accepts is
// checked for the header's promises; then the stream reads the same bytes and must agree.
#include "pliant/script.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

int LLVMFuzzerInitialize(int *argc, char ***argv);
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static const char *const seeds[] = {
    "pliant-script 1\nprobe nose vertex 812\nprobe tip near 0.1 -2e-3 +1.3\ndisplace 812 0 0 "
    "-0.02\nstep\n",
    "pliant-script 1\r\ndisplace 1:17 0 0 -0.02 # comment\r\ntraction source 3 0 0 -100\r\nstep "
    "100\r\n",
    "\xef\xbb\xbfpliant-script 1\nforce near 1 2 3 0 0 -3\nsupport 30 0 0 0.01\ngravity 0 0 "
    "-9.81\ndt 1e-3\n",
    "pliant-script 1\ndisplace 1:near 0 1 2 0 0 1\nprobe p vertex 0:source 7\nrelease 2:5\n",
    "pliant-script 1\npatch thumb tolerance 1e-4\npatch thumb 12 0 0 -1\npatch thumb release all\ndrop "
    "thumb\n",
    "pliant-script 1\ncontact tolerance 1e-3\ntool a sphere 1 2 3 4 friction 0.5\nmove a 1 2 2\n"
    "tool b plane 0 0 1 -2\ntool c capsule 1 2 3 4 5 6 7\n",
    "pliant-script 1\nproxy pen 1 2 3 stiffness 100 friction 1\nstep\n",
    "pliant-script 1\ndeadline 200\nstep\ndeadline none\n",
    "pliant-script 1\nrelease 812\nrelease all\nexpect nose 0 0 -0.02 1e-3\n\n# \xc3\xa4\n",
    "pliant-script 1\ninstances 9 at 0 0 1 step 1 1 1 columns 3 random 7\ndamping 0.5 every 2\n"
    "grab instance 1 near 0 0 1 radius 2 hand\nmove hand 0 0 2 over 9\nlet hand\n",
    "pliant-script 1\nplane 0 0 1 0 friction 1\nbox 0 0 0 1 1 1 as crate\ncollide all\nimpulse 3 0 0 "
    "1\nbone arm 0 0 1\nbind arm 7\nturn arm 0 0 1 90\nstrain-limit 2\n",
    "pliant-script 2\n",
    "step x\nrelease\ndt -1\nexpect a,b\ngravity nan inf 1e999\n",
};

// PLIANT_FUZZ_SEEDS names the folder to leave valid inputs in.
int LLVMFuzzerInitialize(int *argc, char ***argv)
{
    (void)argc;
    (void)argv;
    const char *folder = getenv("PLIANT_FUZZ_SEEDS");
    for (size_t i = 0; folder && i < sizeof seeds / sizeof *seeds; i++) {
        char path[1000];
        snprintf(path, sizeof path, "%s/seed-script-%zu", folder, i);
        FILE *file = fopen(path, "wb");
        if (!file) continue;
        fputs(seeds[i], file);
        fclose(file);
    }
    return 0;
}

static void check_statement(const pliant_statement *s)
{
    for (int d = 0; d < 3; d++)
        if (!isfinite(s->value[d]) || !isfinite(s->end[d]) || !isfinite(s->vertex.position[d]))
            abort();
    if (!isfinite(s->scalar) || s->column < 1 || s->vertex.number < 0 || s->vertex.level < 0)
        abort();
    if (!s->vertex.has_level && s->vertex.level != 0) abort();
    if (!memchr(s->name, 0, sizeof s->name)) abort();
    if ((s->kind == PLIANT_STATEMENT_STEP || s->kind == PLIANT_STATEMENT_VERSION) && s->count < 1)
        abort();
    if (s->kind == PLIANT_STATEMENT_DEADLINE && (s->count < -1 || s->count > 1000000000)) abort();
    if (s->kind == PLIANT_STATEMENT_DT && !(s->scalar > 0)) abort();
    if (!(s->friction >= 0) || !(s->stiffness >= 0) || !isfinite(s->friction + s->stiffness)) abort();
    if ((s->kind == PLIANT_STATEMENT_TOOL || s->kind == PLIANT_STATEMENT_OBSTACLE) !=
        (s->shape != PLIANT_SHAPE_NONE))
        abort();
    if (!(isfinite(s->copies.velocity[0]) && isfinite(s->copies.velocity[1]) &&
          isfinite(s->copies.velocity[2]))) abort();
    if (s->instance < 0 || (!s->has_instance && s->instance != 0)) abort();
    if (pliant_statement_family_of(s->kind) == PLIANT_FAMILY_COMMON && s->shape != PLIANT_SHAPE_NONE)
        abort();
    if (s->shape == PLIANT_SHAPE_PLANE && s->value[0] == 0 && s->value[1] == 0 && s->value[2] == 0)
        abort();
    if ((s->shape == PLIANT_SHAPE_SPHERE || s->shape == PLIANT_SHAPE_CAPSULE) && !(s->scalar > 0))
        abort();
}

// One line by itself; the statement's kind, or its refusal.
static int parse_line(const char *text, size_t length, int64_t line, int first)
{
    char *copy = malloc(length > 0 ? length : 1);
    if (!copy) abort();
    memcpy(copy, text, length);
    pliant_statement s;
    pliant_error err;
    const pliant_status status =
        pliant_statement_parse(copy, length, "fuzz", line, first, &s, &err);
    free(copy);
    if (status < 0) {
        if (strncmp(err.text, "fuzz:", 5) != 0 || strchr(err.text, '\n')) abort();
        return status;
    }
    check_statement(&s);
    return (int)s.kind;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    char path[64];
    pliant_script *script;
    const int file = memfd_create("script", MFD_CLOEXEC);
    if (file < 0 || write(file, data, size) != (ssize_t)size) abort();
    snprintf(path, sizeof path, "/proc/self/fd/%d", file);
    if (pliant_script_open(path, &script, NULL) < 0) abort();

    int first = 1, more = 1;
    int64_t line = 0;
    for (const char *at = (const char *)data, *end = at + size; at < end;) {
        const char *stop = memchr(at, '\n', (size_t)(end - at));
        size_t length = (size_t)((stop ? stop : end) - at);
        const char *text = at;
        at = stop ? stop + 1 : end;
        line++;
        if (stop && length > 0 && text[length - 1] == '\r') length--;
        if (line == 1 && length >= 3 && memcmp(text, "\xef\xbb\xbf", 3) == 0)
            text += 3, length -= 3;
        const int expected = parse_line(text, length, line, first);
        if (expected == PLIANT_STATEMENT_NONE) continue;
        pliant_statement s = {.kind = PLIANT_STATEMENT_NONE};
        const pliant_status status = pliant_script_next(script, &s, &more, NULL);
        if (!more || (status < 0 ? (int)status : (int)s.kind) != expected) abort();
        if (status == PLIANT_OK && s.line != line) abort();
        if (status == PLIANT_OK && s.kind == PLIANT_STATEMENT_VERSION) first = 0;
    }
    pliant_statement s;
    if (pliant_script_next(script, &s, &more, NULL) != PLIANT_OK || more) abort();
    pliant_script_close(script);
    close(file);
    return 0;
}
