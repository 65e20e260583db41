// main.c: pliant-precompute: from a mesh to a file of compressed Green's functions.
#include "interruption.h"
#include "options.h"
#include "refusal.h"
#include "run.h"

#include "pliant/sections.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char program[] = "pliant-precompute";

enum { EXIT_DONE = 0, EXIT_FAILED = 1, EXIT_MISUSED = 2 };

static double factor(const pliant_compression_result *r)
{
    return r->kept ? (double)r->dense / (double)r->kept : 0;
}

static const char *filling_text(const pliant_lattice_summary *lattice)
{
    return lattice->filling == PLIANT_VOXELS_SOLID ? "solid" : "shell";
}

static void print_text_lattice(const pliant_lattice_summary *l)
{
    printf("  lattice      %d particles, %d cells of %.4g (%s), %d component%s, %.6g kg\n", l->particles, l->cells,
           l->cell_size, filling_text(l), l->components, l->components == 1 ? "" : "s", l->mass);
    printf("               %d regions of half-width %d, %d of them irregular; %d triangle batches\n", l->regions,
           l->half_width, l->irregular_regions, l->batches);
}

static void print_text_remesh(const pliant_remesh_report *r)
{
    printf("  remesh       %d base vertices, %d level%s above; %d tried; the aims are %s\n", r->base_vertices, r->levels,
           r->levels == 1 ? "" : "s", r->tried_count, r->met ? "met" : "missed");
    printf("               distance %.3f%% of the diagonal (original to mesh), %.3f%% (back); smallest angle %.1f degrees\n",
           100 * r->fit.there, 100 * r->fit.back, r->fit.smallest_angle);
    printf("               normals off by %.1f degrees (mean), %.1f (largest); folds up to %.0f degrees; %d flipped\n",
           r->fit.normal_mean, r->fit.normal_largest, r->fit.fold, r->fit.flipped_count);
}

static double rate(double flops, double seconds)
{
    return seconds > 0 ? flops / seconds / 1e9 : 0;
}

static void print_text(const pliant_options *options, const pliant_run_summary *s)
{
    const pliant_run_times *t = &s->times;
    printf("%s: %d vertices in %d level%s, ", options->output, s->vertex_count, s->level_count,
           s->level_count == 1 ? "" : "s");
    if (options->product == PLIANT_PRODUCT_MESH) {
        printf("%d faces, %.2f MB\n", s->face_count, s->file_bytes / 1e6);
        print_text_remesh(&s->remesh);
        printf("  seconds      remesh %.2f, write %.2f, total %.2f\n", t->read, t->write, t->total);
        return;
    }
    if (options->greens == PLIANT_GREENS_NONE) {
        printf("%d faces, %.2f MB\n", s->face_count, s->file_bytes / 1e6);
        print_text_lattice(&s->lattice);
        if (options->remeshing == PLIANT_REMESH_FIRST) print_text_remesh(&s->remesh);
        printf("  seconds      read %.2f, lattice %.2f, write %.2f, total %.2f\n", t->read, t->lattice, t->write,
               t->total);
        return;
    }
    printf("%d free, %d held, %.2f MB\n", s->free_count, s->fixed_count, s->file_bytes / 1e6);
    if (options->remeshing == PLIANT_REMESH_FIRST) print_text_remesh(&s->remesh);
    if (s->detail_steps > 0)
        printf("  detail       %d vertices, %d step%s finer; offsets %.3g (RMS), %.3g (largest), tangential part "
               "%.3g, %.3g\n",
               s->detail_vertex_count, s->detail_steps, s->detail_steps == 1 ? "" : "s", s->detail.rms,
               s->detail.largest, s->detail.tangential_rms, s->detail.tangential_largest);
    for (int b = 0; b < PLIANT_BLOCK_COUNT; b++)
        for (int32_t l = s->levels.first; l <= s->levels.last; l++) {
            const pliant_compression_result *r = &s->results[b][l].compression;
            if (r->dense == 0) continue;
            printf("  %-12s level %d, %d columns: %llu of %llu blocks kept, factor %.1f, RMS %.4f, MAX %.4f\n",
                   pliant_block_text((pliant_block_name)b), l, s->column_counts[b][l],
                   (unsigned long long)r->kept, (unsigned long long)r->dense, factor(r), r->rms, r->max);
        }
    if (options->lattice_cells > 0) print_text_lattice(&s->lattice);
    printf("  memory       planned %.3g GB, at most used %.3g GB\n", s->memory_bytes / 1e9,
           s->peak_memory_bytes / 1e9);
    if (s->factor_flops > 0)
        printf("  GFLOP/s      factor %.1f, solve %.1f\n", rate(s->factor_flops, t->factor),
               rate(s->solve_flops, t->solve));
    printf("  seconds      read %.2f, lattice %.2f, inside %.2f, assemble %.2f, factor %.2f, solve %.2f, transform %.2f, compress "
           "%.2f, write %.2f, total %.2f\n",
           t->read, t->lattice, t->inside, t->assemble, t->factor, t->solve, t->transform, t->compress, t->write, t->total);
}

