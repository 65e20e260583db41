// test_statement.c: every statement of the contact script language, and every kind of mistake.
#include "check.h"

#include "pliant/script.h"
#include "pliant/utf8.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static pliant_statement parse_at(const char *text, size_t length, int first, pliant_status expected,
                                 pliant_error *err)
{
    pliant_statement s = {.kind = PLIANT_STATEMENT_NONE};
    // An exact copy: the line has no NUL at its end.
    char *copy = malloc(length > 0 ? length : 1);
    assert_non_null(copy);
    memcpy(copy, text, length);
    strcpy(err->text, "");
    const pliant_status status = pliant_statement_parse(copy, length, "s", 7, first, &s, err);
    free(copy);
    if (status != expected) fail_msg("\"%.200s\": status %d, %s", text, status, err->text);
    return s;
}

static pliant_statement parse(const char *text)
{
    pliant_error err;
    return parse_at(text, strlen(text), 0, PLIANT_OK, &err);
}

static void check_refused(const char *text, const char *message)
{
    pliant_error err;
    parse_at(text, strlen(text), 0, PLIANT_ERR_FORMAT, &err);
    assert_string_equal(err.text, message);
}

static void every_statement_is_understood(void **state)
{
    (void)state;
    pliant_error err;
    pliant_statement s = parse_at("pliant-script 1", 15, 1, PLIANT_OK, &err);
    assert_int_equal(s.kind, PLIANT_STATEMENT_VERSION);
    assert_int_equal(s.count, 1);
    assert_int_equal(s.line, 7);
    assert_int_equal(parse("").kind, PLIANT_STATEMENT_NONE);
    assert_int_equal(parse(" \t ").kind, PLIANT_STATEMENT_NONE);
    assert_int_equal(parse("# displace").kind, PLIANT_STATEMENT_NONE);
    assert_int_equal(parse_at("  # before the version", 22, 1, PLIANT_OK, &err).kind, PLIANT_STATEMENT_NONE);

    s = parse("probe nose vertex 812");
    assert_int_equal(s.kind, PLIANT_STATEMENT_PROBE);
    assert_string_equal(s.name, "nose");
    assert_int_equal(s.vertex.kind, PLIANT_VERTEX_MODEL);
    assert_int_equal(s.vertex.number, 812);
    assert_int_equal(s.column, 7);
    s = parse("probe Nasenspitze-\xc3\xa4.1 vertex source 3");
    assert_string_equal(s.name, "Nasenspitze-\xc3\xa4.1");
    assert_int_equal(s.vertex.kind, PLIANT_VERTEX_SOURCE);
    assert_int_equal(s.vertex.number, 3);
    s = parse("\tprobe tip near 0.1 -2e-1 +1.3");
    assert_int_equal(s.vertex.kind, PLIANT_VERTEX_NEAR);
    check_near(s.vertex.position[1], -0.2, 0);
    check_near(s.vertex.position[2], 1.3, 0);

    s = parse("displace 812 0 0 -0.02   # push");
    assert_int_equal(s.kind, PLIANT_STATEMENT_DISPLACE);
    assert_int_equal(s.vertex.number, 812);
    check_near(s.value[2], -0.02, 0);
    assert_int_equal(s.column, 10);
    s = parse("displace 1:17 0 0 .5#glued");
    assert_int_equal(s.vertex.kind, PLIANT_VERTEX_MODEL);
    assert_int_equal(s.vertex.has_level, 1);
    assert_int_equal(s.vertex.level, 1);
    assert_int_equal(s.vertex.number, 17);
    check_near(s.value[2], 0.5, 0);
    s = parse("traction near 1 2 3 4 5 6");
    assert_int_equal(s.kind, PLIANT_STATEMENT_TRACTION);
    check_near(s.vertex.position[2], 3, 0);
    check_near(s.value[0], 4, 0);
    s = parse("force source 2147483647 1 1. 1E0");
    assert_int_equal(s.kind, PLIANT_STATEMENT_FORCE);
    assert_int_equal(s.vertex.number, INT32_MAX);
    assert_int_equal(s.vertex.has_level, 0);
    s = parse("support 0:source 30 0 0 0.01");
    assert_int_equal(s.vertex.kind, PLIANT_VERTEX_SOURCE);
    assert_int_equal(s.vertex.has_level, 1);
    assert_int_equal(s.vertex.level, 0);
    assert_int_equal(s.vertex.number, 30);
    s = parse("release 2147483647:near 0.1 0.2 0.3");
    assert_int_equal(s.vertex.kind, PLIANT_VERTEX_NEAR);
    assert_int_equal(s.vertex.has_level, 1);
    assert_int_equal(s.vertex.level, INT32_MAX);
    check_near(s.vertex.position[0], 0.1, 0);
    assert_int_equal(parse("support 30 0 0 0.01").kind, PLIANT_STATEMENT_SUPPORT);
    s = parse("gravity 0 0 -9.81");
    assert_int_equal(s.kind, PLIANT_STATEMENT_GRAVITY);
    check_near(s.value[2], -9.81, 0);
    assert_int_equal(parse("release 812").vertex.kind, PLIANT_VERTEX_MODEL);
    assert_int_equal(parse("release all").vertex.kind, PLIANT_VERTEX_ALL);
    assert_int_equal(parse("deadline 200").count, 200);
    assert_int_equal(parse("deadline 0").count, 0);
    assert_int_equal(parse("deadline none").count, -1);
    assert_int_equal(parse("deadline 1000000000").kind, PLIANT_STATEMENT_DEADLINE);
    check_near(parse("dt 1e-3").scalar, 0.001, 0);
    assert_int_equal(parse("step").count, 1);
    assert_int_equal(parse("step 100").count, 100);
    assert_true(parse("step 9223372036854775807").count == INT64_MAX);
    s = parse("expect nose 0 0 -0.02 1e-3");
    assert_int_equal(s.kind, PLIANT_STATEMENT_EXPECT);
    check_near(s.scalar, 1e-3, 0);
    check_near(parse("gravity 0 0 1e-400").value[2], 0, 0);
}

