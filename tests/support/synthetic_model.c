// synthetic_model.c: models with exactly known answers, for tests that need a model file.
#include "synthetic_model.h"

#include "synthetic_lattice.h"

#include "pliant/loop.h"
#include "pliant/writer.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

extern void dpotrf_(const char *uplo, const int *n, double *a, const int *lda, int *info);
extern void dpotri_(const char *uplo, const int *n, double *a, const int *lda, int *info);
extern void dposv_(const char *uplo, const int *n, const int *nrhs, double *a, const int *lda,
                   double *b, const int *ldb, int *info);
extern void dgesv_(const int *n, const int *nrhs, double *a, const int *lda, int *pivots, double *b,
                   const int *ldb, int *info);
extern void dgemm_(const char *ta, const char *tb, const int *m, const int *n, const int *k,
                   const double *alpha, const double *a, const int *lda, const double *b,
                   const int *ldb, const double *beta, double *c, const int *ldc);

// OpenBLAS's own threads are invisible to ThreadSanitizer, and small test matrices gain nothing
// from them. NULL with another BLAS.
extern void openblas_set_num_threads(int count) __attribute__((weak));

static void *take(size_t count, size_t size)
{
    void *memory = calloc(count ? count : 1, size);
    assert_non_null(memory);
    return memory;
}

static int32_t row_domain(int32_t block)
{
    return block / 2;
}

static int32_t column_domain(int32_t block)
{
    return block % 2;
}

static int32_t block_count(const check_synthetic *s)
{
    return s->def.blocks == CHECK_ALL_BLOCKS ? PLIANT_BLOCK_COUNT : 1;
}

// ---- The exact Green's functions ----

static void split_domains(check_synthetic *s)
{
    const int32_t n = s->surface.mesh->vertex_count;
    for (int d = 0; d < 2; d++) s->nodes[d] = take((size_t)n, sizeof **s->nodes);
    for (int32_t v = 0; v < n; v++) {
        const int d = s->surface.mesh->vertices[3 * (size_t)v + 2] < -0.6;
        s->nodes[d][s->counts[d]++] = v;
    }
    // A coarse base may put a vertex there or not; the tests want both domains.
    assert_true(s->counts[0] > 0 && s->counts[1] > 0);
}

// K_ij for i != j.
static void spring(const check_synthetic *s, int32_t i, int32_t j, double k[9])
{
    const double *x = s->surface.mesh->vertices + 3 * (size_t)i;
    const double *y = s->surface.mesh->vertices + 3 * (size_t)j;
    const double r[3] = {x[0] - y[0], x[1] - y[1], x[2] - y[2]};
    const double square = r[0] * r[0] + r[1] * r[1] + r[2] * r[2];
    const double strength = s->surface.areas[i] * s->surface.areas[j] / (square * sqrt(square));
    for (int a = 0; a < 3; a++)
        for (int b = 0; b < 3; b++)
            k[3 * a + b] = -strength * ((a == b ? 0.5 : 0) + r[a] * r[b] / (2 * square));
}

// The part of K between two lists of vertices, row-major.
static double *assemble(const check_synthetic *s, const int32_t *rows, int32_t row_count,
                        const int32_t *columns, int32_t column_count)
{
    const size_t width = 3 * (size_t)column_count;
    double *k = take(3 * (size_t)row_count * width, sizeof *k);
    for (int32_t i = 0; i < row_count; i++)
        for (int32_t j = 0; j < column_count; j++) {
            double block[9] = {0};
            if (rows[i] != columns[j]) {
                spring(s, rows[i], columns[j], block);
            } else {
                for (int32_t v = 0; v < s->surface.mesh->vertex_count; v++) {
                    double other[9];
                    if (v == rows[i]) continue;
                    spring(s, rows[i], v, other);
                    for (int c = 0; c < 9; c++) block[c] -= other[c];
                }
            }
            for (int a = 0; a < 3; a++)
                for (int b = 0; b < 3; b++)
                    k[(3 * (size_t)i + a) * width + 3 * (size_t)j + b] = block[3 * a + b];
        }
    return k;
}

// c = a b + beta c, all row-major (column-major dgemm on the transposes).
static void multiply(int32_t rows, int32_t columns, int32_t depth, double alpha, const double *a,
                     const double *b, double beta, double *c)
{
    if (rows == 0 || columns == 0) return;
    dgemm_("N", "N", &columns, &rows, &depth, &alpha, b, &columns, a, &depth, &beta, c, &columns);
}

