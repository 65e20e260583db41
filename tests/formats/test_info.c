// test_info.c: the program pliant-info, as a user meets it.
#include "tiny_write.h"

#include "image.h"
#include "pliant/pliant.h"

#include <ctype.h>
#include <errno.h>
#include <sys/wait.h>

typedef struct answer {
    int status;
    char text[100000];  // standard output and error
} answer;

// Run pliant-info with these arguments (a shell's words).
static answer *ask(const char *arguments)
{
    static answer a;
    char command[3000];
    const char *build = getenv("PLIANT_BUILD");
    snprintf(command, sizeof command, "{ '%s/pliant-info' %s ; } 2>&1 </dev/null", build ? build : "build", arguments);
    FILE *pipe = popen(command, "r");
    assert_non_null(pipe);
    const size_t length = fread(a.text, 1, sizeof a.text - 1, pipe);
    a.text[length] = 0;
    const int status = pclose(pipe);
    assert_true(WIFEXITED(status));
    a.status = WEXITSTATUS(status);
    return &a;
}

static answer *ask_about(const char *options, const char *path)
{
    char arguments[2000];
    snprintf(arguments, sizeof arguments, "%s '%s'", options, path);
    return ask(arguments);
}

static void check_answer(const answer *a, int status, const char *part)
{
    if (a->status != status) fail_msg("expected exit %d, found %d: %s", status, a->status, a->text);
    check_contains(a->text, part);
    // A refusal is one line.
    if (status != 0) assert_ptr_equal(strchr(a->text, '\n'), a->text + strlen(a->text) - 1);
}

static const char *write_model(const char *name, int32_t level_count, int supports)
{
    pliant_error err;
    tiny_file file;
    const char *path = scratch(name);
    tiny_model_make(level_count, supports, &file);
    check_ok(tiny_write(&file, path, &err), &err);
    tiny_free(&file);
    return path;
}

// ---- A checker of JSON: returns the end of the value at p, or NULL ----

static const char *skip_space(const char *p)
{
    while (*p == ' ' || *p == '\n') p++;
    return p;
}

static const char *check_string(const char *p)
{
    if (*p++ != '"') return NULL;
    for (; *p != '"'; p++) {
        if ((unsigned char)*p < 0x20) return NULL;
        if (*p == '\\' && !strchr("\"\\/bfnrtu", *++p)) return NULL;
        if (*p == 'u' && p[-1] == '\\')
            for (int i = 0; i < 4; i++)
                if (!isxdigit((unsigned char)*++p)) return NULL;
    }
    return p + 1;
}

static const char *check_value(const char *p)
{
    p = skip_space(p);
    const char close = *p == '{' ? '}' : ']';
    if (*p == '"') return check_string(p);
    if (*p != '{' && *p != '[') {
        for (const char *const *word = (const char *const[]){"true", "false", "null", NULL}; *word; word++)
            if (strncmp(p, *word, strlen(*word)) == 0) return p + strlen(*word);
        char *end;
        if (*p != '-' && !isdigit((unsigned char)*p)) return NULL;
        strtod(p, &end);
        return end;
    }
    p = skip_space(p + 1);
    if (*p == close) return p + 1;
    for (;;) {
        if (close == '}') {
            p = check_string(skip_space(p));
            if (!p || *(p = skip_space(p)) != ':') return NULL;
            p++;
        }
        p = check_value(p);
        if (!p) return NULL;
        p = skip_space(p);
        if (*p == close) return p + 1;
        if (*p++ != ',') return NULL;
    }
}

static void check_json(const char *text)
{
    const char *end = check_value(text);
    if (!end || *skip_space(end) != 0) fail_msg("not JSON: %s", text);
}

// ---- Cases ----

