// test_precompute_fem.c: pliant-precompute --method fem from the outside: files that play as the
// boundary elements' do, ranks, solvers, materials by region, refusals.
#include "check.h"
#include "command.h"

#include "pliant/dense_view.h"
#include "pliant/mesh.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char name[] = "pliant-precompute: ";
static const char sample[] =
    "scripts/sample/whale.obj --fixed 'z<0.03' --young 50000 --poisson 0.4 --density 1000";

static const char *in_folder(const char *file)
{
    static char paths[4][512];
    static int turn;
    char *path = paths[turn++ % 4];
    snprintf(path, sizeof paths[0], "%s/%s", check_folder(), file);
    return path;
}

static void precompute(int ranks, const char *mesh, const char *options, const char *model,
                       const char *dense)
{
    check_command run;
    char launcher[64] = "";
    if (ranks > 1) snprintf(launcher, sizeof launcher, "mpirun --quiet -n %d ", ranks);
    check_run(&run, "%s%s/pliant-precompute -q %s %s -o %s --force%s%s", launcher, check_build(),
              mesh, options, in_folder(model), dense ? " --blocks all --dense " : "",
              dense ? in_folder(dense) : "");
    if (run.status) print_error("%s", run.errors);
    assert_int_equal(run.status, 0);
}

// ---- Files against each other ----

typedef struct opened {
    pliant_reader *reader;
    pliant_dense_view view;
} opened;

static opened open_dense(const char *file)
{
    opened o;
    pliant_error err;
    check_ok(pliant_reader_open(in_folder(file), &o.reader, &err), &err);
    check_ok(pliant_dense_view_bind(o.reader, &o.view, &err), &err);
    return o;
}

// The largest difference, relative to the largest value.
static double largest_difference(const double *a, const double *b, size_t count)
{
    double off = 0, most = 0;
    for (size_t i = 0; i < count; i++) {
        off = fmax(off, fabs(a[i] - b[i]));
        most = fmax(most, fabs(b[i]));
    }
    return off / most;
}

static void check_same(const char *first, const char *second, double tolerance)
{
    opened a = open_dense(first), b = open_dense(second);
    const size_t m = 3 * (size_t)a.view.free_count, k = 3 * (size_t)a.view.fixed_count;
    assert_int_equal(a.view.free_count, b.view.free_count);
    check_at_most(largest_difference(a.view.free_free, b.view.free_free, m * m), tolerance);
    check_at_most(largest_difference(a.view.free_fixed, b.view.free_fixed, m * k), tolerance);
    check_at_most(largest_difference(a.view.fixed_free, b.view.fixed_free, m * k), tolerance);
    check_at_most(largest_difference(a.view.fixed_fixed, b.view.fixed_fixed, k * k), tolerance);
    check_at_most(largest_difference(a.view.gravity_free, b.view.gravity_free, 3 * m), tolerance);
    check_at_most(largest_difference(a.view.gravity_fixed, b.view.gravity_fixed, 3 * k), tolerance);
    pliant_reader_close(b.reader);
    pliant_reader_close(a.reader);
}

static void ranks_and_solvers_give_the_same_columns(void **state)
{
    (void)state;
    precompute(1, sample, "--subdivide 1 --method fem --solver direct", "model.h5", "direct1.h5");
    precompute(2, sample, "--subdivide 1 --method fem --solver direct", "model.h5", "direct2.h5");
    check_same("direct2.h5", "direct1.h5", 1e-9);
    precompute(1, sample, "--subdivide 1 --method fem --solver multigrid", "model.h5",
               "multigrid1.h5");
    check_same("multigrid1.h5", "direct1.h5", 1e-6);
    // Two ranks with one system between them, too.
    precompute(2, sample, "--subdivide 1 --method fem --solver direct --groups 1", "model.h5",
               "together2.h5");
    check_same("together2.h5", "direct1.h5", 1e-9);
    precompute(2, sample, "--subdivide 0 --method fem --solver direct", "model.h5", "direct2.h5");
    precompute(2, sample, "--subdivide 0 --method fem --solver multigrid", "model.h5",
               "multigrid2.h5");
    check_same("multigrid2.h5", "direct2.h5", 1e-6);
}

