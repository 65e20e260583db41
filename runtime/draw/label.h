// label.h: short texts in a picture, in a 5 x 7 dot font: small letters, digits and . , + -
#pragma once

#include "raster.h"

#define PLIANT_LABEL_HEIGHT 7  // dots; a letter is 5 wide and stands 6 from the next

// Width of a text in dots.
double pliant_label_width(const char *text);

// Draw a text with its upper left corner at (x, y), `dot` pixels to a dot. Other characters, the
// space among them, stay empty.
void pliant_label_draw(pliant_raster *raster, const char *text, double x, double y, double dot,
                       const float *colour);
