// description.c: the description of a file for people.
#include "description.h"

#include "lattice_facts.h"
#include "pliant/mesh.h"
#include "pliant/utf8.h"
#include "pliant/wavelet.h"

#include <inttypes.h>
#include <math.h>
#include <string.h>

pliant_mesh_facts pliant_description_mesh(const pliant_model_view *view)
{
    pliant_mesh_facts facts = {.source_count = 0};
    // The mesh's arrays are only read.
    const pliant_mesh mesh = {
        .vertex_count = view->vertex_count,
        .face_count = view->face_count,
        .vertices = (double *)(uintptr_t)view->vertices,
        .faces = (int32_t *)(uintptr_t)view->faces,
    };
    facts.volume = pliant_mesh_volume(&mesh);
    for (int32_t v = 0; v < view->vertex_count; v++) {
        for (int d = 0; d < 3; d++) {
            const double x = view->vertices[3 * (size_t)v + (size_t)d];
            if (v == 0 || x < facts.low[d]) facts.low[d] = x;
            if (v == 0 || x > facts.high[d]) facts.high[d] = x;
        }
        facts.source_count += view->source_index[v] >= 0;
    }
    return facts;
}

pliant_detail_facts pliant_description_detail(const pliant_model_view *view)
{
    double sum = 0, tangential_sum = 0, largest = 0, tangential_largest = 0;
    for (int32_t v = 0; v < view->detail_vertex_count; v++) {
        const float *o = view->detail_offset + 3 * (size_t)v;
        const double x = (double)o[0], y = (double)o[1], z = (double)o[2];
        const double tangential = x * x + y * y, square = tangential + z * z;
        sum += square;
        tangential_sum += tangential;
        if (square > largest) largest = square;
        if (tangential > tangential_largest) tangential_largest = tangential;
    }
    const double count = view->detail_vertex_count > 0 ? view->detail_vertex_count : 1;
    return (pliant_detail_facts){
        .rms = sqrt(sum / count),
        .largest = sqrt(largest),
        .tangential_rms = sqrt(tangential_sum / count),
        .tangential_largest = sqrt(tangential_largest),
    };
}

int32_t pliant_description_level_faces(const pliant_model_view *view, int32_t level)
{
    return view->face_count >> 2 * (view->level_count - 1 - level);
}

uint64_t pliant_description_level_bytes(const pliant_greens_view *greens)
{
    return ((uint64_t)greens->column_count + 1) * sizeof *greens->column_offset +
           greens->nnz * (sizeof *greens->row + 9 * sizeof *greens->block);
}

// 1.23 MB: three digits and a unit.
static void write_bytes(uint64_t bytes, char text[16])
{
    static const char *const units[] = {"B", "kB", "MB", "GB", "TB"};
    double value = (double)bytes;
    int unit = 0;
    for (; value >= 999.5 && unit < 4; unit++) value /= 1000;
    const int decimals = unit == 0 || value >= 99.95 ? 0 : value >= 9.995 ? 1 : 2;
    snprintf(text, 16, "%.*f %s", decimals, value, units[unit]);
}

// Text that may come from a file which was not bound: what a terminal should not see becomes "?".
static void print_text(const char *text, size_t length, FILE *stream)
{
    for (size_t i = 0; i < length;) {
        const int size = pliant_utf8_character(text + i, length - i);
        const unsigned char c = (unsigned char)text[i];
        // C1 controls are U+0080 to U+009F.
        const int control =
            c < 0x20 || c == 0x7f || (size == 2 && c == 0xc2 && (unsigned char)text[i + 1] < 0xa0);
        if (size == 0 || control) fputc('?', stream);
        else fwrite(text + i, 1, (size_t)size, stream);
        i += size > 0 ? (size_t)size : 1;
    }
}

