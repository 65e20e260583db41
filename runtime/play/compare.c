// compare.c: every played step against the exact answer from a dense file.
//
// With the reference problem's values vbar0 (tractions of free nodes, displacements of fixed ones)
// the unknowns are v = Xi vbar0 + B g (GF-7, 10). A changed node specifies its v instead of its
// vbar0. So, S the changed nodes and R the loaded unchanged ones,
//
//     Xi_SS x = vbar_S - Xi_SR vbar_R - B_S g,     v = Xi_S x + Xi_R vbar_R + B g,
//
// which is what the capacitance matrix algorithm computes with C = -Xi_SS (GF-18..20). A node of
// level l acts through its hat h: its column is sum_j h_j Xi_j (GF-60), and its row is that of its
// vertex, where hats interpolate (GF-69). Levels may be mixed.
#include "compare.h"

#include "pliant/dense_view.h"
#include "pliant/error.h"
#include "pliant/reader.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// LAPACK: solve A x = b by LU with partial pivoting, in place, A column-major.
extern void dgesv_(const int *n, const int *nrhs, double *a, const int *lda, int *pivots, double *b,
                   const int *ldb, int *info);

// Columns summed from the row-major file for a node that stays changed or loaded are kept:
// gathering strides over the whole matrix and dominates otherwise. 128 MB at most.
enum { COLUMN_CACHE_BYTES = 128 << 20 };

struct pliant_compare {
    char *path;
    const pliant_model *model;
    pliant_reader *reader;
    pliant_dense_view view;
    int32_t vertex_count, level_count;
    size_t
        row_count;  // 3 (m + k): rows of the free nodes, then of the fixed ones if they are stored
    int32_t *position;  // [n] place in free nodes, or -1 - place in fixed nodes
    int32_t *parents;   // [n][2] of a vertex that is not of level 0

    // The present problem. Conditions are sorted: changed nodes first, then loaded ones.
    pliant_condition *conditions;  // [condition_count]
    int32_t condition_count, condition_capacity, changed_count;
    pliant_vec3 gravity;
    double *matrix;  // [3s][3s] column-major
    double *right;   // [3s]
    int *pivots;
    size_t matrix_capacity;  // 3s that the three above have room for
    int solved;              // 1: u and force belong to conditions and gravity

    double *rows;  // [row_count]
    double *u;     // [3n]
    double force[3];

    // A node's hat: its support in its domain, vertices ascending.
    double *hat;          // [n], zero but while a hat is made
    int32_t *hat_vertex;  // [hat_count]
    double *hat_value;    // [hat_count]
    int32_t hat_count;

    // Summed columns: three [row_count] each per place, replaced in turn.
    double *columns;
    pliant_node *column_node;  // [column_capacity]; level -1: empty
    int32_t *column_place;     // [n]: of a node of this vertex, -1: not summed
    int32_t column_capacity, column_next;

    double square, exact_square;  // sums over all steps
    pliant_compare_summary summary;
};

// ---- Life ----

static pliant_status check_nodes(const pliant_compare *c, pliant_error *err)
{
    const pliant_model_info info = pliant_model_describe(c->model);
    const pliant_dense_view *view = &c->view;
    if (view->free_count != info.free_count)
        return pliant_error_set(err, PLIANT_ERR_MISSING,
                                "%s:/dense/nodes: expected the model's %d free vertices, found %d",
                                c->path, (int)info.free_count, (int)view->free_count);
    for (int32_t i = 0; i < view->free_count; i++)
        if (pliant_model_is_free(c->model, view->nodes[i]) != 1)
            return pliant_error_set(err, PLIANT_ERR_MISSING,
                                    "%s:/dense/nodes[%d]: expected a free vertex of the model, "
                                    "found %d",
                                    c->path, (int)i, (int)view->nodes[i]);
    if (!view->has_supports) return PLIANT_OK;
    if (view->fixed_count != info.fixed_count)
        return pliant_error_set(
            err, PLIANT_ERR_MISSING,
            "%s:/dense/fixed-nodes: expected the model's %d fixed vertices, found %d", c->path,
            (int)info.fixed_count, (int)view->fixed_count);
    for (int32_t i = 0; i < view->fixed_count; i++)
        if (pliant_model_is_free(c->model, view->fixed_nodes[i]) != 0)
            return pliant_error_set(err, PLIANT_ERR_MISSING,
                                    "%s:/dense/fixed-nodes[%d]: expected a fixed vertex of the "
                                    "model, found %d",
                                    c->path, (int)i, (int)view->fixed_nodes[i]);
    return PLIANT_OK;
}

