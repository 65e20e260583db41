// test_model.c: opening model files, sound and broken.
#include "check.h"

#include "synthetic_model.h"

#include "pliant/pliant.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static char path[64], broken_path[64];

static int set_up_path(void **state)
{
    (void)state;
    snprintf(path, sizeof path, "/tmp/pliant_test_model_%d.h5", (int)getpid());
    snprintf(broken_path, sizeof broken_path, "/tmp/pliant_test_broken_%d.h5", (int)getpid());
    check_write_synthetic_model(path, NULL, 1, 0.05, pliant_wavelet_default(), CHECK_ALL_BLOCKS);
    return 0;
}

static int remove_path(void **state)
{
    (void)state;
    unlink(path);
    unlink(broken_path);
    return 0;
}

static void a_model_describes_what_was_written(void **state)
{
    (void)state;
    pliant_model *model = NULL;
    pliant_error err = {""};
    check_ok(pliant_model_open(path, &model, &err), &err);
    check_synthetic *s = check_synthetic_create(
        &(check_synthetic_def){1, 0.05, pliant_wavelet_default(), CHECK_ALL_BLOCKS, 0});
    const pliant_model_info info = pliant_model_describe(model);
    assert_int_equal(info.vertex_count, 42);
    assert_int_equal(info.face_count, 80);
    assert_int_equal(info.level_count, 2);
    assert_int_equal(info.free_count, s->counts[0]);
    assert_int_equal(info.fixed_count, s->counts[1]);
    assert_int_equal(info.has_supports, 1);
    check_near(info.poisson, 0.3, 0);
    const double *summary = s->compressed[PLIANT_FREE_FREE].summary;
    check_near(info.rms, summary[PLIANT_SUMMARY_RMS], 0);
    check_near(info.max, summary[PLIANT_SUMMARY_MAX], 0);
    check_near(info.factor, summary[PLIANT_SUMMARY_FACTOR], 0);
    assert_int_equal(pliant_model_level_vertex_count(model, 0), 12);
    assert_int_equal(pliant_model_level_vertex_count(model, 1), 42);
    assert_int_equal(pliant_model_level_vertex_count(model, 2), 0);
    assert_int_equal(pliant_model_level_vertex_count(model, -1), 0);
    assert_int_equal(pliant_model_level_face_count(model, 0), 20);
    assert_int_equal(pliant_model_level_face_count(model, 2), 0);
    assert_non_null(pliant_model_faces(model, 0));
    assert_null(pliant_model_faces(model, 2));
    assert_memory_equal(pliant_model_positions(model), s->surface.mesh->vertices,
                        3 * 42 * sizeof(double));
    for (int32_t v = 0; v < 42; v++) {
        assert_int_equal(pliant_model_from_source(model, 41 - v), v);
        assert_int_equal(pliant_model_is_free(model, v),
                         s->surface.mesh->vertices[3 * v + 2] >= -0.6);
        check_near(pliant_model_area(model, v), s->surface.areas[v], 1e-15);
        const int32_t nearest =
            pliant_model_nearest(model, s->surface.mesh->vertices + 3 * (size_t)v);
        if (pliant_model_is_free(model, v)) assert_int_equal(nearest, v);
        else assert_int_equal(pliant_model_is_free(model, nearest), 1);
    }
    const int32_t outside[] = {-1, 42, INT32_MAX, INT32_MIN};
    for (int i = 0; i < 4; i++) {
        assert_int_equal(pliant_model_is_free(model, outside[i]), -1);
        assert_int_equal(pliant_model_from_source(model, outside[i]), -1);
        check_near(pliant_model_area(model, outside[i]), 0, 0);
    }
    check_ok(pliant_model_verify(model, &err), &err);
    check_synthetic_destroy(s);
    pliant_model_close(model);
}

static void what_cannot_be_opened_is_refused_without_effect(void **state)
{
    (void)state;
    pliant_model *const untouched = (pliant_model *)(void *)&(char){0}, *model = untouched;
    pliant_error err = {""};
    assert_int_equal(pliant_model_open("/nowhere/at/all.h5", &model, &err), PLIANT_ERR_IO);
    assert_non_null(strstr(err.text, "/nowhere/at/all.h5"));
    assert_true(pliant_model_open("/tmp", &model, &err) < 0);
    assert_true(pliant_model_open("/dev/null", &model, NULL) < 0);
    assert_int_equal(pliant_model_open(NULL, &model, &err), PLIANT_ERR_ARGUMENT);
    assert_ptr_equal(model, untouched);
    assert_int_equal(pliant_model_open(path, NULL, &err), PLIANT_ERR_ARGUMENT);
    pliant_model_close(NULL);
    pliant_solver_destroy(NULL);
}

