// triangle_rule.c: symmetric quadrature rules on the triangle.
//
// This follows: D. A. Dunavant, High degree efficient symmetrical Gaussian quadrature rules for the
// triangle, Int. J. Numer. Methods Eng. 21, 1985 (degree 8, and degree 5, which is J. Radon's of
// 1948 in closed form); A. H. Stroud, Approximate calculation of multiple integrals, 1971, for 3.
#include "bem/triangle_rule.h"

#include <stddef.h>

// clang-format off
#define CENTRE            {1.0 / 3, 1.0 / 3, 1.0 / 3}
#define ORBIT(share, b)   {share, b, b}, {b, share, b}, {b, b, share}
#define ORBIT_6(a, b, c)  {a, b, c}, {b, c, a}, {c, a, b}, {a, c, b}, {c, b, a}, {b, a, c}
#define THREE(weight)     weight, weight, weight
// clang-format on

// sqrt(15), written out because an initialiser may not call.
#define ROOT_15 3.87298334620741688518

static const pliant_triangle_rule rules[] = {
    {
        .degree = 3,
        .point_count = 4,
        .points = {CENTRE, ORBIT(0.6, 0.2)},
        .weights = {-27.0 / 48, THREE(25.0 / 48)},
    },
    {
        .degree = 5,
        .point_count = 7,
        .points = {CENTRE, ORBIT((9 + 2 * ROOT_15) / 21, (6 - ROOT_15) / 21),
                   ORBIT((9 - 2 * ROOT_15) / 21, (6 + ROOT_15) / 21)},
        .weights = {9.0 / 40, THREE((155 - ROOT_15) / 1200), THREE((155 + ROOT_15) / 1200)},
    },
    {
        .degree = 8,
        .point_count = 16,
        .points = {CENTRE, ORBIT(0.081414823414554, 0.459292588292723),
                   ORBIT(0.658861384496480, 0.170569307751760),
                   ORBIT(0.898905543365938, 0.050547228317031),
                   ORBIT_6(0.008394777409958, 0.263112829634638, 0.728492392955404)},
        .weights = {0.144315607677787, THREE(0.095091634267285), THREE(0.103217370534718),
                    THREE(0.032458497623198), THREE(0.027230314174435), THREE(0.027230314174435)},
    },
};

const pliant_triangle_rule *pliant_triangle_rule_of_degree(int degree)
{
    for (size_t i = 0; i < sizeof rules / sizeof rules[0]; i++)
        if (rules[i].degree == degree) return &rules[i];
    return NULL;
}
