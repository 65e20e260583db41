// options.c: what the command line of pliant-precompute asks for.
#include "options.h"

#include "mesh/region.h"
#include "fem/size_field.h"
#include "remesh/mesh_output.h"

#include "pliant/error.h"
#include "pliant/links.h"
#include "pliant/option.h"

#include <errno.h>
#include <getopt.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
    OPTION_SUBDIVIDE = 256,
    OPTION_SCHEME,
    OPTION_DETAIL,
    OPTION_REMESH,
    OPTION_LEVELS,
    OPTION_MESH_ONLY,
    OPTION_FIXED,
    OPTION_FIXED_LIST,
    OPTION_YOUNG,
    OPTION_POISSON,
    OPTION_DENSITY,
    OPTION_METHOD,
    OPTION_VOLUME,
    OPTION_GROWTH,
    OPTION_ORDER,
    OPTION_SOLVER,
    OPTION_GROUPS,
    OPTION_MATERIAL,
    OPTION_RMS,
    OPTION_MAX,
    OPTION_EPS,
    OPTION_WAVELET,
    OPTION_NO_LIFT,
    OPTION_BOUNDARY,
    OPTION_CONSTRAINT_LEVELS,
    OPTION_BLOCKS,
    OPTION_LATTICE,
    OPTION_HALF_WIDTH,
    OPTION_SOLID,
    OPTION_SHELL,
    OPTION_LATTICE_MASS,
    OPTION_NO_GREENS,
    OPTION_DENSE,
    OPTION_FORCE,
    OPTION_RESUME,
    OPTION_JSON,
    OPTION_VERSION,
};

static const struct option long_options[] = {
    {"subdivide", required_argument, NULL, OPTION_SUBDIVIDE},
    {"scheme", required_argument, NULL, OPTION_SCHEME},
    {"detail", required_argument, NULL, OPTION_DETAIL},
    {"remesh", optional_argument, NULL, OPTION_REMESH},
    {"levels", required_argument, NULL, OPTION_LEVELS},
    {"mesh-only", no_argument, NULL, OPTION_MESH_ONLY},
    {"fixed", required_argument, NULL, OPTION_FIXED},
    {"fixed-list", required_argument, NULL, OPTION_FIXED_LIST},
    {"young", required_argument, NULL, OPTION_YOUNG},
    {"poisson", required_argument, NULL, OPTION_POISSON},
    {"density", required_argument, NULL, OPTION_DENSITY},
    {"method", required_argument, NULL, OPTION_METHOD},
    {"volume", required_argument, NULL, OPTION_VOLUME},
    {"growth", required_argument, NULL, OPTION_GROWTH},
    {"order", required_argument, NULL, OPTION_ORDER},
    {"solver", required_argument, NULL, OPTION_SOLVER},
    {"groups", required_argument, NULL, OPTION_GROUPS},
    {"material", required_argument, NULL, OPTION_MATERIAL},
    {"rms", required_argument, NULL, OPTION_RMS},
    {"max", required_argument, NULL, OPTION_MAX},
    {"eps", required_argument, NULL, OPTION_EPS},
    {"wavelet", required_argument, NULL, OPTION_WAVELET},
    {"no-lift", no_argument, NULL, OPTION_NO_LIFT},
    {"boundary", required_argument, NULL, OPTION_BOUNDARY},
    {"output", required_argument, NULL, 'o'},
    {"constraint-levels", required_argument, NULL, OPTION_CONSTRAINT_LEVELS},
    {"blocks", required_argument, NULL, OPTION_BLOCKS},
    {"lattice", required_argument, NULL, OPTION_LATTICE},
    {"half-width", required_argument, NULL, OPTION_HALF_WIDTH},
    {"solid", no_argument, NULL, OPTION_SOLID},
    {"shell", no_argument, NULL, OPTION_SHELL},
    {"lattice-mass", required_argument, NULL, OPTION_LATTICE_MASS},
    {"no-greens", no_argument, NULL, OPTION_NO_GREENS},
    {"dense", required_argument, NULL, OPTION_DENSE},
    {"force", no_argument, NULL, OPTION_FORCE},
    {"resume", no_argument, NULL, OPTION_RESUME},
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

// From 1 to 2, both included.
static pliant_status growth(const char *option, const char *text, double *value, pliant_error *err)
{
    const pliant_status status = number(option, text, -INFINITY, INFINITY, value, err);
    if (status == PLIANT_OK && !(*value >= 1 && *value <= 2))
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "%s: expected a number from 1 (all alike) to 2, found %s", option, text);
    return status;
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

// --remesh's BASE may be left out: is this word one, or what comes behind it: another option, or
// MESH, whose name has a dot or a slash?
static int is_base(const char *text)
{
    char *end;
    (void)strtod(text, &end);
    if (end != text && *end == '\0') return 1;
    return text[0] != '-' && !strpbrk(text, "./");
}

// A number in a range, or "auto".
static pliant_status number_or_auto(const char *option, const char *text, int32_t low, int32_t high,
                                    int32_t *value, pliant_error *err)
{
    if (strcmp(text, "auto") == 0) {
        *value = PLIANT_REMESH_AUTO;
        return PLIANT_OK;
    }
    return pliant_option_integer(option, text, low, high, value, err);
}

// Do --remesh, --levels and --mesh-only go with the rest?
static pliant_status check_remesh(const pliant_options *o, int levels_given, pliant_error *err)
{
    if (o->remeshing == PLIANT_REMESH_NEVER && levels_given)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT, "--levels goes with --remesh BASE_VERTICES");
    if (o->remeshing == PLIANT_REMESH_FIRST && o->subdivide >= 0)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "--remesh makes levels of its own: give --levels instead of --subdivide");
    if (o->remeshing == PLIANT_REMESH_FIRST && o->fixed_list)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "--fixed-list names vertices of MESH, which --remesh replaces: give --fixed EXPR, "
                                "or remesh with --mesh-only first");
    if (o->product == PLIANT_PRODUCT_MODEL) return PLIANT_OK;
    if (o->remeshing == PLIANT_REMESH_NEVER)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT, "--mesh-only goes with --remesh BASE_VERTICES");
    if (o->lattice_cells > 0 || o->fixed_expression || o->dense)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT, "--mesh-only writes a mesh: --%s is for a model",
                                o->lattice_cells > 0 ? "lattice" : o->dense ? "dense" : "fixed");
    if (!pliant_mesh_output_is_known(o->output))
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "--mesh-only: expected -o with a name that ends in .obj or .ply, found '%s'",
                                o->output);
    return PLIANT_OK;
}

