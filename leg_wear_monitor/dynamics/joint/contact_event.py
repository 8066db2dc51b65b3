"""Contact events: begin and end of contact inside a step, on the penetration's cubic Hermite interpolant.

The kernels take samples (SAMPLE, k) of the clearance joints at the start and at the end of a step.
The contact begins where the penetration of physics.md section 3 becomes positive.
"""

from leg_wear_monitor.dynamics.run.dormand_prince import hermite
from leg_wear_monitor.dynamics.run.run_statistics import begin_impact, end_impact, parabola_peak, raise_peak
from leg_wear_monitor.kernel import kernel

# rows of a sample: eccentricity [m], its rate [m/s], normal force [N], penetration [m], its rate [m/s]
EX, EY, VX, VY, F_N, DELTA, DELTA_DOT = 0, 1, 2, 3, 4, 5, 6
SAMPLE = 7

CONTACT_EVENT = 1.0e-11  # penetration [m] at which a contact counts as just begun
NEVER = 2.0

_CLOSE = 1.0e-14  # tolerance of a crossing, as a fraction of the step


@kernel
def _crossing(low, high, rising, h, k, start, end):
    """Fraction of a step, between low and high, at which the penetration of joint k changes sign.

    Newton's iteration, with bisection where Newton's step leaves the bracket. h is the length of the step
    [s].
    """
    u = 0.5 * (low + high)
    for _ in range(48):
        delta, rate = hermite(u, h, start[DELTA, k], start[DELTA_DOT, k], end[DELTA, k], end[DELTA_DOT, k])
        if (delta > 0.0) == rising:
            high = u
        else:
            low = u
        last, u = u, u - delta / (h * rate)
        if not low < u < high:
            u = 0.5 * (low + high)
        if abs(u - last) < _CLOSE:
            break
    return u


@kernel
def _delta_at(u, h, k, start, end):
    """Penetration [m] of joint k at the fraction u of a step of length h [s]."""
    return hermite(u, h, start[DELTA, k], start[DELTA_DOT, k], end[DELTA, k], end[DELTA_DOT, k])[0]


@kernel
def first_contact_event(approach, h, start, end):
    """Fraction of a step after which the first open joint comes into contact; NEVER if none does.

    ``approach`` (k,) [m/s] is 0 for open joints; ``start`` and ``end`` (SAMPLE, k) are samples. The middle of
    the step is checked too, for a contact that begins and ends inside the step.
    """
    earliest = NEVER
    for k in range(approach.shape[0]):
        if approach[k] == 0.0 and start[DELTA, k] <= CONTACT_EVENT:
            if start[DELTA_DOT, k] > 0.0 and _delta_at(0.5, h, k, start, end) > CONTACT_EVENT:
                earliest = min(earliest, _crossing(0.0, 0.5, True, h, k, start, end))
            elif end[DELTA, k] > CONTACT_EVENT:
                earliest = min(earliest, _crossing(0.5, 1.0, True, h, k, start, end))
    return earliest


@kernel
def begin_contact(k, joint, speed_floor, t, rate, approach, recent, impact, impacts):
    """Begin a contact in clearance joint k at time t [s]; ``rate`` [m/s] is that of the penetration.

    Changes approach (k,) [m/s], recent (k, 4) [s, N, s, N], and the run statistics' impact and impacts.
    """
    approach[k] = max(rate, speed_floor[k])
    begin_impact(impact, impacts, joint[k], t, rate)
    recent[k, 0], recent[k, 1], recent[k, 2], recent[k, 3] = t, 0.0, t, 0.0


@kernel
def update_contacts(joint, speed_floor, t, h, start, end, approach, recent, peak, impact, impacts):
    """Process the contacts after a step from t to t + h [s]: beginnings, ends, and force peaks.

    Changes approach (k,) [m/s] and recent (k, 4), the last two samples of time [s] and normal force [N] of
    each joint, and the run statistics' peak, impact and impacts. Returns whether a contact began or ended.
    """
    changed = False
    for k in range(approach.shape[0]):
        rate, force = end[DELTA_DOT, k], end[F_N, k]
        if approach[k] == 0.0:
            # a rotating worn profile can come into contact with a journal that does not approach it
            nearer = rate > 0.0 or end[DELTA, k] > start[DELTA, k]
            if end[DELTA, k] >= -CONTACT_EVENT and nearer:
                begin_contact(k, joint, speed_floor, t + h, rate, approach, recent, impact, impacts)
                changed = True
            continue
        top = force
        if recent[k, 3] >= force and recent[k, 3] >= recent[k, 1] and recent[k, 0] < recent[k, 2]:
            top = parabola_peak(recent[k, 0], recent[k, 1], recent[k, 2], recent[k, 3], t + h, force)
        raise_peak(peak, impact, impacts, joint[k], top)
        recent[k, 0], recent[k, 1], recent[k, 2], recent[k, 3] = recent[k, 2], recent[k, 3], t + h, force
        if end[DELTA, k] <= 0.0 and rate < 0.0:
            end_impact(impact, impacts, joint[k], t + h * _crossing(0.0, 1.0, False, h, k, start, end))
            approach[k] = 0.0
            changed = True
    return changed


@kernel
def pushed_through(bushing_radius, sample):
    """First clearance joint with a penetration of more than a tenth of the bushing's radius, else -1."""
    for k in range(bushing_radius.shape[0]):
        if not sample[DELTA, k] < 0.1 * bushing_radius[k]:
            return k
    return -1
