// right_hand.c: the right-hand sides of the columns that are solved for (GF 7.3).
#include "right_hand.h"

static int32_t columns_of(const pliant_hats *hats, int32_t level)
{
    return hats->level_offset[level + 1];
}

int32_t pliant_right_hand_count(const pliant_problem *p, pliant_blocks blocks)
{
    const int32_t free_columns = columns_of(p->free_hats, p->levels.last);
    return blocks == PLIANT_BLOCKS_ALL ? free_columns + columns_of(p->fixed_hats, p->levels.last) : free_columns;
}

// b_hat_k = sum_j h_kj b_j for the hats of one domain.
static void contract(const pliant_hats *hats, const int32_t *nodes, int32_t level, int32_t rows,
                     const double *B, size_t ld_b, double *right, size_t ld_right)
{
    const int32_t *offset = hats->offset[level], *position = hats->position[level];
    const double *weight = hats->weight[level];
    for (int32_t k = 0; k < columns_of(hats, level); k++)
        for (int c = 0; c < 3; c++) {
            double *restrict to = right + (3 * (size_t)k + c) * ld_right;
            for (int32_t i = 0; i < rows; i++) to[i] = 0;
            for (int32_t e = offset[k]; e < offset[k + 1]; e++) {
                const double h = weight[e], *from = B + (3 * (size_t)nodes[position[e]] + c) * ld_b;
                for (int32_t i = 0; i < rows; i++) to[i] += h * from[i];
            }
        }
}

void pliant_right_hand_contract(const pliant_problem *p, pliant_blocks blocks, int32_t rows,
                                const double *B, size_t ld_b, double *right, size_t ld_right)
{
    contract(p->free_hats, p->free_nodes, p->levels.last, rows, B, ld_b, right, ld_right);
    if (blocks == PLIANT_BLOCKS_FREE) return;
    right += 3 * (size_t)columns_of(p->free_hats, p->levels.last) * ld_right;
    contract(p->fixed_hats, p->fixed_nodes, p->levels.last, rows, B, ld_b, right, ld_right);
}
