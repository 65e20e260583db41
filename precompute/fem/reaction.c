// reaction.c: tractions of held vertices, and what they do beyond the rim of the held part.
#include "fem/reaction.h"

#include "fem/element.h"

#include <string.h>

// N = integral of (C^T N_I) phi_l for held vertices l.
static PetscErrorCode add_faces(const pliant_tetrahedra *t, const uint8_t *held,
                                const PetscInt *position, Mat N)
{
    PetscFunctionBegin;
    for (int32_t f = 0; f < t->face_count; f++) {
        const int32_t *nodes = t->faces + (size_t)f * (size_t)t->face_nodes;
        const double area = pliant_tetrahedra_face_area(t, f);
        for (int i = 0; i < t->face_nodes; i++) {
            const pliant_following to = pliant_tetrahedra_follow(t, nodes[i]);
            // A midpoint is held with both its ends.
            if (!held[to.vertex[0]] || !held[to.vertex[to.count - 1]]) continue;
            for (int l = 0; l < 3; l++)
                for (int q = 0; q < to.count && held[nodes[l]]; q++)
                    PetscCall(MatSetValue(N, position[to.vertex[q]], position[nodes[l]],
                                          to.weight * area *
                                              pliant_element_face_share(t->face_nodes, i, l),
                                          ADD_VALUES));
        }
    }
    PetscCall(MatAssemblyBegin(N, MAT_FINAL_ASSEMBLY));
    PetscCall(MatAssemblyEnd(N, MAT_FINAL_ASSEMBLY));
    PetscFunctionReturn(0);
}

static PetscErrorCode factor_mass(pliant_reaction *r)
{
    PetscFunctionBegin;
    IS rows, columns;
    MatFactorInfo info;
    PetscCall(MatCreateVecs(r->N, &r->solution, &r->right));
    PetscCall(MatGetOrdering(r->N, MATORDERINGND, &rows, &columns));
    PetscCall(MatFactorInfoInitialize(&info));
    info.fill = 5;
    PetscCall(MatGetFactor(r->N, MATSOLVERPETSC, MAT_FACTOR_CHOLESKY, &r->factor));
    PetscCall(MatCholeskyFactorSymbolic(r->factor, r->N, rows, &info));
    PetscCall(MatCholeskyFactorNumeric(r->factor, r->N, &info));
    PetscCall(ISDestroy(&rows));
    PetscCall(ISDestroy(&columns));
    PetscFunctionReturn(0);
}

PetscErrorCode pliant_reaction_create(const pliant_tetrahedra *t, const uint8_t *held,
                                      pliant_reaction **reaction)
{
    PetscFunctionBegin;
    pliant_reaction *r;
    const int32_t n = t->surface_count;
    PetscInt *position, *nonzeros;
    uint8_t *at_rim;
    PetscCall(PetscNew(&r));
    *reaction = r;
    r->vertex_count = n;
    PetscCall(PetscMalloc2(n, &r->held, n, &r->rim));
    PetscCall(PetscMalloc2(n, &position, n + 1, &nonzeros));
    PetscCall(PetscCalloc1(n, &at_rim));
    for (int32_t v = 0; v < n; v++) {
        position[v] = held[v] ? r->held_count : -1;
        if (!held[v]) continue;
        r->held[r->held_count] = v;
        nonzeros[r->held_count++] = 1;
    }
    // Neighbours on closed surfaces are as many as faces.
    for (int32_t f = 0; f < t->face_count; f++) {
        const int32_t *v = t->faces + (size_t)f * (size_t)t->face_nodes;
        for (int k = 0; k < 3; k++) {
            if (held[v[k]]) nonzeros[position[v[k]]]++;
            if (!held[v[0]] || !held[v[1]] || !held[v[2]]) at_rim[v[k]] = held[v[k]];
        }
    }
    for (int32_t v = 0; v < n; v++)
        if (at_rim[v]) r->rim[r->rim_count++] = v;
    PetscCall(MatCreateSeqAIJ(PETSC_COMM_SELF, r->held_count, r->held_count, 0, nonzeros, &r->N));
    PetscCall(MatSetOption(r->N, MAT_SPD, PETSC_TRUE));
    PetscCall(add_faces(t, held, position, r->N));
    PetscCall(PetscFree(at_rim));
    PetscCall(PetscFree2(position, nonzeros));
    PetscCall(factor_mass(r));
    PetscFunctionReturn(0);
}