static void model_is_described(void **state)
{
    (void)state;
    const answer *a = ask_about("", write_model("model.h5", 3, 1));
    check_answer(a, 0, ": Pliant model, format version 1, ");
    check_contains(a->text, "mesh        66 vertices, 128 faces, 3 levels\n");
    check_contains(a->text, "level 1         18 vertices         32 faces\n");
    check_contains(a->text, "from (-1, -1, -1) to (1, 1, 1), volume 1.33333\n");
    check_contains(a->text, "6 vertices of the input, 60 made by subdivision\n");
    check_contains(a->text, "material    Young's modulus 1000, Poisson's ratio 0.3, density 1\n");
    check_contains(a->text, "domains     53 free, 13 fixed\n");
    check_contains(a->text, "free-free        2        66       53        937  37.9 kB       3x     0.05    0.015     0.04         -  "
                            "butterfly, lifted, zero\n");
    check_contains(a->text, "fixed-fixed      2        66       13 ");
    check_contains(a->text, "gravity     free, fixed\n");
    check_contains(a->text, "program = pliant-precompute 0.1.0\n");
    check_contains(a->text, "place = Z\xc3\xbcrich \"quoted\"\n");
}

static void dense_and_other_files_are_described(void **state)
{
    (void)state;
    pliant_error err;
    tiny_file file;
    const char *path = scratch("dense.h5");
    tiny_dense_make(1, &file);
    check_ok(tiny_write(&file, path, &err), &err);
    tiny_free(&file);
    check_answer(ask_about("", path), 0, ": dense Green's functions, format version 1, ");
    check_answer(ask_about("", path), 0, "nodes       4 free, 2 fixed\n");
    check_answer(ask_about("--verify", path), 0, "verified: 8 sections");
    check_answer(ask_about("--export x.obj", path), 1, "expected a model to export, found a dense file");
    check_json(ask_about("--json", path)->text);

    pliant_writer *writer;
    const pliant_section_def other = {"/displacement", PLIANT_F4, 3, {0, 5, 3}};
    path = scratch("frames.h5");
    check_ok(pliant_writer_create(path, &other, 1, &writer, &err), &err);
    check_ok(pliant_writer_commit(writer, &err), &err);
    check_answer(ask_about("", path), 0, "sections    /displacement f4 [0, 5, 3]\n");
    check_json(ask_about("--json", path)->text);
}

static void json_is_json_and_keeps_quotes_and_names(void **state)
{
    (void)state;
    const answer *a = ask_about("--json", write_model("na \"me\\\xff.h5", 2, 1));
    check_answer(a, 0, "na \\\"me\\\\\\ufffd.h5\",");
    check_contains(a->text, "\"place\": \"Z\xc3\xbcrich \\\"quoted\\\"\"");
    check_contains(a->text, "\"domains\": {\"free\": 13, \"fixed\": 5}");
    check_contains(a->text, "\"block\": \"fixed-free\", \"level\": 1, \"vertices\": 18, \"rows\": 5, \"columns\": 13");
    check_contains(a->text, "\"smallest_eigenvalue\": null, \"wavelet\"");
    check_contains(a->text, "\"wavelet\": \"butterfly\", \"lifted\": true, \"boundary\": \"zero\"");
    assert_null(strstr(a->text, "verified"));
    check_json(a->text);
    a = ask_about("--json --verify", scratch("na \"me\\\xff.h5"));
    check_answer(a, 0, "\"verified\": true");
    check_contains(a->text, "\"verified\": {\"smallest_eigenvalue\": ");
    check_json(a->text);
}

// The same model with another number stored as its smallest eigenvalue.
static const char *write_definite(const char *name, double smallest)
{
    pliant_error err;
    tiny_file file;
    const char *path = scratch(name);
    tiny_model_make(2, 0, &file);
    ((double *)tiny_find(&file, "/greens/free-free/level1/summary")->data)[PLIANT_SUMMARY_DEFINITE] = smallest;
    check_ok(tiny_write(&file, path, &err), &err);
    tiny_free(&file);
    return path;
}

