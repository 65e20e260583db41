// options.c: the command line of pliant-draw.
#include "options.h"

#include "pliant/error.h"
#include "pliant/option.h"
#include "raster.h"

#include <errno.h>
#include <getopt.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define SMALLEST_SIDE 64  // pixels: below, nothing can be made out

const char *pliant_draw_options_help(void)
{
    return "usage: pliant-draw [options] MODEL.h5 [SCRIPT] -o PICTURE.png\n"
           "\n"
           "Plays a contact script on a model and draws the surface, coloured by how far it "
           "moved,\n"
           "beside the shape at rest. Contacts are marked by dots and arrows, held vertices "
           "tinted.\n"
           "SCRIPT - is standard input; without one the rest shape is drawn. Of a lattice all "
           "instances\n"
           "are drawn, each in a hue of its own, with the obstacles; step 0 is where they begin.\n"
           "\n"
           "  -o, --output FILE     the picture, PNG; written whole or not at all\n"
           "      --step N          the state after step N (0: at rest); default the script's "
           "last\n"
           "      --steps A,B,C     several states, ascending, a panel each\n"
           "      --sheet C[xR]     a contact sheet of C columns (and R rows, default 1): steps "
           "spread\n"
           "                        evenly over the script, or those of --steps\n"
           "      --show WHAT       both, deformed or rest; default both\n"
           "      --view AZ,EL      seen from azimuth AZ (0: +x, 90: +y) and elevation EL, "
           "degrees;\n"
           "                        default -60,18\n"
           "      --region BOX      show this box alone, X,Y,Z,X,Y,Z its least and greatest "
           "corner; default\n"
           "                        all there is in any panel\n"
           "      --size WxH        pixels, 64 to 4096 each; default by the number of panels\n"
           "      --magnify F       draw displacements F times as large; default 1\n"
           "      --range MAX       displacement at the end of the colour scale; default by the "
           "largest\n"
           "      --level L         draw level L of the mesh, 0 the coarsest; default the finest\n"
           "      --detail          draw the detailed surface over that level (of a model made "
           "with --detail)\n"
           "      --lattice         draw the lattice's play of a model that has Green's functions "
           "too\n"
           "  -h, --help            this text\n"
           "      --version         the version\n"
           "\n"
           "Exit status: 0 done, 1 failed, 2 misused.\n";
}

// A whole number from low to high at the start of `text`; *end is what follows it.
static int read_count(const char *text, int64_t low, int64_t high, int64_t *value, const char **end)
{
    if (*text < '0' || *text > '9') return 0;
    char *stop;
    errno = 0;
    const long long v = strtoll(text, &stop, 10);
    if (errno || v < low || v > high) return 0;
    *value = v;
    *end = stop;
    return 1;
}

static int read_number(const char *text, double *value, const char **end)
{
    char *stop;
    if (*text == ' ' || *text == '\t' || *text == '\n') return 0;
    *value = strtod(text, &stop);
    if (stop == text || !isfinite(*value)) return 0;
    *end = stop;
    return 1;
}

static int read_pair_of_counts(const char *text, char between, int64_t low, int64_t high,
                               int64_t *first, int64_t *second)
{
    const char *end;
    if (!read_count(text, low, high, first, &end) || *end != between) return 0;
    return read_count(end + 1, low, high, second, &end) && *end == '\0';
}

static pliant_status refuse(pliant_error *err, const char *option, const char *expected,
                            const char *found)
{
    return pliant_error_set(err, PLIANT_ERR_ARGUMENT, "%s: expected %s, found '%s'", option,
                            expected, found);
}

