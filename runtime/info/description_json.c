// description_json.c: the description of a file as JSON (RFC 8259).
#include "description.h"

#include "lattice_facts.h"
#include "pliant/utf8.h"
#include "pliant/wavelet.h"

#include <inttypes.h>
#include <math.h>
#include <string.h>

// A string in quotes. Bytes that are no UTF-8 become U+FFFD, the replacement character.
static void print_string(const char *text, size_t length, FILE *stream)
{
    fputc('"', stream);
    for (size_t i = 0; i < length;) {
        const int size = pliant_utf8_character(text + i, length - i);
        const unsigned char c = (unsigned char)text[i];
        if (size == 0) fputs("\\ufffd", stream);
        else if (c == '"' || c == '\\') fprintf(stream, "\\%c", c);
        else if (c < 0x20 || c == 0x7f) fprintf(stream, "\\u%04x", c);
        else fwrite(text + i, 1, (size_t)size, stream);
        i += size > 0 ? (size_t)size : 1;
    }
    fputc('"', stream);
}

// JSON has no inf: sums of huge finite coordinates may be one.
static void print_number(double value, FILE *stream)
{
    if (isfinite(value)) fprintf(stream, "%.17g", value);
    else fputs("null", stream);
}

static void print_vector(const double *x, FILE *stream)
{
    for (int d = 0; d < 3; d++) {
        fputs(d == 0 ? "[" : ", ", stream);
        print_number(x[d], stream);
    }
    fputs("]", stream);
}

static void print_mesh(const pliant_model_view *v, FILE *stream)
{
    const pliant_mesh_facts facts = pliant_description_mesh(v);
    fprintf(stream,
            ",\n  \"mesh\": {\"vertices\": %d, \"faces\": %d, \"source_vertices\": %d,\n    "
            "\"levels\": [",
            (int)v->vertex_count, (int)v->face_count, (int)facts.source_count);
    for (int32_t l = 0; l < v->level_count; l++)
        fprintf(stream, "%s{\"vertices\": %d, \"faces\": %d}", l ? ", " : "",
                (int)v->level_vertex_count[l], (int)pliant_description_level_faces(v, l));
    fputs("],\n    \"bounding_box\": [", stream);
    print_vector(facts.low, stream);
    fputs(", ", stream);
    print_vector(facts.high, stream);
    fputs("], \"volume\": ", stream);
    print_number(facts.volume, stream);
    fputs("},\n  \"material\": {\"young\": ", stream);
    print_number(v->material[0], stream);
    fputs(", \"poisson\": ", stream);
    print_number(v->material[1], stream);
    fputs(", \"density\": ", stream);
    print_number(v->material[2], stream);
    fputs("}", stream);
    if (v->has_greens)
        fprintf(stream, ",\n  \"domains\": {\"free\": %d, \"fixed\": %d}", (int)v->free_count,
                (int)v->fixed_count);
}

static void print_detail(const pliant_model_view *v, FILE *stream)
{
    if (v->detail_steps == 0) return;
    const pliant_detail_facts facts = pliant_description_detail(v);
    const struct {
        const char *name;
        double value;
    } numbers[] = {{"rms", facts.rms},
                   {"largest", facts.largest},
                   {"tangential_rms", facts.tangential_rms},
                   {"tangential_largest", facts.tangential_largest}};
    fprintf(stream, ",\n  \"detail\": {\"steps\": %d, \"vertices\": %d, \"faces\": %lld",
            (int)v->detail_steps, (int)v->detail_vertex_count,
            (long long)v->face_count << 2 * v->detail_steps);
    for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++) {
        fprintf(stream, ", \"%s\": ", numbers[i].name);
        print_number(numbers[i].value, stream);
    }
    fputs("}", stream);
}

static void print_level(const pliant_model_view *v, pliant_block_name block, int32_t level,
                        const pliant_definiteness *verified, FILE *stream)
{
    const pliant_greens_view *g = &v->greens[block][level];
    static const struct {
        const char *name;
        pliant_summary_item item;
    } numbers[] = {
        {"eps", PLIANT_SUMMARY_EPS},
        {"rms", PLIANT_SUMMARY_RMS},
        {"max", PLIANT_SUMMARY_MAX},
        {"factor", PLIANT_SUMMARY_FACTOR},
    };
    const double *s = g->summary;
    fprintf(stream,
            "{\"block\": \"%s\", \"level\": %d, \"vertices\": %d, \"rows\": %d, \"columns\": %d"
            ", \"nnz\": %" PRIu64 ", \"bytes\": %" PRIu64,
            pliant_block_text(block), (int)level, (int)v->level_vertex_count[level], (int)g->row_count,
            (int)g->column_count, g->nnz, pliant_description_level_bytes(g));
    for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++) {
        fprintf(stream, ", \"%s\": ", numbers[i].name);
        print_number(s[numbers[i].item], stream);
    }
    fputs(", \"smallest_eigenvalue\": ", stream);
    if (s[PLIANT_SUMMARY_DEFINITE] != 0) print_number(s[PLIANT_SUMMARY_DEFINITE], stream);
    else fputs("null", stream);
    if (verified && block == PLIANT_FREE_FREE && verified->levels[level].steps > 0) {
        const pliant_lanczos_result *found = &verified->levels[level];
        fputs(", \"verified\": {\"smallest_eigenvalue\": ", stream);
        print_number(found->smallest, stream);
        fputs(", \"largest_eigenvalue\": ", stream);
        print_number(found->largest, stream);
        fputs(", \"eigenvalue_ratio\": ", stream);
        print_number(pliant_definiteness_ratio(found), stream);
        fputs("}", stream);
    }
    fprintf(stream, ", \"wavelet\": \"%s\", \"lifted\": %s, \"boundary\": \"%s\"}",
            s[PLIANT_SUMMARY_WAVELET] == PLIANT_BUTTERFLY ? "butterfly" : "linear",
            s[PLIANT_SUMMARY_LIFTED] == PLIANT_LIFTED ? "true" : "false",
            s[PLIANT_SUMMARY_BOUNDARY] == PLIANT_DROP ? "drop" : "zero");
}

