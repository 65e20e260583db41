// report.c: what a played script has to say, as text.
#include "report.h"

#include <string.h>

static void write_timings(const pliant_timings *timings, FILE *stream)
{
    fprintf(stream, "%-14s %12s %12s %12s\n", "phase", "median us", "99% us", "worst us");
    for (int p = 0; p < pliant_phase_count(timings->kind); p++) {
        const pliant_histogram *h = &timings->phases[p];
        fprintf(stream, "%-14s %12.1f %12.1f %12.1f\n", pliant_phase_name(timings->kind, p),
                1e-3 * pliant_histogram_percentile(h, 0.5),
                1e-3 * pliant_histogram_percentile(h, 0.99),
                1e-3 * pliant_histogram_percentile(h, 1));
    }
}

static void write_deadline(const pliant_report *report, FILE *stream)
{
    // Of warm-up, too: a miss is a miss.
    pliant_punctuality p = report->result->timings->punctuality;
    pliant_punctuality_merge(&p, &report->result->warm_up->punctuality);
    if (p.given_count == 0) return;
    fprintf(stream, "deadline %.9g", 1e-3 * (double)p.least_given);
    if (p.most_given > p.least_given) fprintf(stream, " to %.9g", 1e-3 * (double)p.most_given);
    fprintf(stream,
            " us: %lld of %lld steps missed it: %lld solved on a coarser level, %lld solved too "
            "late, worst lateness %.1f us\n",
            (long long)p.missed_count, (long long)p.given_count, (long long)p.coarser_count,
            (long long)p.overrun_count, 1e-3 * (double)p.worst_lateness_ns);
    fprintf(stream, "steps by constraint level:");
    for (int l = 0; l < report->info->level_count; l++)
        fprintf(stream, "%s %lld on %d", l ? "," : "", (long long)p.level_counts[l], l);
    fprintf(stream, "\n");
}

// What a prop did besides its force: how many nodes carry it, or whether it touches; and what its
// `error` is.
static void write_prop(const pliant_prop *prop, FILE *stream)
{
    switch (prop->kind) {
    case PLIANT_PROP_PATCH:
        fprintf(stream, "nodes %d error %.3g", (int)prop->node_count, prop->error);
        break;
    case PLIANT_PROP_TOOL:
        fprintf(stream, "nodes %d penetration %.3g", (int)prop->node_count, prop->error);
        break;
    case PLIANT_PROP_PROXY:
        fprintf(stream, "contact %d depth %.3g", (int)prop->node_count, prop->error);
        break;
    }
}

static void write_props(const pliant_player *player, int width, FILE *stream)
{
    int32_t count;
    const pliant_prop *list = pliant_props_list(pliant_player_props(player), &count);
    for (int32_t i = 0; i < count; i++) {
        const pliant_prop *prop = &list[i];
        if (!prop->is_present) continue;
        const pliant_vec3 f = prop->force;
        fprintf(stream, "%-*s %8s %13.6g %13.6g %13.6g  ", width, prop->name,
                pliant_prop_kind_name(prop->kind), (double)f.x, (double)f.y, (double)f.z);
        write_prop(prop, stream);
        fputc('\n', stream);
    }
}

// "812", or "812/3" of an instance.
static const char *place_of(const pliant_player *player, const pliant_probe *probe, char text[32])
{
    const pliant_scene *scene = pliant_player_scene(player);
    if (scene && pliant_instances_count(pliant_scene_instances(scene)) > 1)
        snprintf(text, 32, "%d/%d", (int)probe->instance, (int)probe->vertex);
    else snprintf(text, 32, "%d", (int)probe->vertex);
    return text;
}

static int widest_name(const pliant_player *player)
{
    size_t width = strlen("contact force");
    int32_t count;
    const pliant_probe *probes = pliant_player_probes(player, &count);
    for (int32_t i = 0; i < count; i++)
        if (strlen(probes[i].name) > width) width = strlen(probes[i].name);
    const pliant_prop *list = pliant_props_list(pliant_player_props(player), &count);
    for (int32_t i = 0; i < count; i++)
        if (list[i].is_present && strlen(list[i].name) > width) width = strlen(list[i].name);
    return (int)width;
}

static void write_probes(const pliant_player *player, FILE *stream)
{
    int32_t count;
    const pliant_probe *probes = pliant_player_probes(player, &count);
    const int width = widest_name(player);
    fprintf(stream, "%-*s %8s %13s %13s %13s\n", width, "last step", "vertex", "x", "y", "z");
    for (int32_t i = 0; i < count; i++) {
        char place[32];
        fprintf(stream, "%-*s %8s ", width, probes[i].name, place_of(player, &probes[i], place));
        // Declared after the last step, on a level that was not reconstructed.
        if (probes[i].step == 0) fprintf(stream, "%13s %13s %13s\n", "-", "-", "-");
        else
            fprintf(stream, "%13.6g %13.6g %13.6g\n", (double)probes[i].u.x, (double)probes[i].u.y,
                    (double)probes[i].u.z);
    }
    const pliant_vec3 f = pliant_player_last(player)->force;
    fprintf(stream, "%-*s %8s %13.6g %13.6g %13.6g\n", width, "contact force", "", (double)f.x,
            (double)f.y, (double)f.z);
    write_props(player, width, stream);
}