// Against the eigenvalues of the dense matrix: tests/common/test_compliance.c.
static void verify_finds_the_smallest_eigenvalue_and_compares_it(void **state)
{
    (void)state;
    const answer *a = ask_about("--verify", write_definite("definite.h5", 0));
    check_answer(a, 0, "contact compliance, level 1: smallest eigenvalue ratio ");
    double ratio, smallest, largest;
    const char *line = strstr(a->text, "ratio ");
    assert_int_equal(sscanf(line, "ratio %lf (%lf of %lf)", &ratio, &smallest, &largest), 3);
    // Blocks of sines: far from definite, and their diagonal is 1, so that eigenvalues of both signs
    // add up to the number of rows.
    assert_true(smallest < -0.1 && largest > 1);
    assert_true(fabs(ratio - smallest / largest) < 0.01 * fabs(ratio));
    assert_null(strstr(a->text, "as stored"));

    check_answer(ask_about("--verify", write_definite("definite.h5", smallest)), 0, ", as stored)\n");
    char shown[64];
    snprintf(shown, sizeof shown, "  %8.3g  butterfly", smallest);
    check_answer(ask_about("", scratch("definite.h5")), 0, shown);
    a = ask_about("--json", scratch("definite.h5"));
    line = strstr(a->text, "\"smallest_eigenvalue\": ");
    assert_non_null(line);
    assert_true(fabs(strtod(line + 23, NULL) - smallest) < 1e-12);
    assert_null(strstr(a->text, "verified"));
    check_answer(ask_about("--verify", write_definite("definite.h5", smallest + 0.1)), 1,
                 "definite.h5: /greens/free-free/level1: smallest eigenvalue: expected ");
    check_answer(ask_about("", scratch("definite.h5")), 0, "Pliant model");
}

static void a_mesh_without_area_is_found_by_verify(void **state)
{
    (void)state;
    pliant_error err;
    tiny_file file;
    const char *path = scratch("flat.h5");
    tiny_model_make(2, 0, &file);
    memset(tiny_find(&file, "/mesh/vertices")->data, 0, tiny_find(&file, "/mesh/vertices")->bytes);
    check_ok(tiny_write(&file, path, &err), &err);
    tiny_free(&file);
    check_answer(ask_about("--verify", path), 1, "flat.h5: /mesh: vertex 0: expected an area above 0, found 0");
}

static void damage_is_found_by_verify_alone(void **state)
{
    (void)state;
    const char *path = write_model("damaged.h5", 2, 0);
    check_answer(ask_about("--verify", path), 0, "verified: 16 sections, ");
    check_contains(ask_about("--verify", path)->text, "checksums, indices and levels\n");
    size_t size;
    unsigned char *bytes = load(path, &size);
    pliant_entry entry;
    memcpy(&entry, bytes + sizeof(pliant_header), sizeof entry);  // /mesh/vertices
    bytes[entry.offset] ^= 1;
    save(path, bytes, size);
    free(bytes);
    check_answer(ask_about("", path), 0, "Pliant model");
    check_answer(ask_about("--verify", path), 1, "/mesh/vertices: damaged: expected checksum ");
}

static void wrong_topology_is_found_by_verify(void **state)
{
    (void)state;
    pliant_error err;
    tiny_file file;
    const char *path = scratch("twisted.h5");
    tiny_model_make(2, 0, &file);
    int32_t *face = tiny_find(&file, "/mesh/faces")->data;
    const int32_t first = face[0];
    face[0] = face[1];
    face[1] = first;  // in range, but turned
    check_ok(tiny_write(&file, path, &err), &err);
    tiny_free(&file);
    check_answer(ask_about("--verify", path), 1, "twisted.h5: /mesh: ");
}

// Positions of a level are the first of the finest level's, so every level of the octahedron encloses
// the same volume; vertices come back to the last bit.
static void levels_are_exported_as_obj_and_ply(void **state)
{
    (void)state;
    const tiny_mesh mesh = tiny_mesh_make(3);
    const char *path = write_model("export.h5", 3, 0);
    char arguments[1500];
    for (int32_t level = 0; level < 3; level++) {
        const char *output = scratch("out.OBJ");
        snprintf(arguments, sizeof arguments, "--export '%s' --level %d '%s'", output, (int)level, path);
        assert_int_equal(ask(arguments)->status, 0);
        FILE *file = fopen(output, "r");
        assert_non_null(file);
        char line[200];
        int32_t vertex = 0, face = 0;
        while (fgets(line, sizeof line, file)) {
            double x[3];
            int v[3];
            if (sscanf(line, "v %lf %lf %lf", &x[0], &x[1], &x[2]) == 3) {
                assert_memory_equal(x, mesh.vertices[vertex], sizeof x);
                vertex++;
            } else if (sscanf(line, "f %d %d %d", &v[0], &v[1], &v[2]) == 3) {
                for (int k = 0; k < 3; k++) assert_in_range(v[k], 1, mesh.level_vertex_count[level]);
                if (level == 2 && face < mesh.face_count)
                    for (int k = 0; k < 3; k++) assert_int_equal(v[k], mesh.faces[face][k] + 1);
                face++;
            }
        }
        fclose(file);
        assert_int_equal(vertex, mesh.level_vertex_count[level]);
        assert_int_equal(face, 8 << 2 * level);
    }

    const char *output = scratch("out.ply");
    snprintf(arguments, sizeof arguments, "--export '%s' '%s'", output, path);
    check_answer(ask(arguments), 0, "");
    size_t size;
    unsigned char *bytes = load(output, &size);
    bytes[size] = 0;
    const char *body = strstr((char *)bytes, "end_header\n");
    assert_non_null(body);
    check_contains((char *)bytes, "element vertex 66\n");
    const size_t begin = (size_t)(body - (char *)bytes) + strlen("end_header\n");
    assert_int_equal(size - begin, 66 * 24 + 128 * 13);
    assert_memory_equal(bytes + begin, mesh.vertices, 66 * 24);
    assert_int_equal(bytes[begin + 66 * 24], 3);
    assert_memory_equal(bytes + begin + 66 * 24 + 1, mesh.faces[0], 12);
    free(bytes);
    assert_false(exists(scratch("out.ply.tmp")));
    assert_false(exists(scratch("out.OBJ.tmp")));
}

