// surfaces.c: the small closed surfaces that tests share, and what they do to them.
//
// Written apart from the library's own subdivision, so that each can be held against the other.
#include "surfaces.h"

#include "pliant/halfedge.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void *reserve(size_t bytes)
{
    void *block = malloc(bytes ? bytes : 1);
    if (!block) fail_msg("no memory for %zu bytes", bytes);
    return block;
}

static pliant_mesh *make(int32_t vertex_count, const double (*vertices)[3], int32_t face_count,
                         const int32_t (*faces)[3])
{
    pliant_mesh *mesh = NULL;
    pliant_error err;
    check_ok(pliant_mesh_create(vertex_count, face_count, &mesh, &err), &err);
    if (vertices) memcpy(mesh->vertices, vertices, (size_t)vertex_count * 3 * sizeof(double));
    if (faces) memcpy(mesh->faces, faces, (size_t)face_count * 3 * sizeof(int32_t));
    return mesh;
}

// ---- Base meshes ----

pliant_mesh *check_tetrahedron(void)
{
    static const double v[4][3] = {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};
    static const int32_t f[4][3] = {{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 3, 2}};
    return make(4, v, 4, f);
}

pliant_mesh *check_octahedron(void)
{
    static const double v[6][3] = {{1, 0, 0},  {-1, 0, 0}, {0, 1, 0},
                                   {0, -1, 0}, {0, 0, 1},  {0, 0, -1}};
    static const int32_t f[8][3] = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                                    {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
    return make(6, v, 8, f);
}

pliant_mesh *check_icosahedron(void)
{
    static const int32_t f[20][3] = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                                     {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                                     {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                                     {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
    const double golden = (1 + sqrt(5)) / 2, p = 1 / hypot(1, golden), q = golden * p;
    const double v[12][3] = {{-p, q, 0}, {p, q, 0}, {-p, -q, 0}, {p, -q, 0},
                             {0, -p, q}, {0, p, q}, {0, -p, -q}, {0, p, -q},
                             {q, 0, -p}, {q, 0, p}, {-q, 0, -p}, {-q, 0, p}};
    return make(12, v, 20, f);
}

pliant_mesh *check_cube(void)
{
    static const double v[8][3] = {{-1, -1, -1}, {1, -1, -1}, {-1, 1, -1}, {1, 1, -1},
                                   {-1, -1, 1},  {1, -1, 1},  {-1, 1, 1},  {1, 1, 1}};
    static const int32_t f[12][3] = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6},
                                     {0, 1, 5}, {0, 5, 4}, {2, 6, 7}, {2, 7, 3},
                                     {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
    return make(8, v, 12, f);
}

pliant_mesh *check_torus(int32_t rows, int32_t columns)
{
    const double turn = 6.283185307179586;
    pliant_mesh *mesh = make(rows * columns, NULL, 2 * rows * columns, NULL);
    int32_t *f = mesh->faces;
    for (int32_t i = 0; i < rows; i++)
        for (int32_t j = 0; j < columns; j++, f += 6) {
            // Rows go round the tube (radius 0.35), columns round the hole (radius 0.65).
            const double u = turn * i / rows, w = turn * j / columns, r = 0.65 + 0.35 * cos(u);
            double *x = mesh->vertices + 3 * (i * columns + j);
            x[0] = r * cos(w), x[1] = r * sin(w), x[2] = 0.35 * sin(u);
            const int32_t down = (i + 1) % rows, right = (j + 1) % columns;
            const int32_t a = i * columns + j, b = i * columns + right;
            const int32_t c = down * columns + right, d = down * columns + j;
            f[0] = a, f[1] = b, f[2] = c;
            f[3] = a, f[4] = c, f[5] = d;
        }
    return mesh;
}

// Is the unit cube with its lowest corner there part of the block?
static int block_has(int32_t genus, int32_t x, int32_t y, int32_t z)
{
    if (x < 0 || x > 2 * genus || y < 0 || y > 2 || z != 0) return 0;
    return !(y == 1 && x % 2 == 1);
}

pliant_mesh *check_block(int32_t genus)
{
    // The corners of unit cube side s, counterclockwise from outside; sides -x +x -y +y -z +z.
    static const int8_t step[6][3] = {{-1, 0, 0}, {1, 0, 0},  {0, -1, 0},
                                      {0, 1, 0},  {0, 0, -1}, {0, 0, 1}};
    static const int8_t corner[6][4][3] = {
        {{0, 0, 0}, {0, 0, 1}, {0, 1, 1}, {0, 1, 0}}, {{1, 0, 0}, {1, 1, 0}, {1, 1, 1}, {1, 0, 1}},
        {{0, 0, 0}, {1, 0, 0}, {1, 0, 1}, {0, 0, 1}}, {{0, 1, 0}, {0, 1, 1}, {1, 1, 1}, {1, 1, 0}},
        {{0, 0, 0}, {0, 1, 0}, {1, 1, 0}, {1, 0, 0}}, {{0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}},
    };
    const int32_t columns = 2 * genus + 1, points = (columns + 1) * 4 * 2;
    int32_t *number = reserve((size_t)points * sizeof *number);
    for (int32_t i = 0; i < points; i++) number[i] = -1;
    int32_t(*faces)[3] = reserve((size_t)columns * 3 * 12 * sizeof *faces);
    double(*vertices)[3] = reserve((size_t)points * sizeof *vertices);
    int32_t vertex_count = 0, face_count = 0;
    for (int32_t x = 0; x < columns; x++)
        for (int32_t y = 0; y < 3; y++)
            for (int s = 0; s < 6; s++) {
                if (!block_has(genus, x, y, 0) ||
                    block_has(genus, x + step[s][0], y + step[s][1], step[s][2]))
                    continue;
                int32_t q[4];
                for (int k = 0; k < 4; k++) {
                    const int32_t px = x + corner[s][k][0], py = y + corner[s][k][1];
                    const int32_t pz = corner[s][k][2], at = (px * 4 + py) * 2 + pz;
                    if (number[at] < 0) {
                        vertices[vertex_count][0] = px - columns / 2.0;
                        vertices[vertex_count][1] = py - 1.5;
                        vertices[vertex_count][2] = pz - 0.5;
                        number[at] = vertex_count++;
                    }
                    q[k] = number[at];
                }
                memcpy(faces[face_count++], (int32_t[3]){q[0], q[1], q[2]}, sizeof *faces);
                memcpy(faces[face_count++], (int32_t[3]){q[0], q[2], q[3]}, sizeof *faces);
            }
    pliant_mesh *mesh =
        make(vertex_count, (const double(*)[3])vertices, face_count, (const int32_t(*)[3])faces);
    free(vertices);
    free(faces);
    free(number);
    return mesh;
}

pliant_mesh *check_beside(pliant_mesh *first, pliant_mesh *second)
{
    const int32_t v = first->vertex_count, f = first->face_count;
    pliant_mesh *mesh = make(v + second->vertex_count, NULL, f + second->face_count, NULL);
    memcpy(mesh->vertices, first->vertices, (size_t)v * 3 * sizeof(double));
    memcpy(mesh->faces, first->faces, (size_t)f * 3 * sizeof(int32_t));
    double right = -INFINITY, left = INFINITY;
    for (int32_t i = 0; i < v; i++) right = fmax(right, first->vertices[3 * i]);
    for (int32_t i = 0; i < second->vertex_count; i++) left = fmin(left, second->vertices[3 * i]);
    for (int32_t i = 0; i < 3 * second->vertex_count; i++)
        mesh->vertices[3 * v + i] = second->vertices[i] + (i % 3 == 0 ? right - left + 0.5 : 0);
    for (int32_t i = 0; i < 3 * second->face_count; i++)
        mesh->faces[3 * f + i] = second->faces[i] + v;
    pliant_mesh_destroy(second);
    pliant_mesh_destroy(first);
    return mesh;
}

pliant_mesh *check_load_obj(const char *path)
{
    FILE *file = fopen(path, "r");
    if (!file) return NULL;
    pliant_mesh *mesh = NULL;
    char line[256];
    int32_t vertex_count = 0, face_count = 0;
    while (fgets(line, sizeof line, file)) {
        vertex_count += strncmp(line, "v ", 2) == 0;
        face_count += strncmp(line, "f ", 2) == 0;
    }
    mesh = make(vertex_count, NULL, face_count, NULL);
    rewind(file);
    double *v = mesh->vertices;
    int32_t *f = mesh->faces;
    int sound = vertex_count > 0 && face_count > 0;
    while (sound && fgets(line, sizeof line, file)) {
        if (strncmp(line, "v ", 2) == 0) {
            sound = sscanf(line + 2, "%lf %lf %lf", &v[0], &v[1], &v[2]) == 3;
            v += 3;
        } else if (strncmp(line, "f ", 2) == 0) {
            sound = sscanf(line + 2, "%d%*[^ ] %d%*[^ ] %d", &f[0], &f[1], &f[2]) == 3 ||
                    sscanf(line + 2, "%d %d %d", &f[0], &f[1], &f[2]) == 3;
            for (int k = 0; k < 3; k++) sound = sound && f[k] >= 1 && f[k]-- <= vertex_count;
            f += 3;
        }
    }
    fclose(file);
    if (sound) return mesh;
    pliant_mesh_destroy(mesh);
    return NULL;
}

// ---- Surfaces with levels ----

// The number of the odd vertex on every half-edge, and the two ends of each, by asking for twins.
static int32_t number_edges(const pliant_mesh *mesh, int32_t *odd, int32_t *parents)
{
    pliant_error err;
    const int32_t side_count = 3 * mesh->face_count;
    int32_t *twin = reserve((size_t)side_count * sizeof *twin);
    check_ok(pliant_halfedge_match(mesh->vertex_count, mesh->face_count, mesh->faces, twin, &err),
             &err);
    int32_t next = 0;
    for (int32_t h = 0; h < side_count; h++) {
        if (twin[h] < h) {
            odd[h] = odd[twin[h]];
            continue;
        }
        const int32_t a = mesh->faces[h], b = mesh->faces[pliant_halfedge_next(h)];
        parents[2 * next] = a < b ? a : b;
        parents[2 * next + 1] = a < b ? b : a;
        odd[h] = mesh->vertex_count + next++;
    }
    free(twin);
    return next;
}

static void refine_once(check_surface *s)
{
    pliant_mesh *coarse = s->mesh;
    const int32_t v = coarse->vertex_count, f = coarse->face_count;
    int32_t *odd = reserve((size_t)f * 3 * sizeof *odd);
    const size_t old_rows = (size_t)(v - s->vertex_count[0]), new_rows = (size_t)f / 2 * 3;
    int32_t *parents = reserve((old_rows + new_rows) * 2 * sizeof *parents);
    if (old_rows) memcpy(parents, s->parents, old_rows * 2 * sizeof *parents);
    number_edges(coarse, odd, parents + 2 * old_rows);
    pliant_mesh *fine = make(v + (int32_t)new_rows, NULL, 4 * f, NULL);
    memcpy(fine->vertices, coarse->vertices, (size_t)v * 3 * sizeof(double));
    for (int32_t i = 0; i < 3 * (int32_t)new_rows; i++) {
        const int32_t *p = parents + 2 * (old_rows + (size_t)i / 3);
        fine->vertices[3 * v + i] =
            (coarse->vertices[3 * p[0] + i % 3] + coarse->vertices[3 * p[1] + i % 3]) / 2;
    }
    for (int32_t i = 0; i < f; i++) {
        const int32_t *c = coarse->faces + 3 * i, *m = odd + 3 * i;
        const int32_t children[12] = {c[0], m[0], m[2], c[1], m[1], m[0],
                                      c[2], m[2], m[1], m[0], m[1], m[2]};
        memcpy(fine->faces + 12 * i, children, sizeof children);
    }
    free(odd);
    free(s->parents);
    pliant_mesh_destroy(coarse);
    s->mesh = fine;
    s->parents = parents;
    s->vertex_count[s->level_count++] = fine->vertex_count;
}

static void measure(check_surface *s)
{
    const pliant_mesh *m = s->mesh;
    pliant_mesh_vertex_areas(m->vertex_count, m->vertices, m->face_count, m->faces, s->areas);
}

check_surface check_refine(pliant_mesh *base, int32_t levels)
{
    check_surface s = {.mesh = base, .level_count = 1, .vertex_count = {base->vertex_count}};
    s.parents = reserve(0);
    while (s.level_count <= levels) refine_once(&s);
    s.areas = reserve((size_t)s.mesh->vertex_count * sizeof(double));
    measure(&s);
    return s;
}

check_surface check_sphere(int32_t levels)
{
    check_surface s = check_refine(check_icosahedron(), levels);
    for (int32_t i = 0; i < s.mesh->vertex_count; i++) {
        double *x = s.mesh->vertices + 3 * i;
        const double length = sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]);
        for (int c = 0; c < 3; c++) x[c] /= length;
    }
    measure(&s);
    return s;
}

check_surface check_blob(int32_t levels)
{
    check_surface s = check_sphere(levels);
    for (int32_t i = 0; i < s.mesh->vertex_count; i++) {
        double *x = s.mesh->vertices + 3 * i;
        const double r = 1 + 0.25 * x[0] + 0.15 * x[1] * x[2] + 0.1 * x[2] * x[2] * x[2];
        x[0] *= 1.2 * r, x[1] *= r, x[2] *= 0.8 * r;
    }
    measure(&s);
    return s;
}

void check_surface_destroy(check_surface *surface)
{
    free(surface->areas);
    free(surface->parents);
    pliant_mesh_destroy(surface->mesh);
    *surface = (check_surface){0};
}

pliant_hierarchy *check_hierarchy(const check_surface *s)
{
    pliant_hierarchy *hierarchy = NULL;
    pliant_error err;
    check_ok(pliant_hierarchy_create(s->level_count, s->vertex_count, s->mesh->face_count,
                                     s->mesh->faces, s->parents, &hierarchy, &err),
             &err);
    return hierarchy;
}

// ---- Changes ----

int32_t check_random_index(check_random *random, int32_t count)
{
    return (int32_t)(check_random_next(random) * count);
}

static int32_t *permutation(int32_t count, check_random *random)
{
    int32_t *p = reserve((size_t)count * sizeof *p);
    for (int32_t i = 0; i < count; i++) {
        const int32_t j = check_random_index(random, i + 1);
        p[i] = p[j];
        p[j] = i;
    }
    return p;
}

void check_shuffle(pliant_mesh *mesh, check_random *random, int32_t *new_number)
{
    const size_t vertex_bytes = (size_t)mesh->vertex_count * 3 * sizeof(double);
    const size_t face_bytes = (size_t)mesh->face_count * 3 * sizeof(int32_t);
    int32_t *to = permutation(mesh->vertex_count, random);
    int32_t *face_to = permutation(mesh->face_count, random);
    double *vertices = reserve(vertex_bytes);
    int32_t *faces = reserve(face_bytes);
    memcpy(vertices, mesh->vertices, vertex_bytes);
    memcpy(faces, mesh->faces, face_bytes);
    for (int32_t v = 0; v < mesh->vertex_count; v++)
        memcpy(mesh->vertices + 3 * (size_t)to[v], vertices + 3 * (size_t)v, 3 * sizeof(double));
    for (int32_t f = 0; f < mesh->face_count; f++) {
        const int32_t turn = check_random_index(random, 3);
        for (int32_t k = 0; k < 3; k++)
            mesh->faces[3 * (size_t)face_to[f] + (size_t)((k + turn) % 3)] =
                to[faces[3 * (size_t)f + (size_t)k]];
    }
    if (new_number) memcpy(new_number, to, (size_t)mesh->vertex_count * sizeof *to);
    free(faces);
    free(vertices);
    free(face_to);
    free(to);
}

// Is there an edge between the vertices? Slow and plain: base meshes are small.
static int has_edge(const pliant_mesh *mesh, int32_t a, int32_t b)
{
    for (int32_t h = 0; h < 3 * mesh->face_count; h++)
        if (mesh->faces[h] == a && mesh->faces[pliant_halfedge_next(h)] == b) return 1;
    return 0;
}

void check_flip_edges(pliant_mesh *mesh, int32_t tries, int32_t valence_min, int32_t valence_max,
                      check_random *random)
{
    int32_t *valence = reserve((size_t)mesh->vertex_count * sizeof *valence);
    memset(valence, 0, (size_t)mesh->vertex_count * sizeof *valence);
    for (int32_t h = 0; h < 3 * mesh->face_count; h++) valence[mesh->faces[h]]++;
    for (; tries > 0; tries--) {
        // Triangles (a, b, c) and (b, a, d) become (a, d, c) and (b, c, d).
        const int32_t h = check_random_index(random, 3 * mesh->face_count);
        const int32_t a = mesh->faces[h], b = mesh->faces[pliant_halfedge_next(h)];
        const int32_t c = mesh->faces[pliant_halfedge_previous(h)];
        int32_t t = 0;
        while (mesh->faces[t] != b || mesh->faces[pliant_halfedge_next(t)] != a) t++;
        const int32_t d = mesh->faces[pliant_halfedge_previous(t)];
        if (valence[a] <= valence_min || valence[b] <= valence_min || valence[c] >= valence_max ||
            valence[d] >= valence_max || c == d || has_edge(mesh, c, d))
            continue;
        memcpy(mesh->faces + h / 3 * 3, (int32_t[3]){a, d, c}, 3 * sizeof(int32_t));
        memcpy(mesh->faces + t / 3 * 3, (int32_t[3]){b, c, d}, 3 * sizeof(int32_t));
        valence[a]--, valence[b]--, valence[c]++, valence[d]++;
    }
    free(valence);
}