// Of every vertex of a level above the base: the ends of the edge that it divides. The children of
// face (a, b, c) begin with (a, ab, ca) and (b, bc, ab).
static void find_parents(const pliant_compare *c)
{
    for (int32_t l = 0; l + 1 < c->level_count; l++) {
        const int32_t *face = pliant_model_faces(c->model, l);
        const int32_t *child = pliant_model_faces(c->model, l + 1);
        const int32_t count = pliant_model_level_face_count(c->model, l);
        for (int32_t f = 0; f < count; f++, face += 3, child += 12) {
            const int32_t middle[3] = {child[1], child[4], child[2]};
            for (int k = 0; k < 3; k++) {
                c->parents[2 * (size_t)middle[k]] = face[k];
                c->parents[2 * (size_t)middle[k] + 1] = face[(k + 1) % 3];
            }
        }
    }
}

static pliant_status allocate(pliant_compare *c, pliant_error *err)
{
    const size_t n = (size_t)c->vertex_count;
    const size_t node_count =
        (size_t)c->view.free_count + (c->view.has_supports ? (size_t)c->view.fixed_count : 0);
    c->row_count = 3 * node_count;
    const size_t bytes = 3 * c->row_count * sizeof *c->columns;
    const size_t places = bytes ? COLUMN_CACHE_BYTES / bytes : 1;
    c->column_capacity = (int32_t)(places < 1 ? 1 : places < n ? places : n);
    c->position = malloc(n * sizeof *c->position);
    c->parents = calloc(2 * n, sizeof *c->parents);
    c->rows = calloc(c->row_count + 1, sizeof *c->rows);
    c->u = calloc(3 * n + 1, sizeof *c->u);
    c->hat = calloc(n, sizeof *c->hat);
    c->hat_vertex = malloc(n * sizeof *c->hat_vertex);
    c->hat_value = malloc(n * sizeof *c->hat_value);
    c->columns = malloc((size_t)c->column_capacity * bytes + 1);
    c->column_node = malloc((size_t)c->column_capacity * sizeof *c->column_node);
    c->column_place = malloc(n * sizeof *c->column_place);
    if (!c->position || !c->parents || !c->rows || !c->u || !c->hat || !c->hat_vertex ||
        !c->hat_value || !c->columns || !c->column_node || !c->column_place)
        return pliant_error_set(err, PLIANT_ERR_MEMORY, "%s: no memory to compare %d vertices",
                                c->path, (int)c->vertex_count);
    for (size_t v = 0; v < n; v++) c->position[v] = -1;
    for (size_t v = 0; v < n; v++) c->column_place[v] = -1;
    for (int32_t i = 0; i < c->column_capacity; i++) c->column_node[i].level = -1;
    for (int32_t i = 0; i < c->view.free_count; i++) c->position[c->view.nodes[i]] = i;
    for (int32_t i = 0; c->view.has_supports && i < c->view.fixed_count; i++)
        c->position[c->view.fixed_nodes[i]] = -1 - i;
    find_parents(c);
    return PLIANT_OK;
}

pliant_status pliant_compare_open(const char *path, const pliant_model *model,
                                  pliant_compare **compare, pliant_error *err)
{
    pliant_compare *c = calloc(1, sizeof *c);
    if (!c || !(c->path = strdup(path))) {
        free(c);
        return pliant_error_set(err, PLIANT_ERR_MEMORY, "%s: no memory", path);
    }
    const pliant_model_info info = pliant_model_describe(model);
    c->model = model;
    c->vertex_count = info.vertex_count;
    c->level_count = info.level_count;
    pliant_status status = pliant_reader_open(path, &c->reader, err);
    if (status >= 0) status = pliant_dense_view_bind(c->reader, &c->view, err);
    if (status >= 0) status = check_nodes(c, err);
    if (status >= 0) status = allocate(c, err);
    if (status < 0) {
        pliant_compare_close(c);
        return status;
    }
    *compare = c;
    return PLIANT_OK;
}

void pliant_compare_close(pliant_compare *compare)
{
    if (!compare) return;
    free(compare->column_place);
    free(compare->column_node);
    free(compare->columns);
    free(compare->hat_value);
    free(compare->hat_vertex);
    free(compare->hat);
    free(compare->u);
    free(compare->rows);
    free(compare->pivots);
    free(compare->right);
    free(compare->matrix);
    free(compare->conditions);
    free(compare->parents);
    free(compare->position);
    pliant_reader_close(compare->reader);
    free(compare->path);
    free(compare);
}

// ---- Columns of nodes ----

static int is_free(const pliant_compare *c, int32_t vertex)
{
    return c->position[vertex] >= 0;
}