static void patches_tools_and_proxies_are_understood(void **state)
{
    (void)state;
    pliant_statement s = parse("patch thumb tolerance 1e-4");
    assert_int_equal(s.kind, PLIANT_STATEMENT_PATCH);
    assert_string_equal(s.name, "thumb");
    check_near(s.scalar, 1e-4, 0);
    check_near(parse("patch thumb tolerance 0").scalar, 0, 0);
    s = parse("patch thumb 812 1 2 3");
    assert_int_equal(s.kind, PLIANT_STATEMENT_PATCH_DISPLACE);
    assert_int_equal(s.vertex.number, 812);
    check_near(s.value[2], 3, 0);
    s = parse("patch near near 1 2 3 4 5 6");  // a name may be any word
    assert_string_equal(s.name, "near");
    assert_int_equal(s.vertex.kind, PLIANT_VERTEX_NEAR);
    check_near(s.vertex.position[0], 1, 0);
    check_near(s.value[0], 4, 0);
    s = parse("patch thumb release source 5");
    assert_int_equal(s.kind, PLIANT_STATEMENT_PATCH_RELEASE);
    assert_int_equal(s.vertex.kind, PLIANT_VERTEX_SOURCE);
    assert_int_equal(parse("patch thumb release all").vertex.kind, PLIANT_VERTEX_ALL);

    s = parse("tool ball sphere 1 2 3 0.5");
    assert_int_equal(s.kind, PLIANT_STATEMENT_TOOL);
    assert_int_equal(s.shape, PLIANT_SHAPE_SPHERE);
    assert_string_equal(s.name, "ball");
    check_near(s.value[1], 2, 0);
    check_near(s.scalar, 0.5, 0);
    check_near(s.friction, 0, 0);
    s = parse("tool floor plane 0 0 -2 -0.1 friction 0.25");
    assert_int_equal(s.shape, PLIANT_SHAPE_PLANE);
    check_near(s.value[2], -2, 0);
    check_near(s.scalar, -0.1, 0);
    check_near(s.friction, 0.25, 0);
    s = parse("tool rod capsule 1 2 3 4 5 6 7 friction 0");
    assert_int_equal(s.shape, PLIANT_SHAPE_CAPSULE);
    check_near(s.value[2], 3, 0);
    check_near(s.end[0], 4, 0);
    check_near(s.end[2], 6, 0);
    check_near(s.scalar, 7, 0);
    check_near(parse("contact tolerance 2e-4").scalar, 2e-4, 0);
    assert_int_equal(parse("contact tolerance 2e-4").kind, PLIANT_STATEMENT_CONTACT);

    s = parse("proxy pen 1 2 3");
    assert_int_equal(s.kind, PLIANT_STATEMENT_PROXY);
    check_near(s.value[0], 1, 0);
    check_near(s.stiffness, 0, 0);
    s = parse("proxy pen 1 2 3 stiffness 800 friction 3.5");
    check_near(s.stiffness, 800, 0);
    check_near(s.friction, 3.5, 0);
    check_near(parse("proxy pen 1 2 3 friction 1").friction, 1, 0);
    s = parse("move pen -1 -2 -3");
    assert_int_equal(s.kind, PLIANT_STATEMENT_MOVE);
    assert_string_equal(s.name, "pen");
    check_near(s.value[2], -3, 0);
    s = parse("drop pen");
    assert_int_equal(s.kind, PLIANT_STATEMENT_DROP);
    assert_string_equal(s.name, "pen");
}

