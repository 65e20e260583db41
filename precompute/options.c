// options.c: what the command line of pliant-precompute asks for.
#include "options.h"

#include "mesh/region.h"

#include "pliant/error.h"
#include "pliant/option.h"

#include <errno.h>
#include <getopt.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char help[] =
    "usage: mpirun -n P pliant-precompute [options] MESH -o MODEL.h5\n"
    "\n"
    "Solve for the Green's functions of an elastic solid, compress them with surface wavelets and\n"
    "write them to an HDF5 file that pliant-play and libpliant map. MESH is a closed triangle surface\n"
    "(OBJ, PLY, STL, OFF and more).\n"
    "\n"
    "Levels (wavelets need them)\n"
    "  --subdivide L           take MESH as base mesh and split every triangle into four, L times (0: as\n"
    "                          it is, on one level, which stores every column whole)\n"
    "  --scheme SCHEME         loop, butterfly or midpoint (default loop)\n"
    "                          Without --subdivide, MESH is the finest level and its subdivision\n"
    "                          connectivity is detected, whatever its vertex order.\n"
    "  --detail D              the D finest levels are geometric detail: elasticity is solved on the mesh\n"
    "                          of the others, the finer shape is stored as a displaced subdivision\n"
    "                          surface that moves with it\n"
    "Support\n"
    "  --fixed EXPR            hold the vertices where EXPR is true at rest: z<0.1, x>=2 and y<0,\n"
    "                          all(z<0.1, x>0), any(...), not(...), box(x0,y0,z0, x1,y1,z1),\n"
    "                          sphere(x,y,z, r)\n"
    "  --fixed-list FILE       hold these vertices of MESH (0-based, separated by white space); with\n"
    "                          --subdivide also the new vertices between two held ones\n"
    "Material, in any consistent units\n"
    "  --young E               Young's modulus (default 1)\n"
    "  --poisson NU            Poisson's ratio, over -1 and under 0.5 (default 0.3)\n"
    "  --density RHO           for gravity (default 1)\n"
    "  --method bem            discretisation: boundary elements (default)\n"
    "Compression\n"
    "  --rms R, --max X        stay under these errors (GF-70, GF-71), either or both; the sparsest set\n"
    "                          is sought (default --rms 0.02 --max 0.05; thin parts under fine contact\n"
    "                          want a smaller --max: the player says so when it matters)\n"
    "  --eps EPS               the paper's threshold instead (GF-31..33)\n"
    "  --wavelet WAVELET       linear or butterfly (default butterfly)\n"
    "  --no-lift               without the lifting update\n"
    "  --boundary RULE         stencil nodes beyond the free surface count as zero or are dropped:\n"
    "                          zero or drop (default zero)\n"
    "Columns\n"
    "  --constraint-levels A..B\n"
    "                          store the hierarchical Green's functions of levels A to B (A alone: of one\n"
    "                          level; default: of all). Those of level B are solved for, coarser ones come\n"
    "                          from them by refinement. Rows keep full resolution; with B under the\n"
    "                          finest level, time for solving and memory for right-hand sides shrink\n"
    "                          fourfold a level. The file then takes constraints on these levels.\n"
    "  --blocks free|all       free-free block only (default), or supports and reactions too\n"
    "Output\n"
    "  -o, --output MODEL.h5   the model; written whole or not at all\n"
    "  --dense FILE.h5         also store the exact dense columns of the finest level (small models, for\n"
    "                          comparisons)\n"
    "  --force                 replace existing outputs\n"
    "  -q, --quiet             print errors only (and the summary with --json)\n"
    "  --json                  print the summary as one JSON object\n"
    "  -h, --help  --version\n"
    "\n"
    "PETSc's own options come through PETSC_OPTIONS. Temporary columns go to TMPDIR, or beside the\n"
    "output. Exit status: 0 done, 1 failed, 2 misused.\n"
    "\n"
    "example: mpirun -n 2 pliant-precompute --subdivide 4 --fixed 'z<0.1' base.obj -o model.h5\n";

const char *pliant_options_help(void)
{
    return help;
}

enum {
    OPTION_SUBDIVIDE = 256,
    OPTION_SCHEME,
    OPTION_DETAIL,
    OPTION_FIXED,
    OPTION_FIXED_LIST,
    OPTION_YOUNG,
    OPTION_POISSON,
    OPTION_DENSITY,
    OPTION_METHOD,
    OPTION_RMS,
    OPTION_MAX,
    OPTION_EPS,
    OPTION_WAVELET,
    OPTION_NO_LIFT,
    OPTION_BOUNDARY,
    OPTION_CONSTRAINT_LEVELS,
    OPTION_BLOCKS,
    OPTION_DENSE,
    OPTION_FORCE,
    OPTION_JSON,
    OPTION_VERSION,
};