// N^-1 in place, at the held vertices of columns [column_count][3n].
static PetscErrorCode solve_mass(const pliant_reaction *r, int32_t column_count, double *columns)
{
    PetscFunctionBegin;
    for (size_t j = 0; j < (size_t)column_count; j++)
        for (size_t c = 0; c < 3; c++) {
            double *column = columns + j * 3 * (size_t)r->vertex_count + c, *right;
            const double *solution;
            PetscCall(VecGetArrayWrite(r->right, &right));
            for (PetscInt k = 0; k < r->held_count; k++) right[k] = column[3 * (size_t)r->held[k]];
            PetscCall(VecRestoreArrayWrite(r->right, &right));
            PetscCall(MatSolve(r->factor, r->right, r->solution));
            PetscCall(VecGetArrayRead(r->solution, &solution));
            for (PetscInt k = 0; k < r->held_count; k++)
                column[3 * (size_t)r->held[k]] = solution[k];
            PetscCall(VecRestoreArrayRead(r->solution, &solution));
        }
    PetscFunctionReturn(0);
}

PetscErrorCode pliant_reaction_couple(pliant_reaction *r, double *responses)
{
    PetscFunctionBegin;
    const size_t size = 3 * (size_t)r->rim_count, rows = 3 * (size_t)r->vertex_count;
    double *a;
    r->responses = responses;
    PetscCall(solve_mass(r, (int32_t)size, responses));
    PetscCall(
        MatCreateSeqDense(PETSC_COMM_SELF, (PetscInt)size, (PetscInt)size, NULL, &r->coupling));
    PetscCall(MatDenseGetArrayWrite(r->coupling, &a));
    for (size_t j = 0; j < size; j++)
        for (size_t i = 0; i < size; i++)
            a[i + j * size] = (i == j) - responses[j * rows + 3 * (size_t)r->rim[i / 3] + i % 3];
    PetscCall(MatDenseRestoreArrayWrite(r->coupling, &a));
    PetscCall(MatAssemblyBegin(r->coupling, MAT_FINAL_ASSEMBLY));
    PetscCall(MatAssemblyEnd(r->coupling, MAT_FINAL_ASSEMBLY));
    if (size > 0) PetscCall(MatLUFactor(r->coupling, NULL, NULL, NULL));
    PetscFunctionReturn(0);
}

PetscErrorCode pliant_reaction_finish(const pliant_reaction *r, int32_t column_count,
                                      double *columns)
{
    PetscFunctionBegin;
    const size_t size = 3 * (size_t)r->rim_count, rows = 3 * (size_t)r->vertex_count;
    PetscCall(solve_mass(r, column_count, columns));
    if (size == 0 || column_count == 0) PetscFunctionReturn(0);
    Mat Z, E, X, product;
    double *rim;
    const double *added;
    PetscCall(MatCreateSeqDense(PETSC_COMM_SELF, (PetscInt)size, column_count, NULL, &E));
    PetscCall(MatDuplicate(E, MAT_DO_NOT_COPY_VALUES, &X));
    PetscCall(MatDenseGetArrayWrite(E, &rim));
    for (size_t j = 0; j < (size_t)column_count; j++)
        for (size_t i = 0; i < size; i++)
            rim[i + j * size] = columns[j * rows + 3 * (size_t)r->rim[i / 3] + i % 3];
    PetscCall(MatDenseRestoreArrayWrite(E, &rim));
    PetscCall(MatAssemblyBegin(E, MAT_FINAL_ASSEMBLY));
    PetscCall(MatAssemblyEnd(E, MAT_FINAL_ASSEMBLY));
    PetscCall(MatMatSolve(r->coupling, E, X));
    PetscCall(MatCreateSeqDense(PETSC_COMM_SELF, (PetscInt)rows, (PetscInt)size, r->responses, &Z));
    PetscCall(MatMatMult(Z, X, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &product));
    PetscCall(MatDenseGetArrayRead(product, &added));
    for (size_t i = 0; i < rows * (size_t)column_count; i++) columns[i] += added[i];
    PetscCall(MatDenseRestoreArrayRead(product, &added));
    PetscCall(MatDestroy(&product));
    PetscCall(MatDestroy(&Z));
    PetscCall(MatDestroy(&X));
    PetscCall(MatDestroy(&E));
    PetscFunctionReturn(0);
}

PetscErrorCode pliant_reaction_destroy(pliant_reaction **reaction)
{
    PetscFunctionBegin;
    pliant_reaction *r = *reaction;
    if (!r) PetscFunctionReturn(0);
    PetscCall(MatDestroy(&r->coupling));
    PetscCall(PetscFree(r->responses));
    PetscCall(VecDestroy(&r->solution));
    PetscCall(VecDestroy(&r->right));
    PetscCall(MatDestroy(&r->factor));
    PetscCall(MatDestroy(&r->N));
    PetscCall(PetscFree2(r->held, r->rim));
    PetscCall(PetscFree(*reaction));
    PetscFunctionReturn(0);
}
