"""The leg in clearance coordinates: its model, its state, its tables at the present crank angle."""

import math
from typing import NamedTuple

import numpy as np

from leg_wear_monitor.contact.arrays import ContactArrays
from leg_wear_monitor.dynamics.clearance_contact import COLUMNS, LOCAL, TO_X
from leg_wear_monitor.dynamics.clearance_tables import ClearanceTables
from leg_wear_monitor.dynamics.rosenbrock import ContactSystem, contact_system
from leg_wear_monitor.kernel import kernel
from leg_wear_monitor.mechanism.arrays import Floats

ANGLE, SPEED, ACCELERATION = 0, 1, 2
VECTORS = 13


class ClearanceModel(NamedTuple):
    """What does not change during a run.

    ``interval`` [s] between the instants at which the tables are taken and the drive is asked: the state
    exists at whole numbers of them. ``tolerance`` (2,) local error allowed in a step, of eccentricities
    [m] and of their rates [m/s].
    """

    contacts: ContactArrays
    tables: ClearanceTables
    interval: float
    tolerance: Floats


class ClearanceState(NamedTuple):
    """All that a continuation needs, surfaces included; snapshot and restore are copies of these arrays.

    ``index`` (1,) intervals done since time 0; ``e`` and ``v`` (d,) eccentricities [m] and rates;
    ``drive`` (3,) angle, speed and acceleration of the crank; ``step`` (1,) next step to try [s];
    ``approach`` (k,) approach speed of each joint in contact, 0 for the others; ``recent`` (k, 4) its last
    two samples of time and normal force; ``local`` (k, LOCAL) the clearance around a direction;
    ``pending`` (k, 3) the Archard integral not yet worn off [J], and the same times the eccentricity it
    acted at; ``depth`` (k, 2, N) wear of bushing and journal [m].
    """

    index: Floats
    e: Floats
    v: Floats
    drive: Floats
    step: Floats
    approach: Floats
    recent: Floats
    local: Floats
    pending: Floats
    depth: Floats


class Now(NamedTuple):
    """Tables at the present crank angle; see ClearanceTables.

    ``damping`` (d, d) accelerations by e', ``free`` (d,) accelerations without contact, ``lever_drive`` (k,)
    slip speeds and ``torque`` (4 + 3 d + k,) the drive's row, all at the present speed of the crank.
    """

    inverse_mass: Floats
    damping: Floats
    free: Floats
    lever: Floats
    lever_drive: Floats
    lever_response: Floats
    angle: Floats
    torque: Floats
    toe: Floats
    load_power: Floats
    damper: Floats


class ClearanceWork(NamedTuple):
    """Room for an interval.

    The tables ``now``; samples of the joints at a step's ``start`` and ``end`` (k, COLUMNS); ``vectors``
    (rows, d) of a step, ``weight`` (N,) of the wear on an arc, ``reaction`` (r,), ``backup`` the state
    that a failed interval falls back to.
    """

    now: Now
    system: ContactSystem
    start: Floats
    end: Floats
    vectors: Floats
    weight: Floats
    reaction: Floats
    backup: ClearanceState


def clearance_state(depth: Floats, angle: float, speed: float) -> ClearanceState:
    """Ideal start at time 0: journals centred and at rest in their bushings; depth (k, 2, N) of wear."""
    loose = len(depth)
    local = np.zeros((loose, LOCAL))
    local[:, TO_X] = np.nan  # nowhere looked up yet
    return ClearanceState(
        index=np.zeros(1),
        e=np.zeros(2 * loose),
        v=np.zeros(2 * loose),
        drive=np.array([angle, speed, 0.0]),
        step=np.array([1.0e-6]),
        approach=np.zeros(loose),
        recent=np.zeros((loose, 4)),
        local=local,
        pending=np.zeros((loose, 3)),
        depth=depth,
    )


