// main.c: pliant-info, what is in a model file, is it sound, and its mesh for other programs.
#include "contents.h"
#include "description.h"
#include "lattice_facts.h"
#include "mesh_export.h"
#include "options.h"

#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>

enum { EXIT_DONE = 0, EXIT_FAILED = 1, EXIT_MISUSED = 2 };

static int refuse(int status, const pliant_error *err)
{
    fprintf(stderr, "pliant-info: %s\n", err->text);
    return status;
}

static int run(const pliant_info_options *options)
{
    pliant_error err = {""};
    pliant_contents contents;
    if (pliant_contents_open(options->path, &contents, &err) < 0) return refuse(EXIT_FAILED, &err);
    int status = EXIT_DONE;
    pliant_definiteness definiteness = {.levels = {{.steps = 0}}};
    if (options->verify && pliant_contents_verify(&contents, &err) < 0) status = EXIT_FAILED;
    if (options->verify && status == EXIT_DONE && contents.kind == PLIANT_CONTENTS_MODEL &&
        (pliant_lattice_facts_verify(&contents, &err) < 0 ||
         pliant_definiteness_measure(&contents, &definiteness, &err) < 0))
        status = EXIT_FAILED;
    if (status == EXIT_DONE && options->output) {
        const pliant_status done =
            options->detail
                ? pliant_mesh_export_detail(&contents, options->output, &err)
                : pliant_mesh_export(&contents, options->output, options->level, &err);
        if (done < 0) status = done == PLIANT_ERR_ARGUMENT ? EXIT_MISUSED : EXIT_FAILED;
    }
    if (status != EXIT_DONE) refuse(status, &err);
    else if (options->json)
        pliant_description_print_json(&contents, options->verify ? &definiteness : NULL, stdout);
    else if (options->verify) pliant_description_print_verified(&contents, &definiteness, stdout);
    else if (!options->output) pliant_description_print(&contents, stdout);
    pliant_contents_close(&contents);
    return status;
}

// A full disk or a closed pipe often shows only now.
static int finish(int status)
{
    const int failed = ferror(stdout);
    errno = 0;
    if ((fclose(stdout) == 0 && !failed) || status != EXIT_DONE) return status;
    fprintf(stderr, "pliant-info: standard output: %s\n",
            errno ? strerror(errno) : "cannot be written");
    return EXIT_FAILED;
}

int main(int argc, char **argv)
{
    pliant_info_options options;
    pliant_error err = {""};
    signal(SIGPIPE, SIG_IGN);  // a closed pipe is a write error like others
    if (pliant_info_options_parse(argc, argv, &options, &err) < 0) {
        fprintf(stderr, "pliant-info: %s\n", err.text);
        return EXIT_MISUSED;
    }
    if (options.help) {
        fputs(pliant_info_options_help(), stdout);
        return finish(EXIT_DONE);
    }
    if (options.version) {
        puts("pliant-info " PLIANT_VERSION_TEXT);
        return finish(EXIT_DONE);
    }
    return finish(run(&options));
}
