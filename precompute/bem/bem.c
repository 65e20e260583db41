// bem.c: assembly of the collocation boundary element matrices.
//
// Rows are assembled eight at a time, one collocation vertex to a vector lane: all far elements
// first, then the near and singular ones of each lane, then the diagonal blocks, then the rows are
// written out. No lane looks at another, and each adds its elements in mesh order: a row's bits
// do not depend on its neighbours.
//
// This follows: C. A. Brebbia, J. C. F. Telles, L. C. Wrobel, Boundary Element Techniques, 1984;
// c(x) and the strongly singular integral from rigid translation, as F. J. Rizzo and D. J. Shippy, An advanced boundary integral equation method for
// three-dimensional thermoelasticity, Int. J. Numer. Methods Eng. 11, 1977, and others since.
#include "bem/bem.h"

#include "bem/far_field.h"
#include "bem/near_integral.h"
#include "bem/singular_integral.h"

#include "pliant/error.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double pi = 3.14159265358979323846;

// Lengths inside are y = (x - origin) / unit, so that no mesh is too small or too large for the
// kernels; unit is a power of two and scaling by it exact.
struct pliant_bem {
    int32_t vertex_count, element_count;
    pliant_kelvin_constants constants;
    double poisson;
    double H_factor;        // -1 / (8 pi (1 - nu))
    double G_factor;        // unit / (16 pi mu (1 - nu))
    double H_body, G_body;  // the same factors for the body-force columns, see `particular`
    double *points;         // shape [vertex_count][3], y
    pliant_element *elements;
};

// The smallest box round the mesh gives origin and unit; 0 when it is empty or not finite.
static int frame_from(const pliant_mesh *mesh, double origin[3], double *unit)
{
    double extent = 0;
    for (int i = 0; i < 3; i++) {
        double low = INFINITY, high = -INFINITY;
        for (int32_t v = 0; v < mesh->vertex_count; v++) {
            low = fmin(low, mesh->vertices[3 * (size_t)v + i]);
            high = fmax(high, mesh->vertices[3 * (size_t)v + i]);
        }
        origin[i] = low / 2 + high / 2;
        extent = fmax(extent, high / 2 - low / 2);
    }
    if (!(extent > 0 && extent < INFINITY)) return 0;
    int exponent;
    frexp(extent, &exponent);
    *unit = ldexp(1, exponent);
    return *unit < INFINITY;
}

pliant_status pliant_bem_create(const pliant_mesh *mesh, const pliant_material *material,
                                pliant_bem **bem, pliant_error *err)
{
    pliant_status status = pliant_material_check(material, err);
    if (status < 0) return status;
    if (mesh->face_count < 4)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "mesh of %d faces: expected at least 4 to close a solid",
                                mesh->face_count);
    double origin[3], unit;
    if (!frame_from(mesh, origin, &unit))
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "mesh of %d vertices: expected a finite size above 0",
                                mesh->vertex_count);
    pliant_bem *b = calloc(1, sizeof *b);
    if (!b) goto memory;
    b->vertex_count = mesh->vertex_count;
    b->element_count = mesh->face_count;
    b->points = malloc((size_t)mesh->vertex_count * sizeof *b->points * 3);
    b->elements = malloc((size_t)mesh->face_count * sizeof *b->elements);
    if (!b->points || !b->elements) goto memory;

    const double nu = material->poisson, mu = material->young / (2 * (1 + nu));
    b->poisson = nu;
    b->constants = (pliant_kelvin_constants){.diagonal = 3 - 4 * nu, .shear = 1 - 2 * nu};
    b->H_factor = -1 / (8 * pi * (1 - nu));
    b->G_factor = unit / (16 * pi * mu * (1 - nu));
    b->H_body = b->H_factor * (material->density * unit * unit / material->young);
    b->G_body = b->G_factor * (material->density * unit);
    for (int32_t v = 0; v < mesh->vertex_count; v++)
        for (int i = 0; i < 3; i++)
            b->points[3 * (size_t)v + i] = (mesh->vertices[3 * (size_t)v + i] - origin[i]) / unit;
    for (int32_t f = 0; f < mesh->face_count; f++) {
        const int32_t *v = mesh->faces + 3 * (size_t)f;
        for (int k = 0; k < 3; k++)
            if (v[k] < 0 || v[k] >= mesh->vertex_count) {
                status = pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                          "face %d: expected vertices below %d, found %d", f,
                                          mesh->vertex_count, v[k]);
                goto done;
            }
        pliant_element_set(&b->elements[f], v, b->points + 3 * (size_t)v[0],
                           b->points + 3 * (size_t)v[1], b->points + 3 * (size_t)v[2]);
        if (!(b->elements[f].area > 0)) {
            status = pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                      "face %d: expected an area above 0, found none", f);
            goto done;
        }
    }
    *bem = b;
    return PLIANT_OK;

memory:
    status = pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for %d boundary elements",
                              mesh->face_count);
done:
    pliant_bem_destroy(b);
    return status;
}