// The exported shape is the library's, float for float.
static void detail_is_described_and_exported(void **state)
{
    (void)state;
    const char *path = write_model("detail.h5", 3, TINY_DETAIL), *output = scratch("detail.obj");
    char arguments[1500];
    check_answer(ask_about("", path), 0, "detail      258 vertices, 512 faces, 1 step finer than level 2\n");
    check_answer(ask_about("--json", path), 0, "\"detail\": {\"steps\": 1, \"vertices\": 258, \"faces\": 512, \"rms\": ");
    check_json(ask_about("--json", path)->text);
    check_answer(ask_about("--verify", path), 0, "verified: ");
    snprintf(arguments, sizeof arguments, "--export '%s' --detail '%s'", output, path);
    check_answer(ask(arguments), 0, "");

    pliant_error err;
    pliant_model *model;
    pliant_detail *detail;
    pliant_vec3 positions[258];
    check_ok(pliant_model_open(path, &model, &err), &err);
    check_ok(pliant_detail_create(model, 2, &detail, &err), &err);
    assert_int_equal(pliant_detail_evaluate(detail, NULL, positions, NULL), PLIANT_OK);
    FILE *file = fopen(output, "r");
    assert_non_null(file);
    char line[200];
    int32_t vertex = 0, face = 0;
    while (fgets(line, sizeof line, file)) {
        pliant_vec3 x;
        int v[3];
        if (sscanf(line, "v %f %f %f", &x.x, &x.y, &x.z) == 3) {
            assert_memory_equal(&x, &positions[vertex], sizeof x);
            vertex++;
        } else if (sscanf(line, "f %d %d %d", &v[0], &v[1], &v[2]) == 3) {
            for (int k = 0; k < 3; k++) assert_int_equal(v[k], pliant_detail_faces(detail)[3 * face + k] + 1);
            face++;
        }
    }
    fclose(file);
    assert_int_equal(vertex, 258);
    assert_int_equal(face, 512);
    pliant_detail_destroy(detail);
    pliant_model_close(model);

    path = write_model("plain.h5", 2, 0);
    snprintf(arguments, sizeof arguments, "--export '%s' --detail '%s'", scratch("none.obj"), path);
    check_answer(ask(arguments), 1, "plain.h5: /detail: expected geometric detail");
    assert_false(exists(scratch("none.obj")));
}

