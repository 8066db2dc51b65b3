"""Start of a part of an interval: state, step tables, samples of the joints (physics.md section 7)."""

from leg_wear_monitor.dynamics.clearance.contact import A0, E0, V0, accelerate_clearances
from leg_wear_monitor.dynamics.clearance.film_effects import load_spins
from leg_wear_monitor.dynamics.clearance.model import blend, fetch_tables, hold_eccentricities, take_tables
from leg_wear_monitor.dynamics.clearance.step import drift
from leg_wear_monitor.dynamics.clearance.worn_walls import take_directions
from leg_wear_monitor.dynamics.joint.contact_event import DELTA, DELTA_DOT, begin_contact
from leg_wear_monitor.kernel import kernel


@kernel
def load_state(model, surfaces, state, angle, speed, acceleration, ahead, work):
    """Load the state, and the tables at a crank angle [rad] for the eccentricities ``ahead`` [s] later."""
    x, now = work.x, work.now
    take_tables(model.tables, angle, speed, acceleration, now)
    hold_eccentricities(model.tables, angle, state.e, state.v, ahead, now)
    if now.spin.shape[0] > 0:
        points = blend(model.tables.spin.shape[0] - 1, angle)
        load_spins(model.tables, points, state.e, state.v, ahead, now)
    for i in range(state.e.shape[0]):
        x[E0, i], x[V0, i] = state.e[i], state.v[i]
    fetch_tables(model.tables, angle, speed)
    if surfaces.feeds_back:
        take_directions(state.e, now.toward)
    drift(now, x)


@kernel
def sample_start(model, surfaces, state, turned, t, statistics, work):
    """Sample the joints at the start of a step at t [s]; begin contacts that rotating worn walls caused."""
    x, start, now, approach, contacts = work.x, work.start, work.now, state.approach, model.contacts
    accelerate_clearances(model, surfaces, approach, now, turned, x, E0, V0, A0, start, True)
    closed = False
    for k in range(approach.shape[0]):
        if approach[k] == 0.0 and start[DELTA, k] > 0.0 and start[DELTA_DOT, k] > 0.0:
            begin_contact(
                k, contacts.joint, contacts.speed_floor, t, start[DELTA_DOT, k],
                approach, state.recent, statistics.impact, statistics.impacts,
            )  # fmt: skip
            closed = True
    if closed:
        accelerate_clearances(model, surfaces, approach, now, turned, x, E0, V0, A0, start, True)
