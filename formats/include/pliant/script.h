// script.h: the contact script language, one statement a line (see formats/README.md).
//
// The parser knows the language, not the model: vertex numbers are checked for form here and for
// meaning by whoever runs the statement. It holds one line at a time, whatever the file's length.
#pragma once

#include "pliant/base.h"

#include <stddef.h>

#define PLIANT_SCRIPT_VERSION        1
#define PLIANT_SCRIPT_NAME_LIMIT     64          // bytes of a name, with its end
#define PLIANT_SCRIPT_LINE_LIMIT     4096        // bytes of a line
#define PLIANT_SCRIPT_DEADLINE_LIMIT 1000000000  // microseconds

typedef enum pliant_statement_kind {
    PLIANT_STATEMENT_NONE,            // blank or comment
    PLIANT_STATEMENT_VERSION,         // pliant-script 1
    PLIANT_STATEMENT_PROBE,           // probe NAME vertex VERTEX | probe NAME near X Y Z
    PLIANT_STATEMENT_DISPLACE,        // displace VERTEX X Y Z
    PLIANT_STATEMENT_TRACTION,        // traction VERTEX X Y Z
    PLIANT_STATEMENT_FORCE,           // force VERTEX X Y Z
    PLIANT_STATEMENT_SUPPORT,         // support VERTEX X Y Z
    PLIANT_STATEMENT_GRAVITY,         // gravity X Y Z
    PLIANT_STATEMENT_RELEASE,         // release VERTEX | release all
    PLIANT_STATEMENT_PATCH,           // patch NAME tolerance T
    PLIANT_STATEMENT_PATCH_DISPLACE,  // patch NAME VERTEX X Y Z
    PLIANT_STATEMENT_PATCH_RELEASE,   // patch NAME release VERTEX | patch NAME release all
    PLIANT_STATEMENT_CONTACT,         // contact tolerance T
    PLIANT_STATEMENT_TOOL,            // tool NAME SHAPE [friction MU]
    PLIANT_STATEMENT_PROXY,           // proxy NAME X Y Z [stiffness K] [friction MU]
    PLIANT_STATEMENT_MOVE,            // move NAME X Y Z [over COUNT]
    PLIANT_STATEMENT_DROP,            // drop NAME
    PLIANT_STATEMENT_DEADLINE,        // deadline MICROSECONDS | deadline none
    PLIANT_STATEMENT_DT,              // dt SECONDS
    PLIANT_STATEMENT_STEP,            // step [COUNT]
    PLIANT_STATEMENT_EXPECT,          // expect NAME X Y Z TOLERANCE
    // On lattices; PARTICLES is [instance I] K or [instance I] near X Y Z [radius R].
    PLIANT_STATEMENT_INSTANCES,      // instances N CLAUSES
    PLIANT_STATEMENT_DAMPING,        // damping K [every N]
    PLIANT_STATEMENT_RIGID_DAMPING,  // rigid-damping K
    PLIANT_STATEMENT_STRAIN_LIMIT,   // strain-limit S
    PLIANT_STATEMENT_GRAB,           // grab PARTICLES [NAME]
    PLIANT_STATEMENT_LET,            // let NAME
    PLIANT_STATEMENT_IMPULSE,        // impulse PARTICLES X Y Z
    PLIANT_STATEMENT_OBSTACLE,       // SHAPE [taper R] [friction MU] [as NAME]
    PLIANT_STATEMENT_COLLIDE,       // collide none | all | self bodies surfaces [friction MU]
    PLIANT_STATEMENT_BONE,           // bone NAME X Y Z
    PLIANT_STATEMENT_BIND,           // bind NAME PARTICLES
    PLIANT_STATEMENT_TURN,           // turn NAME AX AY AZ DEGREES [over COUNT]
} pliant_statement_kind;

// What a statement is about.
typedef enum pliant_statement_family {
    PLIANT_FAMILY_COMMON,   // both
    PLIANT_FAMILY_GREENS,   // the statics of Green's functions
    PLIANT_FAMILY_LATTICE,  // the dynamics of lattices
} pliant_statement_family;

typedef enum pliant_vertex_kind {
    PLIANT_VERTEX_NONE,
    PLIANT_VERTEX_MODEL,   // K: number in the model
    PLIANT_VERTEX_SOURCE,  // source K: number in the input mesh
    PLIANT_VERTEX_NEAR,    // near X Y Z: the free vertex nearest to a rest position
    PLIANT_VERTEX_ALL,     // all (release only)
} pliant_vertex_kind;

