// volume.c: the inside of a surface as tetrahedra, from gmsh or from a Gmsh file.
//
// The surface goes to gmsh as discrete surfaces, one for each component, that it keeps as they are;
// what comes back is checked to have exactly this boundary (tetrahedra.c), whoever made it.
#include "fem/volume.h"

#include "fem/gmsh_library.h"
#include "fem/size_field.h"
#include "mesh/components.h"

#include "pliant/error.h"

#include <fcntl.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#ifdef PLIANT_WITHOUT_FEM

pliant_status pliant_volume_create(const pliant_volume_def *def, pliant_tetrahedra **tetrahedra,
                                   pliant_error *err)
{
    (void)tetrahedra;
    return pliant_error_set(
        err, PLIANT_ERR_MISSING,
        "%s: --method fem: this program was built without it (it takes libgmsh-dev and "
        "libmetis-dev): use --method bem",
        def->mesh_name);
}

#else

// What gmsh calls a triangle, and straight tetrahedra of 4 nodes.
enum { GMSH_TRIANGLE = 2, GMSH_TETRAHEDRON = 4 };

// Mesh.Algorithm3D. HXT is five times as fast as Delaunay and makes better elements of good
// surfaces; Delaunay sometimes fills what HXT does not.
static const struct {
    const char *name;
    double number;
} algorithms[] = {{"HXT", 10}, {"Delaunay", 1}};
enum { ALGORITHMS = sizeof algorithms / sizeof *algorithms };

static pliant_status no_memory(pliant_error *err, const char *name)
{
    return pliant_error_set(err, PLIANT_ERR_MEMORY, "%s: no memory for its inside", name);
}

// ---- To gmsh ----

// One component as a discrete surface; its tag, or < 0.
static int add_surface(const pliant_gmsh_library *gmsh, const pliant_mesh *surface,
                       const pliant_components *parts, int32_t part)
{
    const int32_t face_count = parts->face_start[part + 1] - parts->face_start[part];
    size_t *tags = malloc((size_t)surface->vertex_count * sizeof *tags);
    double *places = malloc((size_t)surface->vertex_count * 3 * sizeof *places);
    size_t *corners = malloc((size_t)face_count * 3 * sizeof *corners);
    int code = 1, tag = -1;
    if (tags && places && corners) {
        size_t count = 0;
        for (int32_t v = 0; v < surface->vertex_count; v++) {
            if (parts->of_vertex[v] != part) continue;
            memcpy(places + 3 * count, surface->vertices + 3 * (size_t)v, 3 * sizeof *places);
            tags[count++] = (size_t)v + 1;
        }
        for (int32_t f = 0; f < face_count; f++)
            for (int k = 0; k < 3; k++)
                corners[3 * (size_t)f + k] =
                    (size_t)
                        surface->faces[3 * (size_t)parts->faces[parts->face_start[part] + f] + k] +
                    1;
        tag = gmsh->gmshModelAddDiscreteEntity(2, -1, NULL, 0, &code);
        if (code == 0)
            gmsh->gmshModelMeshAddNodes(2, tag, tags, count, places, 3 * count, NULL, 0, &code);
        if (code == 0)
            gmsh->gmshModelMeshAddElementsByType(tag, GMSH_TRIANGLE, NULL, 0, corners,
                                                 3 * (size_t)face_count, &code);
    }
    free(corners);
    free(places);
    free(tags);
    return code == 0 ? tag : -1;
}

// A component at even depth with the cavities right in it.
static int add_body(const pliant_gmsh_library *gmsh, const pliant_mesh *surface,
                    const pliant_components *parts, int32_t body)
{
    int *loops = malloc((size_t)parts->count * sizeof *loops), code = 1;
    size_t count = 0;
    for (int32_t k = body; loops && k < body + parts->count; k++) {
        // The body itself comes first.
        const int32_t part = k % parts->count;
        if (part != body && parts->outer[part] != body) continue;
        int tag = add_surface(gmsh, surface, parts, part);
        if (tag < 0) goto done;
        loops[count++] = gmsh->gmshModelGeoAddSurfaceLoop(&tag, 1, -1, &code);
        if (code) goto done;
    }
    if (loops) (void)gmsh->gmshModelGeoAddVolume(loops, count, -1, &code);
    if (code == 0) gmsh->gmshModelGeoSynchronize(&code);
done:
    free(loops);
    return code == 0;
}

