// contact_forces.c: with what force tools push their nodes, and the solver's part in it.
#include "contact.h"

#include "pliant/vector_clones.h"

#include <math.h>
#include <string.h>

// Friction is solved to this part of the tolerance, in at most so many sweeps: from frame to frame
// few contacts change, and from nothing tests need up to 25.
static const double friction_part = 2e-3;
enum { sweep_limit = 60 };
// A sliding contact is on its cone to this; the law's residual is in its force.
static const double on_cone = 1 - 1e-3;

static double dot(const double *a, const double *b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

// ---- Compliance ----

static int32_t same_node(pliant_node a, pliant_node b)
{
    return a.level == b.level && a.vertex == b.vertex;
}

// Is what the solver holds what it held when the compliance was made?
static int32_t same_held(const pliant_contact *contact)
{
    const pliant_solver *solver = contact->solver;
    if (solver->solved_count != contact->held_count) return 0;
    for (int32_t i = 0; i < solver->solved_count; i++)
        if (!same_node(solver->solved[i].node, contact->held[i])) return 0;
    return 1;
}

// Index of the pairs' nodes among those of the compliance; 0 when one is not there.
static int32_t index_pairs(pliant_contact *contact)
{
    for (int32_t i = 0; i < contact->pair_count; i++) {
        pliant_contact_pair *pair = &contact->pairs[i];
        pair->index = contact->node_of[pair->node.vertex];
        if (pair->index < 0 || contact->nodes[pair->index].level != pair->node.level) return 0;
    }
    return 1;
}

static void list_nodes(pliant_contact *contact)
{
    for (int32_t i = 0; i < contact->node_count; i++)
        contact->node_of[contact->nodes[i].vertex] = -1;
    contact->node_count = 0;
    for (int32_t i = 0; i < contact->pair_count; i++) {
        const pliant_node node = contact->pairs[i].node;
        if (contact->node_of[node.vertex] >= 0) continue;
        contact->node_of[node.vertex] = contact->node_count;
        contact->nodes[contact->node_count++] = node;
    }
}

// A list that holds more nodes than the pairs' will do.
static void index_nodes(pliant_contact *contact)
{
    if (index_pairs(contact)) return;
    list_nodes(contact);
    (void)index_pairs(contact);
    contact->is_compliance_known = 0;
}

static void update_compliance(pliant_contact *contact)
{
    index_nodes(contact);
    if (contact->is_compliance_known && same_held(contact)) return;
    const int64_t begin = pliant_clock_ns();
    // Nodes that no pair has any more may be held now.
    list_nodes(contact);
    (void)index_pairs(contact);
    const pliant_solver *solver = contact->solver;
    contact->held_count = solver->solved_count;
    for (int32_t i = 0; i < solver->solved_count; i++) contact->held[i] = solver->solved[i].node;
    contact->is_compliance_known =
        pliant_solver_compliance(contact->solver, contact->nodes, contact->node_count,
                                 contact->compliance) >= 0;
    contact->report.compliance_ns += pliant_clock_ns() - begin;
}

// ---- The law ----

// An orthonormal frame of a normal (Duff et al., Building an orthonormal basis, revisited, 2017).
static void make_frame(const double *n, double *frame)
{
    const double sign = n[2] < 0 ? -1 : 1;
    const double a = -1 / (sign + n[2]), b = n[0] * n[1] * a;
    memcpy(frame, n, 3 * sizeof *frame);
    frame[3] = 1 + sign * n[0] * n[0] * a;
    frame[4] = sign * b;
    frame[5] = -sign * n[0];
    frame[6] = b;
    frame[7] = sign + n[1] * n[1] * a;
    frame[8] = -n[1];
}

// Forces on nodes: the sum over the tools that push them.
static void sum_forces(pliant_contact *contact)
{
    memset(contact->node_force, 0, 3 * (size_t)contact->node_count * sizeof(double));
    for (int32_t i = 0; i < contact->pair_count; i++) {
        const pliant_contact_pair *pair = &contact->pairs[i];
        for (int c = 0; c < 3; c++)
            contact->node_force[3 * pair->index + c] += pair->area * pair->pressure[c];
    }
}

// u = W f, of a symmetric W whose rows are its columns.
PLIANT_VECTOR_CLONES
static void respond(size_t n, const double *restrict w, const double *restrict f,
                    double *restrict u)
{
    memset(u, 0, n * sizeof *u);
    for (size_t j = 0; j < n; j++) {
        if (f[j] == 0) continue;
        for (size_t i = 0; i < n; i++) u[i] += w[j * n + i] * f[j];
    }
}

// Three rows of n along an axis.
PLIANT_VECTOR_CLONES
static void combine(size_t n, const double *restrict rows, const double *restrict axis,
                    double *restrict along)
{
    for (size_t k = 0; k < n; k++)
        along[k] = axis[0] * rows[k] + axis[1] * rows[k + n] + axis[2] * rows[k + 2 * n];
}

// The rows of a pair in the problem's matrix, in the pairs' frames: `size` of them. It is
// symmetric, but half of it written across rows would take longer than all of it along them.
static void assemble_rows(pliant_contact *contact, int32_t i, int size)
{
    const size_t n = 3 * (size_t)contact->node_count;
    const double *rows = contact->compliance + 3 * (size_t)contact->pairs[i].index * n;
    double *to =
        contact->matrix + (size_t)size * (size_t)i * (size_t)size * (size_t)contact->pair_count;
    for (int r = 0; r < size; r++) {
        combine(n, rows, contact->frames + 9 * (size_t)i + 3 * r, contact->row);
        for (int32_t j = 0; j < contact->pair_count; j++) {
            const double *at = contact->row + 3 * (size_t)contact->pairs[j].index;
            const double *frame = contact->frames + 9 * (size_t)j;
            *to++ = dot(at, frame);
            if (size == 1) continue;
            *to++ = dot(at, frame + 3);
            *to++ = dot(at, frame + 6);
        }
    }
}

// gap = b + A f: `size` 1 is normal only, 3 with the slip. A is symmetric.
static void assemble(pliant_contact *contact, int size)
{
    sum_forces(contact);
    respond(3 * (size_t)contact->node_count, contact->compliance, contact->node_force,
            contact->node_shift);
    for (int32_t i = 0; i < contact->pair_count; i++) {
        pliant_contact_pair *pair = &contact->pairs[i];
        const double *u = contact->node_shift + 3 * (size_t)pair->index;
        double *frame = contact->frames + 9 * (size_t)i, lag[3], force[3];
        make_frame(pair->normal, frame);
        memcpy(pair->pushed_along, pair->normal, sizeof pair->normal);
        for (int c = 0; c < 3; c++) {
            lag[c] = pair->x[c] - pair->anchor[c] - u[c];
            force[c] = pair->area * pair->pressure[c];
        }
        contact->friction[i] = contact->reached[pair->tool].friction;
        contact->b[(size_t)size * (size_t)i] = pair->gap + pair->offset - dot(frame, u);
        for (int c = 0; c < size; c++) {
            const size_t at = (size_t)size * (size_t)i + (size_t)c;
            contact->force[at] = dot(frame + 3 * c, force);
            if (c > 0) contact->b[at] = dot(frame + 3 * c, lag);
        }
    }
    for (int32_t i = 0; i < contact->pair_count; i++) assemble_rows(contact, i, size);
}

static int32_t has_friction(const pliant_contact *contact)
{
    for (int32_t i = 0; i < contact->pair_count; i++)
        if (contact->reached[contact->pairs[i].tool].friction > 0) return 1;
    return 0;
}

// From the pairs' frames to tractions.
static void take_forces(pliant_contact *contact, int size)
{
    for (int32_t i = 0; i < contact->pair_count; i++) {
        pliant_contact_pair *pair = &contact->pairs[i];
        const double *frame = contact->frames + 9 * (size_t)i;
        const double *force = contact->force + (size_t)size * (size_t)i;
        double pressure[3] = {0};
        for (int c = 0; c < size; c++)
            for (int k = 0; k < 3; k++) pressure[k] += force[c] * frame[3 * c + k] / pair->area;
        const double tangential = size == 3 ? hypot(force[1], force[2]) : 0;
        pair->is_sliding = force[0] > 0 && tangential >= on_cone * contact->friction[i] * force[0];
        // Tools so deep that floats overflow push nothing.
        const double square = dot(pressure, pressure);
        if (!(square < 1e37 * 1e37)) memset(pressure, 0, sizeof pressure);
        memcpy(pair->pressure, pressure, sizeof pressure);
    }
}

// Contact has ended, and with it what its compliance was raised by.
static void forget_compliance(pliant_contact *contact)
{
    list_nodes(contact);
    contact->is_compliance_known = 0;
    if (pliant_solver_compliance(contact->solver, NULL, 0, NULL) < 0) return;
}

void pliant_contact_apply_law(pliant_contact *contact)
{
    if (contact->pair_count == 0) {
        if (contact->is_compliance_known) forget_compliance(contact);
        return;
    }
    update_compliance(contact);
    if (!contact->is_compliance_known) {  // not that nodes of ours could be refused
        for (int32_t i = 0; i < contact->pair_count; i++)
            memset(contact->pairs[i].pressure, 0, sizeof contact->pairs[i].pressure);
        return;
    }
    const int64_t begin = pliant_clock_ns();
    pliant_contact_law_report report;
    const int size = has_friction(contact) ? 3 : 1;
    assemble(contact, size);
    if (size == 1)
        report = pliant_contact_law_push(&contact->law, contact->pair_count, contact->matrix,
                                         contact->b, contact->force);
    else
        report = pliant_contact_law_rub(
            &contact->law, contact->pair_count, contact->matrix, contact->b, contact->friction,
            friction_part * contact->def.tolerance, sweep_limit, contact->force);
    take_forces(contact, size);
    contact->report.pivots += report.count;
    contact->report.law_ns += pliant_clock_ns() - begin;
}

double pliant_contact_residual(const pliant_contact *contact)
{
    double most = 0;
    for (int32_t i = 0; i < contact->pair_count; i++) {
        const pliant_contact_pair *pair = &contact->pairs[i];
        const double gap = pair->gap + pair->offset;
        if (!pliant_contact_is_pushed(pair)) {
            most = fmax(most, -gap);
            continue;
        }
        most = fmax(most, fabs(gap));
        if (pair->is_sliding) continue;
        double slip[3];
        for (int c = 0; c < 3; c++) slip[c] = pair->x[c] - pair->anchor[c];
        const double along = dot(slip, pair->normal);
        most = fmax(most, sqrt(fmax(dot(slip, slip) - along * along, 0)));
    }
    return most;
}

double pliant_contact_turn(const pliant_contact *contact)
{
    double most = 0;
    for (int32_t i = 0; i < contact->pair_count; i++) {
        const pliant_contact_pair *pair = &contact->pairs[i];
        if (!pliant_contact_is_pushed(pair)) continue;
        double turn[3];
        for (int c = 0; c < 3; c++) turn[c] = pair->normal[c] - pair->pushed_along[c];
        most = fmax(most, sqrt(dot(turn, turn)));
    }
    return most;
}

// ---- Loads ----

static int32_t same_value(pliant_vec3 a, pliant_vec3 b)
{
    return a.x == b.x && a.y == b.y && a.z == b.z;
}

void pliant_contact_check_loads(pliant_contact *contact)
{
    const pliant_solver *solver = contact->solver;
    int32_t kept = 0;
    for (int32_t i = 0; i < contact->load_count; i++) {
        const pliant_contact_load load = contact->loads[i];
        const int32_t at = solver->load_of[load.node.vertex];
        if (at < 0 || !solver->loads[at].is_specified ||
            !same_node(solver->loads[at].node, load.node) ||
            !same_value(solver->loads[at].value, load.traction))
            continue;
        contact->loads[kept++] = load;
    }
    contact->load_count = kept;
    const int32_t room = solver->load_capacity - (solver->specified_count - kept);
    contact->room = room < contact->def.node_capacity ? room : contact->def.node_capacity;
}

static void state_load(pliant_contact *contact, pliant_node node, pliant_vec3 traction)
{
    if (pliant_solver_press(contact->solver, node, traction) < 0) return;
    contact->loads[contact->load_count++] = (pliant_contact_load){node, traction};
}

void pliant_contact_press(pliant_contact *contact, int64_t deadline)
{
    // The traction of every node in `nodes`, and which of these the solver has already.
    pliant_vec3 *traction = contact->traction;
    index_nodes(contact);
    memset(traction, 0, (size_t)contact->node_count * sizeof *traction);
    for (int32_t i = 0; i < contact->pair_count; i++) {
        const pliant_contact_pair *pair = &contact->pairs[i];
        traction[pair->index].x += (float)pair->pressure[0];
        traction[pair->index].y += (float)pair->pressure[1];
        traction[pair->index].z += (float)pair->pressure[2];
    }
    int32_t kept = 0;
    for (int32_t i = 0; i < contact->load_count; i++) {
        pliant_contact_load load = contact->loads[i];
        const int32_t index = contact->node_of[load.node.vertex];
        if (index >= 0 && same_node(contact->nodes[index], load.node) &&
            !same_value(traction[index], (pliant_vec3){0, 0, 0})) {
            if (!same_value(traction[index], load.traction) &&
                pliant_solver_press(contact->solver, load.node, traction[index]) >= 0)
                load.traction = traction[index];
            traction[index] = (pliant_vec3){0, 0, 0};
            contact->loads[kept++] = load;
        } else if (pliant_solver_release(contact->solver, load.node) < 0) {
            contact->loads[kept++] = load;  // not that a node of ours could be refused
        }
    }
    contact->load_count = kept;
    for (int32_t i = 0; i < contact->node_count; i++)
        if (!same_value(traction[i], (pliant_vec3){0, 0, 0}))
            state_load(contact, contact->nodes[i], traction[i]);

    const int64_t begin = pliant_clock_ns();
    contact->solver_status = pliant_solver_solve(contact->solver, deadline);
    contact->report.solve_ns += pliant_clock_ns() - begin;
}
