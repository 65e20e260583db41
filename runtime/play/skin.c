// skin.c: the detailed surface that goes with a player's surface, as displacements from rest.
#include "skin.h"

#include "pliant/error.h"

#include <stdlib.h>

pliant_status pliant_skin_create(const pliant_model *model, int32_t level, pliant_skin **skin,
                                 pliant_error *err)
{
    pliant_skin *s = calloc(1, sizeof *s);
    if (!s) return pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for a detail");
    pliant_status status = pliant_detail_create(model, level, &s->detail, err);
    if (status < 0) goto refused;
    const pliant_detail_info info = pliant_detail_describe(s->detail);
    const size_t n = (size_t)info.vertex_count;
    s->vertex_count = info.vertex_count;
    s->face_count = info.face_count;
    s->faces = pliant_detail_faces(s->detail);
    s->rest = malloc(3 * n * sizeof *s->rest);
    s->displacement = malloc(n * sizeof *s->displacement);
    s->normals = malloc(n * sizeof *s->normals);
    if (!s->rest || !s->displacement || !s->normals) {
        status = pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for a detail of %d vertices",
                                  info.vertex_count);
        goto refused;
    }
    status = pliant_detail_evaluate(s->detail, NULL, s->displacement, s->normals);
    for (size_t v = 0; v < n; v++) {
        s->rest[3 * v] = (double)s->displacement[v].x;
        s->rest[3 * v + 1] = (double)s->displacement[v].y;
        s->rest[3 * v + 2] = (double)s->displacement[v].z;
        s->displacement[v] = (pliant_vec3){0, 0, 0};
    }
    *skin = s;
    return PLIANT_OK;
refused:
    pliant_skin_destroy(s);
    return status;
}

void pliant_skin_destroy(pliant_skin *skin)
{
    if (!skin) return;
    free(skin->normals);
    free(skin->displacement);
    free(skin->rest);
    pliant_detail_destroy(skin->detail);
    free(skin);
}

void pliant_skin_move(pliant_skin *skin, const pliant_vec3 *u)
{
    // Folded places are what is to be seen there, too.
    (void)!pliant_detail_evaluate(skin->detail, u, skin->displacement, skin->normals);
    for (size_t v = 0; v < (size_t)skin->vertex_count; v++) {
        skin->displacement[v].x -= (float)skin->rest[3 * v];
        skin->displacement[v].y -= (float)skin->rest[3 * v + 1];
        skin->displacement[v].z -= (float)skin->rest[3 * v + 2];
    }
}