// What an option goes with, so that none is given in vain.
typedef enum option_kind { KIND_ANY, KIND_GREENS, KIND_FEM, KIND_LATTICE, KIND_COUNT } option_kind;

static option_kind kind_of(int code)
{
    switch (code) {
    case OPTION_DETAIL:
    case OPTION_METHOD:
    case OPTION_RMS:
    case OPTION_MAX:
    case OPTION_EPS:
    case OPTION_WAVELET:
    case OPTION_NO_LIFT:
    case OPTION_BOUNDARY:
    case OPTION_CONSTRAINT_LEVELS:
    case OPTION_BLOCKS:
    case OPTION_RESUME:
    case OPTION_GROUPS:
    case OPTION_DENSE: return KIND_GREENS;
    case OPTION_VOLUME:
    case OPTION_GROWTH:
    case OPTION_ORDER:
    case OPTION_SOLVER:
    case OPTION_MATERIAL: return KIND_FEM;
    case OPTION_HALF_WIDTH:
    case OPTION_SOLID:
    case OPTION_SHELL:
    case OPTION_LATTICE_MASS:
    case OPTION_NO_GREENS: return KIND_LATTICE;
    default: return KIND_ANY;
    }
}

static const char *name_of(int code)
{
    const struct option *option = long_options;
    while (option->val != code) option++;
    return option->name;
}