// ---- From gmsh ----

typedef struct raw {
    size_t *node_tags, node_count, largest_tag;
    double *places;
    size_t *corners, corner_count;  // tags, four for each tetrahedron
    int32_t *regions;
    int32_t *number;  // by node tag, -1 where there is none
} raw;

static void release(const pliant_gmsh_library *gmsh, raw *r)
{
    if (r->node_tags) gmsh->gmshFree(r->node_tags);
    if (r->places) gmsh->gmshFree(r->places);
    free(r->corners);
    free(r->regions);
    free(r->number);
    *r = (raw){0};
}

// Which material has the region `entity`? 0: that of the rest.
static pliant_status find_region(const pliant_gmsh_library *gmsh, const pliant_volume_def *def,
                                 int entity, int32_t *used, int32_t *region, pliant_error *err)
{
    int *groups = NULL, code = 1;
    size_t count = 0;
    *region = 0;
    gmsh->gmshModelGetPhysicalGroupsForEntity(3, entity, &groups, &count, &code);
    pliant_status status = PLIANT_OK;
    for (size_t i = 0; code == 0 && i < count && status == PLIANT_OK; i++) {
        char *name = NULL, digits[16];
        int failed = 1;
        gmsh->gmshModelGetPhysicalName(3, groups[i], &name, &failed);
        snprintf(digits, sizeof digits, "%d", groups[i]);
        for (int32_t k = 0; k < def->region_count; k++) {
            if ((failed || !name || strcmp(name, def->region_names[k]) != 0) &&
                strcmp(digits, def->region_names[k]) != 0)
                continue;
            used[k] = 1;
            if (*region && *region != k + 1)
                status = pliant_error_set(
                    err, PLIANT_ERR_FORMAT, "%s: its volume %d is of two materials, '%s' and '%s'",
                    def->file, entity, def->region_names[*region - 1], def->region_names[k]);
            else *region = k + 1;
        }
        if (name) gmsh->gmshFree(name);
    }
    if (groups) gmsh->gmshFree(groups);
    return status;
}

static pliant_status append(raw *r, const size_t *corners, size_t count, int32_t region,
                            const char *name, pliant_error *err)
{
    size_t *grown = realloc(r->corners, (r->corner_count + count + 1) * sizeof *grown);
    if (grown) r->corners = grown;
    int32_t *regions = realloc(r->regions, ((r->corner_count + count) / 4 + 1) * sizeof *regions);
    if (regions) r->regions = regions;
    if (!grown || !regions) return no_memory(err, name);
    memcpy(r->corners + r->corner_count, corners, count * sizeof *corners);
    for (size_t e = r->corner_count / 4; e < (r->corner_count + count) / 4; e++)
        r->regions[e] = region;
    r->corner_count += count;
    return PLIANT_OK;
}

