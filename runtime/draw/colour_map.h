// colour_map.h: colours for a quantity from 0 to 1, in even perceptual steps.
#pragma once

// `colour` has shape [3], linear light. Values outside [0, 1] take the nearer end's colour.
void pliant_colour_map_at(float value, float *colour);

// The colour of a lightness (0 to 1), chroma and hue (degrees) of Oklab, in linear light.
void pliant_colour_from_oklch(double lightness, double chroma, double hue, float *colour);