static void print_json_text(const char *text)
{
    putchar('"');
    for (const unsigned char *c = (const unsigned char *)text; *c; c++) {
        if (*c == '"' || *c == '\\') printf("\\%c", *c);
        else if (*c < 0x20) printf("\\u%04x", *c);
        else putchar(*c);
    }
    putchar('"');
}

// What is known of one level of one block, without braces.
static void print_json_result(const pliant_greens_result *result)
{
    const pliant_compression_result *r = &result->compression;
    printf("\"kept\": %llu, \"dense\": %llu, \"factor\": %.6g, \"rms\": %.6g, \"max\": %.6g",
           (unsigned long long)r->kept, (unsigned long long)r->dense, factor(r), r->rms, r->max);
    if (result->largest_eigenvalue != 0)
        printf(", \"smallest_eigenvalue\": %.6g, \"largest_eigenvalue\": %.6g", result->smallest_eigenvalue,
               result->largest_eigenvalue);
}

// A block's numbers are those of its finest stored level; all its levels follow.
static void print_json_block(const pliant_run_summary *s, pliant_block_name block)
{
    printf("\"%s\": {", pliant_block_text(block));
    print_json_result(&s->results[block][s->levels.last]);
    printf(", \"levels\": [");
    for (int32_t l = s->levels.first; l <= s->levels.last; l++) {
        printf("%s{\"level\": %d, \"columns\": %d, ", l > s->levels.first ? ", " : "", l, s->column_counts[block][l]);
        print_json_result(&s->results[block][l]);
        printf("}");
    }
    printf("]}");
}

static void print_json_lattice(const pliant_lattice_summary *l)
{
    printf(", \"lattice\": {\"particles\": %d, \"cells\": %d, \"cell_size\": %.9g, \"dims\": [%d, %d, %d]"
           ", \"filling\": \"%s\", \"half_width\": %d, \"components\": %d, \"regions\": %d"
           ", \"irregular_regions\": %d, \"batches\": %d, \"mass\": %.9g}",
           l->particles, l->cells, l->cell_size, l->dims[0], l->dims[1], l->dims[2], filling_text(l), l->half_width,
           l->components, l->regions, l->irregular_regions, l->batches, l->mass);
}

static void print_json_remesh(const pliant_remesh_report *r)
{
    printf(", \"remesh\": {\"base_vertices\": %d, \"levels\": %d, \"tried\": %d, \"met\": %s, \"distance_there\": %.6g"
           ", \"distance_back\": %.6g, \"smallest_angle\": %.6g, \"normal_mean\": %.6g, \"normal_largest\": %.6g"
           ", \"fold\": %.6g, \"flipped\": %d}",
           r->base_vertices, r->levels, r->tried_count, r->met ? "true" : "false", r->fit.there, r->fit.back,
           r->fit.smallest_angle, r->fit.normal_mean, r->fit.normal_largest, r->fit.fold, r->fit.flipped_count);
}

static void print_json(const pliant_options *options, const pliant_run_summary *s)
{
    const pliant_run_times *t = &s->times;
    printf("{\"output\": ");
    print_json_text(options->output);
    printf(", \"vertices\": %d, \"faces\": %d, \"levels\": %d, \"components\": %d, \"ranks\": %d"
           ", \"volume\": %.9g, \"file_bytes\": %.0f",
           s->vertex_count, s->face_count, s->level_count, s->component_count, s->ranks, s->volume,
           s->file_bytes);
    if (options->lattice_cells > 0) print_json_lattice(&s->lattice);
    if (options->remeshing == PLIANT_REMESH_FIRST) print_json_remesh(&s->remesh);
    if (options->product == PLIANT_PRODUCT_MESH) {
        printf(", \"seconds\": {\"remesh\": %.3f, \"write\": %.3f, \"total\": %.3f}}\n", t->read, t->write, t->total);
        return;
    }
    if (options->greens == PLIANT_GREENS_NONE) {
        printf(", \"seconds\": {\"read\": %.3f, \"lattice\": %.3f, \"write\": %.3f, \"total\": %.3f}}\n",
               t->read, t->lattice, t->write, t->total);
        return;
    }
    printf(", \"free\": %d, \"fixed\": %d, \"solver\": \"%s\", \"groups\": %d, \"residual\": %.3g, \"memory_bytes\": %.0f"
           ", \"peak_memory_bytes\": %.0f, \"factor_flops\": %.6g, \"solve_flops\": %.6g",
           s->free_count, s->fixed_count, s->solver, s->groups, s->residual, s->memory_bytes,
           s->peak_memory_bytes, s->factor_flops, s->solve_flops);
    if (s->detail_steps > 0)
        printf(", \"detail\": {\"steps\": %d, \"vertices\": %d, \"rms\": %.6g, \"largest\": %.6g, "
               "\"tangential_rms\": %.6g, \"tangential_largest\": %.6g, \"least_sine\": %.3g}",
               s->detail_steps, s->detail_vertex_count, s->detail.rms, s->detail.largest,
               s->detail.tangential_rms, s->detail.tangential_largest, s->detail.least_sine);
    printf(", \"blocks\": {");
    for (int b = 0; b < PLIANT_BLOCK_COUNT; b++) {
        if (s->results[b][s->levels.last].compression.dense == 0) continue;
        if (b > 0) printf(", ");
        print_json_block(s, (pliant_block_name)b);
    }
    printf("}, \"seconds\": {\"read\": %.3f, \"lattice\": %.3f, \"inside\": %.3f, \"assemble\": %.3f, \"factor\": %.3f, \"solve\": %.3f, "
           "\"transform\": %.3f, \"compress\": %.3f, \"write\": %.3f, \"total\": %.3f}}\n",
           t->read, t->lattice, t->inside, t->assemble, t->factor, t->solve, t->transform, t->compress, t->write, t->total);
}

