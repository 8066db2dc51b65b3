"""The real-time motion: interval by interval, sub-stepped inside, each impact met where it begins.

The state exists at whole intervals of time. Inside one the tables are held at its middle, and steps
adapt to a local error (Rosenbrock, order 2); so the state does not depend on how the time axis was cut
into calls, and a call costs at most its intervals times a bounded number of steps.
"""

import math

from leg_wear_monitor.dynamics.clearance import ANGLE, crank_between, take_tables
from leg_wear_monitor.dynamics.clearance_contact import F_T, TO_X, accelerate_clearances, follow_clearance, look_around
from leg_wear_monitor.dynamics.clearance_step import (
    A0,
    A1,
    DRIFT,
    E1,
    V1,
    add_drive,
    add_joints,
    drift,
    drive_torque,
    external_power_now,
    gather_wear,
    reaction,
    toe_deviation,
    try_step,
    wear_off,
)
from leg_wear_monitor.dynamics.drive import drive_at
from leg_wear_monitor.dynamics.run import DONE, INVALID_DRIVE, PUSHED_THROUGH, STEP_TOO_SMALL
from leg_wear_monitor.dynamics.tally import FORCE, FORCE_SQUARED, bin_of
from leg_wear_monitor.dynamics.touch import DELTA, F_N, NEVER, first_touch, update_contacts
from leg_wear_monitor.kernel import kernel
from leg_wear_monitor.wear.surfaces import Surfaces

MOST_TRIALS = 20000  # steps tried in an interval before it is given up

_SHORTEST_STEP = 1.0e-13  # s
_RENEWAL = 4  # intervals between two looks at the surfaces and at the reactions of the ideal joints
_FASTEST = 1.0e4  # rad/s and, over an interval, rad/s^2: a drive beyond is not a leg's


@kernel
def advance_clearances(model, feeds_back, state, polynomial, t_end, tally, work):
    """Advance the state by all whole intervals up to t_end [s] and add to the tally.

    ``polynomial`` (7,) is the crank's motion from the last time reached to t_end.

    Returns
    -------
    status, k
        DONE, or why it stopped and the loose joint concerned (-1 if none). The state is then that of the
        last whole interval, finite and good to go on from.
    """
    surfaces = Surfaces(state.depth, feeds_back)
    while (state.index[0] + 1.0) * model.interval <= t_end * (1.0 + 1.0e-12) + 1.0e-15:
        copy_motion(state, work.backup)
        status, k = _interval(model, surfaces, state, polynomial, tally, work)
        if status != DONE:
            copy_motion(work.backup, state)
            return status, k
    return DONE, -1


@kernel
def copy_motion(source, out_state):
    """Copy all of a state but its surfaces, which only a finished interval changes."""
    out_state.index[:] = source.index
    out_state.e[:] = source.e
    out_state.v[:] = source.v
    out_state.drive[:] = source.drive
    out_state.step[:] = source.step
    out_state.approach[:] = source.approach
    out_state.recent[:] = source.recent
    out_state.local[:] = source.local
    out_state.pending[:] = source.pending


@kernel
def _interval(model, surfaces, state, polynomial, tally, work):
    """One interval, from whole instant to whole instant."""
    x, now, contacts, interval = work.vectors, work.now, model.contacts, model.interval
    began = state.index[0] * interval
    before = work.backup.drive
    drive_at(polynomial, (state.index[0] + 1.0) * interval, state.drive)
    angle, speed, acceleration = crank_between(before, state.drive, interval)
    if not (abs(speed) < _FASTEST and abs(acceleration) * interval < _FASTEST):
        return INVALID_DRIVE, -1
    take_tables(model.tables, angle, speed, acceleration, now)
    _begin(model, surfaces, state, work)
    tally.time[0] += interval
    done, trials, cut = 0.0, 0, NEVER
    torque = drive_torque(now, speed, acceleration, x[A0], state.v, work.start)
    while done < interval:
        h = min(state.step[0], interval - done)
        if h < interval - done < 2.0 * h and cut == NEVER:
            h = 0.5 * (interval - done)
        if cut < 1.0:
            h = cut
        ends = h >= (interval - done) * (1.0 - 1.0e-9)
        error = try_step(model, state, h, work)
        trials += 1
        if not error <= 1.0:
            state.step[0] = h * max(0.2, 0.9 * error ** (-1.0 / 3.0)) if error < 1.0e9 else 0.1 * h
            cut = NEVER
            if state.step[0] < _SHORTEST_STEP or trials > MOST_TRIALS:
                return STEP_TOO_SMALL, _deepest(contacts, work.end)
            continue
        share = first_touch(state.approach, h, work.start, work.end)
        if share < 1.0 and share * h > _SHORTEST_STEP and trials <= MOST_TRIALS:
            cut = share * h
            continue
        if cut == NEVER:
            state.step[0] = h * min(3.0, 0.9 * max(error, 1.0e-6) ** (-1.0 / 3.0))
        cut = NEVER
        deepest = _deepest(contacts, work.end)
        if deepest >= 0:
            return PUSHED_THROUGH, deepest
        torque = _take(model, surfaces, state, began + done, h, speed, acceleration, torque, tally, work)
        done = interval if ends else done + h
    state.index[0] += 1.0
    _finish(model, surfaces, state, speed, acceleration, tally, work)
    return DONE, -1