// A = K_ff^-1 in place, symmetric.
static void invert_definite(int32_t n, double *a)
{
    int info = 0;
    dpotrf_("L", &n, a, &n, &info);
    assert_int_equal(info, 0);
    dpotri_("L", &n, a, &n, &info);
    assert_int_equal(info, 0);
    for (size_t j = 0; j < (size_t)n; j++)
        for (size_t i = j + 1; i < (size_t)n; i++) a[j + i * n] = a[i + j * n];
}

// With f_f = a_f p_f and u_c given, K u = f + b g says
//     u_f = A (a_f p_f + b_f g - K_fc u_c)          A = K_ff^-1
//     a_c p_c = K_cf u_f + K_cc u_c - b_c g
static void eliminate(check_synthetic *s)
{
    const int32_t m = 3 * s->counts[0], k = 3 * s->counts[1];
    const double *areas = s->surface.areas;
    double *a = assemble(s, s->nodes[0], s->counts[0], s->nodes[0], s->counts[0]);
    invert_definite(m, a);
    s->xi[PLIANT_FREE_FREE] = a;
    s->gravity[0] = take(3 * (size_t)m, sizeof(double));
    for (int32_t i = 0; i < m; i++)
        for (int32_t j = 0; j < m; j++)
            s->gravity[0][3 * (size_t)i + j % 3] +=
                a[(size_t)i * m + j] * s->density * areas[s->nodes[0][j / 3]];

    if (s->def.blocks == CHECK_ALL_BLOCKS) {
        const int32_t n = s->surface.mesh->vertex_count;
        int32_t *all = take((size_t)n, sizeof *all);
        for (int32_t v = 0; v < n; v++) all[v] = v;
        s->stiffness = assemble(s, all, n, all, n);
        free(all);
        double *fc = assemble(s, s->nodes[0], s->counts[0], s->nodes[1], s->counts[1]);
        double *cf = assemble(s, s->nodes[1], s->counts[1], s->nodes[0], s->counts[0]);
        double *cc = assemble(s, s->nodes[1], s->counts[1], s->nodes[1], s->counts[1]);
        double *x_fc = take((size_t)m * k, sizeof *x_fc);
        double *x_cf = take((size_t)m * k, sizeof *x_cf);
        multiply(m, k, m, -1, a, fc, 0, x_fc);
        multiply(k, m, m, 1, cf, a, 0, x_cf);
        multiply(k, k, m, 1, cf, x_fc, 1, cc);
        s->gravity[1] = take(3 * (size_t)k, sizeof(double));
        multiply(k, 3, m, 1, cf, s->gravity[0], 0, s->gravity[1]);
        for (int32_t i = 0; i < k; i++) {
            const double area = areas[s->nodes[1][i / 3]];
            s->gravity[1][3 * (size_t)i + i % 3] -= s->density * area;
            for (int c = 0; c < 3; c++) s->gravity[1][3 * (size_t)i + c] /= area;
            for (int32_t j = 0; j < m; j++)
                x_cf[(size_t)i * m + j] *= areas[s->nodes[0][j / 3]] / area;
            for (int32_t j = 0; j < k; j++) cc[(size_t)i * k + j] /= area;
        }
        s->xi[PLIANT_FREE_FIXED] = x_fc;
        s->xi[PLIANT_FIXED_FREE] = x_cf;
        s->xi[PLIANT_FIXED_FIXED] = cc;
        free(fc);
        free(cf);
    }
    for (int32_t i = 0; i < m; i++)
        for (int32_t j = 0; j < m; j++) a[(size_t)i * m + j] *= areas[s->nodes[0][j / 3]];
}

// ---- Compression ----

// Block column j (three columns) of a row-major matrix of `width` columns as rows of nine.
static void gather_column(const double *matrix, int32_t rows, size_t width, int32_t j, double *x)
{
    for (int32_t i = 0; i < rows; i++)
        for (int a = 0; a < 3; a++)
            for (int b = 0; b < 3; b++)
                x[9 * (size_t)i + 3 * a + b] =
                    matrix[(3 * (size_t)i + a) * width + 3 * (size_t)j + b];
    memset(x + 9 * (size_t)rows, 0, 9 * sizeof *x);
}