static void print_mesh(const pliant_model_view *v, FILE *stream)
{
    const pliant_mesh_facts facts = pliant_description_mesh(v);
    fprintf(stream, "mesh        %d vertices, %d faces, %d level%s\n", (int)v->vertex_count,
            (int)v->face_count, (int)v->level_count, v->level_count == 1 ? "" : "s");
    for (int32_t l = 0; l < v->level_count; l++)
        fprintf(stream, "            level %-2d  %8d vertices  %9d faces\n", (int)l,
                (int)v->level_vertex_count[l], (int)pliant_description_level_faces(v, l));
    fprintf(stream, "            from (%g, %g, %g) to (%g, %g, %g), volume %g\n", facts.low[0],
            facts.low[1], facts.low[2], facts.high[0], facts.high[1], facts.high[2], facts.volume);
    fprintf(stream, "            %d vertices of the input, %d made by subdivision\n",
            (int)facts.source_count, (int)(v->vertex_count - facts.source_count));
    fprintf(stream, "material    Young's modulus %g, Poisson's ratio %g, density %g\n",
            v->material[0], v->material[1], v->material[2]);
    if (v->has_greens)
        fprintf(stream, "domains     %d free, %d fixed\n", (int)v->free_count, (int)v->fixed_count);
}

static void print_detail(const pliant_model_view *v, FILE *stream)
{
    if (v->detail_steps == 0) return;
    const pliant_detail_facts facts = pliant_description_detail(v);
    fprintf(stream, "detail      %d vertices, %lld faces, %d step%s finer than level %d\n",
            (int)v->detail_vertex_count, (long long)v->face_count << 2 * v->detail_steps,
            (int)v->detail_steps, v->detail_steps == 1 ? "" : "s", (int)v->level_count - 1);
    fprintf(stream,
            "            offsets %.3g (RMS), %.3g (largest); tangential part %.3g, %.3g\n",
            facts.rms, facts.largest, facts.tangential_rms, facts.tangential_largest);
}

static void print_level(const pliant_model_view *v, pliant_block_name block, int32_t level, FILE *stream)
{
    const pliant_greens_view *g = &v->greens[block][level];
    const double *s = g->summary;
    char eps[32] = "targets", smallest[32] = "-", size[16];
    if (s[PLIANT_SUMMARY_EPS] != 0) snprintf(eps, sizeof eps, "%g", s[PLIANT_SUMMARY_EPS]);
    if (s[PLIANT_SUMMARY_DEFINITE] != 0)
        snprintf(smallest, sizeof smallest, "%.3g", s[PLIANT_SUMMARY_DEFINITE]);
    write_bytes(pliant_description_level_bytes(g), size);
    fprintf(stream,
            "            %-11s  %5d  %8d  %7d  %9" PRIu64
            "  %7s  %6.3gx  %7s  %7.3g  %7.3g  %8s  %s, %s, %s\n",
            pliant_block_text(block), (int)level, (int)v->level_vertex_count[level], (int)g->column_count,
            g->nnz, size, s[PLIANT_SUMMARY_FACTOR], eps, s[PLIANT_SUMMARY_RMS], s[PLIANT_SUMMARY_MAX], smallest,
            s[PLIANT_SUMMARY_WAVELET] == PLIANT_BUTTERFLY ? "butterfly" : "linear",
            s[PLIANT_SUMMARY_LIFTED] == PLIANT_LIFTED ? "lifted" : "unlifted",
            s[PLIANT_SUMMARY_BOUNDARY] == PLIANT_DROP ? "drop" : "zero");
}

static void print_greens(const pliant_model_view *v, FILE *stream)
{
    if (!v->has_greens) return;
    fprintf(stream, "%-12s%-11s  %5s  %8s  %7s  %9s  %7s  %7s  %7s  %7s  %7s  %8s  %s\n", "greens",
            "block", "level", "vertices", "columns", "stored", "size", "factor", "eps", "rms", "max",
            "smallest", "wavelet");
    for (pliant_block_name block = PLIANT_FREE_FREE; block < PLIANT_BLOCK_COUNT; block++)
        for (int32_t level = 0; level < v->level_count; level++)
            if (v->greens[block][level].column_offset)
                print_level(v, block, level, stream);
    fprintf(stream, "gravity     free%s\n", v->gravity_fixed ? ", fixed" : "");
}