// A vertex's place among the free nodes, or among the fixed ones.
static size_t place_in_domain(const pliant_compare *c, int32_t vertex)
{
    const int32_t position = c->position[vertex];
    return (size_t)(position >= 0 ? position : -1 - position);
}

static size_t row_of(const pliant_compare *c, int32_t vertex)
{
    const size_t first = is_free(c, vertex) ? 0 : 3 * (size_t)c->view.free_count;
    return first + 3 * place_in_domain(c, vertex);
}

// hat_vertex and hat_value of a node: one at its vertex, the mean of the parents at vertices that
// finer levels add, zero outside its vertex's domain (GF-53).
static void make_hat(pliant_compare *c, pliant_node node)
{
    const int domain = is_free(c, node.vertex);
    c->hat_vertex[0] = node.vertex;
    c->hat_value[0] = c->hat[node.vertex] = 1;
    c->hat_count = 1;
    const int32_t begin = pliant_model_level_vertex_count(c->model, node.level);
    for (int32_t v = begin; v < c->vertex_count; v++) {
        const int32_t *parents = c->parents + 2 * (size_t)v;
        const double value = 0.5 * (c->hat[parents[0]] + c->hat[parents[1]]);
        if (value == 0 || is_free(c, v) != domain) continue;
        c->hat_vertex[c->hat_count] = v;
        c->hat_value[c->hat_count++] = c->hat[v] = value;
    }
    for (int32_t i = 0; i < c->hat_count; i++) c->hat[c->hat_vertex[i]] = 0;
}

// The hat's three columns on the rows of one domain into column[3][row_count], from its row `to`.
static void sum_rows(const pliant_compare *c, const double *matrix, size_t count, size_t width,
                     double *column, size_t to)
{
    for (size_t row = 0; row < 3 * count; row++, matrix += width) {
        double sum[3] = {0};
        for (int32_t i = 0; i < c->hat_count; i++) {
            const double *from = matrix + 3 * place_in_domain(c, c->hat_vertex[i]);
            for (int k = 0; k < 3; k++) sum[k] += c->hat_value[i] * from[k];
        }
        for (size_t k = 0; k < 3; k++) column[k * c->row_count + to + row] = sum[k];
    }
}

// A node's three columns, shape [3][row_count].
static const double *gather(pliant_compare *c, pliant_node node)
{
    const pliant_dense_view *view = &c->view;
    const size_t size = 3 * c->row_count, m = (size_t)view->free_count;
    int32_t place = c->column_place[node.vertex];
    if (place >= 0 && c->column_node[place].level == node.level)
        return c->columns + size * (size_t)place;
    if (place < 0) {
        place = c->column_next;
        c->column_next = (place + 1) % c->column_capacity;
        if (c->column_node[place].level >= 0) c->column_place[c->column_node[place].vertex] = -1;
    }
    c->column_node[place] = node;
    c->column_place[node.vertex] = place;
    double *column = c->columns + size * (size_t)place;
    const int column_free = is_free(c, node.vertex);
    const size_t width = 3 * (size_t)(column_free ? view->free_count : view->fixed_count);
    make_hat(c, node);
    sum_rows(c, column_free ? view->free_free : view->free_fixed, m, width, column, 0);
    if (view->has_supports)
        sum_rows(c, column_free ? view->fixed_free : view->fixed_fixed, (size_t)view->fixed_count,
                 width, column, 3 * m);
    return column;
}

// ---- The changed problem ----

// A node whose type differs from the reference problem's.
static int is_changed(const pliant_compare *c, const pliant_condition *condition)
{
    return condition->kind == PLIANT_CONDITION_DISPLACED ||
           (condition->kind == PLIANT_CONDITION_PRESSED && !is_free(c, condition->node.vertex));
}

static pliant_status reserve(pliant_compare *c, int32_t count, pliant_error *err)
{
    if (count <= c->condition_capacity) return PLIANT_OK;
    pliant_condition *grown = realloc(c->conditions, 2 * (size_t)count * sizeof *grown);
    if (!grown)
        return pliant_error_set(err, PLIANT_ERR_MEMORY, "%s: no memory for %d conditions", c->path,
                                (int)count);
    c->conditions = grown;
    c->condition_capacity = 2 * count;
    return PLIANT_OK;
}

static int same_condition(const pliant_condition *a, const pliant_condition *b)
{
    return a->node.level == b->node.level && a->node.vertex == b->node.vertex &&
           a->kind == b->kind && memcmp(&a->value, &b->value, sizeof a->value) == 0;
}

