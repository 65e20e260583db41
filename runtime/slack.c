// slack.c: where a displaced node would go if it were let go.
#include "solver.h"

#include <math.h>

// K = -C^-1 is the stiffness that the other nodes see when all of S is held: moving node i by d
// changes its traction by K_ii d. Let go, its traction vanishes:
//
//     d = -K_ii^-1 x_i = (C^-1)_ii^-1 x_i
int32_t pliant_solver_slack(const pliant_solver *solver, int32_t member, pliant_vec3 *u)
{
    const pliant_capacitance *type = solver->solved_type;
    const size_t at = 3 * (size_t)type->order[member];
    double k[3][3];
    for (size_t r = 0; r < 3; r++)
        for (size_t c = 0; c < 3; c++)
            k[r][c] = (double)type->product[at + r + (at + c) * type->stride];
    const pliant_vec3 traction = solver->reference[member];
    const double x[3] = {(double)traction.x, (double)traction.y, (double)traction.z};
    // Cramer's rule by cross products of columns.
    double cofactor[3][3];
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++) {
            const int r1 = (r + 1) % 3, r2 = (r + 2) % 3, c1 = (c + 1) % 3, c2 = (c + 2) % 3;
            cofactor[r][c] = k[r1][c1] * k[r2][c2] - k[r1][c2] * k[r2][c1];
        }
    const double determinant =
        k[0][0] * cofactor[0][0] + k[0][1] * cofactor[0][1] + k[0][2] * cofactor[0][2];
    double d[3];
    for (int c = 0; c < 3; c++)
        d[c] =
            (cofactor[0][c] * x[0] + cofactor[1][c] * x[1] + cofactor[2][c] * x[2]) / determinant;
    if (!isfinite(d[0]) || !isfinite(d[1]) || !isfinite(d[2])) return 0;
    const pliant_vec3 held = solver->solved[member].value;
    *u = (pliant_vec3){held.x + (float)d[0], held.y + (float)d[1], held.z + (float)d[2]};
    return 1;
}
