// options.c: the command line of pliant-info.
#include "options.h"

#include "mesh_export.h"
#include "pliant/error.h"
#include "pliant/option.h"
#include "pliant/hierarchy.h"

#include <getopt.h>
#include <stdlib.h>
#include <string.h>

const char *pliant_info_options_help(void)
{
    return "usage: pliant-info [options] FILE.h5\n"
           "\n"
           "Show what a model file of pliant-precompute holds: mesh, levels, domains, material, "
           "blocks\n"
           "of Green's functions with their size and error, the lattice, provenance. Dense files "
           "and\n"
           "recordings of pliant-play are shown, too.\n"
           "\n"
           "  --verify            check every checksum and index, and the mesh's levels; find the smallest\n"
           "                      eigenvalue of the stored contact compliance of every level anew, and\n"
           "                      the lattice's regions from its cells\n"
           "  --export FILE       write the model's mesh; FILE ends in .obj or .ply\n"
           "  --level L           with --export: the mesh of level L, 0 the coarsest (default: "
           "finest)\n"
           "  --detail            with --export: the detailed shape at rest instead of a level\n"
           "  --json              the same as JSON\n"
           "  -h, --help          this text\n"
           "  --version           the program's version\n"
           "\n"
           "Exit status: 0 done, 1 failed (one line on standard error says why), 2 misused.\n";
}

enum { OPTION_VERSION = 256, OPTION_VERIFY, OPTION_EXPORT, OPTION_LEVEL, OPTION_DETAIL, OPTION_JSON };

static const struct option known[] = {
    {"help", no_argument, NULL, 'h'},
    {"version", no_argument, NULL, OPTION_VERSION},
    {"verify", no_argument, NULL, OPTION_VERIFY},
    {"export", required_argument, NULL, OPTION_EXPORT},
    {"level", required_argument, NULL, OPTION_LEVEL},
    {"detail", no_argument, NULL, OPTION_DETAIL},
    {"json", no_argument, NULL, OPTION_JSON},
    {NULL, 0, NULL, 0},
};

pliant_status pliant_info_options_parse(int argc, char **argv, pliant_info_options *options,
                                        pliant_error *err)
{
    pliant_info_options o = {.level = -1};
    pliant_status status = PLIANT_OK;
    opterr = 0;
    optind = 1;
    for (int c; status == PLIANT_OK && (c = getopt_long(argc, argv, ":h", known, NULL)) != -1;) {
        switch (c) {
        case 'h':
            o.help = 1;
            break;
        case OPTION_VERSION:
            o.version = 1;
            break;
        case OPTION_VERIFY:
            o.verify = 1;
            break;
        case OPTION_EXPORT:
            o.output = optarg;
            break;
        case OPTION_LEVEL:
            status = pliant_option_integer("--level", optarg, 0, PLIANT_LEVEL_LIMIT, &o.level, err);
            break;
        case OPTION_DETAIL:
            o.detail = 1;
            break;
        case OPTION_JSON:
            o.json = 1;
            break;
        default:
            return pliant_option_refuse(c, argc, argv, known, err);
        }
        if (o.help || o.version) {
            *options = o;
            return status;
        }
    }
    if (status < 0) return status;
    if (argc - optind != 1)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT, "expected one file, found %d; see --help",
                                argc - optind);
    o.path = argv[optind];
    if (o.level >= 0 && !o.output)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "--level: expected --export with it, found none");
    if (o.detail && !o.output)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "--detail: expected --export with it, found none");
    if (o.detail && o.level >= 0)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "--detail and --level name two meshes: expected one");
    if (o.output && pliant_mesh_export_format(o.output) == PLIANT_MESH_UNKNOWN)
        return pliant_error_set(
            err, PLIANT_ERR_ARGUMENT,
            "--export: expected a name that ends in .obj or .ply, found \"%.300s\"", o.output);
    *options = o;
    return PLIANT_OK;
}