// Alone in its file, or beside Green's functions.
static void lattice_is_described_and_exported(void **state)
{
    (void)state;
    static const char *const shown[] = {
        "lattice     35 particles (5 x 3 x 3), 9 cells of size 1, solid, 2 components\n",
        "            half-width 1, ", " regions, 13 irregular by ",
        "            mass 8, of a particle 0.228571 to 0.228571\n",
        "            surface in 2 batches of at most 27 particles\n",
        "material    Young's modulus 1000",
    };
    for (int parts = TINY_LATTICE; parts <= (TINY_LATTICE | TINY_NO_GREENS); parts += TINY_NO_GREENS) {
        const int has_greens = !(parts & TINY_NO_GREENS);
        const char *path = write_model("lattice.h5", 3, parts);
        const answer *a = ask_about("", path);
        check_answer(a, 0, ": Pliant model, format version 1, ");
        for (size_t i = 0; i < sizeof shown / sizeof *shown; i++) check_contains(a->text, shown[i]);
        assert_int_equal(strstr(a->text, "domains") != NULL, has_greens);
        assert_int_equal(strstr(a->text, "greens") != NULL, has_greens);
        assert_int_equal(strstr(a->text, "gravity") != NULL, has_greens);
        a = ask_about("--json", path);
        check_json(a->text);
        check_contains(a->text, "\"lattice\": {\"particles\": 35, \"cells\": 9, \"dims\": [5, 3, 3], "
                                "\"cell_size\": 1, \"origin\": [-1, -1, -1]");
        check_contains(a->text, "\"shell\": false, \"components\": 2, \"half_width\": 1, ");
        check_contains(a->text, "\"irregular\": 13, ");
        check_contains(a->text, "\"batches\": 2, \"largest_batch\": 27}");
        assert_int_equal(strstr(a->text, "\"domains\"") != NULL, has_greens);
        check_answer(ask_about("--verify", path), 0, "checksums, indices, levels and lattice\n");
        char arguments[1500];
        const char *output = scratch("lattice.ply");
        snprintf(arguments, sizeof arguments, "--export '%s' --level 1 '%s'", output, path);
        check_answer(ask(arguments), 0, "");
        assert_true(exists(output));
    }
}

// What binding takes, since it does no harm, but is not so.
static void wrong_lattices_are_found_by_verify(void **state)
{
    (void)state;
    static const struct {
        const char *path;
        int32_t element;
        double value;
        const char *reason;
    } cases[] = {
        {"/lattice/summary", PLIANT_LATTICE_COMPONENT_COUNT, 1, "/lattice/summary: components: expected 2, found 1"},
        {"/lattice/frame", PLIANT_LATTICE_MASS, 7.9, "/lattice/mass: expected a sum of 7.9, found 8"},
        {"/lattice/frame", 0, -1.1, "/lattice/vertex_offset: element 0: expected a vertex at 1, found 0.9"},
        {"/lattice/vertex_cell", 0, 0, "/lattice/vertex_offset: element 0: expected a vertex at 1, found 0"},
        {"/lattice/region_size", 7, 26, "/lattice/region_size: element 7: expected "},
        {"/lattice/region_nodes", 2, -2, "/lattice/region_nodes: row 0: expected what particle 2 reaches"},
        {"/lattice/plate_nodes", 4, 1, "/lattice/region_nodes: row "},
        {"/lattice/batch_points", 29, 3, "/lattice/batch_points: batch 1: expected particle "},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        pliant_error err;
        tiny_file file;
        const char *path = scratch("wrong.h5");
        tiny_model_make(3, TINY_LATTICE | TINY_NO_GREENS, &file);
        tiny_section *s = tiny_find(&file, cases[i].path);
        if (s->def.type == PLIANT_F8) ((double *)s->data)[cases[i].element] = cases[i].value;
        else ((int32_t *)s->data)[cases[i].element] = (int32_t)cases[i].value;
        check_ok(tiny_write(&file, path, &err), &err);
        tiny_free(&file);
        check_answer(ask_about("", path), 0, "Pliant model");
        if (ask_about("--verify", path)->status != 1) fail_msg("%s: passed", cases[i].path);
        check_answer(ask_about("--verify", path), 1, cases[i].reason);
    }
}

static void exports_that_cannot_be_written_leave_nothing(void **state)
{
    (void)state;
    const char *path = write_model("model.h5", 2, 0);
    char arguments[1500];
    snprintf(arguments, sizeof arguments, "--export '%s' '%s'", scratch("no/out.obj"), path);
    check_answer(ask(arguments), 1, strerror(ENOENT));
    snprintf(arguments, sizeof arguments, "--export '%s' --level 2 '%s'", scratch("out2.obj"), path);
    check_answer(ask(arguments), 2, "--level: expected 0 to 1, found 2");
    assert_false(exists(scratch("out2.obj")));
    mkdir(scratch("folder.ply"), 0777);
    snprintf(arguments, sizeof arguments, "--export '%s' '%s'", scratch("folder.ply"), path);
    check_answer(ask(arguments), 1, "folder.ply: expected a file to replace");
    // A limit of one block of 512 bytes on files: the mesh does not fit.
    snprintf(arguments, sizeof arguments, "--version; ulimit -f 1; trap '' XFSZ; '%s/pliant-info' --export '%s' '%s'",
             getenv("PLIANT_BUILD") ? getenv("PLIANT_BUILD") : "build", scratch("big.obj"), path);
    const answer *a = ask(arguments);
    assert_int_equal(a->status, 1);
    check_contains(a->text, strerror(EFBIG));
    assert_false(exists(scratch("big.obj")));
    assert_false(exists(scratch("big.obj.tmp")));
}

