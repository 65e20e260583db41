// model_files.c: two model files held against each other.
#include "model_files.h"

#include "check.h"

#include "pliant/reader.h"

#include <math.h>
#include <string.h>

// Lines of the provenance that two runs of the same thing may not share.
static int may_differ(const char *line)
{
    return strncmp(line, "seconds_", 8) == 0 || strncmp(line, "command_line", 12) == 0;
}

static void same_provenance(const pliant_section *a, const pliant_section *b)
{
    const char *p = a->data, *q = b->data, *p_end = p + a->bytes, *q_end = q + b->bytes;
    while (p < p_end && q < q_end && *p != '\n' && *q != '\n') {
        const int p_size = (int)strcspn(p, "\n"), q_size = (int)strcspn(q, "\n");
        if (!may_differ(p) && (p_size != q_size || strncmp(p, q, (size_t)p_size) != 0))
            fail_msg("provenance: '%.*s' against '%.*s'", p_size, p, q_size, q);
        p += p_size + 1;
        q += q_size + 1;
    }
}

void check_same_model(const char *found, const char *expected, double tolerance)
{
    pliant_reader *a = NULL, *b = NULL;
    pliant_error err;
    check_ok(pliant_reader_open(found, &a, &err), &err);
    check_ok(pliant_reader_open(expected, &b, &err), &err);
    check_ok(pliant_reader_verify(a, &err), &err);
    assert_int_equal(pliant_reader_section_count(a), pliant_reader_section_count(b));
    for (int32_t i = 0; i < pliant_reader_section_count(a); i++) {
        const pliant_section *s = pliant_reader_section(a, i), *t = pliant_reader_section(b, i);
        assert_string_equal(s->path, t->path);
        if (strcmp(s->path, "/provenance/text") == 0) {
            if (tolerance == 0) same_provenance(s, t);
            continue;
        }
        if (s->bytes != t->bytes)
            fail_msg("%s: %llu bytes against %llu", s->path, (unsigned long long)s->bytes,
                     (unsigned long long)t->bytes);
        if (memcmp(s->data, t->data, s->bytes) == 0) continue;
        if (tolerance == 0) fail_msg("%s: other bytes", s->path);
        if (!strstr(s->path, "block") && !strstr(s->path, "gravity")) {
            if (!strstr(s->path, "summary")) fail_msg("%s: other bytes", s->path);
            continue;
        }
        const float *x = s->data, *y = t->data;
        double largest = 0, off = 0;
        for (uint64_t k = 0; k < s->count; k++) {
            largest = fmax(largest, fabs((double)y[k]));
            off = fmax(off, fabs((double)x[k] - (double)y[k]));
        }
        check_at_most(off / largest, tolerance);
    }
    pliant_reader_close(b);
    pliant_reader_close(a);
}
