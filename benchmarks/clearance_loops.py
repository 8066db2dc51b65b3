"""Parts of the clearance model, each many times over in a compiled loop.

Every call waits for the result of the one before, as it does in a step: calls that may overlap look cheaper.
The chain is 0, which the compiler does not know.
"""

import math

from leg_wear_monitor.compiled.kernel import entry
from leg_wear_monitor.contact.friction import friction_force
from leg_wear_monitor.contact.normal import normal_force
from leg_wear_monitor.dynamics.clearance.advance import drive_torque, reactions, toe_deviation
from leg_wear_monitor.dynamics.clearance.contact import (
    A0,
    E0,
    FRESH_COEFFICIENT,
    FRICTION_COEFFICIENT,
    FRICTION_LAW,
    HYSTERESIS_FACTOR,
    K1E,
    K1V,
    NORMAL_FORM,
    RAMP_0,
    RAMP_1,
    V0,
    accelerate_clearances,
)
from leg_wear_monitor.dynamics.clearance.film_system import factorise_contacts, solve_contacts
from leg_wear_monitor.dynamics.clearance.model import hold_eccentricities, take_tables
from leg_wear_monitor.dynamics.clearance.step import integrate_joints, shift_start, try_step
from leg_wear_monitor.dynamics.joint import DELTA, first_contact_event, update_contacts
from leg_wear_monitor.wear import deposit_wear

STEP = 1.0e-5  # s


@entry
def floors(count, chain, law, clearance, e, v, inverse_mass, force, out_a):
    for _ in range(count):
        e[0] += chain * out_a[0]
        for i in range(e.shape[0]):
            out_a[i] = 0.0
        for k in range(clearance.shape[0]):
            ex, ey, vx, vy = e[2 * k], e[2 * k + 1], v[2 * k], v[2 * k + 1]
            length = math.sqrt(ex * ex + ey * ey)
            nx, ny = ex / length, ey / length
            f_n, _, _, _ = normal_force(
                law[NORMAL_FORM, k], law[FRESH_COEFFICIENT, k], clearance[k], law[HYSTERESIS_FACTOR, k],
                length - clearance[k], nx * vx + ny * vy,
            )  # fmt: skip
            mu, code, slip = law[FRICTION_COEFFICIENT, k], law[FRICTION_LAW, k], nx * vy - ny * vx
            f_t = friction_force(code, mu, law[RAMP_0, k], law[RAMP_1, k], f_n, slip)
            force[2 * k], force[2 * k + 1] = -f_n * nx - f_t * ny, -f_n * ny + f_t * nx
        for j in range(e.shape[0]):
            for i in range(e.shape[0]):
                out_a[i] += inverse_mass[j, i] * force[j]


@entry
def trials(count, chain, model, surfaces, state, work):
    x, now, system = work.x, work.now, work.system
    for _ in range(count):
        error = try_step(model, surfaces, state.approach, STEP, 0.0, now, system, x, work.start, work.end)
        x[E0, 0] += chain * min(error, 1.0)


@entry
def evaluations(count, chain, model, surfaces, state, work):
    x = work.x
    for _ in range(count):
        accelerate_clearances(model, surfaces, state.approach, work.now, 0.0, x, E0, V0, A0, work.start, True)
        x[E0, 0] += chain * x[A0, 0]


@entry
def factorisations(count, chain, model, state, work):
    m, now = state.approach.shape[0], work.now
    for _ in range(count):
        h = STEP + chain * work.system.rows[m - 1, 0]
        factorise_contacts(h, now.inverse_mass, now.speed[0], work.start, work.system)


@entry
def solutions(count, chain, model, state, work):
    m, x = state.approach.shape[0], work.x
    for _ in range(count):
        solve_contacts(STEP, work.system, m, 1.0, x, V0, A0, K1E, K1V)
        x[A0, 0] += chain * x[K1E, 0]


@entry
def integrals(count, chain, model, state, work, added):
    for _ in range(count):
        h = STEP + chain * added[0, 0]
        integrate_joints(model, state.approach, h, work.start, work.end, added)


@entry
def touches(count, chain, model, state, work, contacts, statistics):
    for _ in range(count):
        fraction = first_contact_event(state.approach, STEP, work.start, work.end)
        update_contacts(
            contacts.joint, contacts.speed_floor, 0.0, STEP + chain * fraction, work.start, work.end,
            state.approach, state.recent, statistics.peak, statistics.impact, statistics.impacts,
        )  # fmt: skip
        work.end[DELTA, 0] += chain * statistics.peak[0]


@entry
def shifts(count, chain, model, state, work):
    for _ in range(count):
        shift_start(work.now, work.x)
        work.x[V0, 0] += chain * work.x[A0, 0]


@entry
def torques(count, chain, model, state, work):
    for _ in range(count):
        work.x[A0, 0] += chain * drive_torque(work.now, work.x, work.start)[0]


@entry
def toes(count, chain, model, state, work, statistics):
    for _ in range(count):
        toe_deviation(work.now, work.x, statistics.response)
        work.x[A0, 0] += chain * statistics.response[2]


@entry
def tables(count, chain, model, state, work):
    for i in range(count):
        angle = 0.003 * i + chain * work.now.row[0]
        take_tables(model.tables, angle, work.now.speed[0], 0.0, work.now)
        hold_eccentricities(model.tables, angle, state.e, state.v, 0.0, work.now)


@entry
def ideal_reactions(count, chain, model, state, work):
    for i in range(count):
        angle = 0.003 * i + chain * work.reaction[0]
        reactions(model.tables, angle, work.now, work.x, work.start, work.by, work.reaction)


@entry
def wear(count, chain, model, surfaces, state, work):
    for _ in range(count):
        ex, ey = state.e[0] + chain * surfaces.depth[0, 0, 0], state.e[1]
        deposit_wear(model.contacts, surfaces, 0, ex, ey, 0.0, 0.0, 1.0e-9, work.weight)