static void print_greens(const pliant_model_view *v, const pliant_definiteness *verified, FILE *stream)
{
    const char *separator = "\n    ";
    if (!v->has_greens) return;
    fputs(",\n  \"blocks\": [", stream);
    for (pliant_block_name block = PLIANT_FREE_FREE; block < PLIANT_BLOCK_COUNT; block++)
        for (int32_t level = 0; level < v->level_count; level++) {
            if (!v->greens[block][level].column_offset) continue;
            fputs(separator, stream);
            print_level(v, block, level, verified, stream);
            separator = ",\n    ";
        }
    fprintf(stream, "],\n  \"gravity\": [\"free\"%s]", v->gravity_fixed ? ", \"fixed\"" : "");
}

// Was this key there before byte `end` of the text? An object has it once: the first wins.
static int came_before(const pliant_contents *contents, const pliant_contents_pair *pair,
                       size_t end)
{
    pliant_contents_pair earlier;
    for (size_t at = 0; pliant_contents_next_pair(contents, &at, &earlier) && at < end;)
        if (earlier.key_bytes == pair->key_bytes &&
            memcmp(earlier.key, pair->key, pair->key_bytes) == 0)
            return 1;
    return 0;
}

static void print_provenance(const pliant_contents *contents, FILE *stream)
{
    const char *separator = "";
    pliant_contents_pair pair;
    fputs(",\n  \"provenance\": {", stream);
    for (size_t at = 0; pliant_contents_next_pair(contents, &at, &pair);) {
        if (pair.key_bytes == 0 || came_before(contents, &pair, at)) continue;
        fprintf(stream, "%s\n    ", separator);
        print_string(pair.key, pair.key_bytes, stream);
        fputs(": ", stream);
        print_string(pair.value, pair.value_bytes, stream);
        separator = ",";
    }
    fputs("}", stream);
}

static void print_sections(const pliant_reader *reader, FILE *stream)
{
    fputs(",\n  \"sections\": [", stream);
    for (int32_t i = 0; i < pliant_reader_section_count(reader); i++) {
        const pliant_section *s = pliant_reader_section(reader, i);
        fprintf(stream, "%s\n    {\"path\": ", i ? "," : "");
        print_string(s->path, strlen(s->path), stream);
        fprintf(stream, ", \"type\": \"%s\", \"shape\": [", pliant_section_type_text(s->type));
        for (int32_t d = 0; d < s->rank; d++)
            fprintf(stream, "%s%" PRIu64, d ? ", " : "", s->shape[d]);
        fprintf(stream, "], \"offset\": %" PRIu64 ", \"bytes\": %" PRIu64 ", \"crc32c\": \"%08x\"}",
                s->offset, s->bytes, (unsigned)s->checksum);
    }
    fputs("]", stream);
}

void pliant_description_print_json(const pliant_contents *contents, const pliant_definiteness *verified,
                                   FILE *stream)
{
    const char *name = pliant_reader_name(contents->reader);
    fputs("{\n  \"file\": ", stream);
    print_string(name, strlen(name), stream);
    fprintf(stream, ",\n  \"kind\": \"%s\", \"format\": %d, \"bytes\": %" PRIu64,
            pliant_contents_kind_text(contents->kind), (int)pliant_reader_version(contents->reader),
            pliant_reader_size(contents->reader));
    if (verified) fputs(", \"verified\": true", stream);
    if (contents->kind == PLIANT_CONTENTS_MODEL) {
        print_mesh(&contents->model, stream);
        print_detail(&contents->model, stream);
        pliant_lattice_facts_print_json(&contents->model, stream);
        print_greens(&contents->model, verified, stream);
    } else if (contents->kind == PLIANT_CONTENTS_DENSE) {
        fprintf(stream, ",\n  \"domains\": {\"free\": %d, \"fixed\": %d}",
                (int)contents->dense.free_count, (int)contents->dense.fixed_count);
    }
    print_provenance(contents, stream);
    print_sections(contents->reader, stream);
    fputs("\n}\n", stream);
}
