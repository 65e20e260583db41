// scene_drawing.h: from a model and a script that plays its lattice to a picture file.
#pragma once

#include "drawing.h"

#include "pliant/pliant.h"

// Do what the command line asks for. On failure no file of the output's name is made or changed.
PLIANT_UNUSED_RESULT pliant_status pliant_scene_drawing_make(const pliant_draw_options *options,
                                                             const pliant_model *model,
                                                             pliant_error *err);