static void misuse_exits_with_2_and_failure_with_1(void **state)
{
    (void)state;
    check_answer(ask("--help"), 0, "usage: pliant-info [options] FILE.h5\n");
    check_answer(ask("-h"), 0, "--verify");
    check_answer(ask("--version"), 0, "pliant-info " PLIANT_VERSION_TEXT "\n");
    check_answer(ask(""), 2, "pliant-info: expected one file, found 0");
    check_answer(ask("a b"), 2, "pliant-info: expected one file, found 2");
    check_answer(ask("-x a"), 2, "pliant-info: -x: unknown option");
    check_answer(ask("--nonsense a"), 2, "pliant-info: --nonsense: unknown");
    check_answer(ask("a --export"), 2, "pliant-info: --export: expected a value, found nothing");
    check_answer(ask("--export out.stl a"), 2, "pliant-info: --export: expected a name that ends in .obj or .ply, found \"out.stl\"");
    check_answer(ask("--export dir.obj/out a"), 2, "expected a name that ends in .obj or .ply");
    check_answer(ask("--level 1 a"), 2, "pliant-info: --level: expected --export with it, found none");
    check_answer(ask("--export a.obj --level x a"), 2, "pliant-info: --level: expected a whole number from 0 to 15, found 'x'");
    check_answer(ask("--export a.obj --level -1 a"), 2, "pliant-info: --level: expected a whole number from 0 to 15, found '-1'");
    check_answer(ask("--detail a"), 2, "pliant-info: --detail: expected --export with it, found none");
    check_answer(ask("--detail --export a.obj --level 1 a"), 2, "pliant-info: --detail and --level name two meshes: expected one");
    check_answer(ask("--json=3 a"), 2, "pliant-info: --json: expected no value, found --json=3");
    check_answer(ask("-- --json"), 1, "pliant-info: --json: No such file or directory");
    check_answer(ask("/tmp"), 1, "pliant-info: /tmp: expected a file, found a directory");
    check_answer(ask("Makefile"), 1, "pliant-info: Makefile: not a Pliant model");
}

static void lost_output_is_noticed(void **state)
{
    (void)state;
    char arguments[1000];
    const char *path = write_model("model.h5", 2, 0);
    snprintf(arguments, sizeof arguments, "'%s' >/dev/full", path);
    check_answer(ask(arguments), 1, "pliant-info: standard output: No space left on device");
    check_answer(ask("--help >/dev/full"), 1, "pliant-info: standard output: No space left on device");
    snprintf(arguments, sizeof arguments, "'%s' >&-", path);
    check_answer(ask(arguments), 1, "pliant-info: standard output: Bad file descriptor");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(model_is_described),
        cmocka_unit_test(dense_and_other_files_are_described),
        cmocka_unit_test(json_is_json_and_keeps_quotes_and_names),
        cmocka_unit_test(verify_finds_the_smallest_eigenvalue_and_compares_it),
        cmocka_unit_test(a_mesh_without_area_is_found_by_verify),
        cmocka_unit_test(damage_is_found_by_verify_alone),
        cmocka_unit_test(wrong_topology_is_found_by_verify),
        cmocka_unit_test(levels_are_exported_as_obj_and_ply),
        cmocka_unit_test(detail_is_described_and_exported),
        cmocka_unit_test(lattice_is_described_and_exported),
        cmocka_unit_test(wrong_lattices_are_found_by_verify),
        cmocka_unit_test(exports_that_cannot_be_written_leave_nothing),
        cmocka_unit_test(misuse_exits_with_2_and_failure_with_1),
        cmocka_unit_test(lost_output_is_noticed),
    };
    return cmocka_run_group_tests(tests, NULL, scratch_clean);
}