static unsigned char *read_file(size_t *size)
{
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    struct stat facts;
    assert_int_equal(fstat(fileno(file), &facts), 0);
    *size = (size_t)facts.st_size;
    unsigned char *bytes = malloc(*size);
    assert_int_equal(fread(bytes, 1, *size, file), *size);
    fclose(file);
    return bytes;
}

static void write_file(const unsigned char *bytes, size_t size)
{
    FILE *file = fopen(broken_path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(bytes, 1, size, file), size);
    fclose(file);
}

// Open a broken file; if that succeeds use it: anything but a crash is fine. 1: opened.
static int use_broken(pliant_status *verified)
{
    pliant_model *model = NULL;
    pliant_solver *solver = NULL;
    pliant_error err = {""};
    if (pliant_model_open(broken_path, &model, &err) < 0) {
        assert_null(model);
        assert_non_null(strstr(err.text, broken_path));
        return 0;
    }
    *verified = pliant_model_verify(model, &err);
    const int32_t n = pliant_model_describe(model).vertex_count;
    const int32_t finest = pliant_model_describe(model).level_count - 1;
    pliant_vec3 *u = calloc((size_t)n, sizeof *u);
    check_ok(pliant_solver_create(model, NULL, &solver, &err), &err);
    for (int32_t v = 0; v < n; v += 3) {
        (void)!pliant_solver_displace(solver, (pliant_node){finest, v}, (pliant_vec3){0, 0, 1});
        (void)!pliant_solver_press(solver, (pliant_node){finest, (v + 1) % n},
                                   (pliant_vec3){0, 0, 1});
    }
    assert_true(pliant_solver_solve(solver, PLIANT_NEVER) >= 0);
    assert_int_equal(pliant_solver_surface(solver, finest, u), PLIANT_OK);
    (void)!pliant_solver_tractions(solver, NULL, n, u);
    pliant_solver_destroy(solver);
    pliant_model_close(model);
    free(u);
    return 1;
}

static void truncated_files_are_refused(void **state)
{
    (void)state;
    size_t size;
    unsigned char *bytes = read_file(&size);
    pliant_status verified;
    for (size_t cut = 0; cut < size; cut += cut < 4096 ? 97 : 4096) {
        write_file(bytes, cut);
        assert_int_equal(use_broken(&verified), 0);
    }
    write_file(bytes, size - 1);
    assert_int_equal(use_broken(&verified), 0);
    free(bytes);
}

static void flipped_bits_are_refused_or_found_by_verify_and_never_crash(void **state)
{
    (void)state;
    size_t size;
    unsigned char *bytes = read_file(&size);
    check_random random = check_random_seed(1);
    int opened = 0;
    for (int trial = 0; trial < 400; trial++) {
        // A third of them in the header and table, the rest anywhere.
        const size_t range = trial % 3 ? size : 4096;
        const size_t at = (size_t)(check_random_next(&random) * (double)range);
        const unsigned char bit = (unsigned char)(1u << (int)(8 * check_random_next(&random)));
        bytes[at] ^= bit;
        write_file(bytes, size);
        pliant_status verified = PLIANT_OK;
        if (use_broken(&verified)) {
            opened++;
            if (verified == PLIANT_OK)
                fail_msg("flip of bit %d at byte %zu was not found", bit, at);
        }
        bytes[at] ^= bit;
    }
    print_message("%d of 400 opened and were found by verify\n", opened);
    free(bytes);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_model_describes_what_was_written),
        cmocka_unit_test(what_cannot_be_opened_is_refused_without_effect),
        cmocka_unit_test(truncated_files_are_refused),
        cmocka_unit_test(flipped_bits_are_refused_or_found_by_verify_and_never_crash),
    };
    return cmocka_run_group_tests(tests, set_up_path, remove_path);
}