// Take over the player's state, changed nodes first. Leaves `solved` when nothing differs.
static pliant_status take_state(pliant_compare *c, const pliant_player *player, int64_t step,
                                pliant_error *err)
{
    int32_t count;
    const pliant_condition *list = pliant_player_conditions(player, &count);
    const pliant_vec3 gravity = pliant_player_gravity(player);
    pliant_status status = reserve(c, count, err);
    if (status < 0) return status;
    int same = c->solved && count == c->condition_count &&
               memcmp(&gravity, &c->gravity, sizeof gravity) == 0;
    int32_t place = 0;
    for (int pass = 0; pass < 2; pass++) {
        for (int32_t i = 0; i < count; i++) {
            if (is_changed(c, &list[i]) != (pass == 0)) continue;
            if (!c->view.has_supports && pliant_model_is_free(c->model, list[i].node.vertex) != 1)
                return pliant_error_set(err, PLIANT_ERR_MISSING,
                                        "%s: step %lld changes the fixed vertex %d: expected a "
                                        "dense file with /dense/free-fixed (--blocks all)",
                                        c->path, (long long)step, (int)list[i].node.vertex);
            same = same && same_condition(&c->conditions[place], &list[i]);
            c->conditions[place++] = list[i];
        }
        if (pass == 0) c->changed_count = place;
    }
    c->condition_count = count;
    c->gravity = gravity;
    c->solved = same;
    return PLIANT_OK;
}

static pliant_status reserve_matrix(pliant_compare *c, pliant_error *err)
{
    const size_t size = 3 * (size_t)c->changed_count;
    if (size <= c->matrix_capacity) return PLIANT_OK;
    free(c->matrix);
    free(c->right);
    free(c->pivots);
    c->matrix = malloc(size * size * sizeof *c->matrix);
    c->right = malloc(size * sizeof *c->right);
    c->pivots = malloc(size * sizeof *c->pivots);
    c->matrix_capacity = c->matrix && c->right && c->pivots ? size : 0;
    if (c->matrix_capacity) return PLIANT_OK;
    return pliant_error_set(err, PLIANT_ERR_MEMORY, "%s: no memory for a matrix of %zu x %zu",
                            c->path, size, size);
}

static void unpack(pliant_vec3 v, double x[3])
{
    x[0] = v.x, x[1] = v.y, x[2] = v.z;
}

static const double *gravity_at(const pliant_compare *c, size_t row)
{
    const size_t m3 = 3 * (size_t)c->view.free_count;
    return row < m3 ? c->view.gravity_free + 3 * row : c->view.gravity_fixed + 3 * (row - m3);
}

// x of the changed nodes into c->right.
static pliant_status solve_changed(pliant_compare *c, int64_t step, pliant_error *err)
{
    pliant_status status = reserve_matrix(c, err);
    if (status < 0) return status;
    const int size = 3 * c->changed_count;
    double g[3], value[3];
    unpack(c->gravity, g);
    for (int32_t i = 0; i < c->changed_count; i++) {
        const size_t row = row_of(c, c->conditions[i].node.vertex);
        unpack(c->conditions[i].value, c->right + 3 * (size_t)i);
        for (size_t r = 0; r < 3; r++)
            for (size_t k = 0; k < 3; k++)
                c->right[3 * (size_t)i + r] -= gravity_at(c, row + r)[k] * g[k];
    }
    for (int32_t j = 0; j < c->condition_count; j++) {
        const double *column = gather(c, c->conditions[j].node);
        unpack(c->conditions[j].value, value);
        for (int32_t i = 0; i < c->changed_count; i++) {
            const double *block = column + row_of(c, c->conditions[i].node.vertex);
            for (size_t k = 0; k < 3; k++, block += c->row_count)
                for (size_t r = 0; r < 3; r++)
                    if (j < c->changed_count)
                        c->matrix[(3 * (size_t)j + k) * (size_t)size + 3 * (size_t)i + r] =
                            block[r];
                    else c->right[3 * (size_t)i + r] -= block[r] * value[k];
        }
    }
    if (size == 0) return PLIANT_OK;
    const int one = 1;
    int info = 0;
    dgesv_(&size, &one, c->matrix, &size, c->pivots, c->right, &size, &info);
    if (info != 0)
        return pliant_error_set(err, PLIANT_ERR_SINGULAR,
                                "%s: step %lld: the dense problem of %d changed nodes is singular",
                                c->path, (long long)step, (int)c->changed_count);
    return PLIANT_OK;
}