static void mistakes_in_patches_tools_and_proxies_are_placed_and_explained(void **state)
{
    (void)state;
    check_refused("patch", "s:7:6: expected a name of letters, digits, _ - ., found the end of the line");
    check_refused("patch a/b tolerance 1", "s:7:7: expected a name of letters, digits, _ - ., found \"a/b\"");
    check_refused("patch p", "s:7:8: expected a vertex: [L:]K, [L:]source K or [L:]near X Y Z, found the end of the line");
    check_refused("patch p tolerance", "s:7:18: expected a tolerance, a number >= 0, found the end of the line");
    check_refused("patch p tolerance -1", "s:7:19: expected a tolerance, a number >= 0, found \"-1\"");
    check_refused("patch p tolerance 1 2", "s:7:21: expected the end of the line, found \"2\"");
    check_refused("patch p 12 0 0", "s:7:15: expected z, a number, found the end of the line");
    check_refused("patch p release", "s:7:16: expected a vertex: [L:]K, [L:]source K or [L:]near X Y Z, found the end of the line");
    check_refused("patch p release all 1", "s:7:21: expected the end of the line, found \"1\"");
    check_refused("contact", "s:7:8: expected tolerance, found the end of the line");
    check_refused("contact friction 1", "s:7:9: expected tolerance, found \"friction\"");
    check_refused("contact tolerance 0", "s:7:19: expected a tolerance, a number > 0, found \"0\"");
    check_refused("tool", "s:7:5: expected a name of letters, digits, _ - ., found the end of the line");
    check_refused("tool t", "s:7:7: expected sphere, plane or capsule, found the end of the line");
    check_refused("tool t cube 1 2 3 4", "s:7:8: expected sphere, plane or capsule, found \"cube\"");
    check_refused("tool t sphere 1 2", "s:7:18: expected z, a number, found the end of the line");
    check_refused("tool t sphere 1 2 3", "s:7:20: expected a radius, a number > 0, found the end of the line");
    check_refused("tool t sphere 1 2 3 0", "s:7:21: expected a radius, a number > 0, found \"0\"");
    check_refused("tool t sphere 1 2 3 -1e-3", "s:7:21: expected a radius, a number > 0, found \"-1e-3\"");
    check_refused("tool t sphere 1 2 3 4 5", "s:7:23: expected the end of the line, found \"5\"");
    check_refused("tool t sphere 1 2 3 4 friction", "s:7:31: expected a friction coefficient, a number >= 0, found the end of the line");
    check_refused("tool t sphere 1 2 3 4 friction -1", "s:7:32: expected a friction coefficient, a number >= 0, found \"-1\"");
    check_refused("tool t sphere 1 2 3 4 friction 1 friction 1", "s:7:34: expected the end of the line, found \"friction\"");
    check_refused("tool t plane 0 0 0 1", "s:7:14: expected a normal that is not 0 0 0, found \"0\"");
    check_refused("tool t plane 0 0 1", "s:7:19: expected the plane's distance, a number, found the end of the line");
    check_refused("tool t capsule 1 2 3 4 5", "s:7:25: expected z, a number, found the end of the line");
    check_refused("tool t capsule 1 2 3 4 5 6 0", "s:7:28: expected a radius, a number > 0, found \"0\"");
    check_refused("proxy p 1 2", "s:7:12: expected z, a number, found the end of the line");
    check_refused("proxy p 1 2 3 stiffness 0", "s:7:25: expected a stiffness, a number > 0, found \"0\"");
    check_refused("proxy p 1 2 3 friction 1 stiffness 2", "s:7:26: expected the end of the line, found \"stiffness\"");
    check_refused("move", "s:7:5: expected a name of letters, digits, _ - ., found the end of the line");
    check_refused("move p 1 2", "s:7:11: expected z, a number, found the end of the line");
    check_refused("drop", "s:7:5: expected a name of letters, digits, _ - ., found the end of the line");
    check_refused("drop a b", "s:7:8: expected the end of the line, found \"b\"");
}