static void scatter_column(const double *x, int32_t rows, size_t width, int32_t j, double *matrix)
{
    for (int32_t i = 0; i < rows; i++)
        for (int a = 0; a < 3; a++)
            for (int b = 0; b < 3; b++)
                matrix[(3 * (size_t)i + a) * width + 3 * (size_t)j + b] =
                    x[9 * (size_t)i + 3 * a + b];
}

static double frobenius(const double *x)
{
    double sum = 0;
    for (int c = 0; c < 9; c++) sum += x[c] * x[c];
    return sqrt(sum);
}

static double largest_block(const double *x, int32_t rows)
{
    double most = 0;
    for (int32_t i = 0; i < rows; i++) most = fmax(most, frobenius(x + 9 * (size_t)i));
    return most;
}

// Transform, threshold (GF-31..33) and round one block of Xi; measure the result (GF-70, 71).
static void compress(check_synthetic *s, int32_t block, const double *xi, int32_t columns,
                     check_compressed *to)
{
    const int32_t rows = s->counts[row_domain(block)];
    const pliant_wavelet *w = s->wavelets[row_domain(block)];
    uint64_t room = (uint64_t)rows * 8 + 8;
    to->column_offset = take((size_t)columns + 1, sizeof *to->column_offset);
    to->row = take(room, sizeof *to->row);
    to->block = take(9 * room, sizeof *to->block);
    double *exact = take(9 * ((size_t)rows + 1), sizeof *exact);
    double *x = take(9 * ((size_t)rows + 1), sizeof *x);
    double square_error = 0, square_sum = 0, largest_error = 0;
    uint64_t nnz = 0;

    for (int32_t j = 0; j < columns; j++) {
        gather_column(xi, rows, 3 * (size_t)columns, j, exact);
        memcpy(x, exact, 9 * ((size_t)rows + 1) * sizeof *x);
        pliant_wavelet_forward(w, 9, x);
        const double most = largest_block(exact, rows);
        if (nnz + (uint64_t)rows > room) {
            room = 2 * room + (uint64_t)rows;
            to->row = realloc(to->row, room * sizeof *to->row);
            to->block = realloc(to->block, 9 * room * sizeof *to->block);
            assert_true(to->row && to->block);
        }
        for (int32_t i = 0, level = 0; i < rows; i++) {
            while (i >= w->level_offset[level + 1]) level++;
            double *row = x + 9 * (size_t)i;
            const double eps = ldexp(s->def.eps, level - s->def.levels);
            if (level > 0 && frobenius(row) < eps * most) {
                memset(row, 0, 9 * sizeof *row);
                continue;
            }
            for (int c = 0; c < 9; c++) row[c] = to->block[9 * nnz + c] = (float)row[c];
            to->row[nnz++] = i;
        }
        to->column_offset[j + 1] = nnz;
        pliant_wavelet_inverse(w, w->level_count - 1, 9, x);
        for (size_t c = 0; c < 9 * (size_t)rows; c++) {
            x[c] -= exact[c];
            square_error += x[c] * x[c];
            square_sum += exact[c] * exact[c];
        }
        largest_error = fmax(largest_error, largest_block(x, rows) / most);
    }
    const double summary[PLIANT_SUMMARY_COUNT] = {
        s->def.eps,
        s->def.wavelet.scheme,
        s->def.wavelet.lifting,
        s->def.wavelet.boundary,
        sqrt(square_error / square_sum),
        largest_error,
        nnz ? (double)rows * columns / (double)nnz : 1,
        0,
    };
    memcpy(to->summary, summary, sizeof summary);
    free(exact);
    free(x);
}

static void compress_gravity(check_synthetic *s, int32_t d)
{
    const int32_t rows = s->counts[d];
    double *x = take(9 * ((size_t)rows + 1), sizeof *x);
    gather_column(s->gravity[d], rows, 3, 0, x);
    pliant_wavelet_forward(s->wavelets[d], 9, x);
    s->gravity_coefficients[d] = take(9 * (size_t)rows, sizeof(float));
    for (size_t c = 0; c < 9 * (size_t)rows; c++) s->gravity_coefficients[d][c] = (float)x[c];
    free(x);
}

