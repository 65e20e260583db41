// pliant.h: precomputed elastic solids in real time. C11; needs libc and libm.
//
// Arrays follow the file's vertex order (coarse to fine: the vertices of level l are 0 ..
// |K(l)|-1). A pliant_model is a read-only mmap that threads may share; a pliant_solver has one
// user at a time. Only open and create allocate: nothing called per frame allocates, locks, prints
// or wakes threads. Lengths, forces and so on are in the units that the model was precomputed with;
// comments write m, N. A status below 0 has had no effect, neither on the object nor on the
// outputs.
//
// GF-n: D. L. James and D. K. Pai, Multiresolution Green's Function Methods for Interactive
// Simulation of Large-scale Elastostatic Objects, ACM TOG 22(1), 2003.
#pragma once

#include "pliant/base.h"

typedef struct pliant_model pliant_model;  // one file: mesh, material, compressed Green's functions
typedef struct pliant_solver pliant_solver;  // one boundary value problem on a model

// ---- Model ----

// Map a file and check its header, section bounds and indices (not the payload's checksums: see
// verify). `err` may be NULL. A file may hold a lattice without Green's functions (--no-greens): no
// vertex of it is free or fixed, what tells of them is 0, none is nearest, and creating a solver or
// an exchange on it is PLIANT_ERR_MISSING.
PLIANT_CALL pliant_status pliant_model_open(const char *path, pliant_model **model,
                                            pliant_error *err);
PLIANT_API void pliant_model_close(pliant_model *model);  // after its solvers; NULL is fine
// Recompute every checksum of the file. Reads every page.
PLIANT_CALL pliant_status pliant_model_verify(const pliant_model *model, pliant_error *err);

typedef struct pliant_model_info {
    int32_t vertex_count;  // n
    int32_t face_count;
    int32_t level_count;  // L + 1
    int32_t free_count;   // m, vertices whose displacement the reference problem leaves free
    int32_t fixed_count;  // vertices that it holds
    double young, poisson, density;  // Pa, -, kg/m^3
    double rms, max, factor;  // of the free-free block: GF-70, GF-71, dense blocks / kept blocks
    int32_t has_supports;     // 1: fixed columns and rows are stored (--blocks all)
    int32_t coarsest_constraint_level, finest_constraint_level;  // stored Green's functions
    int32_t detail_steps, detail_vertex_count;  // of the finer shape (--detail); 0: none stored
} pliant_model_info;
PLIANT_API pliant_model_info pliant_model_describe(const pliant_model *model);

// The hierarchical Green's functions of one level (GF 7).
typedef struct pliant_level_info {
    int32_t vertex_count;     // |K(l)|
    int32_t column_count;     // free nodes whose hats have columns; 0: the level is not stored
    double rms, max, factor;  // as in pliant_model_info
    // Smallest eigenvalue of this level's area-weighted, symmetrised contact compliance, scaled to
    // a unit diagonal: below 0 some patch would not be definite as stored. 0: not known.
    double smallest_eigenvalue;
} pliant_level_info;
PLIANT_API pliant_level_info pliant_model_level(const pliant_model *model, int32_t level);

PLIANT_API int32_t pliant_model_level_vertex_count(const pliant_model *model, int32_t level);
PLIANT_API int32_t pliant_model_level_face_count(const pliant_model *model, int32_t level);
// Rest positions, shape [n][3], m; borrowed until close.
PLIANT_API const double *pliant_model_positions(const pliant_model *model);
// Triangles of a level, shape [level_face_count][3]; borrowed until close.
PLIANT_API const int32_t *pliant_model_faces(const pliant_model *model, int32_t level);
// Vertex of the model that is vertex `source` of the input mesh, or -1.
PLIANT_API int32_t pliant_model_from_source(const pliant_model *model, int32_t source);
// 1, 0; -1: out of range, or there are no Green's functions.
PLIANT_API int32_t pliant_model_is_free(const pliant_model *model, int32_t vertex);
PLIANT_API double pliant_model_area(const pliant_model *model, int32_t vertex);  // a_i, m^2 (GF-4)
// Free vertex whose rest position is nearest to `position` (shape [3], m); -1: there is none.
PLIANT_API int32_t pliant_model_nearest(const pliant_model *model, const double *position);
// The same among the vertices of a level; -1: there is none.
PLIANT_API int32_t pliant_model_nearest_on(const pliant_model *model, int32_t level,
                                           const double *position);

// A hierarchical basis function, the hat of vertex `vertex` on level `level` (GF-51..53); on the
// finest level, L, the vertex itself. Constraints and loads on it act through the hat, which is one
// at its vertex, falls to zero at the level's neighbours and ends where its domain does. Nodes of
// levels that the file has no columns for are PLIANT_ERR_MISSING.
typedef struct pliant_node {
    int32_t level, vertex;
} pliant_node;
// Integral of a node's hat over the surface, m^2: traction times this is its force. 0: no such
// node.
PLIANT_API double pliant_model_node_area(const pliant_model *model, pliant_node node);

// ---- Solver ----

// Monotonic time in nanoseconds, what deadlines are given in.
PLIANT_API int64_t pliant_clock_ns(void);
#define PLIANT_NEVER INT64_MAX  // no deadline

// Where a solver reads the columns that it sums at every solve. Half: a copy of its own in half
// precision, scaled by columns, 24 bytes a stored block; worth it from some 30 nodes in S on. Taken
// where the machine converts halves, for domains of at most 65536 nodes; else as float. It changes
// displacements away from S by some 3e-4 of the largest, a hundredth of what compression does, and
// reactions likewise, but neither contact forces nor what is known at S.
typedef enum pliant_storage {
    PLIANT_STORAGE_FLOAT = 0,  // the file's floats, mapped and shared: 40 bytes a stored block
    PLIANT_STORAGE_HALF = 1,
} pliant_storage;

// What a contact solve takes for the compliance among the nodes of S.
typedef enum pliant_compliance {
    // As stored: C of GF-69 element by element. What compression did to symmetry and definiteness
    // shows as PLIANT_ROUGH.
    PLIANT_COMPLIANCE_STORED = 0,
    // Symmetric and positive definite in the energy sense (weighted by the hats' areas), by
    // construction: opposite elements are averaged by how far their columns are to be believed, of
    // two levels the one at the finer vertex is taken for both, and the diagonal is raised where
    // the least eigenvalue falls short. Contact then has an elastic energy. The raise never falls
    // until the last constraint is released, so that no loop through contact gains energy, whatever
    // nodes come and go.
    PLIANT_COMPLIANCE_PASSIVE = 1,
} pliant_compliance;