static void statements_on_lattices_are_understood(void **state)
{
    (void)state;
    pliant_statement s = parse("instances 150");
    assert_int_equal(s.kind, PLIANT_STATEMENT_INSTANCES);
    assert_int_equal(s.count, 150);
    assert_true(s.copies.seed == -1);
    assert_int_equal(s.copies.has_step, 0);
    assert_int_equal(s.copies.columns + s.copies.rows, 0);
    s = parse("instances 8 rows 3 at 1 2 3 columns 2 step 4 5 6 random 7 velocity 0 0 -1");
    check_near(s.value[1], 2, 0);
    check_near(s.end[2], 6, 0);
    assert_int_equal(s.copies.has_step, 1);
    assert_int_equal(s.copies.columns, 2);
    assert_int_equal(s.copies.rows, 3);
    assert_true(s.copies.seed == 7);
    check_near(s.copies.velocity[2], -1, 0);
    s = parse("damping 0.25");
    assert_int_equal(s.kind, PLIANT_STATEMENT_DAMPING);
    check_near(s.scalar, 0.25, 0);
    assert_int_equal(s.count, 1);
    assert_int_equal(parse("damping 1 every 4").count, 4);
    assert_int_equal(parse("rigid-damping 0").kind, PLIANT_STATEMENT_RIGID_DAMPING);
    check_near(parse("strain-limit 1.5").scalar, 1.5, 0);
    s = parse("grab 12 hand");
    assert_int_equal(s.kind, PLIANT_STATEMENT_GRAB);
    assert_int_equal(s.vertex.kind, PLIANT_VERTEX_MODEL);
    assert_int_equal(s.vertex.number, 12);
    assert_string_equal(s.name, "hand");
    assert_string_equal(parse("grab 12").name, "");
    s = parse("grab instance 3 near 1 2 3 radius 0.5 hand");
    assert_int_equal(s.has_instance, 1);
    assert_int_equal(s.instance, 3);
    assert_int_equal(s.vertex.kind, PLIANT_VERTEX_NEAR);
    check_near(s.vertex.position[2], 3, 0);
    check_near(s.scalar, 0.5, 0);
    assert_string_equal(s.name, "hand");
    assert_string_equal(parse("grab near 1 2 3 radiant").name, "radiant");
    assert_int_equal(parse("let hand").kind, PLIANT_STATEMENT_LET);
    s = parse("impulse near 1 2 3 4 5 6");
    assert_int_equal(s.kind, PLIANT_STATEMENT_IMPULSE);
    check_near(s.value[2], 6, 0);
    s = parse("plane 0 0 1 -0.5");
    assert_int_equal(s.kind, PLIANT_STATEMENT_OBSTACLE);
    assert_int_equal(s.shape, PLIANT_SHAPE_PLANE);
    check_near(s.scalar, -0.5, 0);
    assert_string_equal(s.name, "");
    s = parse("sphere 1 2 3 4 friction 0.5 as ball");
    assert_int_equal(s.shape, PLIANT_SHAPE_SPHERE);
    check_near(s.friction, 0.5, 0);
    assert_string_equal(s.name, "ball");
    s = parse("box 0 0 0 1 2 3 as crate");
    assert_int_equal(s.shape, PLIANT_SHAPE_BOX);
    check_near(s.end[1], 2, 0);
    assert_int_equal(parse("capsule 1 2 3 4 5 6 7").shape, PLIANT_SHAPE_CAPSULE);
    assert_int_equal(parse("collide none").count, PLIANT_COLLIDE_NONE);
    assert_int_equal(parse("collide self").count, PLIANT_COLLIDE_SELF);
    assert_int_equal(parse("collide bodies").count, PLIANT_COLLIDE_BODIES);
    assert_int_equal(parse("collide all").count, 7);
    s = parse("collide self surfaces friction 0.5");
    assert_int_equal(s.count, PLIANT_COLLIDE_SELF | PLIANT_COLLIDE_SURFACES);
    check_near(s.friction, 0.5, 0);
    s = parse("capsule 1 2 3 4 5 6 7 taper 0 friction 1 as icicle");
    assert_int_equal(s.has_taper, 1);
    check_near(s.taper, 0, 0);
    check_near(s.friction, 1, 0);
    assert_string_equal(s.name, "icicle");
    s = parse("bone arm 1 2 3");
    assert_int_equal(s.kind, PLIANT_STATEMENT_BONE);
    check_near(s.value[0], 1, 0);
    s = parse("bind arm near 1 2 3 radius 2");
    assert_int_equal(s.kind, PLIANT_STATEMENT_BIND);
    assert_string_equal(s.name, "arm");
    check_near(s.scalar, 2, 0);
    s = parse("turn arm 0 0 2 -90 over 30");
    assert_int_equal(s.kind, PLIANT_STATEMENT_TURN);
    check_near(s.scalar, -90, 0);
    assert_int_equal(s.count, 30);
    assert_int_equal(parse("move hand 1 2 3").count, 0);
    assert_int_equal(parse("move hand 1 2 3 over 20").count, 20);
    s = parse("probe p instance 4 vertex 5");
    assert_int_equal(s.instance, 4);
    assert_int_equal(s.vertex.number, 5);
    assert_int_equal(parse("probe p near 1 2 3").has_instance, 0);
}

