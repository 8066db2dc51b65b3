"""What a step in clearance coordinates starts from: state, clearances around it, samples of the joints."""

import math

from leg_wear_monitor.dynamics.clearance_contact import (
    A0,
    CLEARANCE,
    E0,
    TO_X,
    TO_Y,
    V0,
    accelerate_clearances,
    has_turned,
    look_around,
)
from leg_wear_monitor.dynamics.clearance_step import drift
from leg_wear_monitor.dynamics.touch import DELTA, DELTA_DOT, EX, EY, begin_contact
from leg_wear_monitor.kernel import kernel

RENEWAL = 2  # intervals between two looks at the surfaces and at the reactions of the ideal joints

_NEAR = 0.3  # of the clearance: how near a worn wall must be to matter, when it is taken on trust
_FAR = 0.05  # rad around where the wall was looked up in which its curvature may be trusted


@kernel
def load_state(model, surfaces, state, work):
    """Load the state, and the clearances and the drift that go with it under the tables now."""
    x, now = work.x, work.now
    for k in range(state.approach.shape[0]):
        turn = (int(state.intervals[0]) + k) % RENEWAL == 0
        if math.isnan(state.local[k, TO_X]) or (surfaces.feeds_back and turn):
            ex, ey = state.e[2 * k], state.e[2 * k + 1]
            length = math.hypot(ex, ey)
            nx, ny = (ex / length, ey / length) if length > 0.0 else (1.0, 0.0)
            beyond = -0.5 * now.speed[0] * model.interval  # the tables are those of the interval's middle
            look_around(model.contacts, surfaces, k, nx, ny, now, beyond, state.local)
    for i in range(state.e.shape[0]):
        x[E0, i], x[V0, i] = state.e[i], state.v[i]
    drift(now, x)


@kernel
def sample_start(model, state, t, tally, work):
    """Sample the joints where a step starts; contact begins where a clearance newly looked up is closed."""
    x, start, contacts = work.x, work.start, model.contacts
    accelerate_clearances(model.law, state.local, state.approach, work.now, 0.0, x, E0, V0, A0, start)
    closed = False
    for k in range(state.approach.shape[0]):
        if state.approach[k] == 0.0 and start[k, DELTA] > 0.0 and start[k, DELTA_DOT] > 0.0:
            begin_contact(
                k, contacts.joint, contacts.speed_floor, t, start[k, DELTA_DOT],
                state.approach, state.recent, tally.impact, tally.impacts,
            )  # fmt: skip
            closed = True
    if closed:
        accelerate_clearances(model.law, state.local, state.approach, work.now, 0.0, x, E0, V0, A0, start)


@kernel
def follow_clearances(contacts, surfaces, sample, now, beyond, local):
    """Look up the clearance of the joints that have turned away from where it was known, if any."""
    found = False
    for k in range(sample.shape[0]):
        ex, ey = sample[k, EX], sample[k, EY]
        length = math.hypot(ex, ey)
        if length > 0.0 and has_turned(k, ex / length, ey / length, local):
            look_around(contacts, surfaces, k, ex / length, ey / length, now, beyond, local)
            found = True
    return found


@kernel
def strays(sample, local):
    """Whether a joint comes near its wall so far from where that is known that it might be elsewhere."""
    for k in range(sample.shape[0]):
        if sample[k, DELTA] > -_NEAR * local[k, CLEARANCE]:
            ex, ey = sample[k, EX], sample[k, EY]
            across = local[k, TO_X] * ey - local[k, TO_Y] * ex
            if abs(across) > _FAR * math.hypot(ex, ey):
                return True
    return False
