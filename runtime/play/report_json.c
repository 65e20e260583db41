// report_json.c: what a played script has to say, as JSON: one object, one line.
#include "report.h"

#include <math.h>

// JSON knows no infinity and no NaN.
static void put_number(double value, FILE *stream)
{
    if (isfinite(value)) fprintf(stream, "%.9g", value);
    else fputs("null", stream);
}

static void put_text(const char *text, FILE *stream)
{
    fputc('"', stream);
    for (const unsigned char *c = (const unsigned char *)text; *c; c++) {
        if (*c == '"' || *c == '\\') fprintf(stream, "\\%c", *c);
        else if (*c < 0x20) fprintf(stream, "\\u%04x", *c);
        else fputc(*c, stream);
    }
    fputc('"', stream);
}

static void put_vector(double x, double y, double z, FILE *stream)
{
    fputc('[', stream);
    put_number(x, stream);
    fputc(',', stream);
    put_number(y, stream);
    fputc(',', stream);
    put_number(z, stream);
    fputc(']', stream);
}

static void put_vec3(pliant_vec3 v, FILE *stream)
{
    put_vector(v.x, v.y, v.z, stream);
}

static void put_phases(const pliant_timings *timings, FILE *stream)
{
    fputc('{', stream);
    for (int p = 0; p < pliant_phase_count(timings->kind); p++) {
        const pliant_histogram *h = &timings->phases[p];
        fprintf(stream, "%s\"%s\":{\"median\":%.3f,\"p99\":%.3f,\"worst\":%.3f,\"mean\":%.3f}",
                p ? "," : "", pliant_phase_name(timings->kind, p),
                1e-3 * pliant_histogram_percentile(h, 0.5),
                1e-3 * pliant_histogram_percentile(h, 0.99),
                1e-3 * pliant_histogram_percentile(h, 1),
                h->count ? 1e-3 * h->sum / (double)h->count : 0.0);
    }
    fputc('}', stream);
}

static void put_punctuality(const pliant_report *report, FILE *stream)
{
    // Of warm-up, too: a miss is a miss.
    pliant_punctuality p = report->result->timings->punctuality;
    pliant_punctuality_merge(&p, &report->result->warm_up->punctuality);
    fputs(",\"level_steps\":[", stream);
    for (int l = 0; l < report->info->level_count; l++)
        fprintf(stream, "%s%lld", l ? "," : "", (long long)p.level_counts[l]);
    fputc(']', stream);
    if (p.given_count == 0) return;
    fprintf(stream,
            ",\"deadline\":{\"us\":%.9g,\"us_least\":%.9g,\"steps\":%lld,\"misses\":%lld,"
            "\"coarser\":%lld,\"overruns\":%lld,"
            "\"worst_lateness_us\":%.3f}",
            1e-3 * (double)p.most_given, 1e-3 * (double)p.least_given, (long long)p.given_count,
            (long long)p.missed_count, (long long)p.coarser_count, (long long)p.overrun_count,
            1e-3 * (double)p.worst_lateness_ns);
}

static void put_instances(const pliant_instances *instances, int32_t threads, FILE *stream)
{
    const pliant_lattice_info info = pliant_lattice_describe(pliant_instances_lattice(instances));
    fprintf(stream,
            ",\"kind\":\"lattice\",\"instances\":%d,\"particles\":%d,\"half_width\":%d,"
            "\"regions\":%d,\"threads\":%d",
            (int)pliant_instances_count(instances), (int)info.particle_count, (int)info.half_width,
            (int)info.region_count, (int)threads);
}

static void put_worst(const char *name, double value, int64_t step, FILE *stream)
{
    fprintf(stream, ",\"%s\":", name);
    put_number(value, stream);
    fprintf(stream, ",\"%s_step\":%lld", name, (long long)step);
}

static void put_compare(const pliant_compare_summary *compare, FILE *stream)
{
    fprintf(stream, "{\"steps\":%lld,\"rms\":", (long long)compare->step_count);
    put_number(compare->rms, stream);
    put_worst("rms_worst", compare->rms_worst, compare->rms_step, stream);
    put_worst("max_worst", compare->max_worst, compare->max_step, stream);
    put_worst("force_worst", compare->force_worst, compare->force_step, stream);
    fputc('}', stream);
}

// ,"patches":{...},"tools":{...},"proxies":{...}: of those that are there, each by name.
static void put_props(const pliant_player *player, FILE *stream)
{
    static const struct {
        pliant_prop_kind kind;
        const char *name, *error;
    } groups[] = {
        {PLIANT_PROP_PATCH, "patches", "error"},
        {PLIANT_PROP_TOOL, "tools", "penetration"},
        {PLIANT_PROP_PROXY, "proxies", "depth"},
    };
    int32_t count;
    const pliant_prop *list = pliant_props_list(pliant_player_props(player), &count);
    for (size_t g = 0; g < sizeof groups / sizeof *groups; g++) {
        int is_any = 0;
        for (int32_t i = 0; i < count; i++) {
            const pliant_prop *prop = &list[i];
            if (!prop->is_present || prop->kind != groups[g].kind) continue;
            if (is_any) fputc(',', stream);
            else fprintf(stream, ",\"%s\":{", groups[g].name);
            is_any = 1;
            put_text(prop->name, stream);
            fputs(":{\"force\":", stream);
            put_vec3(prop->force, stream);
            if (prop->kind == PLIANT_PROP_PROXY)
                fprintf(stream, ",\"contact\":%s", prop->node_count ? "true" : "false");
            else fprintf(stream, ",\"nodes\":%d", (int)prop->node_count);
            fprintf(stream, ",\"%s\":", groups[g].error);
            put_number(prop->error, stream);
            fputc('}', stream);
        }
        if (is_any) fputc('}', stream);
    }
}