static void mistakes_on_lattices_are_placed_and_explained(void **state)
{
    (void)state;
    check_refused("instances 0", "s:7:11: expected a number of instances, 1 to 1000000, found \"0\"");
    check_refused("instances 2 on 1 2 3", "s:7:13: expected at, step, columns, rows, random or velocity, found \"on\"");
    check_refused("instances 2 at 1 2", "s:7:19: expected z, a number, found the end of the line");
    check_refused("instances 2 columns 0", "s:7:21: expected a number of columns, 1 or more, found \"0\"");
    check_refused("instances 2 random -1", "s:7:20: expected a seed, a whole number from 0, found \"-1\"");
    check_refused("damping 1.5", "s:7:9: expected a damping, a number from 0 to 1, found \"1.5\"");
    check_refused("damping 1 every 0", "s:7:17: expected a number of steps, 1 or more, found \"0\"");
    check_refused("damping 1 4", "s:7:11: expected the end of the line, found \"4\"");
    check_refused("rigid-damping -1", "s:7:15: expected a damping, a number from 0 to 1, found \"-1\"");
    check_refused("strain-limit -1", "s:7:14: expected a strain limit, a number >= 0, found \"-1\"");
    check_refused("grab hand", "s:7:6: expected a particle: K or near X Y Z, found \"hand\"");
    check_refused("grab instance x 1 h", "s:7:15: expected the number of an instance, from 0, found \"x\"");
    check_refused("grab near 1 2 3 radius 0 h", "s:7:24: expected a radius, a number > 0, found \"0\"");
    check_refused("grab 1 a/b", "s:7:8: expected a name of letters, digits, _ - ., found \"a/b\"");
    check_refused("grab 1 a b", "s:7:10: expected the end of the line, found \"b\"");
    check_refused("let", "s:7:4: expected a name of letters, digits, _ - ., found the end of the line");
    check_refused("impulse 3 1 2", "s:7:14: expected z, a number, found the end of the line");
    check_refused("plane 0 0 0 1", "s:7:7: expected a normal that is not 0 0 0, found \"0\"");
    check_refused("sphere 0 0 0 -1", "s:7:14: expected a radius, a number > 0, found \"-1\"");
    check_refused("sphere 0 0 0 1 as", "s:7:18: expected a name of letters, digits, _ - ., found the end of the line");
    check_refused("sphere 0 0 0 1 ball", "s:7:16: expected the end of the line, found \"ball\"");
    check_refused("box 0 0 0 1 0 1", "s:7:11: expected a corner that is greater than the first in x, y and z, found \"1\"");
    check_refused("tool t box 0 0 0 1 1 1", "s:7:8: expected sphere, plane or capsule, found \"box\"");
    check_refused("collide everything", "s:7:9: expected none, all, or some of self, bodies and surfaces, found \"everything\"");
    check_refused("collide", "s:7:8: expected none, all, or some of self, bodies and surfaces, found the end of the line");
    check_refused("collide self none", "s:7:14: expected none, all, or some of self, bodies and surfaces, found \"none\"");
    check_refused("sphere 1 2 3 4 taper 1", "s:7:16: expected the end of the line, found \"taper\"");
    check_refused("capsule 1 2 3 4 5 6 7 taper -1", "s:7:29: expected a radius, a number >= 0, found \"-1\"");
    check_refused("turn a 0 0 0 9", "s:7:8: expected an axis that is not 0 0 0, found \"0\"");
    check_refused("turn a 0 0 1", "s:7:13: expected an angle in degrees, a number, found the end of the line");
    check_refused("move a 0 0 1 over 0", "s:7:19: expected a number of steps, 1 or more, found \"0\"");
    check_refused("bind arm", "s:7:9: expected a particle: K or near X Y Z, found the end of the line");
}