typedef struct pliant_solver_def {
    int32_t constraint_capacity;  // s: the capacitance matrix (GF-19) is 3s x 3s. Default 64
    int32_t load_capacity;   // nodes with a specified traction or support displacement. Default 256
    int32_t cache_count;     // boundary-value-problem types whose inverse is kept. Default 4
    pliant_storage storage;  // Default PLIANT_STORAGE_FLOAT
    pliant_compliance compliance;  // Default PLIANT_COMPLIANCE_STORED
} pliant_solver_def;
PLIANT_API pliant_solver_def pliant_solver_default(const pliant_model *model);
PLIANT_CALL pliant_status pliant_solver_create(const pliant_model *model,
                                               const pliant_solver_def *def, pliant_solver **solver,
                                               pliant_error *err);
PLIANT_API void pliant_solver_destroy(pliant_solver *solver);  // NULL is fine

// Statements change the state and cost next to nothing; solve does the work, and what is read stays
// that of the last solve until the next. The last statement about a vertex holds, on whatever level
// it was made; their order does not matter otherwise. Levels may be mixed. Displace prescribes the
// displacement of a free vertex (its type changes: CMA). Press prescribes the traction of a free
// vertex, or frees a fixed one and loads it. Support prescribes a fixed vertex's displacement. The
// latter two on fixed vertices need the fixed blocks (has_supports; else PLIANT_ERR_MISSING).
// PLIANT_ERR_ARGUMENT: no such node, a number that is not finite, displace on a fixed vertex,
// support on a free one. PLIANT_ERR_CAPACITY: the definition's room for constraints or loads is
// taken.
PLIANT_CALL pliant_status pliant_solver_displace(pliant_solver *solver, pliant_node node,
                                                 pliant_vec3 u);  // m
PLIANT_CALL pliant_status pliant_solver_press(pliant_solver *solver, pliant_node node,
                                              pliant_vec3 p);  // N/m^2
PLIANT_CALL pliant_status pliant_solver_support(pliant_solver *solver, pliant_node node,
                                                pliant_vec3 u);  // m
PLIANT_CALL pliant_status pliant_solver_gravity(pliant_solver *solver,
                                                pliant_vec3 acceleration);  // m/s^2
PLIANT_CALL pliant_status
pliant_solver_release(pliant_solver *solver, pliant_node node);  // back to the reference condition
PLIANT_API void pliant_solver_release_all(pliant_solver *solver);  // gravity too
PLIANT_API int32_t
pliant_solver_constraint_count(const pliant_solver *solver);  // s: nodes whose type is changed

// Solve for the present state (GF-42..45, 68, 69): afterwards tractions and forces at constraints
// are known and any part of the surface can be read. Does not refuse. A set of nodes that no kept
// type has costs an update of the nearest kept type's inverse (some 70 s^2 operations for each node
// that came or went) or a factorisation (some 54 s^3), whichever is less; the report tells.
//
// `deadline` is a time of pliant_clock_ns, or PLIANT_NEVER. When the work ahead, predicted from
// operation counts calibrated at create, would end after it, the constraints are resolved on the
// finest level that fits (GF 8.2): a constraint on a finer level stays when its vertex belongs to
// that level, with that level's hat; it is left out when such a hat covers its vertex; else it
// stays as it is. Then the status is PLIANT_LATE and the state is valid. What time is left goes
// into the inverse of the full set, so that a contact that rests is resolved as stated after some
// solves. PLIANT_ROUGH (stored compliance only; before PLIANT_LATE): the matrix of this patch, or
// of its nodes of one level, is not positive definite; finite, displacements at S as specified, but
// forces are unreliable.
PLIANT_CALL pliant_status pliant_solver_solve(pliant_solver *solver, int64_t deadline);

// Displacements of the whole surface up to `level` (GF-46, 47): u[level_vertex_count], m. Exact
// where displaced or supported, on every level. Another level after the same solve costs a new
// summation.
PLIANT_CALL pliant_status pliant_solver_surface(pliant_solver *solver, int32_t level,
                                                pliant_vec3 *u);
// Chosen vertices only: the cost follows count, not mesh size (GF 3.2.4). NULL: 0 .. count-1. The
// same vertices every frame are the fast case, since how to reach them is remembered.
PLIANT_CALL pliant_status pliant_solver_displacements(pliant_solver *solver,
                                                      const int32_t *vertices, int32_t count,
                                                      pliant_vec3 *u);  // u[count], m
// Tractions of chosen vertices: specified or solved for at free ones; reactions at fixed ones
// (PLIANT_ERR_MISSING without fixed rows). p[count], N/m^2.
PLIANT_CALL pliant_status pliant_solver_tractions(pliant_solver *solver, const int32_t *vertices,
                                                  int32_t count, pliant_vec3 *p);
// Sum over the displaced nodes of traction times hat area, N: what the tool exerts on the body.
PLIANT_API pliant_vec3 pliant_solver_contact_force(const pliant_solver *solver);
// The same of one displaced node, N; zero when it was not in S in the last solve.
PLIANT_API pliant_vec3 pliant_solver_node_force(const pliant_solver *solver, pliant_node node);

// What the last solve did and took; times are monotonic nanoseconds.
typedef struct pliant_solver_report {
    int32_t constraint_count;  // s, of what was solved
    int32_t asked_count;       // s of what was stated
    int32_t level;           // finest constraint level used; finest stored one without constraints
    int32_t is_late;         // 1: resolved on a coarser level than stated
    float prepared;          // part of the stated set's inverse that late solves have made, 0 to 1
    int32_t factored;        // 1: a new boundary-value-problem type was factored from scratch
    int32_t updated;         // nodes that an inverse was updated for; 0 and 0: found in the cache
    int32_t summed_columns;  // columns added because they changed (GF-11)
    double residual;         // of the inverse, |M M^-1 x - x| / |x|, when it was updated; else 0
    double shift;            // in the scaled compliance's diagonal, whose elements are else one
    int64_t predicted_ns;    // of the work that was chosen
    int64_t lateness_ns;     // end of the solve less the deadline; 0 when in time
    int64_t capacitance_ns;  // assembling and factoring C
    int64_t contact_ns;      // q = E^T W^-1 g - E^T vbar, then C^-1 q
    int64_t summation_ns;    // sparse sums
    int64_t surface_ns;      // last pliant_solver_surface, whenever it was
} pliant_solver_report;
PLIANT_API pliant_solver_report pliant_solver_last(const pliant_solver *solver);

