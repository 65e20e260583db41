// drawing.h: from a model and a script to a picture file.
#pragma once

#include "options.h"

// Do what the command line asks for. On failure no file of the output's name is made or changed.
PLIANT_UNUSED_RESULT pliant_status pliant_drawing_make(const pliant_draw_options *options,
                                                       pliant_error *err);

// The size that gives every panel room, when none was asked for.
void pliant_drawing_choose_size(pliant_picture_def *picture, int32_t panel_count);

// Which steps to draw, from the options: ascending, PLIANT_RECORDING_END for the last; `steps` has
// room for PLIANT_RECORDING_LIMIT + 1.
PLIANT_UNUSED_RESULT pliant_status pliant_drawing_choose_steps(const pliant_draw_options *options,
                                                               int64_t *steps, int32_t *step_count,
                                                               pliant_error *err);
