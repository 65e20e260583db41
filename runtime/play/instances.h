// instances.h: the instances of a lattice that a scene plays with, and their embedded surfaces.
//
// Instances are placed first and made all at once; then their number stays. Everything that is read
// lies one instance after the other. Displacements are from where the model has a vertex or a
// particle, whatever the instance's own placement: adding the model's rest positions gives
// positions for every instance alike.
#pragma once

#include "pliant/pliant.h"
#include "pliant/script.h"

#define PLIANT_INSTANCE_LIMIT 100000  // instances

typedef struct pliant_instances pliant_instances;

// A particle of an instance.
typedef struct pliant_instance_place {
    int32_t instance, particle;
} pliant_instance_place;

// The model is borrowed until destroy. PLIANT_ERR_MISSING: a file without a lattice.
PLIANT_UNUSED_RESULT pliant_status pliant_instances_create(const pliant_model *model,
                                                           pliant_instances **instances,
                                                           pliant_error *err);
void pliant_instances_destroy(pliant_instances *instances);  // NULL is fine

// Place what an `instances` statement says. Refusals have no effect.
PLIANT_UNUSED_RESULT pliant_status pliant_instances_place(pliant_instances *instances,
                                                          const pliant_statement *statement,
                                                          pliant_error *reason);
// Make the bodies, as `def` says but for place and velocity; where none was placed, one as the
// model has it. Refused, nothing is made.
PLIANT_UNUSED_RESULT pliant_status pliant_instances_populate(pliant_instances *instances,
                                                             const pliant_body_def *def,
                                                             pliant_error *reason);
int pliant_instances_is_populated(const pliant_instances *instances);

const pliant_lattice *pliant_instances_lattice(const pliant_instances *instances);
int32_t pliant_instances_count(const pliant_instances *instances);  // placed, or 1
pliant_body *pliant_instances_body(const pliant_instances *instances,
                                   int32_t instance);                        // NULL: not made
int32_t pliant_instances_vertex_count(const pliant_instances *instances);    // of one instance
int32_t pliant_instances_particle_count(const pliant_instances *instances);  // of one instance

pliant_vec3 pliant_instances_position(const pliant_instances *instances, int32_t instance,
                                      int32_t particle);
// The particle nearest to a position now, of one instance or (-1) of all. Populated only.
pliant_instance_place pliant_instances_nearest(pliant_instances *instances, int32_t instance,
                                               const double position[3]);
// Particles of a body within `radius` of the segment from a to b now, m: their number, at most
// what the lattice has; `particles` has room for that.
int32_t pliant_instances_within(pliant_instances *instances, int32_t instance, const double a[3],
                                const double b[3], double radius, int32_t *particles);

// Bring surfaces up to date. Allocates nothing.
void pliant_instances_follow(pliant_instances *instances);
// As of the last follow, shape [count * vertex_count], m and unit; 0 and NULL before there are
// bodies.
int32_t
pliant_instances_surface_count(const pliant_instances *instances);  // of all, once there are bodies
const pliant_vec3 *pliant_instances_displacements(const pliant_instances *instances);
const pliant_vec3 *pliant_instances_normals(const pliant_instances *instances);
// Displacements of all particles now, shape [count * particle_count], m.
void pliant_instances_read_particles(pliant_instances *instances, pliant_vec3 *displacements);