// Compliance among free nodes of one solver, with what is displaced now held where it is (GF-15):
// matrix, shape [3 count][3 count], row-major: component r at node i's vertex per unit force c on
// node j's hat, m/N, at 3 i + r, 3 j + c. By the definition's rule, so symmetric positive definite
// when that is passive. Nodes that are themselves displaced have none: PLIANT_ERR_ARGUMENT, as for
// nodes that are not free or `count` above the definition's constraint_capacity. To be called after
// a solve; it does not change it. A passive raise stays until a call with `count` 0, which is to
// say that contact through these nodes has ended.
PLIANT_CALL pliant_status pliant_solver_compliance(pliant_solver *solver, const pliant_node *nodes,
                                                   int32_t count, double *matrix);

// ---- Detail ----

// A finer shape that moves with the elastic surface (GF 9.2): a displaced subdivision surface,
// whose control mesh is a level of the model. Evaluating is linear in what is asked for, on the
// state of no solver: u comes from pliant_solver_surface, or is NULL for the shape at rest. A
// detail is const after create, and threads may share it; the model must outlive it.
//
// Vertices 0 .. n-1 of the detail are those of the model, where these are at rest. They do not
// follow it exactly: Loop's rule averages, so that where six edges meet the detail moves by half of
// the vertex's displacement and half of its neighbours' mean.
typedef struct pliant_detail pliant_detail;

// Over the mesh of level `level`, with u that level's displacements; pliant_model_describe's
// level_count - 1 is the finest, on which the detail is defined. Coarser ones carry the same shape
// at rest on fewer numbers. PLIANT_ERR_MISSING: the file has none. PLIANT_ERR_FORMAT: the surface
// has no normal at some vertex.
PLIANT_CALL pliant_status pliant_detail_create(const pliant_model *model, int32_t level,
                                               pliant_detail **detail, pliant_error *err);
PLIANT_API void pliant_detail_destroy(pliant_detail *detail);  // NULL is fine

typedef struct pliant_detail_info {
    int32_t level;          // of the control mesh
    int32_t control_count;  // its vertices: u has shape [control_count]
    int32_t vertex_count, face_count;
} pliant_detail_info;
PLIANT_API pliant_detail_info pliant_detail_describe(const pliant_detail *detail);
// Triangles, shape [face_count][3], counterclockwise from outside; borrowed until destroy.
PLIANT_API const int32_t *pliant_detail_faces(const pliant_detail *detail);
// Vertex of the input mesh, -1: made by subdivision; shape [vertex_count], borrowed until the model
// is closed.
PLIANT_API const int32_t *pliant_detail_source_index(const pliant_detail *detail);

// The whole detailed surface: positions[vertex_count], m, and unit normals[vertex_count] (NULL: not
// wanted), the mean of the surrounding triangles' normals weighted by area. PLIANT_ROUGH: folded so
// that the subdivision surface has no normal at some vertex; there the offset keeps the direction
// it has at rest. Finite as long as u is within 1e9 times the size of the model.
PLIANT_CALL pliant_status pliant_detail_evaluate(const pliant_detail *detail, const pliant_vec3 *u,
                                                 pliant_vec3 *positions, pliant_vec3 *normals);
// Chosen vertices only, the same to rounding: positions[count], normals[count] (or NULL; a normal
// costs as much as its neighbours' positions). u still has shape [control_count], but is read only
// at the control vertices that pliant_detail_support names.
PLIANT_CALL pliant_status pliant_detail_points(const pliant_detail *detail, const pliant_vec3 *u,
                                               const int32_t *vertices, int32_t count,
                                               pliant_vec3 *positions, pliant_vec3 *normals);
// The control vertices that points and normals of these vertices depend on:
// control[*control_count], ascending, some 12 to 20 for one vertex. PLIANT_ERR_CAPACITY: there are
// more than `capacity`.
PLIANT_CALL pliant_status pliant_detail_support(const pliant_detail *detail,
                                                const int32_t *vertices, int32_t count,
                                                int32_t *control, int32_t capacity,
                                                int32_t *control_count);
// Carry numbers that belong to the control vertices to the detail's, by the weights of the limit
// surface: values[control_count][width] to result[vertex_count][width].
PLIANT_CALL pliant_status pliant_detail_interpolate(const pliant_detail *detail, int32_t width,
                                                    const float *values, float *result);

// ---- Patch ----

// A contact given on the finest scale, and met there to a tolerance with few nodes of mixed levels
// (GF-68): where the prescribed displacements are smooth by coarse hats, elsewhere by finer ones.
// What was chosen is kept from solve to solve, and nodes come and go smoothly. A patch need not be
// connected. Several patches may share a solver, beside constraints and loads of the caller's own
// on other vertices; those on a patch's vertices may be replaced by its nodes.
typedef struct pliant_patch pliant_patch;

typedef struct pliant_patch_def {
    int32_t vertex_capacity;  // vertices in the patch. Default 512
    double tolerance;         // m, largest |u - target| at a vertex of the patch; 0: all are nodes.
                              // Default a 1000th of the diagonal of the model's box
    // At least 1. A node is given up once the error without it was predicted below tolerance /
    // hysteresis in several solves running. Default 2
    double hysteresis;
    int32_t blend_steps;  // solves that a node takes to come or go; 0: at once. Default 16
} pliant_patch_def;
PLIANT_API pliant_patch_def pliant_patch_default(const pliant_model *model);
// `def` and `err` may be NULL. The solver is borrowed until destroy; its constraint_capacity bounds
// the nodes.
PLIANT_CALL pliant_status pliant_patch_create(pliant_solver *solver, const pliant_patch_def *def,
                                              pliant_patch **patch, pliant_error *err);
// Releases its nodes, for the next solve. Before its solver. NULL is fine.
PLIANT_API void pliant_patch_destroy(pliant_patch *patch);