static void print_dense(const pliant_dense_view *v, FILE *stream)
{
    fprintf(stream, "nodes       %d free", (int)v->free_count);
    if (v->has_supports) fprintf(stream, ", %d fixed", (int)v->fixed_count);
    fprintf(stream, "\nmatrices    free-free %d x %d", 3 * (int)v->free_count,
            3 * (int)v->free_count);
    if (v->has_supports) fputs(", free-fixed, fixed-free, fixed-fixed", stream);
    fprintf(stream, "\ngravity     free%s\n", v->has_supports ? ", fixed" : "");
}

static void print_sections(const pliant_reader *reader, FILE *stream)
{
    for (int32_t i = 0; i < pliant_reader_section_count(reader); i++) {
        const pliant_section *s = pliant_reader_section(reader, i);
        fprintf(stream, "%-12s%s %s [", i == 0 ? "sections" : "", s->path,
                pliant_section_type_text(s->type));
        for (int32_t d = 0; d < s->rank; d++)
            fprintf(stream, "%s%" PRIu64, d ? ", " : "", s->shape[d]);
        fputs("]\n", stream);
    }
}

static void print_provenance(const pliant_contents *contents, FILE *stream)
{
    pliant_contents_pair pair;
    const char *title = "provenance";
    for (size_t at = 0; pliant_contents_next_pair(contents, &at, &pair); title = "") {
        fprintf(stream, "%-12s", title);
        print_text(pair.key, pair.key_bytes, stream);
        if (pair.key_bytes > 0) fputs(" = ", stream);
        print_text(pair.value, pair.value_bytes, stream);
        fputc('\n', stream);
    }
}

void pliant_description_print_verified(const pliant_contents *contents, const pliant_definiteness *verified,
                                       FILE *stream)
{
    const int has_lattice = contents->model.lattice_cell_count > 0;
    const char *looked_at = has_lattice                               ? ", indices, levels and lattice"
                            : contents->kind == PLIANT_CONTENTS_MODEL ? ", indices and levels"
                            : contents->kind == PLIANT_CONTENTS_DENSE ? " and indices"
                                                                      : "";
    fprintf(stream, "verified: %" PRId32 " sections, %" PRIu64 " bytes: checksums%s\n",
            pliant_reader_section_count(contents->reader), pliant_reader_size(contents->reader), looked_at);
    for (int32_t l = 0; contents->kind == PLIANT_CONTENTS_MODEL && l < contents->model.level_count; l++) {
        const pliant_lanczos_result *level = &verified->levels[l];
        if (level->steps == 0) continue;
        const double stored = contents->model.greens[PLIANT_FREE_FREE][l].summary[PLIANT_SUMMARY_DEFINITE];
        fprintf(stream, "contact compliance, level %d: smallest eigenvalue ratio %.3g (%.6g of %.6g%s)\n", (int)l,
                pliant_definiteness_ratio(level), level->smallest, level->largest,
                stored != 0 ? ", as stored" : "");
    }
}

void pliant_description_print(const pliant_contents *contents, FILE *stream)
{
    static const char *const titles[] = {
        [PLIANT_CONTENTS_MODEL] = "Pliant model",
        [PLIANT_CONTENTS_DENSE] = "dense Green's functions",
        [PLIANT_CONTENTS_RECORDING] = "recording of pliant-play",
        [PLIANT_CONTENTS_OTHER] = "Pliant file of an unknown kind",
    };
    const char *name = pliant_reader_name(contents->reader);
    char size[16];
    print_text(name, strlen(name), stream);
    fprintf(stream, ": %s, format version %d, ", titles[contents->kind],
            (int)pliant_reader_version(contents->reader));
    write_bytes(pliant_reader_size(contents->reader), size);
    fprintf(stream, "%s\n", size);
    if (contents->kind == PLIANT_CONTENTS_MODEL) {
        print_mesh(&contents->model, stream);
        print_detail(&contents->model, stream);
        pliant_lattice_facts_print(&contents->model, stream);
        print_greens(&contents->model, stream);
    } else if (contents->kind == PLIANT_CONTENTS_DENSE) {
        print_dense(&contents->dense, stream);
    } else {
        print_sections(contents->reader, stream);
    }
    print_provenance(contents, stream);
}