// Where the sample's tail goes under its own weight and a pull, in a file of each method.
static void play(const char *model, double tail[3])
{
    check_command run;
    char path[512];
    snprintf(path, sizeof path, "%s", in_folder("pull.script"));
    FILE *out = fopen(path, "w");
    assert_non_null(out);
    fprintf(out, "pliant-script 1\nprobe tail vertex 33\ngravity 0 0 -9.81\ndisplace 0:9 0 0 "
                 "-0.004\nstep\n");
    fclose(out);
    check_run(&run, "%s/pliant-play -o %s %s %s", check_build(), in_folder("pull.csv"),
              in_folder(model), path);
    if (run.status) print_error("%s", run.errors);
    assert_int_equal(run.status, 0);
    FILE *in = fopen(in_folder("pull.csv"), "r");
    assert_non_null(in);
    char line[1024] = "";
    while (fgets(line, sizeof line, in)) {
    }
    fclose(in);
    const char *at = line;
    for (int comma = 0; comma < 5; comma++) at = strchr(at, ',') + 1;
    assert_int_equal(sscanf(at, "%lf,%lf,%lf", &tail[0], &tail[1], &tail[2]), 3);
}

static void files_of_both_methods_play_alike_the_more_the_finer(void **state)
{
    (void)state;
    double off[2];
    for (int level = 2; level <= 3; level++) {
        char options[128];
        double tail[2][3], away = 0, size = 0;
        for (int fem = 0; fem < 2; fem++) {
            snprintf(options, sizeof options,
                     "--subdivide %d --constraint-levels 0 --eps 1e-6 --method %s", level,
                     fem ? "fem" : "bem");
            precompute(1, sample, options, fem ? "fem.h5" : "bem.h5", NULL);
            play(fem ? "fem.h5" : "bem.h5", tail[fem]);
        }
        for (int i = 0; i < 3; i++)
            away += pow(tail[1][i] - tail[0][i], 2), size += tail[0][i] * tail[0][i];
        off[level - 2] = sqrt(away / size);
        print_message("level %d: the tail goes %.4f m, the methods differ by %.2f%%\n", level,
                      sqrt(size), 100 * off[level - 2]);
    }
    check_at_most(off[0], 0.12);
    check_at_most(off[1], 0.06);
    check_at_most(off[1], 0.6 * off[0]);
    check_command run;
    check_run(&run, "%s/pliant-info --verify %s", check_build(), in_folder("fem.h5"));
    assert_int_equal(run.status, 0);
    check_run(&run, "%s/pliant-info %s", check_build(), in_folder("fem.h5"));
    assert_int_equal(run.status, 0);
    assert_non_null(strstr(run.output, "fem"));
}

// ---- A bar of four cubes, six tetrahedra each, in two physical volumes ----

enum { CELLS = 4, NODES = 4 * (CELLS + 1), TETS = 6 * CELLS };

static int compare_keys(const void *a, const void *b)
{
    return memcmp(a, b, 4 * sizeof(int32_t));
}

