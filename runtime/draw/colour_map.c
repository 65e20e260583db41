// colour_map.c: colours for a quantity from 0 to 1, in even perceptual steps.
//
// This follows: B. Ottosson, A perceptual color space for image processing, 2020 (Oklab). The map
// is a path in it with lightness falling evenly from cream by amber and red to plum: also legible
// in grey and with the common colour blindnesses.
#include "colour_map.h"

#include <math.h>

static const struct stop {
    double value, lightness, chroma, hue;
} stops[] = {
    {0.00, 0.935, 0.030, 95}, {0.25, 0.835, 0.130, 78},  {0.50, 0.705, 0.185, 48},
    {0.75, 0.560, 0.205, 20}, {1.00, 0.400, 0.165, -25},
};

void pliant_colour_from_oklch(double lightness, double chroma, double hue, float *colour)
{
    const double degree = acos(-1.0) / 180;
    const double a = chroma * cos(hue * degree), b = chroma * sin(hue * degree);
    const double l = pow(lightness + 0.3963377774 * a + 0.2158037573 * b, 3);
    const double m = pow(lightness - 0.1055613458 * a - 0.0638541728 * b, 3);
    const double s = pow(lightness - 0.0894841775 * a - 1.2914855480 * b, 3);
    const double rgb[3] = {
        4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s,
        -1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s,
        -0.0041960863 * l - 0.7034186147 * m + 1.7076147010 * s,
    };
    for (int c = 0; c < 3; c++) colour[c] = (float)fmin(fmax(rgb[c], 0), 1);
}

void pliant_colour_map_at(float value, float *colour)
{
    const double x = value > 0 ? fmin((double)value, 1) : 0;  // NaN: the lower end
    int k = 0;
    while (k + 2 < (int)(sizeof stops / sizeof *stops) && x > stops[k + 1].value) k++;
    const struct stop *p = &stops[k], *q = &stops[k + 1];
    const double t = (x - p->value) / (q->value - p->value);
    pliant_colour_from_oklch(p->lightness + t * (q->lightness - p->lightness),
                             p->chroma + t * (q->chroma - p->chroma),
                             p->hue + t * (q->hue - p->hue), colour);
}