void pliant_bem_destroy(pliant_bem *bem)
{
    if (!bem) return;
    free(bem->elements);
    free(bem->points);
    free(bem);
}

// Eight rows on their way: one collocation vertex to a lane.
typedef struct tile {
    int32_t row, row_count;  // lanes from row_count on are idle
    pliant_lanes x[3];
    pliant_row_sum *sums;  // shape [vertex_count], brackets of element.h
    pliant_lanes body[3][3];
    uint8_t *near;  // shape [element_count]
} tile;

// Add U's bracket times the traction of the particular solution, over one element, for one lane.
static void add_body(const pliant_element *element, const pliant_element_integrals *integrals,
                     int lane, pliant_lanes body[3][3])
{
    for (int c = 0; c < 3; c++)
        for (int k = 0; k < 3; k++) {
            const double *U = integrals->of_hat[k] + PLIANT_INTEGRAL_U;
            for (int r = 0; r < 3; r++)
                body[r][c][lane] += element->loads[k][c] * U[pliant_integral_place[r][c]];
        }
}

static void integrate_elements(const pliant_bem *bem, int with_body, tile *t)
{
    for (int lane = 0; lane < PLIANT_LANES; lane++) {
        const int32_t row = t->row + (lane < t->row_count ? lane : 0);
        for (int i = 0; i < 3; i++) t->x[i][lane] = bem->points[3 * (size_t)row + i];
    }
    memset(t->sums, 0, (size_t)bem->vertex_count * sizeof *t->sums);
    memset(t->body, 0, sizeof t->body);
    pliant_far_field_add(&bem->constants, bem->elements, bem->element_count, t->x, t->sums,
                         with_body ? t->body : NULL, t->near);
    for (int32_t e = 0; e < bem->element_count; e++) {
        if (!t->near[e]) continue;
        const pliant_element *element = bem->elements + e;
        for (int lane = 0; lane < t->row_count; lane++) {
            if (!(t->near[e] >> lane & 1)) continue;
            const int32_t row = t->row + lane;
            int own = 0;
            while (own < 3 && element->vertices[own] != row) own++;
            pliant_element_integrals integrals;
            if (own < 3) pliant_singular_integral_set(&bem->constants, element, own, &integrals);
            else
                pliant_near_integral_set(&bem->constants, element, bem->points + 3 * (size_t)row,
                                         &integrals);
            for (int k = 0; k < 3; k++)
                for (int m = 0; m < PLIANT_INTEGRAL_COUNT; m++)
                    t->sums[element->vertices[k]][m][lane] += integrals.of_hat[k][m];
            if (with_body) add_body(element, &integrals, lane, t->body);
        }
    }
}

// H_ii = - sum of H_ij over j != i: a translation gives no traction. Nothing has been added to the
// brackets S and W of a row's own vertex so far.
PLIANT_VECTOR_CLONES
static void close_diagonal(int32_t vertex_count, tile *t)
{
    pliant_lanes total[PLIANT_INTEGRAL_COUNT];
    memset(total, 0, sizeof total);
    for (int32_t j = 0; j < vertex_count; j++)
        for (int m = PLIANT_INTEGRAL_S; m < PLIANT_INTEGRAL_COUNT; m++) total[m] += t->sums[j][m];
    for (int lane = 0; lane < t->row_count; lane++)
        for (int m = PLIANT_INTEGRAL_S; m < PLIANT_INTEGRAL_COUNT; m++)
            t->sums[t->row + lane][m][lane] = -total[m][lane];
}

// H and G of the tile's rows at one vertex, from the brackets of element.h.
PLIANT_LANES_INLINE void blocks_from(const pliant_row_sum sum, double H_factor, double G_factor,
                                     pliant_lanes H[3][3], pliant_lanes G[3][3])
{
    const pliant_lanes *U = sum + PLIANT_INTEGRAL_U, *S = sum + PLIANT_INTEGRAL_S;
    const pliant_lanes *w = sum + PLIANT_INTEGRAL_W;
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++) {
            H[r][c] = H_factor * S[pliant_integral_place[r][c]];
            G[r][c] = G_factor * U[pliant_integral_place[r][c]];
        }
    for (int r = 0; r < 3; r++) {
        const int c = (r + 1) % 3, axis = (r + 2) % 3;
        H[r][c] -= H_factor * w[axis];
        H[c][r] += H_factor * w[axis];
    }
}

// One column of eight rows: lane l's three components are rows 3 l .. 3 l + 2.
PLIANT_LANES_INLINE void write_column(const pliant_lanes *x, const pliant_lanes *y,
                                      const pliant_lanes *z, int32_t row_count, double *column)
{
    double packed[3 * PLIANT_LANES];
    for (int lane = 0; lane < PLIANT_LANES; lane++) {
        packed[3 * lane] = (*x)[lane];
        packed[3 * lane + 1] = (*y)[lane];
        packed[3 * lane + 2] = (*z)[lane];
    }
    if (row_count == PLIANT_LANES) memcpy(column, packed, sizeof packed);
    else memcpy(column, packed, (size_t)row_count * 3 * sizeof *packed);
}

