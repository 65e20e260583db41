// refine.c: the topology of one subdivision step.
#include "pliant/refine.h"

#include "pliant/halfedge.h"

#include <string.h>

void pliant_refine_number(int32_t vertex_count, int32_t face_count, const int32_t *faces,
                          const int32_t *twin, int32_t *odd, int32_t *parents)
{
    int32_t next = 0;
    for (int32_t h = 0; h < 3 * face_count; h++) {
        if (twin[h] < h) {
            odd[h] = odd[twin[h]];
            continue;
        }
        const int32_t a = faces[h], b = faces[pliant_halfedge_next(h)];
        if (parents) {
            parents[2 * (size_t)next] = a < b ? a : b;
            parents[2 * (size_t)next + 1] = a < b ? b : a;
        }
        odd[h] = vertex_count + next++;
    }
}

// From the last face, whose room nothing else needs.
void pliant_refine_faces(int32_t face_count, const int32_t *odd, int32_t *faces)
{
    for (int32_t f = face_count - 1; f >= 0; f--) {
        const int32_t *c = faces + 3 * (size_t)f, *m = odd + 3 * (size_t)f;
        const int32_t children[12] = {c[0], m[0], m[2], c[1], m[1], m[0],
                                      c[2], m[2], m[1], m[0], m[1], m[2]};
        memcpy(faces + 12 * (size_t)f, children, sizeof children);
    }
}

// Half-edge k of face f is cut into side 0 of child k and side 2 of child k+1; side 1 of child k
// faces side k-1 of the middle child.
void pliant_refine_twins(int32_t face_count, int32_t *twin)
{
    for (int32_t f = face_count - 1; f >= 0; f--) {
        const int32_t across[3] = {twin[3 * f], twin[3 * f + 1], twin[3 * f + 2]};
        int32_t *child = twin + 12 * (size_t)f;
        for (int32_t k = 0; k < 3; k++) {
            const int32_t g = across[k] / 3, j = across[k] % 3, next = (k + 1) % 3,
                          last = (k + 2) % 3;
            child[3 * k] = 3 * (4 * g + (j + 1) % 3) + 2;
            child[3 * next + 2] = 3 * (4 * g + j);
            child[3 * k + 1] = 3 * (4 * f + 3) + last;
            child[9 + last] = 3 * (4 * f + k) + 1;
        }
    }
}
