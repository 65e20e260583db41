// main.c: pliant-play, plays contact scripts on precomputed models.
#include "crew.h"
#include "options.h"
#include "outputs.h"
#include "report.h"

#include "pliant/error.h"

#include <signal.h>
#include <stdio.h>
#include <string.h>

enum { DONE = 0, FAILED = 1, MISUSED = 2 };
enum { WORLD_THREAD_LIMIT = 64 };  // pliant_world_def.thread_count

static int complain(const pliant_error *err, int status)
{
    fprintf(stderr, "pliant-play: %s\n", err->text);
    return status;
}

static int print(const char *const *parts)
{
    int status = 0;
    while (*parts && status >= 0) status = fputs(*parts++, stdout);
    if (status >= 0 && fflush(stdout) == 0) return DONE;
    perror("pliant-play: standard output");
    return FAILED;
}

static void warn_of_rough(const pliant_crew_result *result)
{
    const int64_t rough = result->timings->rough_count + result->warm_up->rough_count;
    if (rough == 0) return;
    fprintf(stderr,
            "pliant-play: %lld of %lld steps: the compressed capacitance matrix was not positive "
            "definite, contact forces are unreliable there; precompute the model with a smaller "
            "--max, or touch fewer vertices\n",
            (long long)rough, (long long)result->step_count);
}

// The table, or the JSON object; after standard input only what was not said line by line.
static void write_end(const pliant_play_options *options, const pliant_report *report)
{
    if (options->json) pliant_report_write_json(report, stdout);
    else if (strcmp(options->script, "-") != 0) {
        if (!options->quiet) pliant_report_write(report, stdout);
        else if (report->compare) pliant_report_write_compare(report->compare, stdout);
    } else if (report->compare) pliant_report_write_compare(report->compare, stdout);
}

// What --threads means depends on the kind: of a lattice the threads of one world, of Green's
// functions players side by side.
static pliant_status share_threads(const pliant_play_options *options, const pliant_model *model,
                                   pliant_crew_def *def, pliant_error *err)
{
    // Without Green's functions no vertex is free or fixed.
    const pliant_model_info info = pliant_model_describe(model);
    const int has_greens = info.free_count + info.fixed_count > 0;
    int is_lattice = options->lattice || !has_greens;
    if (!is_lattice && options->threads > 1)
        is_lattice = pliant_script_family(options->script) == PLIANT_FAMILY_LATTICE;
    if (is_lattice && options->threads > WORLD_THREAD_LIMIT)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "--threads: expected at most %d for a lattice, found %d",
                                WORLD_THREAD_LIMIT, (int)options->threads);
    if (options->lattice) def->player.kind_rule = PLIANT_KIND_LATTICE;
    def->threads = is_lattice ? 1 : options->threads;
    def->player.thread_count = is_lattice ? options->threads : 1;
    return pliant_play_options_check_script(options, def->threads, err);
}

static pliant_crew_def define(const pliant_play_options *options, const pliant_model *model,
                              int32_t level)
{
    const int is_streaming = strcmp(options->script, "-") == 0;
    pliant_crew_def def = {
        .script = options->script,
        .player = pliant_player_default(model),
        .repeat = options->repeat,
    };
    def.player.script_name = is_streaming ? "standard input" : options->script;
    def.player.level = level;
    def.player.greens_option = pliant_play_options_of_greens(options);
    if (options->deadline_us >= 0) def.player.deadline_ns = (int64_t)options->deadline_us * 1000;
    if (options->passive) def.player.compliance = PLIANT_COMPLIANCE_PASSIVE;
    if (options->compare) def.player.prop_rule = PLIANT_PROPS_REFUSED;
    if (options->csv || (options->json && is_streaming))
        def.player.probe_rule = PLIANT_PROBES_FIRST;
    return def;
}

static pliant_status play(const pliant_play_options *options, const pliant_model *model,
                          pliant_crew_def *def, pliant_outputs *outputs, pliant_error *err)
{
    const pliant_model_info info = pliant_model_describe(model);
    const pliant_observer observer = pliant_outputs_observer(outputs);
    def->observer = &observer;
    pliant_crew_result result;
    pliant_status status = pliant_crew_play(model, def, &result, err);
    if (status >= 0) status = pliant_outputs_commit(outputs, result.player, err);
    if (status >= 0) {
        const pliant_report report = {
            .model = options->model,
            .script = def->player.script_name,
            .info = &info,
            .threads = options->threads,
            .repeat = options->repeat,
            .result = &result,
            .compare = pliant_outputs_compared(outputs),
        };
        write_end(options, &report);
        status = pliant_outputs_flush(outputs, err);
        if (status >= 0 && !options->quiet) warn_of_rough(&result);
    }
    pliant_crew_result_clear(&result);
    return status;
}

static int run(const pliant_play_options *options)
{
    pliant_error err;
    pliant_model *model = NULL;
    pliant_outputs *outputs = NULL;
    int pipe_closed = 0, exit_status = DONE;
    pliant_status status = pliant_model_open(options->model, &model, &err);
    if (status < 0) return complain(&err, FAILED);

    const int32_t finest = pliant_model_describe(model).level_count - 1;
    const int32_t level = options->level < 0 ? finest : options->level;
    if (level > finest) {
        pliant_error_set(&err, PLIANT_ERR_ARGUMENT,
                         "--lod: expected a number from 0 to %d, the levels of %.200s, found %d",
                         (int)finest, options->model, (int)level);
        exit_status = complain(&err, MISUSED);
        goto done;
    }
    pliant_crew_def def = define(options, model, level);
    if (share_threads(options, model, &def, &err) < 0) {
        exit_status = complain(&err, MISUSED);
        goto done;
    }
    if (options->verify) status = pliant_model_verify(model, &err);
    if (status >= 0) status = pliant_outputs_open(options, model, level, &outputs, &err);
    if (status >= 0) status = play(options, model, &def, outputs, &err);
    pipe_closed = outputs && pliant_outputs_pipe_closed(outputs);
    if (status < 0) exit_status = pipe_closed ? FAILED : complain(&err, FAILED);
    else if (pliant_outputs_refused_count(outputs) > 0) exit_status = FAILED;

done:
    pliant_outputs_destroy(outputs);
    pliant_model_close(model);
    if (pipe_closed) {
        // Nobody reads on: end as programs do by default, now that nothing is left behind.
        signal(SIGPIPE, SIG_DFL);
        raise(SIGPIPE);
    }
    return exit_status;
}

int main(int argc, char **argv)
{
    // A closed pipe and a file-size limit come back as errors of write, so that outputs are
    // cleaned.
    signal(SIGPIPE, SIG_IGN);
    signal(SIGXFSZ, SIG_IGN);
    pliant_error err;
    pliant_play_options options;
    pliant_play_request request;
    static const char *const version[] = {"pliant-play " PLIANT_VERSION_TEXT "\n", NULL};
    if (pliant_play_options_parse(argc, argv, &options, &request, &err) < 0)
        return complain(&err, MISUSED);
    switch (request) {
    case PLIANT_PLAY_HELP:
        return print(pliant_play_help);
    case PLIANT_PLAY_VERSION:
        return print(version);
    case PLIANT_PLAY_RUN:
        break;
    }
    return run(&options);
}
