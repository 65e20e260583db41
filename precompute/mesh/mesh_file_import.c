// mesh_file_import.c: what the import library (assimp) reads: glTF, COLLADA, 3DS, FBX and more.
//
// Positions are floats there and vertices are split by material and texture, so all triangles of
// the scene, placed by their nodes, are merged and equal positions welded. Points and lines are
// dropped. The library opens the file itself: some formats lie in several files.
#include "mesh_file_formats.h"

#include "pliant/error.h"

#include <assimp/cimport.h>
#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

enum {
    NODE_DEPTH_LIMIT = 200, // of the scene's tree; tools nest some ten
    NODE_LIMIT = 10000000,  // visits, since nodes may name one mesh over and over
    EXTENSION_LENGTH_LIMIT = 16,
};

static int extension(const pliant_mesh_source *source, char text[EXTENSION_LENGTH_LIMIT])
{
    const char *dot = strrchr(source->name, '.');
    if (!dot || strchr(dot, '/') || strlen(dot) < 2 || strlen(dot) >= EXTENSION_LENGTH_LIMIT)
        return 0;
    memcpy(text, dot, strlen(dot) + 1);
    return 1;
}

int pliant_mesh_file_imports(const pliant_mesh_source *source)
{
    char text[EXTENSION_LENGTH_LIMIT];
    return source->path && extension(source, text) && aiIsExtensionSupported(text) == AI_TRUE;
}

static pliant_status add_mesh(const struct aiMesh *mesh, const struct aiMatrix4x4 *m,
                              const char *name, pliant_mesh_builder *builder, pliant_error *err)
{
    const int32_t base = builder->vertex_count;
    pliant_status status = PLIANT_OK;
    for (unsigned i = 0; status == PLIANT_OK && i < mesh->mNumVertices; i++) {
        const struct aiVector3D *v = mesh->mVertices + i;
        const double p[3] = {(double)v->x, (double)v->y, (double)v->z};
        const double x[3] = {
            (double)m->a1 * p[0] + (double)m->a2 * p[1] + (double)m->a3 * p[2] + (double)m->a4,
            (double)m->b1 * p[0] + (double)m->b2 * p[1] + (double)m->b3 * p[2] + (double)m->b4,
            (double)m->c1 * p[0] + (double)m->c2 * p[1] + (double)m->c3 * p[2] + (double)m->c4};
        if (!isfinite(x[0]) || !isfinite(x[1]) || !isfinite(x[2]))
            return pliant_error_set(err, PLIANT_ERR_FORMAT, "%s: vertex %d is not finite", name,
                                    builder->vertex_count);
        status = pliant_mesh_builder_vertex(builder, x, err);
    }
    // A mirroring node turns the triangles round.
    const double determinant =
        (double)m->a1 * ((double)m->b2 * (double)m->c3 - (double)m->b3 * (double)m->c2) -
        (double)m->a2 * ((double)m->b1 * (double)m->c3 - (double)m->b3 * (double)m->c1) +
        (double)m->a3 * ((double)m->b1 * (double)m->c2 - (double)m->b2 * (double)m->c1);
    for (unsigned f = 0; status == PLIANT_OK && f < mesh->mNumFaces; f++) {
        const struct aiFace *face = mesh->mFaces + f;
        if (face->mNumIndices != 3) continue;
        for (int k = 0; status == PLIANT_OK && k < 3; k++) {
            const int64_t index = face->mIndices[determinant < 0 ? 2 - k : k];
            const int64_t number = index < mesh->mNumVertices ? base + index : -1;
            status = pliant_mesh_builder_corner(builder, number, index, err);
        }
        if (status == PLIANT_OK) status = pliant_mesh_builder_polygon(builder, err);
    }
    return status;
}

static struct aiMatrix4x4 product(const struct aiMatrix4x4 *a, const struct aiMatrix4x4 *b)
{
    struct aiMatrix4x4 c = *a;
    aiMultiplyMatrix4(&c, b);
    return c;
}

typedef struct walk {
    const struct aiScene *scene;
    const char *name;
    pliant_mesh_builder *builder;
    int64_t visits;
} walk;

static pliant_status add_node(walk *w, const struct aiNode *node, const struct aiMatrix4x4 *parent,
                              int depth, pliant_error *err)
{
    if (depth > NODE_DEPTH_LIMIT || ++w->visits > NODE_LIMIT)
        return pliant_error_set(err, PLIANT_ERR_FORMAT, "%s: the scene nests too many nodes",
                                w->name);
    const struct aiMatrix4x4 placed = product(parent, &node->mTransformation);
    for (unsigned i = 0; i < node->mNumMeshes; i++) {
        if (node->mMeshes[i] >= w->scene->mNumMeshes) continue;
        const pliant_status status =
            add_mesh(w->scene->mMeshes[node->mMeshes[i]], &placed, w->name, w->builder, err);
        if (status < 0) return status;
    }
    for (unsigned i = 0; i < node->mNumChildren; i++) {
        const pliant_status status = add_node(w, node->mChildren[i], &placed, depth + 1, err);
        if (status < 0) return status;
    }
    return PLIANT_OK;
}

pliant_status pliant_mesh_file_import(const pliant_mesh_source *source,
                                      pliant_mesh_builder *builder, pliant_error *err)
{
    struct aiPropertyStore *store = aiCreatePropertyStore();
    if (!store)
        return pliant_error_set(err, PLIANT_ERR_MEMORY, "%s: no memory to import", source->name);
    // Nothing but positions: normals and textures would keep equal vertices apart.
    aiSetImportPropertyInteger(store, AI_CONFIG_PP_RVC_FLAGS,
                               aiComponent_NORMALS | aiComponent_TANGENTS_AND_BITANGENTS |
                                   aiComponent_COLORS | aiComponent_TEXCOORDS |
                                   aiComponent_BONEWEIGHTS | aiComponent_ANIMATIONS |
                                   aiComponent_TEXTURES | aiComponent_LIGHTS | aiComponent_CAMERAS);
    const struct aiScene *scene = aiImportFileExWithProperties(
        source->path,
        aiProcess_RemoveComponent | aiProcess_Triangulate | aiProcess_JoinIdenticalVertices, NULL,
        store);
    pliant_status status;
    if (!scene || !scene->mRootNode) {
        // The library's text may run over lines; messages are one line.
        char reason[200];
        snprintf(reason, sizeof reason, "%s", aiGetErrorString());
        reason[strcspn(reason, "\r\n")] = 0;
        status = pliant_error_set(err, PLIANT_ERR_FORMAT, "%s: the import library refuses it: %s",
                                  source->name, reason[0] ? reason : "no scene");
    } else {
        struct aiMatrix4x4 identity;
        aiIdentityMatrix4(&identity);
        walk w = {.scene = scene, .name = source->name, .builder = builder};
        status = add_node(&w, scene->mRootNode, &identity, 0, err);
        if (status == PLIANT_OK) status = pliant_mesh_builder_weld(builder, err);
    }
    if (scene) aiReleaseImport(scene);
    aiReleasePropertyStore(store);
    return status;
}