// Replace the patch: free vertices, any order, and their displacements; u[count], m; copied. A
// count of 0 ends the contact. Costs next to nothing. PLIANT_ERR_ARGUMENT: a vertex that is not
// free or named twice, a number that is not finite. PLIANT_ERR_CAPACITY: more than vertex_capacity.
PLIANT_CALL pliant_status pliant_patch_set(pliant_patch *patch, const int32_t *vertices,
                                           const pliant_vec3 *u, int32_t count);
// Another tolerance, m, from the next solve on. PLIANT_ERR_ARGUMENT: not finite or below 0.
PLIANT_CALL pliant_status pliant_patch_tolerate(pliant_patch *patch, double tolerance);

// Choose nodes, state them to the solver (which then says what pliant_solver_solve would), solve,
// and refine until the error is within the tolerance. Everything of the solver can be read
// afterwards. PLIANT_LATE: the deadline came first, or the solver's room or the file's levels do
// not go as far; the state is valid, and the report tells its error. Calls go on from there.
// PLIANT_ROUGH as pliant_solver_solve. Does not refuse.
PLIANT_CALL pliant_status pliant_patch_solve(pliant_patch *patch, int64_t deadline);

// Force that the patch exerts on the body, N: of its nodes and of those fading out.
PLIANT_API pliant_vec3 pliant_patch_force(const pliant_patch *patch);
// The nodes of the last solve (for drawing): the first `capacity` to nodes[capacity]; returns how
// many there are. `nodes` may be NULL when capacity is 0.
PLIANT_API int32_t pliant_patch_nodes(const pliant_patch *patch, pliant_node *nodes,
                                      int32_t capacity);

typedef struct pliant_patch_report {
    int32_t vertex_count;
    int32_t node_count;       // of the patch, without those fading out
    int32_t level_count[16];  // nodes by level
    int32_t solve_count;      // solves that this took, 1 when the last nodes were right
    int32_t blending;         // nodes that have not reached their displacement, or are fading out
    int32_t is_late;          // 1: the deadline came before the tolerance was met
    int32_t is_full;          // 1: the solver's room did, or the finest nodes that the file has
    double error;             // m, largest |u - target| at the patch's vertices
} pliant_patch_report;
PLIANT_API pliant_patch_report pliant_patch_last(const pliant_patch *patch);

// ---- Contact with rigid tools ----

// Rigid tools pressed into the surface: a tool pushes and never pulls (unilateral contact), with
// Coulomb friction if asked for. The contact takes as coarse a mix of levels as keeps the stated
// tolerance, and lets a change of level take effect gradually, so that nothing pops when a tool
// moves. It works through the solver's loads: what it states there stays until the next solve or
// destroy, and a vertex about which the caller has stated something is never its node. Tools touch
// free vertices; smaller than the finest triangles they slip between.

// The body's surface stays outside of: a ball, a half-space (solid on the side that its normal
// points away from), a ball swept along a segment.
typedef enum pliant_tool_kind {
    PLIANT_TOOL_NONE = 0,
    PLIANT_TOOL_SPHERE = 1,
    PLIANT_TOOL_PLANE = 2,
    PLIANT_TOOL_CAPSULE = 3,
} pliant_tool_kind;

typedef struct pliant_tool {
    pliant_tool_kind kind;
    pliant_vec3 a;   // m; sphere: centre; plane: a point on it; capsule: one end
    pliant_vec3 b;   // plane: normal, out of the solid, of any length but 0; capsule: other end, m
    float radius;    // m, above 0; of spheres and capsules
    float friction;  // Coulomb's coefficient, 0 to 2
} pliant_tool;

typedef struct pliant_contact pliant_contact;

typedef struct pliant_contact_def {
    int32_t node_capacity;  // nodes in contact or near it. Default 64, or the solver's capacities
    int32_t tool_capacity;  // tools are numbered 0 .. tool_capacity - 1. Default 4, 64 at most
    // How far the surface may enter a tool, and how far it may stand off where the tool's force
    // acts on it (in proportion to the pressure there), m. Default: 1/500 of the longest side of
    // the model's box.
    double tolerance;
    // Solves until a change of level has taken effect in full. Default 16; 0: at once, which pops.
    int32_t fade_count;
    int32_t coarsest_level, finest_level;  // of the nodes. Default: all that are stored
} pliant_contact_def;
PLIANT_API pliant_contact_def pliant_contact_default(const pliant_solver *solver);

// The solver is borrowed until destroy; one contact for a solver. It must have passive compliance
// and capacities for `node_capacity` nodes: constraint_capacity, and load_capacity, where loads of
// the caller's leave the contact so many nodes less.
PLIANT_CALL pliant_status pliant_contact_create(pliant_solver *solver,
                                                const pliant_contact_def *def,
                                                pliant_contact **contact, pliant_error *err);
PLIANT_API void
pliant_contact_destroy(pliant_contact *contact);  // takes its loads out; NULL is fine

// Put tool `index` somewhere, or move it there; it takes effect in the next solve. A tool of the
// same kind as before has moved rigidly (without spin about a capsule's axis or a plane's normal,
// spheres without any), which is what friction follows. PLIANT_TOOL_NONE takes it away. Copied.
// PLIANT_ERR_ARGUMENT: no such number, not finite, radius or friction out of range, a plane without
// normal.
PLIANT_CALL pliant_status pliant_contact_set_tool(pliant_contact *contact, int32_t index,
                                                  const pliant_tool *tool);

// In place of pliant_solver_solve: solve for the tools and leave the solver solved for the caller's
// statements and the tools' forces, to be read as usual. Does not refuse. PLIANT_LATE: the deadline
// (of pliant_clock_ns, or PLIANT_NEVER) came first, or the solver's constraints were resolved on
// coarser levels for it; what there is, is the last pass that was completed, of which there is
// always one: finite, and no tool pulls. A tool that moved by more than half its radius may be on
// its way then; the next solve goes on.
PLIANT_CALL pliant_status pliant_contact_solve(pliant_contact *contact, int64_t deadline);

typedef struct pliant_tool_result {
    pliant_vec3 force;   // N, what the tool exerts on the body
    pliant_vec3 torque;  // N m, of that about the tool's point a
    int32_t node_count;  // nodes that it pushes
    float penetration;   // m, deepest vertex inside it
} pliant_tool_result;
PLIANT_API pliant_tool_result pliant_contact_tool(const pliant_contact *contact, int32_t index);