// The command line as one would type it again, on one line.
static char *join(int argc, char **argv)
{
    size_t size = 1;
    for (int i = 0; i < argc; i++) size += 4 * strlen(argv[i]) + 3;
    char *line = malloc(size), *end = line;
    if (!line) return NULL;
    for (int i = 0; i < argc; i++) {
        const char *text = i == 0 ? program : argv[i];
        const int plain = *text && !text[strcspn(text, " \t\n\"'\\$`<>|&;()*?[]#~!{}")];
        if (i > 0) *end++ = ' ';
        if (!plain) *end++ = '\'';
        for (; *text; text++) {
            if (*text == '\'') end += sprintf(end, "'\\''");
            else *end++ = *text == '\n' ? ' ' : *text;
        }
        if (!plain) *end++ = '\'';
    }
    *end = 0;
    return line;
}

static int run(int argc, char **argv, int rank)
{
    pliant_options options;
    pliant_options_action action;
    pliant_error err = {""};
    char *command_line = join(argc, argv);  // as typed: parsing moves the arguments about
    const pliant_status status = pliant_options_parse(argc, argv, &options, &action, &err);
    if (status < 0 || action != PLIANT_OPTIONS_RUN) free(command_line);
    if (status < 0) {
        if (rank == 0) fprintf(stderr, "%s: %s\n", program, err.text);
        return EXIT_MISUSED;
    }
    if (action != PLIANT_OPTIONS_RUN) {
        if (rank > 0) return EXIT_DONE;
        if (action == PLIANT_OPTIONS_VERSION) printf("%s %s\n", program, PLIANT_VERSION_TEXT);
        else for (const char *const *part = pliant_options_help; *part; part++) fputs(*part, stdout);
        return fflush(stdout) == 0 ? EXIT_DONE : EXIT_FAILED;
    }
    pliant_progress progress = pliant_progress_create(
        rank == 0 && options.talk == PLIANT_TALK_PROGRESS ? program : NULL);
    pliant_run_summary summary;
    const PetscErrorCode code = pliant_run(PETSC_COMM_WORLD, &options, command_line ? command_line : program,
                                           &progress, &summary, &err);
    free(command_line);
    if (code != 0 && code != PLIANT_REFUSED) MPI_Abort(PETSC_COMM_WORLD, EXIT_FAILED);
    const int failed = summary.signal    ? 128 + summary.signal
                       : summary.misused ? EXIT_MISUSED
                                         : EXIT_FAILED;
    if (rank > 0) return code ? failed : EXIT_DONE;
    if (code) {
        (void)pliant_progress_end(&progress);
        fprintf(stderr, "%s: %s\n", program, err.text);
        return failed;
    }
    if (summary.was_finished) {
        pliant_progress_note(&progress, "%s: was finished already", options.output);
        return EXIT_DONE;
    }
    if (options.reporting == PLIANT_REPORT_JSON) print_json(&options, &summary);
    else if (options.talk == PLIANT_TALK_PROGRESS) print_text(&options, &summary);
    if (fflush(stdout) == 0 && !ferror(stdout)) return EXIT_DONE;
    fprintf(stderr, "%s: cannot write the summary to standard output\n", program);
    return EXIT_FAILED;
}

int main(int argc, char **argv)
{
    // Our options are ours: PETSc's come through PETSC_OPTIONS.
    int none = 1;
    char **first = argv;
    if (PetscInitialize(&none, &first, NULL, NULL)) return EXIT_FAILED;
    if (pliant_refusal_install()) return EXIT_FAILED;
    int rank = 0;
    MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
    pliant_interruption_install(rank == 0 ? program : NULL);
    pliant_interruption_at_once("nothing is kept", NULL, NULL);
    const int status = run(argc, argv, rank);
    PetscFinalize();
    return status;
}