static void every_statement_has_a_family_and_its_keyword(void **state)
{
    (void)state;
    const struct {
        const char *line, *keyword;
        pliant_statement_family family;
    } cases[] = {
        {"probe p vertex 1", "probe", PLIANT_FAMILY_COMMON},
        {"gravity 0 0 1", "gravity", PLIANT_FAMILY_COMMON},
        {"move a 1 2 3", "move", PLIANT_FAMILY_COMMON},
        {"step", "step", PLIANT_FAMILY_COMMON},
        {"displace 1 0 0 0", "displace", PLIANT_FAMILY_GREENS},
        {"patch p 1 0 0 0", "patch", PLIANT_FAMILY_GREENS},
        {"deadline none", "deadline", PLIANT_FAMILY_GREENS},
        {"tool t sphere 0 0 0 1", "tool", PLIANT_FAMILY_GREENS},
        {"sphere 0 0 0 1", "sphere", PLIANT_FAMILY_LATTICE},
        {"grab 1", "grab", PLIANT_FAMILY_LATTICE},
        {"instances 2", "instances", PLIANT_FAMILY_LATTICE},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        const pliant_statement s = parse(cases[i].line);
        assert_int_equal(pliant_statement_family_of(s.kind), cases[i].family);
        assert_string_equal(pliant_statement_keyword(s.kind, s.shape), cases[i].keyword);
    }
}

static void mistakes_are_placed_and_explained(void **state)
{
    (void)state;
    check_refused("shove 1 2 3", "s:7:1: expected a statement such as probe, displace, grab, step or "
                                 "expect (--help lists all), found \"shove\"");
    check_refused("pliant-script 1", "s:7:1: expected pliant-script as first statement only, found \"pliant-script\"");
    check_refused("displace", "s:7:9: expected a vertex: [L:]K, [L:]source K or [L:]near X Y Z, found the end of the line");
    check_refused("displace -1 0 0 0", "s:7:10: expected a vertex: [L:]K, [L:]source K or [L:]near X Y Z, found \"-1\"");
    check_refused("displace 2147483648 0 0 0", "s:7:10: expected a vertex: [L:]K, [L:]source K or [L:]near X Y Z, found \"2147483648\"");
    check_refused("displace 1: 0 0 0", "s:7:10: expected a vertex: [L:]K, [L:]source K or [L:]near X Y Z, found \"1:\"");
    check_refused("displace 1:2:3 0 0 0", "s:7:10: expected a vertex: [L:]K, [L:]source K or [L:]near X Y Z, found \"1:2:3\"");
    check_refused("displace :2 0 0 0", "s:7:10: expected a vertex: [L:]K, [L:]source K or [L:]near X Y Z, found \":2\"");
    check_refused("displace 12a 0 0 0", "s:7:10: expected a vertex: [L:]K, [L:]source K or [L:]near X Y Z, found \"12a\"");
    check_refused("displace 1:source:3 0 0 0", "s:7:10: expected a vertex: [L:]K, [L:]source K or [L:]near X Y Z, found \"1:source:3\"");
    check_refused("displace 1:2:near 0 0 0 0 0 0", "s:7:10: expected a vertex: [L:]K, [L:]source K or [L:]near X Y Z, found \"1:2:near\"");
    check_refused("displace 2147483648:near 0 0 0 0 0 0", "s:7:10: expected a vertex: [L:]K, [L:]source K or [L:]near X Y Z, found \"2147483648:near\"");
    check_refused("displace -1:near 0 0 0 0 0 0", "s:7:10: expected a vertex: [L:]K, [L:]source K or [L:]near X Y Z, found \"-1:near\"");
    check_refused("displace 1: near 0 0 0", "s:7:10: expected a vertex: [L:]K, [L:]source K or [L:]near X Y Z, found \"1:\"");
    check_refused("displace 1:near 0 0", "s:7:20: expected z, a number, found the end of the line");
    check_refused("displace 1:source x 0 0 0", "s:7:19: expected the number of a vertex of the input mesh, found \"x\"");
    check_refused("release 1:all", "s:7:9: expected a vertex: [L:]K, [L:]source K or [L:]near X Y Z, found \"1:all\"");
    check_refused("displace source 0 0", "s:7:20: expected y, a number, found the end of the line");
    check_refused("displace source x 0 0", "s:7:17: expected the number of a vertex of the input mesh, found \"x\"");
    check_refused("displace 8 0 nan 0", "s:7:14: expected y, a number, found \"nan\"");
    check_refused("displace 8 inf 0 0", "s:7:12: expected x, a number, found \"inf\"");
    check_refused("displace 8 0 0 -INFINITY", "s:7:16: expected z, a number, found \"-INFINITY\"");
    check_refused("displace 8 0x10 0 0", "s:7:12: expected x, a number, found \"0x10\"");
    check_refused("displace 8 1e 0 0", "s:7:12: expected x, a number, found \"1e\"");
    check_refused("displace 8 . 0 0", "s:7:12: expected x, a number, found \".\"");
    check_refused("displace 8 1,5 0 0", "s:7:12: expected x, a number, found \"1,5\"");
    check_refused("displace 8 1e400 0 0", "s:7:12: expected a number within +-3.4e38, found \"1e400\"");
    check_refused("displace 8 0 -3.5e38 0", "s:7:14: expected a number within +-3.4e38, found \"-3.5e38\"");
    check_refused("displace 8 0 0 0 0", "s:7:18: expected the end of the line, found \"0\"");
    check_refused("gravity 0 0 1 please", "s:7:15: expected the end of the line, found \"please\"");
    check_refused("release", "s:7:8: expected a vertex: [L:]K, [L:]source K or [L:]near X Y Z, found the end of the line");
    check_refused("release all 3", "s:7:13: expected the end of the line, found \"3\"");
    check_refused("step 0", "s:7:6: expected a number of steps, 1 or more, found \"0\"");
    check_refused("step -3", "s:7:6: expected a number of steps, 1 or more, found \"-3\"");
    check_refused("step 9223372036854775808", "s:7:6: expected a number of steps, 1 or more, found \"9223372036854775808\"");
    check_refused("step 2 3", "s:7:8: expected the end of the line, found \"3\"");
    check_refused("deadline", "s:7:9: expected microseconds, a whole number from 0 to 1000000000, or none, found the end of the line");
    check_refused("deadline 1.5", "s:7:10: expected microseconds, a whole number from 0 to 1000000000, or none, found \"1.5\"");
    check_refused("deadline 1000000001", "s:7:10: expected microseconds, a whole number from 0 to 1000000000, or none, found \"1000000001\"");
    check_refused("deadline none 1", "s:7:15: expected the end of the line, found \"1\"");
    check_refused("dt 0", "s:7:4: expected seconds, a number > 0, found \"0\"");
    check_refused("dt", "s:7:3: expected seconds, a number > 0, found the end of the line");
    check_refused("expect nose 0 0 0", "s:7:18: expected a tolerance, a number >= 0, found the end of the line");
    check_refused("expect nose 0 0 0 -1", "s:7:19: expected a tolerance, a number >= 0, found \"-1\"");
    check_refused("probe", "s:7:6: expected a name of letters, digits, _ - ., found the end of the line");
    check_refused("probe a,b vertex 1", "s:7:7: expected a name of letters, digits, _ - ., found \"a,b\"");
    check_refused("probe nose 1:near 0 0 0", "s:7:12: expected vertex or near, found \"1:near\"");
    check_refused("probe nose 812", "s:7:12: expected vertex or near, found \"812\"");
    check_refused("probe nose vertex", "s:7:18: expected a vertex: [L:]K, [L:]source K or [L:]near X Y Z, found the end of the line");
}