// All straight tetrahedra of the current model, volume by volume.
static pliant_status fetch_elements(const pliant_gmsh_library *gmsh, const pliant_volume_def *def,
                                    raw *r, pliant_error *err)
{
    const char *name = def->file ? def->file : def->mesh_name;
    int *entities = NULL, code = 1;
    size_t count = 0;
    int32_t *used = calloc((size_t)def->region_count + 1, sizeof *used);
    if (!used) return no_memory(err, name);
    gmsh->gmshModelGetEntities(&entities, &count, 3, &code);
    pliant_status status = PLIANT_OK;
    for (size_t i = 0; code == 0 && i + 1 < count && status == PLIANT_OK; i += 2) {
        const int entity = entities[i + 1];
        int32_t region;
        status = find_region(gmsh, def, entity, used, &region, err);
        int *types = NULL, failed = 1;
        size_t type_count = 0;
        gmsh->gmshModelMeshGetElementTypes(&types, &type_count, 3, entity, &failed);
        for (size_t t = 0; !failed && t < type_count && status == PLIANT_OK; t++)
            if (types[t] != GMSH_TETRAHEDRON)
                status = pliant_error_set(
                    err, PLIANT_ERR_FORMAT,
                    "%s: expected tetrahedra of 4 nodes (Gmsh's type 4), found elements of type %d",
                    name, types[t]);
        if (types) gmsh->gmshFree(types);
        size_t *tags = NULL, *corners = NULL, tag_count = 0, corner_count = 0;
        if (status == PLIANT_OK) {
            gmsh->gmshModelMeshGetElementsByType(GMSH_TETRAHEDRON, &tags, &tag_count, &corners,
                                                 &corner_count, entity, 0, 1, &failed);
            if (!failed) status = append(r, corners, corner_count, region, name, err);
        }
        if (tags) gmsh->gmshFree(tags);
        if (corners) gmsh->gmshFree(corners);
    }
    for (int32_t k = 0; k < def->region_count && status == PLIANT_OK; k++)
        if (!used[k])
            status =
                pliant_error_set(err, PLIANT_ERR_FORMAT,
                                 "%s: has no physical volume '%s', for which --material is given",
                                 name, def->region_names[k]);
    if (entities) gmsh->gmshFree(entities);
    free(used);
    return status;
}

static pliant_status fetch(const pliant_gmsh_library *gmsh, const pliant_volume_def *def, raw *r,
                           pliant_error *err)
{
    const char *name = def->file ? def->file : def->mesh_name;
    double *parameters = NULL;
    size_t place_count = 0, parameter_count = 0;
    int code = 1;
    gmsh->gmshModelMeshGetNodes(&r->node_tags, &r->node_count, &r->places, &place_count,
                                &parameters, &parameter_count, -1, -1, 0, 0, &code);
    if (parameters) gmsh->gmshFree(parameters);
    if (code || place_count != 3 * r->node_count)
        return pliant_error_set(err, PLIANT_ERR_FORMAT, "%s: its nodes cannot be read", name);
    const pliant_status status = fetch_elements(gmsh, def, r, err);
    if (status < 0) return status;
    for (size_t i = 0; i < r->node_count; i++)
        if (r->node_tags[i] > r->largest_tag) r->largest_tag = r->node_tags[i];
    if (r->node_count > INT32_MAX || r->corner_count / 4 > INT32_MAX / 10 ||
        r->largest_tag > (size_t)1 << 32)
        return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                "%s: %zu nodes and %zu tetrahedra are too many", name,
                                r->node_count, r->corner_count / 4);
    r->number = malloc((r->largest_tag + 1) * sizeof *r->number);
    if (!r->number) return no_memory(err, name);
    for (size_t t = 0; t <= r->largest_tag; t++) r->number[t] = -1;
    return PLIANT_OK;
}

// What has been gathered: nodes from the surface's on, and tetrahedra.
typedef struct inside {
    int32_t node_count;
    size_t tet_count;
    double *nodes;
    int32_t *tets, *regions;
} inside;

static void discard(inside *in)
{
    free(in->regions);
    free(in->tets);
    free(in->nodes);
}

// Add raw tetrahedra, with every node's number known; of `node_count` nodes in all.
static pliant_status gather(const char *name, const raw *r, int32_t node_count, inside *in,
                            pliant_error *err)
{
    const size_t added = r->corner_count / 4;
    if (in->tet_count + added > INT32_MAX / 10)
        return pliant_error_set(err, PLIANT_ERR_FORMAT, "%s: %zu tetrahedra are too many", name,
                                in->tet_count + added);
    double *nodes = realloc(in->nodes, (size_t)node_count * 3 * sizeof *nodes);
    if (nodes) in->nodes = nodes;
    int32_t *tets = realloc(in->tets, (in->tet_count + added + 1) * 4 * sizeof *tets);
    if (tets) in->tets = tets;
    int32_t *regions = realloc(in->regions, (in->tet_count + added + 1) * sizeof *regions);
    if (regions) in->regions = regions;
    if (!nodes || !tets || !regions) return no_memory(err, name);
    in->node_count = node_count;
    for (size_t i = 0; i < r->node_count; i++) {
        const int32_t number = r->number[r->node_tags[i]];
        if (number >= 0) memcpy(nodes + 3 * (size_t)number, r->places + 3 * i, 3 * sizeof *nodes);
    }
    for (size_t k = 0; k < r->corner_count; k++) {
        const int32_t number = r->corners[k] <= r->largest_tag ? r->number[r->corners[k]] : -1;
        if (number < 0)
            return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                    "%s: a tetrahedron names node %zu, which is not there", name,
                                    r->corners[k]);
        tets[4 * in->tet_count + k] = number;
    }
    if (added > 0) memcpy(regions + in->tet_count, r->regions, added * sizeof *regions);
    in->tet_count += added;
    return PLIANT_OK;
}