// Nodes that tools push, for drawing and for tests.
typedef struct pliant_contact_node {
    pliant_node node;
    int32_t tool;
    pliant_vec3 force;   // N, on the body
    pliant_vec3 normal;  // out of the tool, along which it pushes
    float gap;           // m, of the node's vertex; below 0: inside
    int32_t is_sliding;  // 1: friction is at its limit
} pliant_contact_node;
PLIANT_API pliant_contact_node pliant_contact_get(const pliant_contact *contact,
                                                  int32_t i);  // 0 .. node_count of last - 1

// What the last solve did; times are monotonic nanoseconds.
typedef struct pliant_contact_report {
    int32_t node_count;                    // pairs of a node and a tool that pushes it
    int32_t watched_count;                 // nodes in the complementarity problem
    int32_t candidate_count;               // vertices whose distance was evaluated
    int32_t coarsest_level, finest_level;  // of the nodes that are pushed; -1: none
    int32_t iterations;                    // passes of: contact law, solve, distances
    int32_t pivots;              // active sets or, with friction, sweeps, of all passes together
    int32_t refined, coarsened;  // nodes that went to another level
    int32_t is_late;             // 1: PLIANT_LATE
    int32_t is_met;              // 1: the tolerance is kept everywhere
    double penetration;          // m, deepest vertex inside a tool
    double error;                // m, the worst of what the tolerance is about
    double residual;  // m, of the contact conditions at the nodes; 0.01 tolerances aimed at
    // Compliances of nodes, contact law, the solver's solves, and all.
    int64_t compliance_ns, law_ns, solve_ns, total_ns;
    int64_t lateness_ns;  // end less the deadline; 0 when in time
} pliant_contact_report;
PLIANT_API pliant_contact_report pliant_contact_last(const pliant_contact *contact);

// ---- Point haptics ----

// A point that a device drags over the deformed surface (a "god object", Zilles and Salisbury
// 1995): where the device is while that is outside, held back on the surface while it is inside.
// A virtual coupling, a spring that is at most as stiff as the definition says, pulls the proxy
// towards the device. Its force acts on the body at the touched face (by the hats of the finest
// stored level there) in addition to whatever the solver's statements say, never in their place.
//
// Without friction the force stands along a normal that is interpolated between vertices, so that
// force and place are continuous over edges and the mesh is not felt (Morgenbesser and Srinivasan
// 1996; GF 9.3). Whatever the normals, and whatever compression did, no closed path of the device
// gains energy. That is one proxy's; of several devices on one body it is true for what the solver
// displaces with passive compliance.
//
// A proxy has one solver, which outlives it and is used by the same thread; a solver may have
// several.
typedef struct pliant_proxy pliant_proxy;

typedef struct pliant_proxy_def {
    double stiffness;  // of the virtual coupling, N/m, above 0. Default: four times Young's modulus
                       // times the root of the mean vertex area, some three times a vertex's own
    double friction;   // Coulomb's coefficient, 0 or more. Default 0
    // The normal map: a more detailed surface's normals at rest, of any length, shape [n][3];
    // copied. They turn with the surface. Within 84 degrees of the mesh's own, which are the
    // default, NULL. A model's detail has some: pliant_detail_evaluate, the first n.
    const float *normals;
} pliant_proxy_def;
PLIANT_API pliant_proxy_def pliant_proxy_default(const pliant_model *model);
PLIANT_CALL pliant_status pliant_proxy_create(pliant_solver *solver, const pliant_proxy_def *def,
                                              pliant_proxy **proxy, pliant_error *err);
PLIANT_API void pliant_proxy_destroy(pliant_proxy *proxy);  // takes its force away; NULL is fine

typedef struct pliant_proxy_result {
    int32_t face;          // that is touched, of the finest level; -1: in free space
    float weights[3];      // of the face's corners at the contact; sum 1
    double position[3];    // of the proxy, m: on the surface as solved, or where the device is
    pliant_vec3 normal;    // outward, smoothed, unit; 0 in free space
    pliant_vec3 force;     // on the body, N; the device gets the opposite. 0 in free space
    double depth;          // of the device along the normal under the surface without the force, m
    double energy;         // held by the body's contact and the coupling, J
    double brake;          // part of the force that is against the device's motion, where that
                           // would have got energy that nobody put in, N; mostly 0
    int32_t is_sliding;    // 1: the proxy moved over the surface in this step
    int32_t vertex_count;  // vertices that this step evaluated
    int64_t step_ns;       // of the whole step
} pliant_proxy_result;

// One haptic step: solve for what the solver's statements say now, move the proxy towards the
// device at `position` (shape [3], m), let its force act and solve again. Afterwards the solver's
// solution (surface, displacements, publish, ...) includes the force. Cost follows what is touched,
// not the mesh. As in pliant_solver_solve, constraints are resolved on a coarser level when the
// step would not end by `deadline`: PLIANT_LATE; PLIANT_ROUGH likewise. PLIANT_ERR_ARGUMENT: a
// position that is not finite.
PLIANT_CALL pliant_status pliant_proxy_step(pliant_proxy *proxy, const double *position,
                                            int64_t deadline, pliant_proxy_result *result);
// Lift the proxy off, its force with it (from the next solve on), and let the next step begin at
// `position`, whatever is in between. The first step begins where its device is. Beginning inside
// the body is being put on the nearest surface.
PLIANT_CALL pliant_status pliant_proxy_place(pliant_proxy *proxy, const double *position);

// ---- Two threads ----

// Carries solutions from the thread that solves (haptics, 1 kHz) to one that looks (graphics, 60
// Hz): a triple buffer, so that neither ever waits for the other and the looker gets the newest.
// For one publishing and one receiving thread.
typedef struct pliant_exchange pliant_exchange;

// Room for solutions of solvers of this definition (NULL: the default) on the model, which outlives
// it.
PLIANT_CALL pliant_status pliant_exchange_create(const pliant_model *model,
                                                 const pliant_solver_def *def,
                                                 pliant_exchange **exchange, pliant_error *err);
PLIANT_API void pliant_exchange_destroy(pliant_exchange *exchange);  // NULL is fine
// Put the last solve's solution there: a copy of some 30 bytes a constraint or load.
// PLIANT_ERR_ARGUMENT: a solver on another model. PLIANT_ERR_CAPACITY: more than there is room for.
PLIANT_CALL pliant_status pliant_solver_publish(const pliant_solver *solver,
                                                pliant_exchange *exchange);