static void columns_count_characters_not_bytes(void **state)
{
    (void)state;
    check_refused("expect \xc3\xa4\xe2\x82\xac\xf0\x9f\x98\x80 0 0 0 x", "s:7:18: expected a tolerance, a number >= 0, found \"x\"");
}

static void first_statement_must_be_the_version(void **state)
{
    (void)state;
    pliant_error err;
    parse_at("step", 4, 1, PLIANT_ERR_FORMAT, &err);
    assert_string_equal(err.text, "s:7:1: expected \"pliant-script 1\" as first statement, found \"step\"");
    parse_at("pliant-script 2", 15, 1, PLIANT_ERR_VERSION, &err);
    assert_string_equal(err.text, "s:7:15: expected version 1 of the language, the newest known here, found \"2\"");
    parse_at("pliant-script 0", 15, 1, PLIANT_ERR_FORMAT, &err);
    parse_at("pliant-script", 13, 1, PLIANT_ERR_FORMAT, &err);
    parse_at("pliant-script 1 1", 17, 1, PLIANT_ERR_FORMAT, &err);
}

static void bytes_that_are_no_text_are_refused(void **state)
{
    (void)state;
    pliant_error err;
    parse_at("step 1\0 2", 9, 0, PLIANT_ERR_FORMAT, &err);
    assert_string_equal(err.text, "s:7:7: expected UTF-8 text, found byte 0x00");
    check_refused("step # \xff", "s:7:8: expected UTF-8 text, found byte 0xff");
    check_refused("step\r", "s:7:5: expected UTF-8 text, found byte 0x0d");
    check_refused("step \x1b[2J", "s:7:6: expected UTF-8 text, found byte 0x1b");
    check_refused("# \xc0\x80", "s:7:3: expected UTF-8 text, found byte 0xc0");
}