static pliant_status hand_on(const pliant_volume_def *def, const inside *in,
                             pliant_tetrahedra **tetrahedra, pliant_error *err)
{
    const pliant_tetrahedra_def out = {def->file ? def->file : def->mesh_name,
                                       in->node_count,
                                       (int32_t)in->tet_count,
                                       in->nodes,
                                       in->tets,
                                       in->regions};
    return pliant_tetrahedra_create(def->surface, &out, tetrahedra, err);
}

// ---- Meshing the inside ----

// gmsh's question how long edges should be at a place. 4.9 and later also tell their own idea.
#if GMSH_API_VERSION_MAJOR > 4 || GMSH_API_VERSION_MINOR > 8
static double size_at(int dimension, int tag, double x, double y, double z, double own, void *data)
#else
static double size_at(int dimension, int tag, double x, double y, double z, void *data)
#endif
{
    (void)dimension;
    (void)tag;
#if GMSH_API_VERSION_MAJOR > 4 || GMSH_API_VERSION_MINOR > 8
    (void)own;
#endif
    return pliant_size_field_at(data, (const double[3]){x, y, z});
}

// One body by one algorithm, checked against its own boundary when all are there.
static pliant_status mesh_body(const pliant_gmsh_library *gmsh, const pliant_volume_def *def,
                               const pliant_components *parts, int32_t body, double algorithm,
                               pliant_size_field *sizes, inside *in, pliant_error *err)
{
    int code;
    char reason[256];
    gmsh->gmshClear(&code);
    gmsh->gmshModelAdd("solid", &code);
    gmsh->gmshOptionSetNumber("Mesh.Algorithm3D", algorithm, &code);
    // Else the surface's sizes are carried inwards, and the smaller ones win.
    gmsh->gmshOptionSetNumber("Mesh.MeshSizeExtendFromBoundary", 0, &code);
    gmsh->gmshModelMeshSetSizeCallback(size_at, sizes, &code);
    if (!add_body(gmsh, def->surface, parts, body)) code = 1;
    else gmsh->gmshModelMeshGenerate(3, &code);
    if (code) {
        pliant_gmsh_library_reason(gmsh, reason, sizeof reason);
        return pliant_error_set(err, PLIANT_ERR_FORMAT, "%s", reason);
    }
    raw r = {0};
    pliant_status status = fetch(gmsh, def, &r, err);
    if (status == PLIANT_OK) {
        // The body's surface has its vertices' numbers from 1 on as tags; what gmsh adds may have
        // those of other bodies.
        const size_t n = (size_t)def->surface->vertex_count;
        int32_t next = in->node_count;
        for (size_t i = 0; i < r.node_count; i++) {
            const size_t tag = r.node_tags[i];
            const int32_t part = tag <= n ? parts->of_vertex[tag - 1] : -1;
            const int is_surface = part >= 0 && (part == body || parts->outer[part] == body);
            r.number[tag] = is_surface ? (int32_t)tag - 1 : next++;
        }
        status = gather(def->mesh_name, &r, next, in, err);
    }
    release(gmsh, &r);
    return status;
}

