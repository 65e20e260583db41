// main.c: pliant-draw, a picture of a body in contact.
#include "drawing.h"
#include "options.h"

#include <stdio.h>

int main(int argc, char **argv)
{
    pliant_draw_options options;
    pliant_error err = {""};
    if (pliant_draw_options_parse(argc, argv, &options, &err) < 0) {
        fprintf(stderr, "pliant-draw: %s\n", err.text);
        return 2;
    }
    if (options.help) return fputs(pliant_draw_options_help(), stdout) < 0 || fflush(stdout) != 0;
    if (options.version) return puts("pliant-draw " PLIANT_VERSION_TEXT) < 0 || fflush(stdout) != 0;
    const pliant_status status = pliant_drawing_make(&options, &err);
    if (status < 0) {
        fprintf(stderr, "pliant-draw: %s\n", err.text);
        return 1;
    }
    return 0;
}