static void round_columns(const check_synthetic *s, int32_t block, const check_compressed *from,
                          int32_t columns, double *xi)
{
    const int32_t rows = s->counts[row_domain(block)];
    const pliant_wavelet *w = s->wavelets[row_domain(block)];
    double *x = take(9 * ((size_t)rows + 1), sizeof *x);
    for (int32_t j = 0; j < columns; j++) {
        memset(x, 0, 9 * ((size_t)rows + 1) * sizeof *x);
        for (uint64_t e = from->column_offset[j]; e < from->column_offset[j + 1]; e++)
            for (int c = 0; c < 9; c++) x[9 * (size_t)from->row[e] + c] = from->block[9 * e + c];
        pliant_wavelet_inverse(w, w->level_count - 1, 9, x);
        scatter_column(x, rows, 3 * (size_t)columns, j, xi);
    }
    free(x);
}

static int32_t level_columns(const check_synthetic *s, int32_t block, int32_t level)
{
    return s->wavelets[column_domain(block)]->level_offset[level + 1];
}

static int32_t is_stored(const check_synthetic *s, int32_t level)
{
    return s->def.level_mask == 0 ? level == s->def.levels : s->def.level_mask >> level & 1;
}

void check_synthetic_round(check_synthetic *s)
{
    for (int32_t block = 0; block < block_count(s); block++) {
        round_columns(s, block, &s->compressed[block], s->counts[column_domain(block)],
                      s->xi[block]);
        for (int32_t l = 0; l < s->def.levels; l++)
            if (s->coarse_xi[l][block])
                round_columns(s, block, &s->coarse[l][block], level_columns(s, block, l),
                              s->coarse_xi[l][block]);
    }
    for (int32_t d = 0; d < (s->def.blocks == CHECK_ALL_BLOCKS ? 2 : 1); d++) {
        const int32_t rows = s->counts[d];
        double *x = take(9 * ((size_t)rows + 1), sizeof *x);
        for (size_t c = 0; c < 9 * (size_t)rows; c++) x[c] = s->gravity_coefficients[d][c];
        pliant_wavelet_inverse(s->wavelets[d], s->def.levels, 9, x);
        scatter_column(x, rows, 3, 0, s->gravity[d]);
        free(x);
    }
}

// The columns of level l from those of l + 1 (GF-60): each its own and half of every odd neighbour
// that is in the domain.
static void refine_columns(check_synthetic *s, int32_t block, int32_t level, const double *finer,
                           double *xi)
{
    const int32_t d = column_domain(block), rows = 3 * s->counts[row_domain(block)];
    const size_t columns = 3 * (size_t)level_columns(s, block, level);
    const size_t finer_columns = 3 * (size_t)level_columns(s, block, level + 1);
    const int32_t base = s->hierarchy->vertex_count[0];
    for (int32_t i = 0; i < rows; i++) {
        const double *from = finer + (size_t)i * finer_columns;
        double *to = xi + (size_t)i * columns;
        memcpy(to, from, columns * sizeof *to);
        for (size_t m = columns / 3; m < finer_columns / 3; m++)
            for (int side = 0; side < 2; side++) {
                const int32_t parent = s->hierarchy->stencils[s->nodes[d][m] - base].parents[side];
                size_t k = 0;
                while (k < columns / 3 && s->nodes[d][k] != parent) k++;
                for (size_t c = 0; k < columns / 3 && c < 3; c++)
                    to[3 * k + c] += from[3 * m + c] / 2;
            }
    }
}

static void coarsen(check_synthetic *s, int32_t block)
{
    double *previous = NULL;
    for (int32_t l = s->def.levels; l-- > 0;) {
        const int32_t columns = level_columns(s, block, l);
        double *xi = take(9 * (size_t)s->counts[row_domain(block)] * (size_t)columns, sizeof *xi);
        refine_columns(s, block, l, previous ? previous : s->xi[block], xi);
        if (previous && !s->coarse_xi[l + 1][block]) free(previous);
        previous = xi;
        if (is_stored(s, l)) {
            s->coarse_xi[l][block] = xi;
            compress(s, block, xi, columns, &s->coarse[l][block]);
        }
    }
    if (previous && !s->coarse_xi[0][block]) free(previous);
}