static pliant_status read_steps(const char *text, pliant_draw_options *options, pliant_error *err)
{
    options->step_count = 0;
    const char *end = text - 1;
    do {
        int64_t *step = &options->steps[options->step_count];
        if (options->step_count == PLIANT_RECORDING_LIMIT ||
            !read_count(end + 1, 0, PLIANT_RECORDING_END - 1, step, &end) ||
            (options->step_count > 0 && step[0] <= step[-1]))
            return refuse(err, "--steps", "up to 64 ascending step numbers as 0,10,20", text);
        options->step_count++;
    } while (*end == ',');
    return *end ? refuse(err, "--steps", "step numbers as 0,10,20", text) : PLIANT_OK;
}

static pliant_status read_sheet(const char *text, pliant_draw_options *options, pliant_error *err)
{
    int64_t columns = 0, rows = 0;  // no rows: as many as needed
    const char *end;
    const int one = read_count(text, 1, PLIANT_RECORDING_LIMIT, &columns, &end) && *end == '\0';
    if (!one && !read_pair_of_counts(text, 'x', 1, PLIANT_RECORDING_LIMIT, &columns, &rows))
        return refuse(err, "--sheet", "columns, or columns x rows as 4x2", text);
    if (columns * rows > PLIANT_RECORDING_LIMIT)
        return refuse(err, "--sheet", "at most 64 panels", text);
    options->sheet_columns = (int32_t)columns;
    options->sheet_rows = (int32_t)rows;
    return PLIANT_OK;
}

static pliant_status read_size(const char *text, pliant_draw_options *options, pliant_error *err)
{
    int64_t width, height;
    if (!read_pair_of_counts(text, 'x', SMALLEST_SIDE, PLIANT_RASTER_SIDE_LIMIT, &width, &height))
        return refuse(err, "--size", "pixels as 1200x640, from 64 to 4096", text);
    options->picture.width = (int32_t)width;
    options->picture.height = (int32_t)height;
    return PLIANT_OK;
}

static pliant_status read_view(const char *text, pliant_draw_options *options, pliant_error *err)
{
    const char *end;
    double azimuth, elevation;
    if (!read_number(text, &azimuth, &end) || *end != ',' ||
        !read_number(end + 1, &elevation, &end) || *end || fabs(elevation) > 90)
        return refuse(err, "--view", "degrees as -60,18, the elevation from -90 to 90", text);
    options->picture.azimuth = azimuth;
    options->picture.elevation = elevation;
    return PLIANT_OK;
}

static pliant_status read_region(const char *text, pliant_draw_options *options, pliant_error *err)
{
    double *region = options->picture.region;
    const char *end = text - 1;
    for (int k = 0; k < 6; k++) {
        if (!read_number(end + 1, &region[k], &end) || *end != (k < 5 ? ',' : '\0') ||
            !(fabs(region[k]) <= 1e9) || (k >= 3 && !(region[k] > region[k - 3])))
            return refuse(err, "--region", "a box as 0,0,0,1,1,2, its least corner first", text);
    }
    options->picture.has_region = 1;
    return PLIANT_OK;
}

static pliant_status read_show(const char *text, pliant_draw_options *options, pliant_error *err)
{
    static const char *const names[] = {"both", "deformed", "rest"};
    for (int i = 0; i < 3; i++)
        if (strcmp(text, names[i]) == 0) {
            options->show = (pliant_draw_show)i;
            return PLIANT_OK;
        }
    return refuse(err, "--show", "both, deformed or rest", text);
}

enum {
    STEP = 256,
    STEPS,
    SHEET,
    SHOW,
    VIEW,
    SIZE,
    MAGNIFY,
    RANGE,
    LEVEL,
    DETAIL,
    LATTICE,
    REGION,
    VERSION
};