def clearance_work(model: ClearanceModel, state: ClearanceState) -> ClearanceWork:
    """Work arrays for a model and a state."""
    loose, d = len(state.approach), len(state.e)
    now = Now(
        inverse_mass=np.zeros((d, d)),
        damping=np.zeros((d, d)),
        free=np.zeros(d),
        lever=np.zeros((loose, d)),
        lever_drive=np.zeros(loose),
        lever_response=np.zeros((loose, d)),
        angle=np.zeros((loose, 2)),
        torque=np.zeros(4 + 3 * d + loose),
        toe=np.zeros((2, 1 + 2 * d)),
        load_power=np.zeros(d + 1),
        damper=np.zeros((d + 1, d + 1)),
    )
    return ClearanceWork(
        now=now,
        system=contact_system(loose),
        start=np.zeros((loose, COLUMNS)),
        end=np.zeros((loose, COLUMNS)),
        vectors=np.zeros((VECTORS, d)),
        weight=np.zeros(state.depth.shape[2]),
        reaction=np.zeros(len(model.tables.reaction_joint)),
        backup=ClearanceState(*(array.copy() for array in state)),
    )


@kernel
def blend(table, angle):
    """Row of a table with N + 1 rows before a crank angle, and the share of the way to the next."""
    n = table.shape[0] - 1
    u = angle * (n / (2.0 * math.pi))
    u -= n * math.floor(u / n)
    i = min(n - 1, int(u))
    return i, u - i


@kernel
def _mix(before, after, w, out):
    """Linear interpolation of two arrays of one shape."""
    a, b, c = before.reshape(-1), after.reshape(-1), out.reshape(-1)
    for i in range(c.shape[0]):
        c[i] = a[i] + w * (b[i] - a[i])


@kernel
def take_tables(tables, angle, speed, acceleration, out_now):
    """Tables at a crank angle [rad], speed [rad/s] and acceleration [rad/s^2]."""
    i, w = blend(tables.inverse_mass, angle)
    _mix(tables.inverse_mass[i], tables.inverse_mass[i + 1], w, out_now.inverse_mass)
    _mix(tables.coriolis[i], tables.coriolis[i + 1], w, out_now.damping)
    _mix(tables.lever[i], tables.lever[i + 1], w, out_now.lever)
    _mix(tables.lever_drive[i], tables.lever_drive[i + 1], w, out_now.lever_drive)
    _mix(tables.lever_response[i], tables.lever_response[i + 1], w, out_now.lever_response)
    _mix(tables.angle[i], tables.angle[i + 1], w, out_now.angle)
    _mix(tables.reaction[i, 0], tables.reaction[i + 1, 0], w, out_now.torque)
    _mix(tables.toe[i], tables.toe[i + 1], w, out_now.toe)
    _mix(tables.load_power[i], tables.load_power[i + 1], w, out_now.load_power)
    d = out_now.free.shape[0]
    free = tables.free
    for j in range(d):
        out_now.free[j] = at(free[i, 0], free[i + 1, 0], j, w)
        out_now.free[j] += acceleration * at(free[i, 1], free[i + 1, 1], j, w)
        out_now.free[j] += speed * speed * at(free[i, 2], free[i + 1, 2], j, w)
        for l in range(d):
            out_now.damping[j, l] *= speed
    for k in range(out_now.lever_drive.shape[0]):
        out_now.lever_drive[k] *= speed
    if tables.viscous.shape[0] > 0:
        _mix(tables.damper[i], tables.damper[i + 1], w, out_now.damper)
        _add_viscous(tables.viscous[i], tables.viscous[i + 1], w, speed, out_now)


@kernel
def at(before, after, j, w):
    """Entry j between two rows, at the share w of the way."""
    return before[j] + w * (after[j] - before[j])


@kernel
def _add_viscous(before, after, w, speed, out_now):
    """Dampers of springs: accelerations by e' and by the crank's speed."""
    d = out_now.free.shape[0]
    for j in range(d):
        out_now.free[j] += speed * at(before[j], after[j], d, w)
        for l in range(d):
            out_now.damping[j, l] += at(before[j], after[j], l, w)


@kernel
def crank_between(start, end, interval):
    """Angle, speed and acceleration of the crank in the middle of an interval, from those at its ends (3,)."""
    speed = 1.5 * (end[ANGLE] - start[ANGLE]) / interval - 0.25 * (start[SPEED] + end[SPEED])
    angle = 0.5 * (start[ANGLE] + end[ANGLE]) + 0.125 * interval * (start[SPEED] - end[SPEED])
    return angle, speed, (end[SPEED] - start[SPEED]) / interval