// Take the newest solution over into another solver on the model, as if it had been told the same
// and had solved, but without solving: only what changed is summed. What it had been told before is
// forgotten; on a late solution it knows the coarser constraints. 1: done; 0: nothing newer than
// the last one taken; PLIANT_ERR_ARGUMENT: a solver on another model; PLIANT_ERR_CAPACITY: its
// definition has less room than the exchange's. Compliance is PLIANT_ERR_MISSING until it solves.
PLIANT_API int32_t pliant_solver_receive(pliant_solver *viewer, pliant_exchange *exchange);

// ---- Lattice bodies: fast lattice shape matching ----
//
// A body of large deformations: the cells of a lattice around the surface, particles at their
// corners, pulled towards where the rigid motions of their neighbourhoods would have them (LSM-n:
// A. R. Rivers and D. L. James, FastLSM: Fast Lattice Shape Matching for Robust Real-Time
// Deformation, ACM TOG 26(3), 2007). A step costs the same per particle whatever the half-width,
// which makes a body stiffer. It is stable whatever is done to it.

typedef struct pliant_lattice pliant_lattice;  // a model's lattice with one half-width; const
typedef struct pliant_body pliant_body;        // one instance of it

// Lay out the model's lattice with this half-width, 1 to 15; 0: the file's own, without counting
// regions again. Bodies and threads share it; destroy it after its bodies and before the model.
// PLIANT_ERR_MISSING: the file has no lattice.
PLIANT_CALL pliant_status pliant_lattice_create(const pliant_model *model, int32_t half_width,
                                                pliant_lattice **lattice, pliant_error *err);
PLIANT_API void pliant_lattice_destroy(pliant_lattice *lattice);  // NULL is fine

typedef struct pliant_lattice_info {
    int32_t particle_count, cell_count, component_count;
    int32_t half_width;       // w: regions reach w neighbours far
    int32_t region_count;     // distinct regions
    int32_t irregular_count;  // regions that are not all particles of their (2w + 1)^3 window
    int32_t is_shell;         // 1: cells that the surface touches; 0: what it encloses too
    int32_t dims[3];          // particles along x, y, z
    // Of the embedded surface: the model's finest level, and its batches.
    int32_t vertex_count, face_count, batch_count;
    double cell_size, mass;  // m, kg
} pliant_lattice_info;
PLIANT_API pliant_lattice_info pliant_lattice_describe(const pliant_lattice *lattice);
// Rest positions, shape [particle_count][3], m; borrowed until destroy.
PLIANT_API const float *pliant_lattice_positions(const pliant_lattice *lattice);
PLIANT_API double pliant_lattice_particle_mass(const pliant_lattice *lattice,
                                               int32_t particle);  // kg; 0: no such particle
// The particle whose rest position is nearest to `position` (shape [3], m).
PLIANT_API int32_t pliant_lattice_nearest(const pliant_lattice *lattice, const double *position);

typedef struct pliant_body_def {
    pliant_vec3 position;      // where the origin of rest coordinates goes, m. Default 0
    float rotation[4];         // unit quaternion x, y, z, w, about that origin. Default none
    pliant_vec3 velocity;      // m/s. Default 0
    float damping;             // k of LSM 4, 0 to 1, of what is not rigid motion of a region
    int32_t damping_interval;  // damp every so many steps. Default 1
    float rigid_damping;       // the same of what is not rigid motion of the whole, 0 to 1
    // A link of two neighbours that is stretched by more than this part of its length breaks for
    // good. Default 0: unbreakable
    float strain_limit;
    int32_t thread_count;  // 1 to 64, the caller among them. Default 1
} pliant_body_def;
PLIANT_API pliant_body_def pliant_body_default(void);
// `def` may be NULL. The lattice is borrowed until destroy.
PLIANT_CALL pliant_status pliant_body_create(const pliant_lattice *lattice,
                                             const pliant_body_def *def, pliant_body **body,
                                             pliant_error *err);
PLIANT_API void pliant_body_destroy(pliant_body *body);  // NULL is fine

// Advance by h > 0 seconds: v += (g - x) / h + h f / m, damping, x += h v (LSM-1, 2), fracture. The
// same bits from any number of threads. Allocates nothing.
PLIANT_CALL pliant_status pliant_body_step(pliant_body *body, float h);

// Shape [particle_count] each, in the order of pliant_lattice_positions; m, m/s. What is not finite
// is PLIANT_ERR_ARGUMENT.
PLIANT_API void pliant_body_positions(const pliant_body *body, pliant_vec3 *x);
PLIANT_API void pliant_body_velocities(const pliant_body *body, pliant_vec3 *v);
PLIANT_CALL pliant_status pliant_body_set_positions(pliant_body *body, const pliant_vec3 *x);
PLIANT_CALL pliant_status pliant_body_set_velocities(pliant_body *body, const pliant_vec3 *v);
PLIANT_API pliant_vec3 pliant_body_position(const pliant_body *body, int32_t particle);
// Make `to` what `from` is, bit for bit, for later or for another: positions, velocities,
// rotations, forces, gravity, broken links; not damping and strain limit. Both are instances of one
// lattice, and `to` is breakable if `from` is.
PLIANT_CALL pliant_status pliant_body_copy(pliant_body *to, const pliant_body *from);

PLIANT_CALL pliant_status pliant_body_set_gravity(pliant_body *body, pliant_vec3 gravity);  // m/s^2
// k = 0 to 1, every `interval` steps.
PLIANT_CALL pliant_status pliant_body_set_damping(pliant_body *body, float k, int32_t interval);
PLIANT_CALL pliant_status pliant_body_set_rigid_damping(pliant_body *body, float k);
// Of a body that was created with one; PLIANT_ERR_MISSING: it was not.
PLIANT_CALL pliant_status pliant_body_set_strain_limit(pliant_body *body, float limit);
PLIANT_API int64_t pliant_body_broken_count(const pliant_body *body);  // links broken so far
// What holds together: piece[p] (shape [particle_count]) is the number of particle p's piece,
// counted from 0 in the order of their first particles. Returns how many there are.
PLIANT_API int32_t pliant_body_pieces(const pliant_body *body, int32_t *piece);
// 1: a link between corners of the cell that carries this vertex of the surface is broken, so that
// faces at the vertex should not be drawn; 0: none is; -1: no such vertex.
PLIANT_API int32_t pliant_body_is_torn(const pliant_body *body, int32_t vertex);
// Added to what acts on a particle in the next step, N; at once, N s.
PLIANT_CALL pliant_status pliant_body_force(pliant_body *body, int32_t particle, pliant_vec3 force);
PLIANT_CALL pliant_status pliant_body_impulse(pliant_body *body, int32_t particle,
                                              pliant_vec3 impulse);