static pliant_status read_option(int option, const char *text, pliant_draw_options *options,
                                 pliant_error *err)
{
    const char *end;
    int64_t count;
    double number;
    switch (option) {
    case 'o':
        options->output = text;
        return PLIANT_OK;
    case STEP:
        if (!read_count(text, 0, PLIANT_RECORDING_END - 1, &options->steps[0], &end) || *end)
            return refuse(err, "--step", "a step's number from 0", text);
        options->step_count = 1;
        return PLIANT_OK;
    case STEPS:
        return read_steps(text, options, err);
    case SHEET:
        return read_sheet(text, options, err);
    case SHOW:
        return read_show(text, options, err);
    case VIEW:
        return read_view(text, options, err);
    case SIZE:
        return read_size(text, options, err);
    case MAGNIFY:
        if (!read_number(text, &number, &end) || *end)
            return refuse(err, "--magnify", "a factor", text);
        options->picture.magnify = number;
        return PLIANT_OK;
    case RANGE:
        if (!read_number(text, &number, &end) || *end || number <= 0)
            return refuse(err, "--range", "a length above 0", text);
        options->picture.range = number;
        return PLIANT_OK;
    case LEVEL:
        if (!read_count(text, 0, 15, &count, &end) || *end)
            return refuse(err, "--level", "a level from 0", text);
        options->level = (int32_t)count;
        return PLIANT_OK;
    case REGION:
        return read_region(text, options, err);
    case LATTICE:
        options->lattice = 1;
        return PLIANT_OK;
    case DETAIL:
        options->detail = 1;
        return PLIANT_OK;
    case 'h':
        options->help = 1;
        return PLIANT_OK;
    default:
        options->version = 1;
        return PLIANT_OK;
    }
}

pliant_status pliant_draw_options_parse(int argc, char **argv, pliant_draw_options *options,
                                        pliant_error *err)
{
    static const struct option names[] = {
        {"output", required_argument, NULL, 'o'},    {"step", required_argument, NULL, STEP},
        {"steps", required_argument, NULL, STEPS},   {"sheet", required_argument, NULL, SHEET},
        {"show", required_argument, NULL, SHOW},     {"view", required_argument, NULL, VIEW},
        {"size", required_argument, NULL, SIZE},     {"magnify", required_argument, NULL, MAGNIFY},
        {"range", required_argument, NULL, RANGE},   {"level", required_argument, NULL, LEVEL},
        {"detail", no_argument, NULL, DETAIL},       {"lattice", no_argument, NULL, LATTICE},
        {"region", required_argument, NULL, REGION}, {"help", no_argument, NULL, 'h'},
        {"version", no_argument, NULL, VERSION},     {NULL, 0, NULL, 0},
    };
    *options = (pliant_draw_options){.picture = pliant_picture_default(), .level = -1};
    options->picture.width = options->picture.height = 0;  // by the number of panels
    optind = 0;  // start afresh: tests parse more than once
    opterr = 0;
    for (;;) {
        const int option = getopt_long(argc, argv, ":o:h", names, NULL);
        if (option == -1) break;
        if (option == ':' || option == '?')
            return pliant_option_refuse(option, argc, argv, names, err);
        const pliant_status status = read_option(option, optarg, options, err);
        if (status < 0) return status;
    }
    if (options->help || options->version) return PLIANT_OK;
    const int count = argc - optind;
    if (count < 1 || count > 2)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "expected MODEL.h5 [SCRIPT], found %d names; see --help", count);
    options->model = argv[optind];
    options->script = count == 2 ? argv[optind + 1] : NULL;
    if (!options->output || !*options->output)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT, "expected -o PICTURE.png; see --help");
    if (!options->script && (options->step_count || options->sheet_columns))
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT, "steps need a SCRIPT");
    if (options->sheet_columns && !options->step_count && strcmp(options->script, "-") == 0)
        return pliant_error_set(
            err, PLIANT_ERR_ARGUMENT,
            "--sheet: standard input cannot be read twice: expected --steps too");
    if (options->sheet_rows && options->step_count > options->sheet_columns * options->sheet_rows)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "--sheet: %dx%d panels cannot hold %d steps",
                                options->sheet_columns, options->sheet_rows, options->step_count);
    return PLIANT_OK;
}