static void write_bar(void)
{
    static const int ways[6][3] = {{1, 2, 4}, {1, 4, 2}, {2, 1, 4},
                                   {2, 4, 1}, {4, 1, 2}, {4, 2, 1}};
    int32_t tets[TETS][4], faces[4 * TETS][7];
    for (int e = 0; e < TETS; e++)
        for (int k = 0, corner = 0; k < 4; corner += k < 3 ? ways[e % 6][k] : 0, k++)
            tets[e][k] = 4 * (e / 6 + (corner & 1)) + (corner >> 1);
    FILE *out = fopen(in_folder("bar.msh"), "w");
    assert_non_null(out);
    fprintf(out,
            "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n2\n3 1 \"left\"\n3 2 "
            "\"right\"\n$EndPhysicalNames\n$Nodes\n%d\n",
            NODES);
    for (int i = 0; i < NODES; i++) fprintf(out, "%d %d %d %d\n", i + 1, i / 4, i & 1, i >> 1 & 1);
    fprintf(out, "$EndNodes\n$Elements\n%d\n", TETS);
    for (int e = 0; e < TETS; e++)
        fprintf(out, "%d 4 2 %d %d %d %d %d %d\n", e + 1, 1 + (e >= TETS / 2), 1 + (e >= TETS / 2),
                tets[e][0] + 1, tets[e][1] + 1, tets[e][2] + 1, tets[e][3] + 1);
    fprintf(out, "$EndElements\n");
    fclose(out);
    // Faces of one tetrahedron only, turned outwards: away from the fourth corner.
    for (int e = 0; e < TETS; e++)
        for (int k = 0; k < 4; k++) {
            int32_t v[3], *face = faces[4 * e + k];
            for (int i = 0, j = 0; i < 4; i++)
                if (i != k) v[j++] = tets[e][i];
            double x[4][3];
            for (int i = 0; i < 4; i++) {
                const int32_t at = i < 3 ? v[i] : tets[e][k];
                x[i][0] = at / 4, x[i][1] = at & 1, x[i][2] = at >> 1 & 1;
            }
            double six = 0;
            for (int i = 0; i < 3; i++) {
                const int j = (i + 1) % 3, l = (i + 2) % 3;
                six += (x[3][i] - x[0][i]) * ((x[1][j] - x[0][j]) * (x[2][l] - x[0][l]) -
                                              (x[1][l] - x[0][l]) * (x[2][j] - x[0][j]));
            }
            face[4] = v[0], face[5] = v[six > 0 ? 2 : 1], face[6] = v[six > 0 ? 1 : 2];
            face[3] = 0;
            for (int i = 0; i < 3; i++) {
                face[i] = v[i];
                for (int j = i; j > 0 && face[j - 1] > face[j]; j--) {
                    const int32_t swap = face[j];
                    face[j] = face[j - 1], face[j - 1] = swap;
                }
            }
        }
    qsort(faces, 4 * TETS, sizeof *faces, compare_keys);
    out = fopen(in_folder("bar.obj"), "w");
    assert_non_null(out);
    for (int i = 0; i < NODES; i++) fprintf(out, "v %d %d %d\n", i / 4, i & 1, i >> 1 & 1);
    for (int f = 0; f < 4 * TETS; f++) {
        if (f + 1 < 4 * TETS && compare_keys(faces[f], faces[f + 1]) == 0) f++;
        else fprintf(out, "f %d %d %d\n", faces[f][4] + 1, faces[f][5] + 1, faces[f][6] + 1);
    }
    fclose(out);
}

// The reaction to a unit acceleration along x: density is 1 on the left, two cubes; and how far the
// end gives way.
static void hang(const char *materials, double *reaction, double *end)
{
    char options[512], mesh[512];
    snprintf(mesh, sizeof mesh, "%s", in_folder("bar.obj"));
    snprintf(options, sizeof options,
             "--subdivide 0 --fixed 'x<0.5' --young 10 --method fem --volume %s %s",
             in_folder("bar.msh"), materials);
    precompute(1, mesh, options, "bar.h5", "bar-dense.h5");
    opened o = open_dense("bar-dense.h5");
    assert_int_equal(o.view.fixed_count, 4);
    // A cube's end in two triangles, and the sides' next to it: their areas by corner.
    pliant_error err;
    int32_t faces = 0;
    pliant_mesh *m = NULL;
    FILE *in = fopen(mesh, "r");
    char line[128];
    check_ok(pliant_mesh_create(NODES, 2 * NODES - 4, &m, &err), &err);
    for (int i = 0; i < NODES; i++)
        m->vertices[3 * i] = i / 4, m->vertices[3 * i + 1] = i & 1,
                        m->vertices[3 * i + 2] = i >> 1 & 1;
    while (fgets(line, sizeof line, in))
        if (sscanf(line, "f %d %d %d", &m->faces[3 * faces], &m->faces[3 * faces + 1],
                   &m->faces[3 * faces + 2]) == 3) {
            for (int k = 0; k < 3; k++) m->faces[3 * faces + k]--;
            faces++;
        }
    fclose(in);
    assert_int_equal(faces, m->face_count);
    double areas[NODES];
    pliant_mesh_vertex_areas(NODES, m->vertices, m->face_count, m->faces, areas);
    *reaction = 0;
    for (int k = 0; k < 4; k++)
        *reaction += areas[o.view.fixed_nodes[k]] * o.view.gravity_fixed[9 * k];
    *end = o.view.gravity_free[3 * 3 * (o.view.free_count - 1)];
    pliant_mesh_destroy(m);
    pliant_reader_close(o.reader);
}

