// triangle_rule.h: symmetric quadrature rules on the triangle.
#pragma once

enum { PLIANT_TRIANGLE_POINTS_MAX = 16 };

// The points in barycentric coordinates, and weights that sum to 1. Points come as the centroid, if
// the rule has it, then orbits of three points (share, other, other), (other, share, other),
// (other, other, share), then orbits of six.
typedef struct pliant_triangle_rule {
    int degree;  // polynomials up to this degree are integrated exactly
    int point_count;
    double points[PLIANT_TRIANGLE_POINTS_MAX][3];
    double weights[PLIANT_TRIANGLE_POINTS_MAX];
} pliant_triangle_rule;

// The rule of 4 points and degree 3, 7 and 5, or 16 and 8; NULL for any other degree. Static.
const pliant_triangle_rule *pliant_triangle_rule_of_degree(int degree);
