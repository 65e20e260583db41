// element.c: a flat triangle with linear hats.
#include "bem/element.h"

#include "bem/far_field.h"

#include <math.h>

static double length(const double a[3])
{
    return sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
}

void pliant_element_set(pliant_element *element, const int32_t vertices[3], const double *a,
                        const double *b, const double *c)
{
    const double *corners[3] = {a, b, c};
    double ab[3], ac[3], bc[3];
    for (int i = 0; i < 3; i++) {
        ab[i] = b[i] - a[i];
        ac[i] = c[i] - a[i];
        bc[i] = c[i] - b[i];
        element->centre[i] = a[i] + (ab[i] + ac[i]) / 3;
    }
    const double n[3] = {ab[1] * ac[2] - ab[2] * ac[1], ab[2] * ac[0] - ab[0] * ac[2],
                         ab[0] * ac[1] - ab[1] * ac[0]};
    const double twice_area = length(n);
    element->area = twice_area / 2;
    double radius = 0;
    for (int k = 0; k < 3; k++) {
        element->vertices[k] = vertices[k];
        element->normal[k] = n[k] / twice_area;
        for (int i = 0; i < 3; i++) element->spokes[k][i] = corners[k][i] - element->centre[i];
        radius = fmax(radius, length(element->spokes[k]));
    }
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < 3; i++) element->loads[k][i] = -corners[k][i] * element->normal[i];
    const double edge = fmax(length(ab), fmax(length(ac), length(bc)));
    const double near = radius + PLIANT_FAR_FIELD_RATIO * edge;
    element->near_radius2 = near * near;
}
