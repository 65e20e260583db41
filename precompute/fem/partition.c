// partition.c: which rank has which nodes: METIS on the tetrahedra.
//
// This follows: G. Karypis, V. Kumar, A fast and high quality multilevel scheme for partitioning
// irregular graphs, SIAM J. Sci. Comput. 20, 1998. Nodes are parted by the mesh's dual graph.
#include "fem/partition.h"

#include "pliant/error.h"

#include <stdlib.h>

#ifndef PLIANT_WITHOUT_FEM
#include <metis.h>

// Nodes of elements, corners only: the midpoints go where the first of their ends goes.
static pliant_status part_corners(const pliant_tetrahedra *t, int parts, int32_t *part,
                                  pliant_error *err)
{
    idx_t elements = t->tet_count, corners = t->corner_count, common = 3, count = parts, cut = 0;
    idx_t *start = malloc(((size_t)elements + 1) * sizeof *start),
          *nodes = malloc(4 * (size_t)elements * sizeof *nodes);
    idx_t *of_element = malloc((size_t)elements * sizeof *of_element),
          *of_node = malloc((size_t)corners * sizeof *of_node);
    pliant_status status = PLIANT_OK;
    if (!start || !nodes || !of_element || !of_node) {
        status = pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for parting %d tetrahedra",
                                  t->tet_count);
    } else {
        for (idx_t e = 0; e <= elements; e++) start[e] = 4 * e;
        for (idx_t e = 0; e < elements; e++)
            for (int k = 0; k < 4; k++)
                nodes[4 * (size_t)e + k] = t->tets[(size_t)e * t->tet_nodes + k];
        idx_t options[METIS_NOPTIONS];
        METIS_SetDefaultOptions(options);
        options[METIS_OPTION_SEED] = 1;
        if (METIS_PartMeshDual(&elements, &corners, start, nodes, NULL, NULL, &common, &count, NULL,
                               options, &cut, of_element, of_node) != METIS_OK)
            status = pliant_error_set(err, PLIANT_ERR_MEMORY, "METIS cannot part %d tetrahedra",
                                      t->tet_count);
        for (int32_t i = 0; i < t->corner_count && status == PLIANT_OK; i++) part[i] = of_node[i];
    }
    free(of_node);
    free(of_element);
    free(nodes);
    free(start);
    return status;
}
#else
static pliant_status part_corners(const pliant_tetrahedra *t, int parts, int32_t *part,
                                  pliant_error *err)
{
    (void)t, (void)parts, (void)part;
    return pliant_error_set(err, PLIANT_ERR_MISSING, "this program was built without METIS");
}
#endif

pliant_status pliant_partition_nodes(const pliant_tetrahedra *t, const uint8_t *free_nodes,
                                     int parts, int32_t *part, pliant_error *err)
{
    if (parts == 1) {
        for (int32_t i = 0; i < t->corner_count; i++) part[i] = 0;
    } else {
        const pliant_status status = part_corners(t, parts, part, err);
        if (status < 0) return status;
    }
    for (int32_t i = t->corner_count; i < t->node_count; i++)
        part[i] = part[t->ends[2 * (size_t)(i - t->corner_count)]];
    for (int32_t i = 0; i < t->node_count; i++)
        if (!free_nodes[i]) part[i] = -1;
    return PLIANT_OK;
}
