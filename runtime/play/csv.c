// csv.c: one row of comma-separated values per step.
#include "csv.h"

#include "output.h"

#include "pliant/error.h"

#include <stdlib.h>
#include <string.h>

struct pliant_csv {
    pliant_output *output;
    int has_header;
};

pliant_status pliant_csv_open(const char *path, pliant_csv **csv, pliant_error *err)
{
    pliant_csv *c = calloc(1, sizeof *c);
    if (!c) return pliant_error_set(err, PLIANT_ERR_MEMORY, "%s: no memory", path);
    const pliant_status status = pliant_output_open(path, &c->output, err);
    if (status < 0) {
        free(c);
        return status;
    }
    *csv = c;
    return PLIANT_OK;
}

// RFC 4180: a field with a comma or a quote is quoted, its quotes doubled.
static void put_field(FILE *stream, const char *name, const char *ending)
{
    if (!strpbrk(name, ",\"")) {
        fprintf(stream, ",%s%s", name, ending);
        return;
    }
    fputs(",\"", stream);
    for (const char *c = name; *c; c++) fprintf(stream, *c == '"' ? "\"%c" : "%c", *c);
    fprintf(stream, "%s\"", ending);
}

static void put_header(pliant_csv *csv, const pliant_player *player)
{
    FILE *stream = pliant_output_stream(csv->output);
    fputs("step,time,solve_us,constraints,level", stream);
    int32_t count;
    const pliant_probe *probes = pliant_player_probes(player, &count);
    for (int32_t i = 0; i < count; i++) {
        put_field(stream, probes[i].name, ".x");
        put_field(stream, probes[i].name, ".y");
        put_field(stream, probes[i].name, ".z");
    }
    fputs(",force.x,force.y,force.z\n", stream);
    csv->has_header = 1;
}

pliant_status pliant_csv_add(pliant_csv *csv, const pliant_player *player, const pliant_step *step,
                             pliant_error *err)
{
    if (!csv->has_header) put_header(csv, player);
    FILE *stream = pliant_output_stream(csv->output);
    fprintf(stream, "%lld,%.12g,%.3f,%d,%d", (long long)step->number, step->time,
            (double)step->total_ns * 1e-3, (int)step->report.constraint_count,
            (int)step->report.level);
    int32_t count;
    const pliant_probe *probes = pliant_player_probes(player, &count);
    // Nine digits bring back the same float.
    for (int32_t i = 0; i < count; i++)
        fprintf(stream, ",%.9g,%.9g,%.9g", (double)probes[i].u.x, (double)probes[i].u.y,
                (double)probes[i].u.z);
    fprintf(stream, ",%.9g,%.9g,%.9g\n", (double)step->force.x, (double)step->force.y,
            (double)step->force.z);
    return pliant_output_check(csv->output, err);
}

pliant_status pliant_csv_commit(pliant_csv *csv, const pliant_player *player, pliant_error *err)
{
    if (!csv->has_header) put_header(csv, player);
    const pliant_status status = pliant_output_commit(csv->output, err);
    free(csv);
    return status;
}

void pliant_csv_abandon(pliant_csv *csv)
{
    if (!csv) return;
    pliant_output_abandon(csv->output);
    free(csv);
}
