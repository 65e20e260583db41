// options.c: the command line of pliant-play.
#include "options.h"

#include "crew.h"

#include "pliant/error.h"
#include "pliant/option.h"

#include <getopt.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

enum long_only {
    OPTION_FRAMES = 256,
    OPTION_VTK,
    OPTION_FORCE,
    OPTION_LOD,
    OPTION_DEADLINE,
    OPTION_PASSIVE,
    OPTION_DETAIL,
    OPTION_REPEAT,
    OPTION_THREADS,
    OPTION_COMPARE,
    OPTION_JSON,
    OPTION_NO_VERIFY,
    OPTION_LATTICE,
    OPTION_PARTICLES,
    OPTION_EVERY,
    OPTION_VERSION,
};

static const struct option long_options[] = {
    {"output", required_argument, NULL, 'o'},
    {"frames", required_argument, NULL, OPTION_FRAMES},
    {"vtk", required_argument, NULL, OPTION_VTK},
    {"force", no_argument, NULL, OPTION_FORCE},
    {"lod", required_argument, NULL, OPTION_LOD},
    {"deadline-us", required_argument, NULL, OPTION_DEADLINE},
    {"passive", no_argument, NULL, OPTION_PASSIVE},
    {"detail", no_argument, NULL, OPTION_DETAIL},
    {"repeat", required_argument, NULL, OPTION_REPEAT},
    {"threads", required_argument, NULL, OPTION_THREADS},
    {"compare", required_argument, NULL, OPTION_COMPARE},
    {"json", no_argument, NULL, OPTION_JSON},
    {"no-verify", no_argument, NULL, OPTION_NO_VERIFY},
    {"lattice", no_argument, NULL, OPTION_LATTICE},
    {"particles", no_argument, NULL, OPTION_PARTICLES},
    {"every", required_argument, NULL, OPTION_EVERY},
    {"quiet", no_argument, NULL, 'q'},
    {"help", no_argument, NULL, 'h'},
    {"version", no_argument, NULL, OPTION_VERSION},
    {NULL, 0, NULL, 0},
};

static const int32_t repeat_limit = 1000000000;

static pliant_status parse_path(const char *option, const char *text, const char **path,
                                pliant_error *err)
{
    if (!*text)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT, "%s: expected a name, found nothing",
                                option);
    *path = text;
    return PLIANT_OK;
}

static pliant_status parse_option(int found, pliant_play_options *o, pliant_error *err)
{
    switch (found) {
    case 'o':
        return parse_path("-o", optarg, &o->csv, err);
    case OPTION_FRAMES:
#ifdef PLIANT_WITHOUT_HDF5
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "--frames: this pliant-play was built without HDF5");
#else
        return parse_path("--frames", optarg, &o->frames, err);
#endif
    case OPTION_VTK:
        return parse_path("--vtk", optarg, &o->vtk, err);
    case OPTION_FORCE:
        o->force = 1;
        return PLIANT_OK;
    case OPTION_LOD:
        // How many levels there are, the model will say.
        return pliant_option_integer("--lod", optarg, 0, INT32_MAX, &o->level, err);
    case OPTION_DEADLINE:
        return pliant_option_integer("--deadline-us", optarg, 0, PLIANT_SCRIPT_DEADLINE_LIMIT,
                                     &o->deadline_us, err);
    case OPTION_PASSIVE:
        o->passive = 1;
        return PLIANT_OK;
    case OPTION_DETAIL:
        o->detail = 1;
        return PLIANT_OK;
    case OPTION_REPEAT:
        return pliant_option_integer("--repeat", optarg, 1, repeat_limit, &o->repeat, err);
    case OPTION_THREADS:
        return pliant_option_integer("--threads", optarg, 1, PLIANT_CREW_LIMIT, &o->threads, err);
    case OPTION_COMPARE:
        return parse_path("--compare", optarg, &o->compare, err);
    case OPTION_JSON:
        o->json = 1;
        return PLIANT_OK;
    case OPTION_LATTICE:
        o->lattice = 1;
        return PLIANT_OK;
    case OPTION_PARTICLES:
        o->particles = 1;
        return PLIANT_OK;
    case OPTION_EVERY:
        return pliant_option_integer("--every", optarg, 1, INT32_MAX, &o->every, err);
    case OPTION_NO_VERIFY:
        o->verify = 0;
        return PLIANT_OK;
    case 'q':
        o->quiet = 1;
        return PLIANT_OK;
    default:
        return PLIANT_ERR_ARGUMENT;
    }
}