static pliant_status try_algorithm(const pliant_gmsh_library *gmsh, const pliant_volume_def *def,
                                   const pliant_components *parts, double algorithm,
                                   pliant_size_field *sizes, pliant_tetrahedra **tetrahedra,
                                   pliant_error *err)
{
    inside in = {.node_count = def->surface->vertex_count};
    pliant_status status = PLIANT_OK;
    // Bodies one by one: they share nothing.
    for (int32_t k = 0; k < parts->count && status == PLIANT_OK; k++)
        if (parts->depth[k] % 2 == 0)
            status = mesh_body(gmsh, def, parts, k, algorithm, sizes, &in, err);
    if (status == PLIANT_OK) status = hand_on(def, &in, tetrahedra, err);
    discard(&in);
    return status;
}

static pliant_status mesh_inside(const pliant_gmsh_library *gmsh, const pliant_volume_def *def,
                                 pliant_tetrahedra **tetrahedra, pliant_error *err)
{
    pliant_components *parts = NULL;
    pliant_size_field *sizes = NULL;
    pliant_status status = pliant_size_field_create(def->surface, def->growth, &sizes, err);
    if (status == PLIANT_OK)
        status = pliant_components_create(def->surface, def->mesh_name, &parts, err);
    if (status < 0) {
        pliant_size_field_destroy(sizes);
        return status;
    }
    pliant_error reasons[ALGORITHMS] = {{""}};
    // Some of gmsh's parts print past its own settings.
    fflush(stdout);
    const int quiet = open("/dev/null", O_WRONLY), output = dup(STDOUT_FILENO);
    if (quiet >= 0 && output >= 0) dup2(quiet, STDOUT_FILENO);
    for (int i = 0; i < ALGORITHMS; i++) {
        status = try_algorithm(gmsh, def, parts, algorithms[i].number, sizes, tetrahedra,
                               &reasons[i]);
        if (status == PLIANT_OK || status == PLIANT_ERR_MEMORY) break;
    }
    fflush(stdout);
    if (quiet >= 0 && output >= 0) dup2(output, STDOUT_FILENO);
    if (output >= 0) close(output);
    if (quiet >= 0) close(quiet);
    pliant_components_destroy(parts);
    pliant_size_field_destroy(sizes);
    int code;
    gmsh->gmshModelMeshRemoveSizeCallback(&code);
    if (status < 0)
        return pliant_error_set(err, status,
                                "%s: its inside cannot be cut into tetrahedra (%s: %.120s; %s: "
                                "%.120s): the surface may "
                                "cut itself; use --method bem, or give --volume FILE.msh",
                                def->mesh_name, algorithms[0].name, reasons[0].text,
                                algorithms[1].name, reasons[1].text);
    return PLIANT_OK;
}

// ---- A given volume ----

// How far a file's surface nodes may be from the model's, in diagonals of its box: files of 7
// digits will do.
static const double reach = 1e-6;

typedef struct by_x {
    double x;
    int32_t index;
} by_x;

static int compare_x(const void *a, const void *b)
{
    const double s = ((const by_x *)a)->x, t = ((const by_x *)b)->x;
    return (s > t) - (s < t);
}

static double diagonal_of(const pliant_mesh *mesh)
{
    double sum = 0;
    for (int i = 0; i < 3; i++) {
        double low = INFINITY, high = -INFINITY;
        for (int32_t v = 0; v < mesh->vertex_count; v++) {
            low = fmin(low, mesh->vertices[3 * (size_t)v + i]);
            high = fmax(high, mesh->vertices[3 * (size_t)v + i]);
        }
        sum += (high - low) * (high - low);
    }
    return sqrt(sum);
}

