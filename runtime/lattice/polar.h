// polar.h: the rotation of the polar decomposition, eight matrices at once, warm-started.
//
// This is LSM 3.2's A_r = R_r U_r. Private to the runtime. A kernel that has its matrices at hand
// takes the quick part inline (polar_block.h) and leaves the rest to pliant_polar_finish.
#pragma once

#include <stdint.h>

// Rotations nearest to A: R maximises tr(R^T A) over proper rotations. That is A = R U where
// det A > 0, and the nearest proper rotation where A is inverted.
//   a         shape [block_count][9][8]: a[72 * block + 8 * (3 * r + c) + lane], row r, column c.
//   q         shape [block_count][4][8]: unit quaternions (x, y, z, w). In: where to start (the
//   last
//             step's; one that is no unit to 1e-3 counts as no rotation). Out: the result, on the
//             start's side.
//   rotation  shape [block_count][9][8], out: the matrices of q.
// Any numbers will do for a: a lane keeps its q where a is zero, denormal, beyond 1e37 or not
// finite. Where the nearest rotation is not unique (rank 1, symmetric inversions) it is the one
// nearest to the start. R^T A is symmetric to 1e-6 |A| (3e-7 |A| as a rule), R orthonormal to 1e-6.
// A lane's result does not depend on its neighbours, bit for bit.
void pliant_polar_blocks(int32_t block_count, const float *a, float *q, float *rotation);

static inline void pliant_polar_block(const float *a, float *q, float *rotation)
{
    pliant_polar_blocks(1, a, q, rotation);
}

// One block's lanes that pliant_polar_try (polar_block.h) left: missed[lane] != 0, q their start.
void pliant_polar_finish(const float *a, const int32_t missed[8], float *q, float *rotation);