PLIANT_VECTOR_CLONES
static void write_rows(const pliant_bem *bem, const uint8_t *fixed, const tile *t, double *A,
                       size_t ld_a, double *B, size_t ld_b)
{
    for (int32_t j = 0; j < bem->vertex_count; j++) {
        const double sign = fixed[j] ? -1 : 1;
        pliant_lanes H[3][3], G[3][3];
        blocks_from(t->sums[j], sign * bem->H_factor, sign * bem->G_factor, H, G);
        pliant_lanes(*left)[3] = fixed[j] ? G : H, (*right)[3] = fixed[j] ? H : G;
        for (int c = 0; c < 3; c++) {
            write_column(&left[0][c], &left[1][c], &left[2][c], t->row_count,
                         A + (3 * (size_t)j + c) * ld_a);
            write_column(&right[0][c], &right[1][c], &right[2][c], t->row_count,
                         B + (3 * (size_t)j + c) * ld_b);
        }
    }
}

// A particular solution for the body force density * e_c: the rod that hangs along axis c, with
// the other axes a, and lengths in units (y = (x - origin) / unit):
//
//     sigma_cc = -density unit y_c, all else 0    p = sigma n = -density unit y_c n_c e_c
//     u_c = -density unit^2 / (2 E) (y_c^2 + nu sum_a y_a^2)    u_a = density unit^2 / E nu y_c y_a
//
// H (u - u_p) = G (p - p_p) then makes the right-hand side H u_p - G p_p, with p_p taken element by
// element: at a vertex the normals of its elements differ.
static void particular(double nu, const double y[3], int c, double u[3])
{
    double others2 = 0;
    for (int a = 0; a < 3; a++) {
        u[a] = nu * y[c] * y[a];
        if (a != c) others2 += y[a] * y[a];
    }
    u[c] = -0.5 * (y[c] * y[c] + nu * others2);
}

PLIANT_VECTOR_CLONES
static void write_body(const pliant_bem *bem, const tile *t, double *gravity, size_t ld_g)
{
    pliant_lanes Hu[3][3];
    memset(Hu, 0, sizeof Hu);
    for (int32_t j = 0; j < bem->vertex_count; j++) {
        pliant_lanes H[3][3], G[3][3];
        blocks_from(t->sums[j], bem->H_body, 0, H, G);
        for (int c = 0; c < 3; c++) {
            double u[3];
            particular(bem->poisson, bem->points + 3 * (size_t)j, c, u);
            for (int r = 0; r < 3; r++)
                Hu[r][c] += H[r][0] * u[0] + H[r][1] * u[1] + H[r][2] * u[2];
        }
    }
    for (int c = 0; c < 3; c++)
        for (int lane = 0; lane < t->row_count; lane++)
            for (int r = 0; r < 3; r++)
                gravity[3 * lane + r + c * ld_g] =
                    Hu[r][c][lane] - bem->G_body * t->body[r][c][lane];
}

pliant_status pliant_bem_assemble(const pliant_bem *bem, int32_t row_begin, int32_t row_end,
                                  const uint8_t *fixed, double *A, size_t ld_a, double *B,
                                  size_t ld_b, double *gravity, size_t ld_g, pliant_error *err)
{
    if (row_begin < 0 || row_end < row_begin || row_end > bem->vertex_count)
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "rows %d to %d: expected a range within 0 to %d", row_begin,
                                row_end, bem->vertex_count);
    const size_t height = 3 * (size_t)(row_end - row_begin);
    if (ld_a < height || ld_b < height || (gravity && ld_g < height))
        return pliant_error_set(err, PLIANT_ERR_ARGUMENT,
                                "leading dimensions %zu, %zu, %zu: expected at least %zu", ld_a,
                                ld_b, ld_g, height);
    if (height == 0) return PLIANT_OK;

    pliant_status status = PLIANT_OK;
    tile t = {.near = malloc((size_t)bem->element_count)};
    t.sums = aligned_alloc(sizeof(pliant_lanes), (size_t)bem->vertex_count * sizeof *t.sums);
    if (!t.sums || !t.near) {
        status = pliant_error_set(err, PLIANT_ERR_MEMORY, "no memory for rows of %d vertices",
                                  bem->vertex_count);
        goto done;
    }
    for (int32_t row = row_begin; row < row_end; row += PLIANT_LANES) {
        t.row = row;
        t.row_count = row_end - row < PLIANT_LANES ? row_end - row : PLIANT_LANES;
        const size_t offset = 3 * (size_t)(row - row_begin);
        integrate_elements(bem, gravity != NULL, &t);
        close_diagonal(bem->vertex_count, &t);
        write_rows(bem, fixed, &t, A + offset, ld_a, B + offset, ld_b);
        if (gravity) write_body(bem, &t, gravity + offset, ld_g);
    }
done:
    free(t.sums);
    free(t.near);
    return status;
}