// What a condition adds besides its columns: force of a displaced node, traction times the area
// of its hat; displacement of a fixed one, its hat times x or its support value.
static void add_hat(pliant_compare *c, const pliant_condition *condition, const double value[3])
{
    const int fixed = !is_free(c, condition->node.vertex);
    if (!fixed && condition->kind != PLIANT_CONDITION_DISPLACED) return;
    make_hat(c, condition->node);
    double area = 0;
    for (int32_t i = 0; i < c->hat_count; i++) {
        const int32_t vertex = c->hat_vertex[i];
        area += c->hat_value[i] * pliant_model_area(c->model, vertex);
        for (int k = 0; fixed && k < 3; k++)
            c->u[3 * (size_t)vertex + (size_t)k] += c->hat_value[i] * value[k];
    }
    for (int k = 0; !fixed && k < 3; k++) c->force[k] += area * value[k];
}

// All displacements and the contact force from x.
static void evaluate(pliant_compare *c)
{
    double g[3], value[3];
    unpack(c->gravity, g);
    for (size_t row = 0; row < c->row_count; row++) {
        const double *body = gravity_at(c, row);
        c->rows[row] = body[0] * g[0] + body[1] * g[1] + body[2] * g[2];
    }
    memset(c->u, 0, 3 * (size_t)c->vertex_count * sizeof *c->u);
    memset(c->force, 0, sizeof c->force);
    for (int32_t j = 0; j < c->condition_count; j++) {
        const pliant_condition *condition = &c->conditions[j];
        if (j < c->changed_count) memcpy(value, c->right + 3 * (size_t)j, sizeof value);
        else unpack(condition->value, value);
        const double *column = gather(c, condition->node);
        for (size_t k = 0; k < 3; k++, column += c->row_count)
            for (size_t row = 0; row < c->row_count; row++) c->rows[row] += column[row] * value[k];
        add_hat(c, condition, value);
    }
    for (int32_t i = 0; i < c->view.free_count; i++)
        memcpy(c->u + 3 * (size_t)c->view.nodes[i], c->rows + 3 * (size_t)i, 3 * sizeof *c->u);
}

// ---- Differences ----

static double relative(double difference, double exact)
{
    if (exact > 0) return difference / exact;
    return difference == 0 ? 0 : HUGE_VAL;
}

static void keep_worst(double value, int64_t step, double *worst, int64_t *worst_step)
{
    // Written so that NaN is the worst of all.
    if (*worst_step == 0 || !(value <= *worst)) {
        *worst = value;
        *worst_step = step;
    }
}

pliant_status pliant_compare_add(pliant_compare *compare, const pliant_player *player,
                                 pliant_error *err)
{
    pliant_compare *c = compare;
    const pliant_step *step = pliant_player_last(player);
    pliant_status status = take_state(c, player, step->number, err);
    if (status >= 0 && !c->solved) {
        status = solve_changed(c, step->number, err);
        if (status >= 0) {
            evaluate(c);
            c->solved = 1;
        }
    }
    if (status < 0) {
        c->solved = 0;
        return status;
    }

    const pliant_vec3 *played = pliant_player_surface(player);
    const int32_t count = pliant_player_surface_count(player);
    double square = 0, exact_square = 0, largest = 0, exact_largest = 0;
    for (int32_t v = 0; v < count; v++) {
        const double *u = c->u + 3 * (size_t)v;
        const double d[3] = {played[v].x - u[0], played[v].y - u[1], played[v].z - u[2]};
        const double d2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
        const double u2 = u[0] * u[0] + u[1] * u[1] + u[2] * u[2];
        square += d2;
        exact_square += u2;
        if (!(d2 <= largest)) largest = d2;
        if (!(u2 <= exact_largest)) exact_largest = u2;
    }
    const double f[3] = {step->force.x - c->force[0], step->force.y - c->force[1],
                         step->force.z - c->force[2]};
    pliant_compare_summary *s = &c->summary;
    keep_worst(relative(sqrt(square), sqrt(exact_square)), step->number, &s->rms_worst,
               &s->rms_step);
    keep_worst(relative(sqrt(largest), sqrt(exact_largest)), step->number, &s->max_worst,
               &s->max_step);
    keep_worst(relative(sqrt(f[0] * f[0] + f[1] * f[1] + f[2] * f[2]),
                        sqrt(c->force[0] * c->force[0] + c->force[1] * c->force[1] +
                             c->force[2] * c->force[2])),
               step->number, &s->force_worst, &s->force_step);
    c->square += square;
    c->exact_square += exact_square;
    s->step_count++;
    s->rms = relative(sqrt(c->square), sqrt(c->exact_square));
    return PLIANT_OK;
}

pliant_compare_summary pliant_compare_result(const pliant_compare *compare)
{
    return compare->summary;
}

const double *pliant_compare_exact(const pliant_compare *compare)
{
    return compare->u;
}