check_synthetic *check_synthetic_create(const check_synthetic_def *def)
{
    check_synthetic *s = take(1, sizeof *s);
    pliant_error err = {""};
    if (openblas_set_num_threads) openblas_set_num_threads(1);
    s->def = *def;
    s->density = 1;
    s->surface = check_sphere(def->levels);
    s->hierarchy = check_hierarchy(&s->surface);
    split_domains(s);
    for (int d = 0; d < 2; d++)
        check_ok(pliant_wavelet_create(s->hierarchy, s->surface.areas, s->nodes[d], s->counts[d],
                                       &def->wavelet, &s->wavelets[d], &err),
                 &err);
    eliminate(s);
    for (int32_t block = 0; block < block_count(s); block++) {
        compress(s, block, s->xi[block], s->counts[column_domain(block)], &s->compressed[block]);
        if (def->level_mask & ((1u << def->levels) - 1)) coarsen(s, block);
    }
    for (int32_t d = 0; d < (def->blocks == CHECK_ALL_BLOCKS ? 2 : 1); d++) compress_gravity(s, d);
    return s;
}

static void free_columns(check_compressed *columns)
{
    free(columns->column_offset);
    free(columns->row);
    free(columns->block);
}

void check_synthetic_roughen(check_synthetic *s, int32_t steps)
{
    const int32_t control_count = s->surface.mesh->vertex_count;
    s->detail_steps = steps;
    s->shape = check_sphere(s->def.levels + steps);
    assert_memory_equal(s->shape.mesh->vertices, s->surface.mesh->vertices,
                        3 * (size_t)control_count * sizeof(double));
    for (int32_t v = control_count; v < s->shape.mesh->vertex_count; v++) {
        double *x = s->shape.mesh->vertices + 3 * (size_t)v;
        const double radius = 1 + 0.03 * sin(9 * x[0] + 7 * x[1] + 5 * x[2]);
        for (int c = 0; c < 3; c++) x[c] *= radius;
    }
}

void check_synthetic_destroy(check_synthetic *s)
{
    if (!s) return;
    for (int b = 0; b < PLIANT_BLOCK_COUNT; b++) {
        free(s->xi[b]);
        free_columns(&s->compressed[b]);
        for (int32_t l = 0; l < s->def.levels; l++) {
            free(s->coarse_xi[l][b]);
            free_columns(&s->coarse[l][b]);
        }
    }
    for (int d = 0; d < 2; d++) {
        free(s->nodes[d]);
        free(s->gravity[d]);
        free(s->gravity_coefficients[d]);
        pliant_wavelet_destroy(s->wavelets[d]);
    }
    free(s->stiffness);
    pliant_hierarchy_destroy(s->hierarchy);
    if (s->shape.mesh) check_surface_destroy(&s->shape);
    check_surface_destroy(&s->surface);
    free(s);
}

// ---- Files ----

static void put(pliant_writer *writer, const char *path, const void *data)
{
    pliant_error err = {""};
    check_ok(pliant_writer_write_all(writer, path, data, &err), &err);
}

static const check_compressed *columns_of(const check_synthetic *s, int32_t block, int32_t level)
{
    return level == s->def.levels ? &s->compressed[block] : &s->coarse[level][block];
}

static void write_level(const check_synthetic *s, pliant_writer *writer, int32_t block,
                        int32_t level)
{
    const check_compressed *from = columns_of(s, block, level);
    char path[PLIANT_PATH_LIMIT];
    pliant_error err = {""};
    const struct {
        const char *name;
        const void *data;
    } sections[] = {
        {"column_offset", from->column_offset}, {"row", from->row}, {"block", from->block}};
    for (size_t i = 0; i < 3; i++) {
        pliant_section_level_path((pliant_block_name)block, level, sections[i].name, path);
        put(writer, path, sections[i].data);
    }
    check_ok(pliant_writer_write_summary(writer, (pliant_block_name)block, level, from->summary,
                                         &err),
             &err);
}

// Offsets of the finer shape from the limit surface, in its frames.
static void write_detail(const check_synthetic *s, pliant_writer *writer)
{
    pliant_hierarchy *h = check_hierarchy(&s->shape);
    const int32_t levels = s->def.levels, count = s->shape.mesh->vertex_count;
    pliant_loop_limit *limit = NULL;
    pliant_error err = {""};
    check_ok(pliant_loop_limit_create(s->detail_steps, h->vertex_count[levels], h->face_count[levels],
                                      h->faces + levels, &limit, &err),
             &err);
    float *offset = take(3 * (size_t)count, sizeof *offset);
    int32_t *source = take((size_t)count, sizeof *source);
    for (int32_t v = 0; v < count; v++) {
        const double *x = s->shape.mesh->vertices + 3 * (size_t)v;
        double point[9], frame[9];
        pliant_loop_limit_evaluate(limit, v, s->surface.mesh->vertices, point);
        check_at_least(pliant_loop_frame(point + 3, point + 6, frame), PLIANT_LOOP_LEAST_SINE);
        for (int a = 0; a < 3; a++) {
            double sum = 0;
            for (int c = 0; c < 3; c++) sum += frame[3 * a + c] * (x[c] - point[c]);
            offset[3 * (size_t)v + (size_t)a] = (float)sum;
        }
        const int32_t control_count = h->vertex_count[levels];
        source[v] = v < control_count ? control_count - 1 - v : v;
    }
    put(writer, "/detail/level_count", h->vertex_count + levels);
    put(writer, "/detail/offset", offset);
    put(writer, "/detail/source_index", source);
    free(source);
    free(offset);
    pliant_loop_limit_destroy(limit);
    pliant_hierarchy_destroy(h);
}

