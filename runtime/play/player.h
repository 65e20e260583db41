// player.h: executes the statements of a contact script against one solver, or on one scene.
//
// A player owns a solver on a borrowed model, keeps the state that the script has set (conditions,
// gravity, patches, tools, proxies, probes, time), and at every step solves and reconstructs the
// surface. It prints and writes nothing: an observer is told what happened. The solver's capacities
// follow the script: a script that needs more makes the player create a larger solver and hand it
// the state. Otherwise only create and the declaration of a probe, patch, tool or proxy allocate.
//
// On a lattice it owns a scene instead (see scene.h). A model that has both kinds is played as
// Green's functions, unless the first statement that belongs to one kind alone is a lattice's.
#pragma once

#include "conditions.h"
#include "phases.h"
#include "probes.h"
#include "props.h"
#include "scene.h"

#include "pliant/pliant.h"
#include "pliant/script.h"

typedef struct pliant_player pliant_player;

typedef enum pliant_probe_rule {
    PLIANT_PROBES_ANYTIME,  // a probe may be declared between steps
    PLIANT_PROBES_FIRST,    // all before the first step: rows of a table have one width
} pliant_probe_rule;

typedef enum pliant_prop_rule {
    PLIANT_PROPS_ALLOWED,
    PLIANT_PROPS_REFUSED,  // --compare: patches, tools and proxies have no dense solution
} pliant_prop_rule;

typedef enum pliant_kind_rule {
    PLIANT_KIND_BY_SCRIPT,  // where a model has both, the script decides
    PLIANT_KIND_LATTICE,    // --lattice
} pliant_kind_rule;

typedef struct pliant_player_def {
    const char *script_name;       // for messages; borrowed until destroy
    int32_t level;                 // the surface is reconstructed up to this level; default all
    pliant_probe_rule probe_rule;  // default anytime
    pliant_prop_rule prop_rule;    // default allowed
    int64_t deadline_ns;           // what a solve is given at first; default PLIANT_NEVER
    pliant_compliance compliance;  // default as stored, until the first tool or proxy
    pliant_kind_rule kind_rule;    // default by script
    int32_t thread_count;          // of a scene's world; default 1
    // An option that was given and makes no sense on a lattice, which is then refused; NULL: none.
    const char *greens_option;
} pliant_player_def;

// What one step did.
typedef struct pliant_step {
    int64_t number;        // 1 is the first
    double time;           // s, at the end of the step
    int64_t deadline_ns;   // what the solve was given, or PLIANT_NEVER
    pliant_status status;  // of the solve: PLIANT_OK or a reduced result (the report tells more)
    int64_t total_ns;      // solve and surface together
    pliant_play_kind kind;
    int64_t phase_ns[PLIANT_PHASE_LIMIT];  // of that kind
    // On a lattice constraint_count is the number of particles held, the rest 0.
    // Of the step's last solve of the solver; but level, is_late and lateness_ns are of all.
    pliant_solver_report report;
    pliant_vec3 force;  // total contact force, of patches, tools and proxies too, N
} pliant_step;

typedef struct pliant_expectation {
    const pliant_probe *probe;
    int64_t line;
    double expected[3], tolerance, distance;  // m
    int met;                                  // 1: distance <= tolerance
} pliant_expectation;

// Told what happens during pliant_player_play; every function may be NULL. A negative status from
// stepped or expected ends the play with that status.
typedef struct pliant_observer {
    void *context;
    pliant_status (*stepped)(void *context, pliant_player *player, const pliant_step *step,
                             pliant_error *err);
    // Also for those that fail, before play returns or `refused` is asked.
    pliant_status (*expected)(void *context, const pliant_expectation *expectation,
                              pliant_error *err);
    // A statement was refused, with no effect. 1: go on with the next line, 0: end the play.
    int (*refused)(void *context, const pliant_error *reason);
} pliant_observer;

pliant_player_def pliant_player_default(const pliant_model *model);
PLIANT_UNUSED_RESULT pliant_status pliant_player_create(const pliant_model *model,
                                                        const pliant_player_def *def,
                                                        pliant_player **player, pliant_error *err);
void pliant_player_destroy(pliant_player *player);  // NULL is fine

// Give every solve from now on `deadline_ns` nanoseconds, 0 or more, or PLIANT_NEVER.
void pliant_player_set_deadline(pliant_player *player, int64_t deadline_ns);

// Execute one statement; `step` solves as often as it says. Refusals read
// "script:line:column: reason" and have no effect on the state; an expectation that is not met is
// one. `observer` may be NULL.
PLIANT_UNUSED_RESULT pliant_status pliant_player_execute(pliant_player *player,
                                                         const pliant_statement *statement,
                                                         const pliant_observer *observer,
                                                         pliant_error *err);
// Execute a script to its end or to the first refusal. `observer` may be NULL.
PLIANT_UNUSED_RESULT pliant_status pliant_player_play(pliant_player *player, pliant_script *script,
                                                      const pliant_observer *observer,
                                                      pliant_error *err);

// Of a lattice, make the instances and their world now, if no statement has needed them yet; then
// surfaces stand where the script has placed them.
PLIANT_UNUSED_RESULT pliant_status pliant_player_prepare(pliant_player *player, pliant_error *err);

pliant_play_kind pliant_player_kind(const pliant_player *player);
const pliant_scene *pliant_player_scene(const pliant_player *player);  // NULL: Green's functions
// The last step; number 0 before any. Borrowed until the next step.
const pliant_step *pliant_player_last(const pliant_player *player);
// Displacements after the last step, shape [surface_count], zero before any; borrowed until the
// next statement. On a lattice all instances', one after the other.
const pliant_vec3 *pliant_player_surface(const pliant_player *player);
int32_t pliant_player_surface_count(const pliant_player *player);  // |K(level)|, of all instances
int32_t pliant_player_level(const pliant_player *player);
// In the order of declaration; borrowed until the next statement.
const pliant_probe *pliant_player_probes(const pliant_player *player, int32_t *count);
// In no particular order; borrowed until the next statement.
const pliant_condition *pliant_player_conditions(const pliant_player *player, int32_t *count);
pliant_vec3 pliant_player_gravity(const pliant_player *player);
// To read; NULL on a lattice.
const pliant_props *pliant_player_props(const pliant_player *player);
// For what the player does not keep (tractions, say); borrowed until the next statement. Not on a
// lattice.
pliant_solver *pliant_player_solver(pliant_player *player);