// VERTEX may be any of K, source K, near X Y Z; with "L:" before it, the hierarchical basis
// function of that vertex on level L.
typedef struct pliant_vertex_name {
    pliant_vertex_kind kind;
    int32_t has_level, level;  // level is 0 unless has_level
    int32_t number;
    double position[3];
} pliant_vertex_name;

// SHAPE of a tool or an obstacle; what it fills of a statement: value, scalar, end.
typedef enum pliant_shape_kind {
    PLIANT_SHAPE_NONE,
    PLIANT_SHAPE_SPHERE,   // sphere X Y Z R: centre, radius
    PLIANT_SHAPE_PLANE,    // plane NX NY NZ D: normal, not 0; the body's side is n.x >= D
    PLIANT_SHAPE_CAPSULE,  // capsule X Y Z X Y Z R: one end, the other (in `end`), radius
    PLIANT_SHAPE_BOX,      // box X Y Z X Y Z: least corner, greatest (in `end`); obstacles only
} pliant_shape_kind;

// What collides with what, of lattices; numbers may be added.
typedef enum pliant_collide {
    PLIANT_COLLIDE_NONE = 0,
    PLIANT_COLLIDE_SELF = 1,      // a body with itself
    PLIANT_COLLIDE_BODIES = 2,    // bodies with each other
    PLIANT_COLLIDE_SURFACES = 4,  // particles with the surfaces of other bodies
} pliant_collide;

// How the copies of `instances` are laid out: copy k stands at value + (k % columns, k / columns %
// rows, k / (columns rows)) times `end`, component by component.
typedef struct pliant_copies {
    int64_t columns, rows;  // 0: not stated
    int64_t seed;           // of a random turn of each; -1: not stated
    double velocity[3];     // of each at the start
    int32_t has_step;       // 1: `end` was stated
} pliant_copies;

typedef struct pliant_statement {
    pliant_statement_kind kind;
    int64_t line;    // 1-based
    int32_t column;  // 1-based, of the statement's first argument (for later messages)
    char name[PLIANT_SCRIPT_NAME_LIMIT];
    pliant_vertex_name vertex;
    double value[3];  // finite
    // Tolerance, seconds of dt, R or D of a shape, radius of PARTICLES (0: not stated), K of
    // damping, S of strain-limit, degrees of turn; finite.
    double scalar;
    // Of step and instances; version of pliant-script; microseconds, -1: none; every N steps of
    // damping; steps of a move or turn, 0: at once; pliant_collide.
    int64_t count;
    pliant_shape_kind shape;
    double end[3];
    double friction, stiffness;  // 0: not stated
    int32_t has_taper;           // 1: of an obstacle that is a capsule,
    double taper;                // the radius at its other end; 0 unless has_taper
    int32_t has_instance;        // of probe and PARTICLES
    int64_t instance;            // from 0; 0 unless has_instance
    pliant_copies copies;        // of instances
} pliant_statement;

pliant_statement_family pliant_statement_family_of(pliant_statement_kind kind);
// The keyword that begins such a statement; that of an obstacle is its shape's. Static.
const char *pliant_statement_keyword(pliant_statement_kind kind, pliant_shape_kind shape);

typedef struct pliant_script pliant_script;  // an open script: a stream, its name and line number

// Open a file, or standard input for "-". Close takes NULL.
PLIANT_UNUSED_RESULT pliant_status pliant_script_open(const char *path, pliant_script **script,
                                                      pliant_error *err);
void pliant_script_close(pliant_script *script);

// What a script that can be read more than once asks for: the family of its first statement that
// belongs to one kind of play; common when a step or a mistake comes first, or it cannot be read.
pliant_statement_family pliant_script_family(const char *path);

// Read on to the next statement that is not blank. *more is 0 at the end of the script. Refusals
// read "name:line:column: expected ..., found ..." and leave the parser at the next line, with
// *more 1; when the stream itself fails, the status is PLIANT_ERR_IO and *more 0.
PLIANT_UNUSED_RESULT pliant_status pliant_script_next(pliant_script *script,
                                                      pliant_statement *statement, int *more,
                                                      pliant_error *err);

// Parse one line (no line break, not necessarily NUL-terminated); what script_next and the fuzzer
// call. `name` and `line` are for messages. `first` is 1 until a version statement was seen: the
// first statement must be one.
PLIANT_UNUSED_RESULT pliant_status pliant_statement_parse(const char *text, size_t length,
                                                          const char *name, int64_t line, int first,
                                                          pliant_statement *statement,
                                                          pliant_error *err);