void check_synthetic_write(const check_synthetic *s, const char *path)
{
    static const char provenance[] = "generator = tests/support/synthetic_model\n";
    const check_surface *surface = &s->surface;
    const int32_t n = surface->mesh->vertex_count;
    pliant_model_layout layout = {
        .vertex_count = n,
        .face_count = surface->mesh->face_count,
        .level_count = surface->level_count,
        .base_count = surface->vertex_count[0],
        .has_greens = 1,
        .free_count = s->counts[0],
        .fixed_count = s->counts[1],
        .text_bytes = sizeof provenance - 1,
        .has_supports = s->def.blocks == CHECK_ALL_BLOCKS,
        .level_mask = s->def.level_mask ? s->def.level_mask : 1u << s->def.levels,
        .detail_steps = s->detail_steps,
        .detail_vertex_count = s->detail_steps ? s->shape.mesh->vertex_count : 0,
    };
    if (s->lattice) layout.lattice = s->lattice->layout;
    for (int32_t l = 0; l < surface->level_count; l++) {
        layout.free_columns[l] = s->wavelets[0]->level_offset[l + 1];
        layout.fixed_columns[l] = s->wavelets[1]->level_offset[l + 1];
    }
    for (int32_t block = 0; block < block_count(s); block++)
        for (int32_t l = 0; l <= s->def.levels; l++)
            if (is_stored(s, l))
                layout.nnz[block][l] =
                    columns_of(s, block, l)->column_offset[level_columns(s, block, l)];

    pliant_section_def *sections = take(PLIANT_SECTION_LIMIT, sizeof *sections);
    int32_t section_count = 0;
    pliant_error err = {""};
    pliant_writer *writer = NULL;
    check_ok(pliant_model_layout_sections(&layout, sections, &section_count, &err), &err);
    check_ok(pliant_writer_create(path, sections, section_count, &writer, &err), &err);
    free(sections);

    int32_t *source = take((size_t)n, sizeof *source);  // the input mesh had the reverse order
    for (int32_t v = 0; v < n; v++) source[v] = n - 1 - v;
    put(writer, "/mesh/vertices", surface->mesh->vertices);
    put(writer, "/mesh/faces", surface->mesh->faces);
    put(writer, "/mesh/level_count", surface->vertex_count);
    put(writer, "/mesh/parents", surface->parents);
    put(writer, "/mesh/source_index", source);
    free(source);
    put(writer, "/material", (const double[3]){1, 0.3, s->density});
    put(writer, "/domains/free/nodes", s->nodes[0]);
    put(writer, "/domains/free/level_offset", s->wavelets[0]->level_offset);
    put(writer, "/domains/fixed/nodes", s->nodes[1]);
    put(writer, "/domains/fixed/level_offset", s->wavelets[1]->level_offset);
    put(writer, "/body/gravity/free", s->gravity_coefficients[0]);
    if (layout.has_supports) put(writer, "/body/gravity/fixed", s->gravity_coefficients[1]);
    for (int32_t block = 0; block < block_count(s); block++)
        for (int32_t l = 0; l <= s->def.levels; l++)
            if (is_stored(s, l)) write_level(s, writer, block, l);
    if (s->detail_steps) write_detail(s, writer);
    if (s->lattice) check_lattice_write_sections(s->lattice, writer);
    check_ok(pliant_writer_write_provenance(writer, provenance, &err), &err);
    check_ok(pliant_writer_commit(writer, &err), &err);
}