static const struct option long_options[] = {
    {"subdivide", required_argument, NULL, OPTION_SUBDIVIDE},
    {"scheme", required_argument, NULL, OPTION_SCHEME},
    {"detail", required_argument, NULL, OPTION_DETAIL},
    {"fixed", required_argument, NULL, OPTION_FIXED},
    {"fixed-list", required_argument, NULL, OPTION_FIXED_LIST},
    {"young", required_argument, NULL, OPTION_YOUNG},
    {"poisson", required_argument, NULL, OPTION_POISSON},
    {"density", required_argument, NULL, OPTION_DENSITY},
    {"method", required_argument, NULL, OPTION_METHOD},
    {"rms", required_argument, NULL, OPTION_RMS},
    {"max", required_argument, NULL, OPTION_MAX},
    {"eps", required_argument, NULL, OPTION_EPS},
    {"wavelet", required_argument, NULL, OPTION_WAVELET},
    {"no-lift", no_argument, NULL, OPTION_NO_LIFT},
    {"boundary", required_argument, NULL, OPTION_BOUNDARY},
    {"output", required_argument, NULL, 'o'},
    {"constraint-levels", required_argument, NULL, OPTION_CONSTRAINT_LEVELS},
    {"blocks", required_argument, NULL, OPTION_BLOCKS},
    {"dense", required_argument, NULL, OPTION_DENSE},
    {"force", no_argument, NULL, OPTION_FORCE},
    {"quiet", no_argument, NULL, 'q'},
    {"json", no_argument, NULL, OPTION_JSON},
    {"help", no_argument, NULL, 'h'},
    {"version", no_argument, NULL, OPTION_VERSION},
    {NULL, 0, NULL, 0},
};

// A finite number in (low, high): open ends, since every range here is.
static pliant_status number(const char *option, const char *text, double low, double high,
                            double *value, pliant_error *err)
{
    char *end;
    errno = 0;
    *value = strtod(text, &end);
    if (end == text || *end || errno == ERANGE || !isfinite(*value))
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT, "%s: expected a number, found '%s'", option, text);
    if (*value > low && *value < high) return PLIANT_OK;
    if (isinf(high))
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT, "%s: expected a number over %g, found %s",
                                option, low, text);
    return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                            "%s: expected a number over %g and under %g, found %s", option, low, high, text);
}

// A level's digits, or NULL: the rest of the text.
static const char *level_digits(const char *text, int32_t *level)
{
    const char *end = text;
    for (*level = 0; *end >= '0' && *end <= '9'; end++) {
        *level = 10 * *level + (*end - '0');
        if (*level > PLIANT_LEVEL_LIMIT) return NULL;
    }
    return end == text ? NULL : end;
}

// "A..B" or "A".
static pliant_status level_range(const char *option, const char *text, pliant_level_range *range,
                                 pliant_error *err)
{
    const char *end = level_digits(text, &range->first);
    range->last = range->first;
    if (end && strncmp(end, "..", 2) == 0) end = level_digits(end + 2, &range->last);
    if (end && !*end && range->first <= range->last) return PLIANT_OK;
    return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                            "%s: expected A..B, levels from 0 to %d with A at most B, or A, found '%.60s'",
                            option, PLIANT_LEVEL_LIMIT, text);
}

// One of `count` words; *choice is its index.
static pliant_status word(const char *option, const char *text, const char *const *words, int count,
                          int *choice, pliant_error *err)
{
    char expected[128] = "";
    for (int i = 0; i < count; i++) {
        if (strcmp(text, words[i]) == 0) {
            *choice = i;
            return PLIANT_OK;
        }
        const size_t used = strlen(expected);
        snprintf(expected + used, sizeof expected - used, "%s%s", i == 0 ? "" : i == count - 1 ? " or " : ", ",
                 words[i]);
    }
    return pliant_error_set(err, PLIANT_ERR_ARGUMENT, "%s: expected %s, found '%s'", option, expected, text);
}

