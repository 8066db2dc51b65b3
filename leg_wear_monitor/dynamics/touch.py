"""Contacts that begin and end inside a step, found on the cubic of the penetration through its ends.

Both formulations hand over the loose joints as rows of `SAMPLE` columns at a step's start and end.
"""

from leg_wear_monitor.dynamics.dormand_prince import hermite
from leg_wear_monitor.dynamics.tally import begin_impact, end_impact, parabola_peak, raise_peak
from leg_wear_monitor.kernel import kernel

# a sample of a loose joint: eccentricity [m] and its rate, normal force [N], penetration [m] and its rate
EX, EY, VX, VY, F_N, DELTA, DELTA_DOT = 0, 1, 2, 3, 4, 5, 6
SAMPLE = 7

TOUCH = 1.0e-11  # penetration [m] at which a contact counts as just begun
NEVER = 2.0


@kernel
def _delta_at(u, h, start, end):
    """Penetration [m] of one joint at the share u of a step."""
    return hermite(u, h, start[DELTA], start[DELTA_DOT], end[DELTA], end[DELTA_DOT])[0]


@kernel
def _crossing(low, high, rising, h, start, end):
    """Share of a step between low and high at which the penetration changes sign, by bisection."""
    for _ in range(48):
        middle = 0.5 * (low + high)
        if (_delta_at(middle, h, start, end) > 0.0) == rising:
            high = middle
        else:
            low = middle
    return 0.5 * (low + high)


@kernel
def first_touch(approach, h, start, end):
    """Share of a step after which the first of the open joints touches; NEVER if none does.

    ``approach`` (k,) is 0 for open joints; ``start`` and ``end`` (k, SAMPLE). The middle of the step is
    looked at too, for a touch and parting inside it.
    """
    earliest = NEVER
    for k in range(approach.shape[0]):
        if approach[k] == 0.0:
            if start[k, DELTA_DOT] > 0.0 and _delta_at(0.5, h, start[k], end[k]) > TOUCH:
                earliest = min(earliest, _crossing(0.0, 0.5, True, h, start[k], end[k]))
            elif end[k, DELTA] > TOUCH:
                earliest = min(earliest, _crossing(0.5, 1.0, True, h, start[k], end[k]))
    return earliest


@kernel
def update_contacts(contacts, t, h, start, end, approach, recent, tally):
    """After a step from t to t + h: contacts that begin or end, and the peaks of those that go on.

    Changes approach (k,) and recent (k, 4), the last two samples of time and normal force of each joint.
    Returns whether a contact began or ended.
    """
    changed = False
    for k in range(approach.shape[0]):
        joint, delta_dot, force = contacts.joint[k], end[k, DELTA_DOT], end[k, F_N]
        if approach[k] == 0.0:
            if end[k, DELTA] >= -TOUCH and delta_dot > 0.0:
                approach[k] = max(delta_dot, contacts.speed_floor[k])
                begin_impact(tally, joint, t + h, delta_dot)
                recent[k, 0], recent[k, 1], recent[k, 2], recent[k, 3] = t + h, 0.0, t + h, 0.0
                changed = True
            continue
        raise_peak(tally, joint, force)
        if recent[k, 3] >= force and recent[k, 3] >= recent[k, 1] and recent[k, 0] < recent[k, 2]:
            top = parabola_peak(recent[k, 0], recent[k, 1], recent[k, 2], recent[k, 3], t + h, force)
            raise_peak(tally, joint, top)
        recent[k, 0], recent[k, 1], recent[k, 2], recent[k, 3] = recent[k, 2], recent[k, 3], t + h, force
        if end[k, DELTA] <= 0.0 and delta_dot < 0.0:
            end_impact(tally, joint, t + h * _crossing(0.0, 1.0, False, h, start[k], end[k]))
            approach[k] = 0.0
            changed = True
    return changed