static int same_file(const char *a, const char *b)
{
    struct stat x, y;
    if (!a || !b) return 0;
    if (stat(a, &x) != 0 || stat(b, &y) != 0) return strcmp(a, b) == 0;
    // A device may well be named twice.
    return S_ISREG(x.st_mode) && x.st_dev == y.st_dev && x.st_ino == y.st_ino;
}

// An output must not replace an input, nor another output.
static pliant_status check_files(const pliant_play_options *o, pliant_error *err)
{
    const char *const inputs[] = {o->model, strcmp(o->script, "-") ? o->script : NULL, o->compare};
    const struct {
        const char *option, *path;
    } outputs[] = {{"-o", o->csv}, {"--frames", o->frames}};
    for (size_t i = 0; i < sizeof outputs / sizeof *outputs; i++)
        for (size_t k = 0; k < sizeof inputs / sizeof *inputs; k++)
            if (same_file(outputs[i].path, inputs[k]))
                return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                        "%s: expected a file of its own, found the input %.200s",
                                        outputs[i].option, inputs[k]);
    if (same_file(o->csv, o->frames))
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "-o and --frames: expected two files, found %.200s twice", o->csv);
    return PLIANT_OK;
}

// A script that is played more than once is opened more than once.
pliant_status pliant_play_options_check_script(const pliant_play_options *options, int32_t threads,
                                               pliant_error *err)
{
    if (options->repeat == 1 && threads == 1) return PLIANT_OK;
    const char *option = options->repeat > 1 ? "--repeat" : "--threads";
    struct stat found;
    if (strcmp(options->script, "-") == 0)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "%s: expected a script file, found standard input", option);
    if (stat(options->script, &found) == 0 && !S_ISREG(found.st_mode))
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "%s: expected a regular file as script, found %.200s", option,
                                options->script);
    return PLIANT_OK;
}

const char *pliant_play_options_of_greens(const pliant_play_options *options)
{
    if (options->level >= 0) return "--lod";
    if (options->deadline_us >= 0) return "--deadline-us";
    if (options->passive) return "--passive";
    if (options->detail) return "--detail";
    return options->compare ? "--compare" : NULL;
}

pliant_status pliant_play_options_parse(int argc, char **argv, pliant_play_options *options,
                                        pliant_play_request *request, pliant_error *err)
{
    pliant_play_options o = {.script = "-",
                             .level = -1,
                             .repeat = 1,
                             .threads = 1,
                             .deadline_us = -1,
                             .every = 1,
                             .verify = 1};
    opterr = 0;
    optind = 0;  // from the start, also the second time
    *request = PLIANT_PLAY_RUN;
    for (int found; (found = getopt_long(argc, argv, ":o:qh", long_options, NULL)) != -1;) {
        if (found == '?' || found == ':')
            return pliant_option_refuse(found, argc, argv, long_options, err);
        if (found == 'h' || found == OPTION_VERSION) {
            *request = found == 'h' ? PLIANT_PLAY_HELP : PLIANT_PLAY_VERSION;
            return PLIANT_OK;
        }
        const pliant_status status = parse_option(found, &o, err);
        if (status < 0) return status;
    }
    if (optind == argc)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "expected MODEL.h5 [SCRIPT], found nothing; see --help");
    o.model = argv[optind++];
    if (optind < argc) o.script = argv[optind++];
    if (optind < argc)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "expected MODEL.h5 [SCRIPT], found '%.60s' too; see --help",
                                argv[optind]);
    if (o.detail && !o.frames && !o.vtk)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "--detail: expected --frames or --vtk with it, found neither");
    if (o.particles && !o.vtk)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "--particles: expected --vtk with it, found none");
    const char *of_greens = pliant_play_options_of_greens(&o);
    if (o.lattice && of_greens)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "--lattice: expected no %s with it, which is about Green's "
                                "functions",
                                of_greens);
    // A lattice has its threads from one play; that is known when the model is.
    pliant_status status = pliant_play_options_check_script(&o, 1, err);
    if (status >= 0) status = check_files(&o, err);
    if (status >= 0) *options = o;
    return status;
}