void check_synthetic_write_dense(const check_synthetic *s, const char *path)
{
    const int32_t has_supports = s->def.blocks == CHECK_ALL_BLOCKS;
    pliant_section_def *sections = take(PLIANT_SECTION_LIMIT, sizeof *sections);
    int32_t section_count = 0;
    pliant_error err = {""};
    pliant_writer *writer = NULL;
    check_ok(pliant_dense_layout_sections(s->counts[0], has_supports ? s->counts[1] : -1, sections,
                                          &section_count, &err),
             &err);
    check_ok(pliant_writer_create(path, sections, section_count, &writer, &err), &err);
    free(sections);
    put(writer, "/dense/nodes", s->nodes[0]);
    put(writer, "/dense/free-free", s->xi[PLIANT_FREE_FREE]);
    put(writer, "/dense/gravity-free", s->gravity[0]);
    if (has_supports) {
        put(writer, "/dense/fixed-nodes", s->nodes[1]);
        put(writer, "/dense/free-fixed", s->xi[PLIANT_FREE_FIXED]);
        put(writer, "/dense/fixed-free", s->xi[PLIANT_FIXED_FREE]);
        put(writer, "/dense/fixed-fixed", s->xi[PLIANT_FIXED_FIXED]);
        put(writer, "/dense/gravity-fixed", s->gravity[1]);
    }
    check_ok(pliant_writer_commit(writer, &err), &err);
}

static void write_once(const char *path, const char *dense_path, check_synthetic_def def)
{
    check_synthetic *s = check_synthetic_create(&def);
    check_synthetic_write(s, path);
    if (dense_path) check_synthetic_write_dense(s, dense_path);
    check_synthetic_destroy(s);
}

void check_write_synthetic_model(const char *path, const char *dense_path, int32_t levels,
                                 double eps, pliant_wavelet_def wavelet, check_blocks blocks)
{
    write_once(path, dense_path, (check_synthetic_def){levels, eps, wavelet, blocks, 0});
}

void check_write_synthetic_levels(const char *path, const char *dense_path, int32_t levels,
                                  double eps, pliant_wavelet_def wavelet, check_blocks blocks)
{
    write_once(path, dense_path,
               (check_synthetic_def){levels, eps, wavelet, blocks, (2u << levels) - 1});
}

// ---- Reference answers ----

check_problem check_problem_create(const check_synthetic *s)
{
    const size_t n = (size_t)s->surface.mesh->vertex_count;
    check_problem problem = {.is_displaced = take(n, 1), .value = take(3 * n, sizeof(double))};
    for (int32_t i = 0; i < s->counts[1]; i++) problem.is_displaced[s->nodes[1][i]] = 1;
    return problem;
}

void check_problem_destroy(check_problem *problem)
{
    free(problem->is_displaced);
    free(problem->value);
    *problem = (check_problem){0};
}

// K u = a p + b g on the traction-specified nodes t, with u of the others d on the right-hand side.
void check_synthetic_solve(const check_synthetic *s, const check_problem *problem, double *u,
                           double *p)
{
    assert_non_null(s->stiffness);
    const int32_t n = s->surface.mesh->vertex_count;
    const size_t width = 3 * (size_t)n;
    const double *areas = s->surface.areas;
    int32_t *unknown = take(width, sizeof *unknown);
    int unknown_count = 0;
    for (int32_t k = 0; k < 3 * n; k++) {
        const int32_t is_displaced = problem->is_displaced[k / 3];
        if (!is_displaced) unknown[unknown_count++] = k;
        (is_displaced ? u : p)[k] = problem->value[k];
    }
    double *matrix = take((size_t)unknown_count * unknown_count, sizeof *matrix);
    double *right = take((size_t)unknown_count, sizeof *right);
    for (int i = 0; i < unknown_count; i++) {
        const int32_t row = unknown[i];
        right[i] = areas[row / 3] * (p[row] + s->density * problem->gravity[row % 3]);
        for (int32_t k = 0; k < 3 * n; k++)
            if (problem->is_displaced[k / 3]) right[i] -= s->stiffness[row * width + k] * u[k];
        for (int j = 0; j < unknown_count; j++)
            matrix[(size_t)i * unknown_count + j] = s->stiffness[row * width + unknown[j]];
    }
    int info = 0;
    dposv_("L", &unknown_count, &(int){1}, matrix, &unknown_count, right, &unknown_count, &info);
    assert_int_equal(info, 0);
    for (int i = 0; i < unknown_count; i++) u[unknown[i]] = right[i];
    for (int32_t k = 0; k < 3 * n; k++) {
        if (!problem->is_displaced[k / 3]) continue;
        double force = -areas[k / 3] * s->density * problem->gravity[k % 3];
        for (int32_t j = 0; j < 3 * n; j++) force += s->stiffness[k * width + j] * u[j];
        p[k] = force / areas[k / 3];
    }
    free(unknown);
    free(matrix);
    free(right);
}