// Do the options that were given go together? `given` has an option's name of each kind, or NULL.
static pliant_status check_kinds(const pliant_options *o, const char *const given[KIND_COUNT],
                                 pliant_error *err)
{
    if (o->lattice_cells == 0 && given[KIND_LATTICE])
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT, "--%s goes with --lattice CELLS", given[KIND_LATTICE]);
    if (o->method != PLIANT_METHOD_FEM && given[KIND_FEM])
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT, "--%s goes with --method fem", given[KIND_FEM]);
    if (o->region_count > 0 && !o->volume)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "--material goes with --volume FILE.msh, whose regions it names");
    if (o->greens == PLIANT_GREENS_NONE && given[KIND_GREENS])
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT, "--%s is for Green's functions, --no-greens makes none",
                                given[KIND_GREENS]);
    if (o->product == PLIANT_PRODUCT_MODEL && o->greens == PLIANT_GREENS_SOLVE && !o->fixed_expression && !o->fixed_list)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "nothing holds the solid: give --fixed EXPR (such as 'z<0.1') or --fixed-list "
                                "FILE%s", o->lattice_cells > 0 ? ", or --no-greens for a lattice only" : "");
    return PLIANT_OK;
}

// NAME:E:NU:RHO.
static pliant_status region_material(const char *text, pliant_options *o, pliant_error *err)
{
    const char *option = "--material";
    if (o->region_count == PLIANT_REGION_LIMIT)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT, "%s: expected at most %d of them", option, PLIANT_REGION_LIMIT);
    pliant_region_option *region = &o->regions[o->region_count];
    char parts[4][PLIANT_REGION_NAME];
    int count = 0;
    const char *begin = text;
    for (size_t length; count < 4; begin += length + 1, count++) {
        length = strcspn(begin, ":");
        if (length == 0 || length >= PLIANT_REGION_NAME || (count < 3) != (begin[length] == ':')) break;
        memcpy(parts[count], begin, length);
        parts[count][length] = 0;
    }
    if (count != 4)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "%s: expected NAME:E:NU:RHO, such as bone:1e9:0.3:1800, found '%.80s'", option, text);
    for (int32_t k = 0; k < o->region_count; k++)
        if (strcmp(o->regions[k].name, parts[0]) == 0)
            return pliant_error_set(err, PLIANT_ERR_ARGUMENT, "%s: '%s' is given twice", option, parts[0]);
    memcpy(region->name, parts[0], sizeof region->name);
    pliant_status status = number(option, parts[1], 0, INFINITY, &region->material.young, err);
    if (status == PLIANT_OK) status = number(option, parts[2], -1, 0.5, &region->material.poisson, err);
    if (status == PLIANT_OK) status = number(option, parts[3], 0, INFINITY, &region->material.density, err);
    if (status == PLIANT_OK) o->region_count++;
    return status;
}