static pliant_status match_surface(const pliant_volume_def *def, raw *r, int32_t *node_count,
                                   pliant_error *err)
{
    const pliant_mesh *mesh = def->surface;
    // Nodes of no tetrahedron (the ends of lines, centres) match nothing.
    for (size_t k = 0; k < r->corner_count; k++)
        if (r->corners[k] <= r->largest_tag) r->number[r->corners[k]] = -2;
    by_x *sorted = malloc((r->node_count + 1) * sizeof *sorted);
    if (!sorted) return no_memory(err, def->file);
    size_t count = 0;
    for (size_t i = 0; i < r->node_count; i++)
        if (r->number[r->node_tags[i]] == -2)
            sorted[count++] = (by_x){r->places[3 * i], (int32_t)i};
    qsort(sorted, count, sizeof *sorted, compare_x);
    const double tolerance = reach * diagonal_of(mesh);
    pliant_status status = PLIANT_OK;
    for (int32_t v = 0; v < mesh->vertex_count && status == PLIANT_OK; v++) {
        const double *x = mesh->vertices + 3 * (size_t)v;
        size_t begin = 0, end = count;
        while (begin < end) {
            const size_t middle = (begin + end) / 2;
            if (sorted[middle].x < x[0] - tolerance) begin = middle + 1;
            else end = middle;
        }
        double best = tolerance;
        int32_t found = -1;
        for (; begin < count && sorted[begin].x <= x[0] + tolerance; begin++) {
            const double *y = r->places + 3 * (size_t)sorted[begin].index;
            const double away = sqrt((x[0] - y[0]) * (x[0] - y[0]) + (x[1] - y[1]) * (x[1] - y[1]) +
                                     (x[2] - y[2]) * (x[2] - y[2]));
            if (away <= best) best = away, found = sorted[begin].index;
        }
        if (found < 0 || r->number[r->node_tags[found]] >= 0)
            status = pliant_error_set(
                err, PLIANT_ERR_FORMAT,
                "%s: its boundary is not the model's surface: no node of it lies at vertex %d, "
                "%.9g %.9g %.9g",
                def->file, v, x[0], x[1], x[2]);
        else r->number[r->node_tags[found]] = v;
    }
    *node_count = mesh->vertex_count;
    for (size_t i = 0; i < r->node_count; i++)
        if (r->number[r->node_tags[i]] == -2) r->number[r->node_tags[i]] = (*node_count)++;
    free(sorted);
    return status;
}

static pliant_status read_inside(const pliant_gmsh_library *gmsh, const pliant_volume_def *def,
                                 pliant_tetrahedra **tetrahedra, pliant_error *err)
{
    char reason[256];
    int code = 1;
    FILE *file = fopen(def->file, "rb");
    if (!file) return pliant_error_set(err, PLIANT_ERR_IO, "%s: cannot be opened", def->file);
    char first[12] = "";
    const size_t got = fread(first, 1, sizeof first - 1, file);
    fclose(file);
    // By its content: gmsh would take many other things for a script to run.
    if (got < sizeof first - 1 || memcmp(first, "$MeshFormat", sizeof first - 1) != 0)
        return pliant_error_set(err, PLIANT_ERR_FORMAT,
                                "%s: expected a Gmsh mesh file, beginning with $MeshFormat",
                                def->file);
    gmsh->gmshOpen(def->file, &code);
    if (code) {
        pliant_gmsh_library_reason(gmsh, reason, sizeof reason);
        return pliant_error_set(err, PLIANT_ERR_FORMAT, "%s: gmsh cannot read it: %s", def->file,
                                reason);
    }
    raw r = {0};
    int32_t node_count = 0;
    pliant_status status = fetch(gmsh, def, &r, err);
    if (status == PLIANT_OK && r.corner_count == 0)
        status = pliant_error_set(err, PLIANT_ERR_FORMAT, "%s: has no tetrahedra", def->file);
    if (status == PLIANT_OK) status = match_surface(def, &r, &node_count, err);
    inside in = {0};
    if (status == PLIANT_OK) status = gather(def->file, &r, node_count, &in, err);
    if (status == PLIANT_OK) status = hand_on(def, &in, tetrahedra, err);
    discard(&in);
    release(gmsh, &r);
    return status;
}

pliant_status pliant_volume_create(const pliant_volume_def *def, pliant_tetrahedra **tetrahedra,
                                   pliant_error *err)
{
    pliant_gmsh_library gmsh;
    pliant_status status = pliant_gmsh_library_open(&gmsh, err);
    if (status < 0) return status;
    status = def->file ? read_inside(&gmsh, def, tetrahedra, err)
                       : mesh_inside(&gmsh, def, tetrahedra, err);
    pliant_gmsh_library_close(&gmsh);
    return status;
}
#endif