typedef struct pliant_body_motion {
    double mass;                 // kg
    double centre[3];            // of mass, m
    double momentum[3];          // kg m/s
    double angular_momentum[3];  // about the centre of mass, kg m^2/s
    double kinetic_energy;       // J
} pliant_body_motion;
PLIANT_API pliant_body_motion pliant_body_measure(const pliant_body *body);

// ---- The surface of a lattice body ----
//
// The model's finest level is embedded: vertex X lies in a cell of the rest lattice and moves with
// its eight corners. Its normal is that of the deformed surface, from two tangents U, V at rest:
//
//     x = sum of a_i x_i     u = sum of b_i x_i     v = sum of c_i x_i     n = u x v / |u x v|
//
// over the corners i, with a_i = phi_i(X), b_i = U . grad phi_i(X), c_i = V . grad phi_i(X)
// (LSM-15..17). The faces are the model's (pliant_model_faces).

// Where the body's surface is, shape [vertex_count] each, m; either may be NULL. Normals are unit
// vectors; where the surface has lost its extent, so that it has none, the one at rest. Some 10 ns
// a vertex. Allocates nothing; threads may ask for one body at once while nothing changes it.
// PLIANT_ERR_MISSING: the lattice has no surface.
PLIANT_CALL pliant_status pliant_body_surface(const pliant_body *body, pliant_vec3 *positions,
                                              pliant_vec3 *normals);

// For shaders that do the above: what a vertex goes with.
typedef struct pliant_vertex_weights {
    int32_t particle[8];  // corner k of the cell: + (k & 1, k >> 1 & 1, k >> 2)
    float position[8];    // a_i
    float u[8], v[8];     // b_i, c_i, 1/m
} pliant_vertex_weights;
PLIANT_CALL pliant_status pliant_lattice_vertex(const pliant_lattice *lattice, int32_t vertex,
                                                pliant_vertex_weights *weights);

// A part of the faces whose vertices go with few particles, so that a shader can hold the positions
// of all. Every face is in one batch.
#define PLIANT_BATCH_PARTICLES 128
typedef struct pliant_lattice_batch {
    int32_t face_count, particle_count;  // particle_count is at most PLIANT_BATCH_PARTICLES
    const int32_t *faces;                // shape [face_count]; borrowed until the model is closed
    const int32_t *particles;            // shape [particle_count], ascending; likewise
} pliant_lattice_batch;
PLIANT_CALL pliant_status pliant_lattice_find_batch(const pliant_lattice *lattice, int32_t batch,
                                                    pliant_lattice_batch *found);
// ---- Worlds of lattice bodies ----

// What bodies live in: gravity, obstacles, holds that drag particles about (hands, bones), and each
// other. A world steps its bodies in place of pliant_body_step. Bodies are borrowed from add until
// remove or destroy and may be read and written between steps (impulses, saved positions put back);
// they need not have the same lattice. A world has one user at a time, and no two worlds the same
// body. The same calls give the same bits, whatever the number of threads.
//
// Everything is allocated by create: what has no room later is refused with PLIANT_ERR_CAPACITY.
// Refusals have no effect. Obstacles and holds are numbered by the caller, 0 .. capacity - 1.
typedef struct pliant_world pliant_world;

// Who collides with whom, bits to be added. Balls are a body's outer particles with a radius of
// half a cell. They do not let anything in that moves by less than that in a step, but keep
// surfaces one or two cells apart. What is inside another's surface, because it was fast or because
// there are no balls, is pushed out at a bounded speed, on the undeformed shape's way out.
enum {
    PLIANT_COLLISION_NONE = 0,
    PLIANT_COLLISION_BODIES = 1,    // balls of different bodies
    PLIANT_COLLISION_SELF = 2,      // balls of one body that are more than two cells apart at rest
    PLIANT_COLLISION_SURFACES = 4,  // particles inside the embedded surfaces of other bodies
};

typedef struct pliant_world_def {
    int32_t body_capacity;      // Default 256
    int32_t particle_capacity;  // particles of all bodies together. Default 65536
    int32_t obstacle_capacity;  // Default 64
    int32_t hold_capacity;      // Default 64
    int32_t held_capacity;      // particles in all holds together. Default 4096
    int32_t thread_count;       // 1 .. 64, the caller's among them. Default 1
    pliant_vec3 gravity;        // m/s^2. Default 0, 0, -9.81
    int32_t collision;          // bits. Default PLIANT_COLLISION_BODIES | PLIANT_COLLISION_SURFACES
    // Of bodies with each other: Coulomb's coefficient, 0 .. 10. Default 0.3. Between balls, which
    // have no spin to take up its torque, friction does not keep angular momentum; all else does,
    // and linear momentum is always kept.
    float friction;
} pliant_world_def;
PLIANT_API pliant_world_def pliant_world_default(void);
PLIANT_CALL pliant_status pliant_world_create(const pliant_world_def *def, pliant_world **world,
                                              pliant_error *err);
PLIANT_API void pliant_world_destroy(pliant_world *world);  // before its bodies; NULL is fine

// PLIANT_ERR_ARGUMENT: a body that is in the world already.
PLIANT_CALL pliant_status pliant_world_add(pliant_world *world, pliant_body *body,
                                           pliant_error *err);
PLIANT_CALL pliant_status pliant_world_remove(pliant_world *world,
                                              pliant_body *body);  // its holds let go

PLIANT_CALL pliant_status pliant_world_set_gravity(pliant_world *world, pliant_vec3 acceleration);
PLIANT_CALL pliant_status pliant_world_set_collision(pliant_world *world, int32_t collision,
                                                     float friction);