// Element (row, column) of Xi in vertex order; `place` maps a vertex to its domain and position.
static double element(const check_synthetic *s, const int32_t *place, int32_t row, int32_t column)
{
    const int32_t r = place[row / 3], c = place[column / 3];
    const double *block = s->xi[2 * (r & 1) + (c & 1)];
    return block[(3 * (size_t)(r / 2) + row % 3) * 3 * (size_t)s->counts[c & 1] +
                 3 * (size_t)(c / 2) + column % 3];
}

void check_synthetic_solve_dense(const check_synthetic *s, const check_problem *problem, double *u,
                                 double *p)
{
    assert_int_equal(s->def.blocks, CHECK_ALL_BLOCKS);
    const int32_t n = s->surface.mesh->vertex_count;
    int32_t *place = take((size_t)n, sizeof *place);  // 2 position + domain
    for (int d = 0; d < 2; d++)
        for (int32_t i = 0; i < s->counts[d]; i++) place[s->nodes[d][i]] = 2 * i + d;
    double *w = take(3 * (size_t)n, sizeof *w), *v = take(3 * (size_t)n, sizeof *v);
    int32_t *changed = take(3 * (size_t)n, sizeof *changed);
    int changed_count = 0;
    for (int32_t k = 0; k < 3 * n; k++) {
        const int32_t d = place[k / 3] & 1;
        if (problem->is_displaced[k / 3] != d) changed[changed_count++] = k;
        else w[k] = problem->value[k];
        for (int c = 0; c < 3; c++)
            v[k] += s->gravity[d][3 * (3 * (size_t)(place[k / 3] / 2) + k % 3) + c] *
                    problem->gravity[c];
    }
    for (int32_t k = 0; k < 3 * n; k++)
        for (int32_t j = 0; j < 3 * n; j++)
            if (w[j] != 0) v[k] += element(s, place, k, j) * w[j];
    if (changed_count > 0) {
        double *matrix = take((size_t)changed_count * changed_count, sizeof *matrix);
        double *x = take((size_t)changed_count, sizeof *x);
        int *pivots = take((size_t)changed_count, sizeof *pivots);
        int info = 0;
        for (int j = 0; j < changed_count; j++) {
            x[j] = problem->value[changed[j]] - v[changed[j]];
            for (int i = 0; i < changed_count; i++)
                matrix[i + (size_t)j * changed_count] = element(s, place, changed[i], changed[j]);
        }
        dgesv_(&changed_count, &(int){1}, matrix, &changed_count, pivots, x, &changed_count, &info);
        assert_int_equal(info, 0);
        for (int j = 0; j < changed_count; j++) {
            for (int32_t k = 0; k < 3 * n; k++) v[k] += element(s, place, k, changed[j]) * x[j];
            w[changed[j]] = x[j];
        }
        free(matrix);
        free(x);
        free(pivots);
    }
    for (int32_t k = 0; k < 3 * n; k++) {
        const int32_t is_free = !(place[k / 3] & 1);
        u[k] = is_free ? v[k] : w[k];
        p[k] = is_free ? w[k] : v[k];
    }
    free(place);
    free(w);
    free(v);
    free(changed);
}

double check_synthetic_element(const check_synthetic *s, int32_t row, int r, int32_t level,
                               int32_t column, int c)
{
    int32_t domain[2], position[2];
    const int32_t vertices[2] = {row, column};
    for (int k = 0; k < 2; k++)
        for (int32_t d = 0; d < 2; d++)
            for (int32_t i = 0; i < s->counts[d]; i++)
                if (s->nodes[d][i] == vertices[k]) domain[k] = d, position[k] = i;
    const int32_t block = 2 * domain[0] + domain[1];
    const double *xi = level == s->def.levels ? s->xi[block] : s->coarse_xi[level][block];
    return xi[(3 * (size_t)position[0] + r) * 3 * (size_t)level_columns(s, block, level) +
              3 * (size_t)position[1] + c];
}