pliant_status pliant_options_parse(int argc, char **argv, pliant_options *options,
                                   pliant_options_action *action, pliant_error *err)
{
    pliant_options o = {.subdivide = -1,
                        .scheme = PLIANT_SUBDIVIDE_LOOP,
                        .material = {.young = 1, .poisson = 0.3, .density = 1},
                        .wavelet = pliant_wavelet_default(),
                        .constraint_levels = {-1, -1}};
    static const char *const schemes[] = {"loop", "butterfly", "midpoint"};
    static const char *const wavelets[] = {"linear", "butterfly"};
    static const char *const boundaries[] = {"zero", "drop"};
    static const char *const blocks[] = {"free", "all"};
    static const char *const methods[] = {"bem"};
    pliant_status status = PLIANT_OK;
    int choice = 0, scheme_given = 0;
    *action = PLIANT_OPTIONS_RUN;
    optind = 0;  // starts afresh, so that parsing can be tested in one process
    opterr = 0;
    for (int code; status == PLIANT_OK &&
                   (code = getopt_long(argc, argv, ":o:qh", long_options, NULL)) != -1;) {
        switch (code) {
        case 'h':
            *action = PLIANT_OPTIONS_HELP;
            return PLIANT_OK;
        case OPTION_VERSION:
            *action = PLIANT_OPTIONS_VERSION;
            return PLIANT_OK;
        case 'o': o.output = optarg; break;
        case 'q': o.talk = PLIANT_TALK_ERRORS; break;
        case OPTION_JSON: o.reporting = PLIANT_REPORT_JSON; break;
        case OPTION_FORCE: o.existing = PLIANT_REPLACE_EXISTING; break;
        case OPTION_DENSE: o.dense = optarg; break;
        case OPTION_FIXED: o.fixed_expression = optarg; break;
        case OPTION_FIXED_LIST: o.fixed_list = optarg; break;
        case OPTION_SUBDIVIDE: status = pliant_option_integer("--subdivide", optarg, 0, PLIANT_LEVEL_LIMIT - 1, &o.subdivide, err); break;
        case OPTION_SCHEME:
            status = word("--scheme", optarg, schemes, 3, &choice, err);
            o.scheme = (pliant_subdivision_scheme)choice;
            scheme_given = 1;
            break;
        case OPTION_DETAIL: status = pliant_option_integer("--detail", optarg, 1, PLIANT_LEVEL_LIMIT, &o.detail, err); break;
        case OPTION_WAVELET:
            status = word("--wavelet", optarg, wavelets, 2, &choice, err);
            o.wavelet.scheme = (pliant_wavelet_scheme)choice;
            break;
        case OPTION_BOUNDARY:
            status = word("--boundary", optarg, boundaries, 2, &choice, err);
            o.wavelet.boundary = (pliant_wavelet_boundary)choice;
            break;
        case OPTION_NO_LIFT: o.wavelet.lifting = PLIANT_UNLIFTED; break;
        case OPTION_CONSTRAINT_LEVELS:
            status = level_range("--constraint-levels", optarg, &o.constraint_levels, err);
            break;
        case OPTION_BLOCKS:
            status = word("--blocks", optarg, blocks, 2, &choice, err);
            o.blocks = (pliant_blocks)choice;
            break;
        case OPTION_METHOD: status = word("--method", optarg, methods, 1, &choice, err); break;
        case OPTION_YOUNG: status = number("--young", optarg, 0, INFINITY, &o.material.young, err); break;
        case OPTION_POISSON: status = number("--poisson", optarg, -1, 0.5, &o.material.poisson, err); break;
        case OPTION_DENSITY: status = number("--density", optarg, 0, INFINITY, &o.material.density, err); break;
        case OPTION_RMS: status = number("--rms", optarg, 0, 1, &o.compression.rms, err); break;
        case OPTION_MAX: status = number("--max", optarg, 0, 1, &o.compression.max, err); break;
        case OPTION_EPS: status = number("--eps", optarg, 0, 1, &o.compression.eps, err); break;
        default: return pliant_option_refuse(code, argc, argv, long_options, err);
        }
    }
    if (status < 0) return status;

    if (optind < argc) o.mesh = argv[optind++];
    if (!o.mesh) return pliant_error_set(err, PLIANT_ERR_ARGUMENT, "expected a MESH; see --help");
    if (optind < argc)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT, "expected one MESH, found also '%s'; see --help", argv[optind]);
    if (!o.output) return pliant_error_set(err, PLIANT_ERR_ARGUMENT, "expected -o MODEL.h5; see --help");
    if (o.dense && strcmp(o.dense, o.output) == 0)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT, "--dense and -o name the same file '%s'", o.dense);
    if (!o.fixed_expression && !o.fixed_list)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "nothing holds the solid: give --fixed EXPR (such as 'z<0.1') or --fixed-list FILE");
    if (o.fixed_expression) {
        // A mistake in the expression is told before a mesh is read: try it on a mesh of nothing.
        const pliant_mesh nothing = {0};
        uint8_t none;
        pliant_error inner;
        if (pliant_region_evaluate(o.fixed_expression, &nothing, &none, &inner) < 0)
            return pliant_error_set(err, PLIANT_ERR_ARGUMENT, "--fixed: %.480s", inner.text);
    }
    if (scheme_given && o.subdivide < 0)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT, "--scheme goes with --subdivide L");
    if (o.subdivide >= 0 && o.detail > o.subdivide)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT, "--detail: expected at most the %d levels of --subdivide, found %d",
                                o.subdivide, o.detail);
    if (o.compression.eps > 0 && (o.compression.rms > 0 || o.compression.max > 0))
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "--eps is a threshold, --rms and --max are errors to stay under: give one kind");
    if (o.compression.eps == 0 && o.compression.rms == 0 && o.compression.max == 0) {
        o.compression.rms = 0.02;
        o.compression.max = 0.05;
    }
    *options = o;
    return PLIANT_OK;
}