static void long_words_and_lines_are_refused_in_one_short_line(void **state)
{
    (void)state;
    static char line[PLIANT_SCRIPT_LINE_LIMIT + 2];
    pliant_error err;
    char name[80];
    memset(name, 'n', 79);
    name[79] = 0;
    snprintf(line, sizeof line, "probe %.63s vertex 1", name);
    assert_int_equal(strlen(parse(line).name), 63);
    snprintf(line, sizeof line, "probe %.64s vertex 1", name);
    check_refused(line, "s:7:7: expected a name of at most 63 bytes, found \"nnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnn...\"");
    memset(line, '0', sizeof line);
    memcpy(line, "dt 1", 4);
    line[3] = '.';
    line[4] = '1';
    check_near(parse_at(line, PLIANT_SCRIPT_LINE_LIMIT, 0, PLIANT_OK, &err).scalar, 0.1, 0);
    parse_at(line, PLIANT_SCRIPT_LINE_LIMIT + 1, 0, PLIANT_ERR_FORMAT, &err);
    assert_string_equal(err.text, "s:7:4097: expected a line of at most 4096 bytes, found more");
    memset(line, 'x', sizeof line);
    parse_at(line, PLIANT_SCRIPT_LINE_LIMIT, 0, PLIANT_ERR_FORMAT, &err);
    assert_true(strlen(err.text) < 200);
}

static void refused_line_leaves_the_statement_as_it_was(void **state)
{
    (void)state;
    pliant_statement s, before;
    memset(&s, 0x5a, sizeof s);
    before = s;
    assert_int_equal(pliant_statement_parse("step x", 6, "s", 1, 0, &s, NULL), PLIANT_ERR_FORMAT);
    assert_memory_equal(&s, &before, sizeof s);
}

// The table of RFC 3629, section 4: first and last of every row, and their neighbours outside.
static void utf8_is_what_rfc_3629_says(void **state)
{
    (void)state;
    static const struct {
        const char *text;
        int size;
    } cases[] = {
        {"\x01", 1}, {"\x7f", 1}, {"\x80", 0}, {"\xbf", 0}, {"\xc0\x80", 0}, {"\xc1\xbf", 0},
        {"\xc2\x80", 2}, {"\xdf\xbf", 2}, {"\xc2", 0}, {"\xc2\x7f", 0}, {"\xc2\xc0", 0},
        {"\xe0\x9f\xbf", 0}, {"\xe0\xa0\x80", 3}, {"\xed\x9f\xbf", 3}, {"\xed\xa0\x80", 0},
        {"\xee\x80\x80", 3}, {"\xef\xbf\xbf", 3}, {"\xe2\x82", 0}, {"\xe2\x82\x7f", 0},
        {"\xf0\x8f\xbf\xbf", 0}, {"\xf0\x90\x80\x80", 4}, {"\xf4\x8f\xbf\xbf", 4},
        {"\xf4\x90\x80\x80", 0}, {"\xf5\x80\x80\x80", 0}, {"\xf0\x9f\x98", 0}, {"\xff", 0},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
        assert_int_equal(pliant_utf8_character(cases[i].text, strlen(cases[i].text)), cases[i].size);
    assert_int_equal(pliant_utf8_check("ab\xc3\xa4", 4), 4);
    assert_int_equal(pliant_utf8_check("ab\xc3\xa4", 3), 2);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_statement_is_understood),
        cmocka_unit_test(patches_tools_and_proxies_are_understood),
        cmocka_unit_test(mistakes_in_patches_tools_and_proxies_are_placed_and_explained),
        cmocka_unit_test(statements_on_lattices_are_understood),
        cmocka_unit_test(mistakes_on_lattices_are_placed_and_explained),
        cmocka_unit_test(every_statement_has_a_family_and_its_keyword),
        cmocka_unit_test(mistakes_are_placed_and_explained),
        cmocka_unit_test(columns_count_characters_not_bytes),
        cmocka_unit_test(first_statement_must_be_the_version),
        cmocka_unit_test(bytes_that_are_no_text_are_refused),
        cmocka_unit_test(long_words_and_lines_are_refused_in_one_short_line),
        cmocka_unit_test(refused_line_leaves_the_statement_as_it_was),
        cmocka_unit_test(utf8_is_what_rfc_3629_says),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