void pliant_report_write_json(const pliant_report *report, FILE *stream)
{
    const pliant_crew_result *result = report->result;
    const pliant_player *player = result->player;
    fputs("{\"model\":", stream);
    put_text(report->model, stream);
    fputs(",\"script\":", stream);
    put_text(report->script, stream);
    fprintf(stream,
            ",\"steps\":%lld,\"time\":%.12g,\"level\":%d,\"vertices\":%d,\"surface_vertices\":%d,"
            "\"constraints_most\":%d,\"rough_steps\":%lld,\"solvers\":%d,\"passes\":%d,"
            "\"steps_played\":%lld,\"seconds\":%.6f,\"steps_per_second\":",
            (long long)pliant_player_last(player)->number, pliant_player_last(player)->time,
            (int)pliant_player_level(player), (int)report->info->vertex_count,
            (int)pliant_player_surface_count(player), (int)result->timings->most_constraints,
            (long long)(result->timings->rough_count + result->warm_up->rough_count),
            pliant_player_scene(player) ? 1 : (int)report->threads, (int)report->repeat,
            (long long)result->step_count, result->seconds);
    put_number((double)result->step_count / result->seconds, stream);
    const pliant_scene *scene = pliant_player_scene(player);
    if (scene) put_instances(pliant_scene_instances(scene), report->threads, stream);
    fputs(",\"us\":", stream);
    put_phases(result->timings, stream);
    if (report->repeat > 1) {
        fputs(",\"first_passes_us\":", stream);
        put_phases(result->warm_up, stream);
    }
    fputs(",\"probes\":{", stream);
    int32_t count;
    const pliant_probe *probes = pliant_player_probes(player, &count);
    for (int32_t i = 0; i < count; i++) {
        if (i) fputc(',', stream);
        put_text(probes[i].name, stream);
        fprintf(stream, ":{\"vertex\":%d,", (int)probes[i].vertex);
        if (scene) fprintf(stream, "\"instance\":%d,", (int)probes[i].instance);
        fputs("\"displacement\":", stream);
        if (probes[i].step == 0) fputs("null", stream);
        else put_vec3(probes[i].u, stream);
        fputc('}', stream);
    }
    fputs("},\"force\":", stream);
    put_vec3(pliant_player_last(player)->force, stream);
    put_props(player, stream);
    if (!scene) put_punctuality(report, stream);
    if (report->compare) {
        fputs(",\"compare\":", stream);
        put_compare(report->compare, stream);
    }
    fputs("}\n", stream);
}

void pliant_report_write_step_json(const pliant_player *player, const pliant_step *step,
                                   FILE *stream)
{
    const pliant_solver_report *r = &step->report;
    fprintf(stream,
            "{\"step\":%lld,\"time\":%.12g,\"solve_us\":%.3f,\"constraints\":%d,\"level\":%d,"
            "\"rough\":%s,\"late\":%s,\"lateness_us\":%.3f,\"us\":{",
            (long long)step->number, step->time, 1e-3 * (double)step->total_ns,
            (int)r->constraint_count, (int)r->level,
            step->status == PLIANT_ROUGH ? "true" : "false", r->is_late ? "true" : "false",
            1e-3 * (double)r->lateness_ns);
    for (int p = 0; p < pliant_phase_count(step->kind); p++)
        fprintf(stream, "%s\"%s\":%.3f", p ? "," : "", pliant_phase_name(step->kind, p),
                1e-3 * (double)step->phase_ns[p]);
    fputs("},\"probes\":{", stream);
    int32_t count;
    const pliant_probe *probes = pliant_player_probes(player, &count);
    for (int32_t i = 0; i < count; i++) {
        if (i) fputc(',', stream);
        put_text(probes[i].name, stream);
        fputc(':', stream);
        put_vec3(probes[i].u, stream);
    }
    fputs("},\"force\":", stream);
    put_vec3(step->force, stream);
    put_props(player, stream);
    fputs("}\n", stream);
}

void pliant_report_write_expectation_json(const pliant_expectation *expectation, FILE *stream)
{
    fputs("{\"expect\":", stream);
    put_text(expectation->probe->name, stream);
    fprintf(stream, ",\"line\":%lld,\"met\":%s,\"found\":", (long long)expectation->line,
            expectation->met ? "true" : "false");
    put_vec3(expectation->probe->u, stream);
    fputs(",\"expected\":", stream);
    put_vector(expectation->expected[0], expectation->expected[1], expectation->expected[2],
               stream);
    fputs(",\"distance\":", stream);
    put_number(expectation->distance, stream);
    fputs(",\"tolerance\":", stream);
    put_number(expectation->tolerance, stream);
    fputs("}\n", stream);
}
