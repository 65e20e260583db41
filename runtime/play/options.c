// options.c: the command line of pliant-play.
#include "options.h"

#include "crew.h"

#include "pliant/error.h"
#include "pliant/option.h"

#include <getopt.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

const char pliant_play_help[] =
    "usage: pliant-play [options] MODEL.h5 [SCRIPT]\n"
    "\n"
    "Plays a contact script on a model that pliant-precompute made. SCRIPT is a file;\n"
    "`-` or none is standard input, answered line by line: every step prints its line\n"
    "at once, expect prints ok or the failure, other statements print nothing. After a\n"
    "script file, a short table: timings by phase in microseconds, then the probes'\n"
    "displacements and the total contact force at the last step.\n"
    "\n"
    "  -o, --output FILE.csv   one row per step: step, time, solve_us, constraints,\n"
    "                          level, x y z of each probe's displacement, x y z of the\n"
    "                          total contact force\n"
    "      --frames FILE.h5    HDF5: displacement f4[steps,vertices,3], step, time,\n"
    "                          solve_us. Needs as much disk again while it plays\n"
    "      --vtk DIR           DIR/pliant.pvd and a .vtp per step, for ParaView: the\n"
    "                          deformed surface, displacement, traction. DIR is made\n"
    "                          when absent, refused when it holds another series\n"
    "      --force             write into DIR all the same; the other files stay\n"
    "      --lod L             reconstruct the surface up to level L only (0 coarsest).\n"
    "                          --frames and --vtk then hold the vertices of level L;\n"
    "                          probes and expect stay exact\n"
    "      --repeat N          play the whole script N times, each time with a new\n"
    "                          solver; timings are of all passes but the first, which\n"
    "                          the table gives apart. Outputs come from the first\n"
    "      --threads N         N solvers play the script at once on the shared model;\n"
    "                          timings are pooled, outputs come from the first\n"
    "      --compare DENSE.h5  solve every step with the dense matrices too (written by\n"
    "                          pliant-precompute --dense), and print the relative RMS\n"
    "                          and MAX differences\n"
    "      --json              JSON instead of text: one object at the end; from\n"
    "                          standard input also one per step and expect, a line each\n"
    "      --no-verify         do not verify the model's checksums at the start\n"
    "  -q, --quiet             print results only where an option asks for them\n"
    "  -h, --help              this text\n"
    "      --version           print the version\n"
    "\n"
    "solve_us and `total` are the whole step: from the state to the surface. Percentiles\n"
    "are within 0.4%. --repeat and --threads need a script that is a regular file. With\n"
    "-o, or --json from standard input, probes must be declared before the first step.\n"
    "\n"
    "The script: one statement a line, # comments; statements change the state, `step`\n"
    "solves. A VERTEX is K (the model's number), L:K (vertex K as a constraint of level\n"
    "L), source K (vertex K of the input mesh) or near X Y Z (the free vertex nearest to\n"
    "a rest position).\n"
    "\n"
    "  pliant-script 1               first statement: version of the language\n"
    "  probe NAME vertex VERTEX      report this vertex; also: probe NAME near X Y Z\n"
    "  displace VERTEX X Y Z         contact displacement at a free vertex\n"
    "  traction VERTEX X Y Z         force per area\n"
    "  force VERTEX X Y Z            force; traction = force / vertex area\n"
    "  support VERTEX X Y Z          displacement of a fixed vertex\n"
    "  gravity X Y Z                 acceleration\n"
    "  release VERTEX | release all  back to the reference condition; all: gravity too\n"
    "  dt SECONDS                    time that a step takes, 0.001 at the start\n"
    "  step [COUNT]                  solve now, or COUNT times\n"
    "  expect NAME X Y Z TOLERANCE   fail when the probe is further off at the last step\n"
    "\n"
    "A mistake or a failed expect ends the play (typed at a terminal: it is told, and\n"
    "the play goes on). A play that fails leaves no file under an output's name: what\n"
    "stood there before stays.\n"
    "\n"
    "Exit status: 0 done, 1 failed (broken file, failed expect, full disk), 2 misused.\n"
    "\n"
    "example:\n"
    "  printf 'pliant-script 1\\nprobe p vertex 812\\nforce 812 0 0 -3\\nstep\\n' |\n"
    "      pliant-play bunny.h5\n"
    "  pliant-play -o poke.csv --vtk poke bunny.h5 poke.script\n";

enum long_only {
    OPTION_FRAMES = 256,
    OPTION_VTK,
    OPTION_FORCE,
    OPTION_LOD,
    OPTION_REPEAT,
    OPTION_THREADS,
    OPTION_COMPARE,
    OPTION_JSON,
    OPTION_NO_VERIFY,
    OPTION_VERSION,
};

static const struct option long_options[] = {
    {"output", required_argument, NULL, 'o'},
    {"frames", required_argument, NULL, OPTION_FRAMES},
    {"vtk", required_argument, NULL, OPTION_VTK},
    {"force", no_argument, NULL, OPTION_FORCE},
    {"lod", required_argument, NULL, OPTION_LOD},
    {"repeat", required_argument, NULL, OPTION_REPEAT},
    {"threads", required_argument, NULL, OPTION_THREADS},
    {"compare", required_argument, NULL, OPTION_COMPARE},
    {"json", no_argument, NULL, OPTION_JSON},
    {"no-verify", no_argument, NULL, OPTION_NO_VERIFY},
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
    case OPTION_REPEAT:
        return pliant_option_integer("--repeat", optarg, 1, repeat_limit, &o->repeat, err);
    case OPTION_THREADS:
        return pliant_option_integer("--threads", optarg, 1, PLIANT_CREW_LIMIT, &o->threads, err);
    case OPTION_COMPARE:
        return parse_path("--compare", optarg, &o->compare, err);
    case OPTION_JSON:
        o->json = 1;
        return PLIANT_OK;
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
static pliant_status check_script(const pliant_play_options *o, pliant_error *err)
{
    if (o->repeat == 1 && o->threads == 1) return PLIANT_OK;
    const char *option = o->repeat > 1 ? "--repeat" : "--threads";
    struct stat found;
    if (strcmp(o->script, "-") == 0)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "%s: expected a script file, found standard input", option);
    if (stat(o->script, &found) == 0 && !S_ISREG(found.st_mode))
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "%s: expected a regular file as script, found %.200s", option,
                                o->script);
    return PLIANT_OK;
}

pliant_status pliant_play_options_parse(int argc, char **argv, pliant_play_options *options,
                                        pliant_play_request *request, pliant_error *err)
{
    pliant_play_options o = {.script = "-", .level = -1, .repeat = 1, .threads = 1, .verify = 1};
    opterr = 0;
    optind = 0;  // from the start, also the second time
    *request = PLIANT_PLAY_RUN;
    for (int found; (found = getopt_long(argc, argv, ":o:qh", long_options, NULL)) != -1;) {
        if (found == '?' || found == ':') return pliant_option_refuse(found, argc, argv, long_options, err);
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
    pliant_status status = check_script(&o, err);
    if (status >= 0) status = check_files(&o, err);
    if (status >= 0) *options = o;
    return status;
}