static void regions_have_their_materials(void **state)
{
    (void)state;
    double reaction, end, changed;
    write_bar();
    hang("", &reaction, &end);
    check_near(reaction, -4, 1e-10);
    hang("--material right:10:0.3:1 --material left:10:0.3:1", &reaction, &changed);
    check_near(reaction, -4, 1e-10);
    check_near(changed, end, 1e-12 * end);
    // By number; three times as heavy there.
    hang("--material 2:10:0.3:3", &reaction, &changed);
    check_near(reaction, -(2 + 3 * 2), 1e-10);
    // Everything ten times as stiff, then the left alone.
    hang("--material left:100:0.3:1 --material right:100:0.3:1", &reaction, &changed);
    check_near(changed, end / 10, 1e-12 * end);
    hang("--material left:100:0.3:1", &reaction, &changed);
    check_near(reaction, -4, 1e-10);
    // As a rod: E u(4) = 8, of which the right half's own is 2 and the left's 6.
    check_near(changed / end, (0.6 + 2) / 8, 0.06);
}

static void refuse(const char *options, int status, const char *part)
{
    check_command run;
    check_run(&run, "%s/pliant-precompute -q %s --subdivide 1 %s -o %s", check_build(), sample,
              options, in_folder("no.h5"));
    assert_int_equal(run.status, status);
    check_one_line(&run, name, part);
}

static void what_cannot_be_is_refused_in_one_line(void **state)
{
    (void)state;
    refuse("--order 1", 2, "--order goes with --method fem");
    refuse("--solver direct", 2, "--solver goes with --method fem");
    refuse("--volume x.msh", 2, "--volume goes with --method fem");
    refuse("--method fem --order 3", 2, "--order");
    refuse("--growth 1.2", 2, "--growth goes with --method fem");
    refuse("--method fem --growth 0.9", 2, "--growth: expected a number from 1 (all alike) to 2, found 0.9");
    refuse("--method fem --volume a.msh --growth 1.1", 2, "--growth is for the inside that is meshed");
    refuse("--method fem --solver fast", 2, "expected auto, direct or multigrid");
    refuse("--method fem --material a:1:0.3:1", 2, "--material goes with --volume");
    refuse("--method fem --volume x.msh --material a:1:0.3", 2, "expected NAME:E:NU:RHO");
    refuse("--method fem --volume x.msh --material a:1:0.5:1", 2, "under 0.5");
    refuse("--method fem --volume x.msh --material a:1:0.3:1 --material a:2:0.3:1", 2,
           "given twice");
    refuse("--method fem --volume x.msh", 1, "x.msh: cannot be opened");
    write_bar();
    char options[600];
    snprintf(options, sizeof options, "--method fem --volume %s", in_folder("bar.msh"));
    refuse(options, 1, "its boundary is not the model's surface");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(ranks_and_solvers_give_the_same_columns),
        cmocka_unit_test(files_of_both_methods_play_alike_the_more_the_finer),
        cmocka_unit_test(regions_have_their_materials),
        cmocka_unit_test(what_cannot_be_is_refused_in_one_line),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