// Advance by `dt` seconds: forces and shape matching, contacts, holds, motion, fracture. Stable in
// any state. PLIANT_ERR_ARGUMENT: not within 1e-9 .. 1000 s. Places and velocities are accepted up
// to 1e9 m and m/s.
PLIANT_CALL pliant_status pliant_world_step(pliant_world *world, float dt);

// ---- Obstacles ----

typedef enum pliant_obstacle_kind {
    PLIANT_OBSTACLE_NONE = 0,
    PLIANT_OBSTACLE_PLANE = 1,  // solid on the side that its normal points away from
    PLIANT_OBSTACLE_SPHERE = 2,
    PLIANT_OBSTACLE_BOX = 3,
    PLIANT_OBSTACLE_CAPSULE = 4,  // a ball swept along a segment, tapered when the radii differ
} pliant_obstacle_kind;

// A solid that particles stay outside of. It is not moved by them.
typedef struct pliant_obstacle {
    pliant_obstacle_kind kind;
    pliant_vec3 a;      // m; plane: a point on it; sphere, box: centre; capsule: one end
    pliant_vec3 b;      // plane: normal, of any length but 0; capsule: other end, m; box: half its
                        // sides, m. Plane and capsule: where they are before `rotation`
    float radius;       // m, above 0; sphere; capsule at a
    float radius_b;     // m, 0 or more; capsule at b
    float rotation[4];  // x, y, z, w; about a
    pliant_vec3 velocity;  // m/s, of a: it goes on moving with this,
    pliant_vec3 spin;      // rad/s, and turning about a with this
    float friction;        // Coulomb's coefficient, 0 .. 10
    float restitution;     // 0 .. 1, speed after over speed before, of each particle
} pliant_obstacle;
// At the origin and at rest, of unit size (radii, half sides 1), normal and axis along z; friction
// 0.5, restitution 0.
PLIANT_API pliant_obstacle pliant_obstacle_default(pliant_obstacle_kind kind);

// Put obstacle `index` somewhere at once; PLIANT_OBSTACLE_NONE takes it away. Copied. Particles
// that are inside one then come out at a bounded speed.
PLIANT_CALL pliant_status pliant_world_set_obstacle(pliant_world *world, int32_t index,
                                                    const pliant_obstacle *obstacle);
// Move it so that it is there, its point a and its rotation (shape [4], unit; NULL: unchanged), at
// the end of the next step, pushing what is in its way; then it is at rest.
// PLIANT_ERR_MISSING: no such obstacle.
PLIANT_CALL pliant_status pliant_world_move_obstacle(pliant_world *world, int32_t index,
                                                     pliant_vec3 a, const float *rotation);
// As it is now; kind PLIANT_OBSTACLE_NONE: there is none.
PLIANT_API pliant_obstacle pliant_world_obstacle(const pliant_world *world, int32_t index);

// ---- Holds ----

// A hold is a rigid frame with particles bound to it: a hand that has grabbed some, a bone of a
// skeleton. Its particles follow it exactly: at the end of a step they are where the frame has
// them, with its velocity; nothing else moves them. A particle has one hold at most.

// Place a hold with nothing bound to it; one that is there lets go first. `rotation` has shape [4],
// x, y, z, w; NULL: none.
PLIANT_CALL pliant_status pliant_world_set_hold(pliant_world *world, int32_t hold,
                                                pliant_vec3 position, const float *rotation);
// Bind particles where they are now, in the frame as it is now: listed ones (NULL: 0 .. count - 1),
// or those within `radius` of the segment from `a` to `b`, of which `bound` (nullable) tells how
// many. Those that another hold has are taken over. PLIANT_ERR_MISSING: no such hold, or a body
// that is not in the world.
PLIANT_CALL pliant_status pliant_world_bind(pliant_world *world, int32_t hold, pliant_body *body,
                                            const int32_t *particles, int32_t count);
PLIANT_CALL pliant_status pliant_world_bind_near(pliant_world *world, int32_t hold,
                                                 pliant_body *body, pliant_vec3 a, pliant_vec3 b,
                                                 float radius, int32_t *bound);
// All at once: a hold at `position` with the particles within `radius` of it, or, where there are
// none, with the nearest one alone, and then its position is that particle's.
PLIANT_CALL pliant_status pliant_world_grab(pliant_world *world, int32_t hold, pliant_body *body,
                                            pliant_vec3 position, float radius, int32_t *bound);
// Where the frame is at the end of the next step, and stays. Rotation NULL: unchanged.
PLIANT_CALL pliant_status pliant_world_move_hold(pliant_world *world, int32_t hold,
                                                 pliant_vec3 position, const float *rotation);
// Let go; its particles keep their velocity. A number without a hold is fine.
PLIANT_CALL pliant_status pliant_world_let(pliant_world *world, int32_t hold);

// Where a hold is, and how many particles it has; -1: there is none.
typedef struct pliant_hold_info {
    pliant_vec3 position;
    float rotation[4];
    int32_t particle_count;
} pliant_hold_info;
PLIANT_API pliant_hold_info pliant_world_hold(const pliant_world *world, int32_t hold);

// ---- What a world tells ----

// Of all bodies now.
typedef struct pliant_world_sum {
    double mass;                 // kg
    double centre[3];            // m
    double momentum[3];          // kg m/s
    double angular_momentum[3];  // kg m^2/s, about the origin
    double kinetic_energy;       // J
    double potential_energy;     // J, of gravity, 0 at the origin
} pliant_world_sum;
PLIANT_API pliant_world_sum pliant_world_add_up(const pliant_world *world);

// What the last step did; times are monotonic nanoseconds of the calling thread.
typedef struct pliant_world_report {
    int32_t body_count, particle_count, held_count;
    int32_t obstacle_contact_count;  // pairs of a particle and an obstacle that holds it off
    int32_t body_contact_count;     // pairs of balls of different bodies that touch or are about to
    int32_t self_contact_count;     // of one body
    int32_t surface_contact_count;  // particles inside another body's surface
    float narrowing;                // 1; below: so many contacts that balls were taken smaller
    int64_t match_ns;               // forces, shape matching, damping
    int64_t obstacle_ns;            // contacts with obstacles
    int64_t search_ns;              // finding what touches
    int64_t contact_ns;             // contacts among bodies
    int64_t move_ns;                // motion, projection, holds, fracture
    int64_t total_ns;
} pliant_world_report;
PLIANT_API pliant_world_report pliant_world_last(const pliant_world *world);