void pliant_report_write_compare(const pliant_compare_summary *compare, FILE *stream)
{
    fprintf(stream, "against the dense solution, %lld steps:\n", (long long)compare->step_count);
    fprintf(stream, "RMS difference   %.3g over all steps, worst %.3g at step %lld\n", compare->rms,
            compare->rms_worst, (long long)compare->rms_step);
    fprintf(stream, "MAX difference   worst %.3g at step %lld\n", compare->max_worst,
            (long long)compare->max_step);
    fprintf(stream, "force difference worst %.3g at step %lld\n", compare->force_worst,
            (long long)compare->force_step);
}

void pliant_report_write(const pliant_report *report, FILE *stream)
{
    const pliant_crew_result *result = report->result;
    const pliant_player *player = result->player;
    const int64_t steps = pliant_player_last(player)->number;
    fprintf(stream, "%s on %s: %lld %s", report->script, report->model, (long long)steps,
            steps == 1 ? "step" : "steps");
    if (steps == 0) {
        fprintf(stream, ": nothing was solved\n");
        return;
    }
    const int most = result->timings->most_constraints;
    const pliant_scene *scene = pliant_player_scene(player);
    if (scene) {
        const pliant_instances *instances = pliant_scene_instances(scene);
        const int count = pliant_instances_count(instances);
        fprintf(stream, ", %d %s of %d particles and %d vertices, up to %d particles held\n", count,
                count == 1 ? "instance" : "instances",
                (int)pliant_instances_particle_count(instances),
                (int)pliant_instances_vertex_count(instances), most);
        if (report->threads > 1) fprintf(stream, "%d threads\n", (int)report->threads);
    } else
        fprintf(stream, ", up to %d %s, surface of %d of %d vertices (level %d of 0..%d)\n", most,
                most == 1 ? "constraint" : "constraints", (int)pliant_player_surface_count(player),
                (int)report->info->vertex_count, (int)pliant_player_level(player),
                (int)report->info->level_count - 1);
    if (scene && report->repeat > 1)
        fprintf(stream, "%d passes: %lld steps in %.3f s, %.0f steps/s\n", (int)report->repeat,
                (long long)result->step_count, result->seconds,
                (double)result->step_count / result->seconds);
    else if (!scene && (report->threads > 1 || report->repeat > 1))
        fprintf(stream, "%d %s x %d %s: %lld steps in %.3f s, %.0f steps/s\n", (int)report->threads,
                report->threads == 1 ? "solver" : "solvers at once", (int)report->repeat,
                report->repeat == 1 ? "pass" : "passes", (long long)result->step_count,
                result->seconds, (double)result->step_count / result->seconds);
    fprintf(stream, "\n");
    write_timings(result->timings, stream);
    if (report->repeat > 1) {
        const pliant_timings *first = result->warm_up;
        const pliant_histogram *h = &first->phases[pliant_phase_count(first->kind) - 1];
        fprintf(stream, "%-14s %12.1f %12.1f %12.1f\n", "first passes",
                1e-3 * pliant_histogram_percentile(h, 0.5),
                1e-3 * pliant_histogram_percentile(h, 0.99),
                1e-3 * pliant_histogram_percentile(h, 1));
    }
    write_deadline(report, stream);
    fprintf(stream, "\n");
    write_probes(player, stream);
    if (report->compare) {
        fprintf(stream, "\n");
        pliant_report_write_compare(report->compare, stream);
    }
}

void pliant_report_write_step(const pliant_player *player, const pliant_step *step, FILE *stream)
{
    fprintf(stream, "step %lld time %.9g us %.1f constraints %d level %d", (long long)step->number,
            step->time, (double)step->total_ns * 1e-3, (int)step->report.constraint_count,
            (int)step->report.level);
    int32_t count;
    const pliant_probe *probes = pliant_player_probes(player, &count);
    for (int32_t i = 0; i < count; i++)
        fprintf(stream, " %s %.6g %.6g %.6g", probes[i].name, (double)probes[i].u.x,
                (double)probes[i].u.y, (double)probes[i].u.z);
    fprintf(stream, " force %.6g %.6g %.6g", (double)step->force.x, (double)step->force.y,
            (double)step->force.z);
    const pliant_prop *list = pliant_props_list(pliant_player_props(player), &count);
    for (int32_t i = 0; i < count; i++) {
        if (!list[i].is_present) continue;
        const pliant_vec3 f = list[i].force;
        fprintf(stream, " %s %s %.6g %.6g %.6g ", pliant_prop_kind_name(list[i].kind), list[i].name,
                (double)f.x, (double)f.y, (double)f.z);
        write_prop(&list[i], stream);
    }
    if (step->report.is_late || step->report.lateness_ns > 0)
        fprintf(stream, " late %.1f", 1e-3 * (double)step->report.lateness_ns);
    fprintf(stream, "\n");
}

void pliant_report_write_expectation(const pliant_expectation *expectation, FILE *stream)
{
    if (expectation->met) {
        fprintf(stream, "ok\n");
        return;
    }
    const pliant_vec3 u = expectation->probe->u;
    const double *e = expectation->expected;
    fprintf(stream,
            "failed: %s: found %.6g %.6g %.6g, expected %.6g %.6g %.6g: distance %.6g, tolerance "
            "%.6g\n",
            expectation->probe->name, (double)u.x, (double)u.y, (double)u.z, e[0], e[1], e[2],
            expectation->distance, expectation->tolerance);
}