@kernel
def _begin(model, surfaces, state, work):
    """Sample the joints under the tables now, the first stage of the first step."""
    contacts, now, x = model.contacts, work.now, work.vectors
    for k in range(state.approach.shape[0]):
        unknown = math.isnan(state.local[k, TO_X])
        if unknown or (surfaces.feeds_back and (int(state.index[0]) + k) % _RENEWAL == 0):
            ex, ey = state.e[2 * k], state.e[2 * k + 1]
            length = math.hypot(ex, ey)
            nx, ny = (ex / length, ey / length) if length > 0.0 else (1.0, 0.0)
            look_around(contacts, surfaces, k, nx, ny, now.angle[k, 0], now.angle[k, 1], state.local[k])
    drift(now, state.v, x[DRIFT])
    accelerate_clearances(
        contacts, state.local, state.approach, state.e, state.v, now, x[DRIFT], work.start, x[A0]
    )


@kernel
def _deepest(contacts, sample):
    """First loose joint whose journal is pushed further than a tenth of the bushing's radius, else -1."""
    for k in range(sample.shape[0]):
        if not sample[k, DELTA] < 0.1 * contacts.bushing_radius[k]:
            return k
    return -1


@kernel
def _take(model, surfaces, state, t, h, speed, acceleration, torque, tally, work):
    """Take the trial step: sums, contacts, wear. Returns the drive torque at its end."""
    x, now, contacts = work.vectors, work.now, model.contacts
    power = external_power_now(model.tables, now, speed, state.v)
    add_joints(contacts, work.start, 0.5 * h, tally)
    add_drive(torque, speed, power, 0.5 * h, tally)
    update_contacts(contacts, t, h, work.start, work.end, state.approach, state.recent, tally)
    gather_wear(h, work.start, work.end, state.pending)
    state.e[:] = x[E1]
    state.v[:] = x[V1]
    for i in range(state.v.shape[0]):
        x[A0, i] = x[A1, i] - x[DRIFT, i]
    drift(now, state.v, x[DRIFT])
    for i in range(state.v.shape[0]):
        x[A0, i] += x[DRIFT, i]
    work.start[:] = work.end
    follow_clearance(contacts, surfaces, work.start, now.angle, state.local)
    torque = drive_torque(now, speed, acceleration, x[A0], state.v, work.start)
    power = external_power_now(model.tables, now, speed, state.v)
    add_joints(contacts, work.start, 0.5 * h, tally)
    add_drive(torque, speed, power, 0.5 * h, tally)
    toe_deviation(now, speed, acceleration, state.e, state.v, x[A0], torque, tally.response)
    return torque


@kernel
def _finish(model, surfaces, state, speed, acceleration, tally, work):
    """At the end of an interval: wear, distributions, and the reactions of the ideal joints."""
    contacts, now, x = model.contacts, work.now, work.vectors
    renew = int(state.index[0]) % _RENEWAL == 0
    for k in range(state.approach.shape[0]):
        if renew or state.approach[k] == 0.0:
            wear_off(contacts, surfaces, k, now.angle[k], state.pending[k], work.weight)
        force = math.hypot(work.start[k, F_N], work.start[k, F_T])
        tally.force_time[contacts.joint[k], bin_of(force)] += model.interval
    torque = drive_torque(now, speed, acceleration, x[A0], state.v, work.start)
    tally.torque_time[1 if torque > 0.0 else 0, bin_of(abs(torque))] += model.interval
    if renew:
        reaction(model.tables, state.drive[ANGLE], speed, acceleration, x[A0], state.v, work.start, work.reaction)
        _add_reactions(model.tables.reaction_joint, work.reaction, _RENEWAL * model.interval, tally)


@kernel
def _add_reactions(joints, reaction, weight, tally):
    """Add the reactions of the ideal joints, which stand for a time ``weight`` [s]; rows as in the tables."""
    row = 1
    while row < joints.shape[0]:
        joint = joints[row]
        squared = reaction[row] ** 2
        row += 1
        if row < joints.shape[0] and joints[row] == joint:
            squared += reaction[row] ** 2
            row += 1
        force = math.sqrt(squared)
        tally.integral[joint, FORCE] += weight * force
        tally.integral[joint, FORCE_SQUARED] += weight * squared
        tally.peak[joint] = max(tally.peak[joint], force)
        tally.force_time[joint, bin_of(force)] += weight
