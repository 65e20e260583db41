// drawing.h: from a model and a script to a picture file.
#pragma once

#include "options.h"

// Do what the command line asks for. On failure no file of the output's name is made or changed.
PLIANT_UNUSED_RESULT pliant_status pliant_drawing_make(const pliant_draw_options *options,
                                                       pliant_error *err);