pliant_status pliant_options_parse(int argc, char **argv, pliant_options *options,
                                   pliant_options_action *action, pliant_error *err)
{
    pliant_options o = {.subdivide = -1,
                        .scheme = PLIANT_SUBDIVIDE_LOOP,
                        .material = {.young = 1, .poisson = 0.3, .density = 1},
                        .wavelet = pliant_wavelet_default(),
                        .constraint_levels = {-1, -1},
                        .remesh = {PLIANT_REMESH_AUTO, PLIANT_REMESH_AUTO},
                        .order = 2,
                        .half_width = 2};
    static const char *const schemes[] = {"loop", "butterfly", "midpoint"};
    static const char *const wavelets[] = {"linear", "butterfly"};
    static const char *const boundaries[] = {"zero", "drop"};
    static const char *const blocks[] = {"free", "all"};
    static const char *const methods[] = {"bem", "fem"};
    static const char *const solvers[] = {"auto", "direct", "multigrid"};
    pliant_status status = PLIANT_OK;
    int choice = 0, scheme_given = 0, filling_given = 0, levels_given = 0, growth_given = 0;
    const char *given[KIND_COUNT] = {NULL};
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
        case OPTION_RESUME: o.resuming = PLIANT_RESUME; break;
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
        case OPTION_REMESH:
            o.remeshing = PLIANT_REMESH_FIRST;
            if (!optarg && optind < argc && is_base(argv[optind])) optarg = argv[optind++];
            if (!optarg) break;
            status = number_or_auto("--remesh", optarg, 4, INT32_MAX / 8, &o.remesh.base_vertices, err);
            break;
        case OPTION_LEVELS:
            levels_given = 1;
            status = number_or_auto("--levels", optarg, 0, PLIANT_LEVEL_LIMIT - 1, &o.remesh.levels, err);
            break;
        case OPTION_MESH_ONLY: o.product = PLIANT_PRODUCT_MESH; break;
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
        case OPTION_LATTICE:
            status = pliant_option_integer("--lattice", optarg, 1, PLIANT_VOXEL_CELL_LIMIT, &o.lattice_cells, err);
            break;
        case OPTION_HALF_WIDTH:
            status = pliant_option_integer("--half-width", optarg, 1, PLIANT_LATTICE_WIDTH_LIMIT, &o.half_width, err);
            break;
        case OPTION_SOLID:
        case OPTION_SHELL:
            o.filling = code == OPTION_SHELL ? PLIANT_VOXELS_SHELL : PLIANT_VOXELS_SOLID;
            if (filling_given && filling_given != code)
                return pliant_error_set(err, PLIANT_ERR_ARGUMENT, "--solid and --shell: give one of them");
            filling_given = code;
            break;
        case OPTION_LATTICE_MASS: o.lattice_mass = optarg; break;
        case OPTION_NO_GREENS: o.greens = PLIANT_GREENS_NONE; break;
        case OPTION_METHOD:
            status = word("--method", optarg, methods, 2, &choice, err);
            o.method = (pliant_method)choice;
            break;
        case OPTION_VOLUME: o.volume = optarg; break;
        case OPTION_GROWTH:
            growth_given = 1;
            status = growth("--growth", optarg, &o.growth, err);
            break;
        case OPTION_GROUPS:
            if (strcmp(optarg, "auto") == 0) o.groups = 0;
            else status = pliant_option_integer("--groups", optarg, 1, INT32_MAX, &o.groups, err);
            break;
        case OPTION_ORDER: status = pliant_option_integer("--order", optarg, 1, 2, &o.order, err); break;
        case OPTION_SOLVER:
            status = word("--solver", optarg, solvers, 3, &choice, err);
            o.solver = (pliant_solver_choice)choice;
            break;
        case OPTION_MATERIAL: status = region_material(optarg, &o, err); break;
        case OPTION_YOUNG: status = number("--young", optarg, 0, INFINITY, &o.material.young, err); break;
        case OPTION_POISSON: status = number("--poisson", optarg, -1, 0.5, &o.material.poisson, err); break;
        case OPTION_DENSITY: status = number("--density", optarg, 0, INFINITY, &o.material.density, err); break;
        case OPTION_RMS: status = number("--rms", optarg, 0, 1, &o.compression.rms, err); break;
        case OPTION_MAX: status = number("--max", optarg, 0, 1, &o.compression.max, err); break;
        case OPTION_EPS: status = number("--eps", optarg, 0, 1, &o.compression.eps, err); break;
        default: return pliant_option_refuse(code, argc, argv, long_options, err);
        }
        if (!given[kind_of(code)] && kind_of(code) != KIND_ANY) given[kind_of(code)] = name_of(code);
    }
    if (status < 0) return status;

    if (optind < argc) o.mesh = argv[optind++];
    if (!o.mesh) return pliant_error_set(err, PLIANT_ERR_ARGUMENT, "expected a MESH; see --help");
    if (optind < argc)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT, "expected one MESH, found also '%s'; see --help", argv[optind]);
    if (!o.output) return pliant_error_set(err, PLIANT_ERR_ARGUMENT, "expected -o MODEL.h5; see --help");
    if (o.dense && strcmp(o.dense, o.output) == 0)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT, "--dense and -o name the same file '%s'", o.dense);
    if (!growth_given) o.growth = pliant_size_field_growth(o.order);
    if (growth_given && o.volume)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT, "--growth is for the inside that is meshed, --volume has one");
    if ((status = check_remesh(&o, levels_given, err)) < 0) return status;
    if ((status = check_kinds(&o, given, err)) < 0) return status;
    if (o.fixed_expression) {
        // A mistake in the expression is told before a mesh is read: try it on a mesh of nothing.
        const pliant_mesh nothing = {0};
        uint8_t none;
        pliant_error inner;
        if (pliant_region_evaluate(o.fixed_expression, &nothing, &none, &inner) < 0)
            return pliant_error_set(err, PLIANT_ERR_ARGUMENT, "--fixed: %.480s", inner.text);
    }
    if (o.dense && o.resuming == PLIANT_RESUME)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "--resume: a run with --dense keeps nothing to resume from");
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
