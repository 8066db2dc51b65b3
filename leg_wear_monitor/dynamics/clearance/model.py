"""Model, state and step tables of the leg in clearance coordinates (physics.md section 7)."""

import math
from typing import NamedTuple

import numpy as np

from leg_wear_monitor.contact.arrays import ContactArrays
from leg_wear_monitor.dynamics.clearance.contact import ADDED, COLUMNS, TO_ANGLE, VECTORS
from leg_wear_monitor.dynamics.clearance.film import FilmModel
from leg_wear_monitor.dynamics.clearance.layout import motion_shapes, views
from leg_wear_monitor.dynamics.clearance.rosenbrock import ContactSystem, contact_system
from leg_wear_monitor.dynamics.clearance.tables import ClearanceTables
from leg_wear_monitor.kernel import kernel
from leg_wear_monitor.mechanism.arrays import Floats

ANGLE, SPEED, ACCELERATION = 0, 1, 2


class ClearanceModel(NamedTuple):
    """Constants of a run.

    ``interval`` [s]: time between the instants at which the state exists; ``tolerance`` (2,): reciprocals of
    the local error allowed in a step, of eccentricities [1/m] and of their rates [s/m]; ``law`` (k, 7): of
    `contact_laws`; ``film``: films of the joints; ``damped``: 1 with dampers, else 0.
    """

    contacts: ContactArrays
    tables: ClearanceTables
    interval: float
    tolerance: Floats
    law: Floats
    film: FilmModel
    damped: int


class ClearanceState(NamedTuple):
    """Complete state of a run; a snapshot consists of copies of ``motion`` and ``depth``.

    ``depth`` (k, 2, N) [m]: wear depth of bushing and journal; ``motion`` (s,): everything else, of which the
    remaining fields are views: ``intervals`` (1,): number of intervals since time 0; ``e`` [m], ``v`` [m/s]
    (d,): eccentricities and rates; ``drive`` (3,): angle [rad], speed and acceleration of the crank; ``step``
    (1,) [s]: next trial step; ``approach`` (k,) [m/s]: approach speed of each joint in contact, 0 for the
    others; ``recent`` (k, 4): its last two samples of time [s] and normal force [N]; ``pending`` (k, 4):
    Archard integral that is not yet deposited as wear [J], and the integrals of its product with the
    direction (x, y) [J] and the length [J m] of the eccentricity.
    """

    depth: Floats
    motion: Floats
    intervals: Floats
    e: Floats
    v: Floats
    drive: Floats
    step: Floats
    approach: Floats
    recent: Floats
    pending: Floats


class StepTables(NamedTuple):
    """Tables at the present crank angle: ``row`` (w,) of the table ``motion``, and its parts.

    Parts that depend on e are evaluated for the eccentricities in the middle of the part of an interval.
    ``speed`` (2,): speed [rad/s] and acceleration [rad/s^2] of the crank. For these: ``force`` (d,) [N]: on e
    at rest, without contact; ``bare`` (d,): its acceleration; ``drift`` (d, d): accelerations per e';
    ``lever_response`` (k, d): accelerations per friction force in each joint; drive torque: ``torque_0`` (1,)
    [N m] at rest, ``torque_by_v`` (d,) per e', ``torque_by_e`` (d,) per e. ``toward`` (k, 3): reference
    directions of the eccentricities at the start of the interval. For the moments of films, of both bodies of
    each joint: ``spin`` (d, d): their rates per e', ``spin_turn`` (d,): per crank speed; ``spin_response``
    (d, d): accelerations per moment.
    """

    row: Floats
    speed: Floats
    force: Floats
    bare: Floats
    drift: Floats
    lever_response: Floats
    torque_0: Floats
    torque_by_v: Floats
    torque_by_e: Floats
    toward: Floats
    inverse_mass: Floats
    free: Floats
    torque_a: Floats
    torque_v: Floats
    coriolis: Floats
    lever: Floats
    lever_drive: Floats
    torque: Floats
    torque_e: Floats
    torque_vv: Floats
    angle: Floats
    turn: Floats
    toe: Floats
    load_power: Floats
    viscous: Floats
    damper: Floats
    spin: Floats
    spin_turn: Floats
    spin_response: Floats


class ClearanceWork(NamedTuple):
    """Work arrays of an interval.

    ``now``: step tables; ``system``: contact system; ``start``, ``end`` (k, COLUMNS): samples of the joints
    at a step's start and end; ``x`` (VECTORS, d): vectors of a step; ``weight`` (N,): of the wear on an arc;
    ``by``
    (c,): factors of the reactions' table; ``reaction`` (r,), ``toe`` (2,): observed values; ``added``
    (k, ADDED): increments of the joints' integrals in a step; ``drive_start``, ``drive_end`` (3,): of
    the drive at its ends; ``backup`` (s,): state to restore after a failed interval, except ``pending`` (k,
    4);
    ``crank`` (3,): drive at the start of the interval.
    """

    now: StepTables
    system: ContactSystem
    start: Floats
    end: Floats
    x: Floats
    weight: Floats
    by: Floats
    reaction: Floats
    toe: Floats
    added: Floats
    drive_start: Floats
    drive_end: Floats
    backup: Floats
    pending: Floats
    crank: Floats


def state_shapes(k: int) -> dict[str, tuple[int, ...]]:
    """Shapes of the parts of ``ClearanceState.motion`` in their order, for k clearance joints."""
    return {
        "intervals": (1,), "e": (2 * k,), "v": (2 * k,), "drive": (3,), "step": (1,),
        "approach": (k,), "recent": (k, 4), "pending": (k, 4),
    }  # fmt: skip


@kernel
def move_time_origin(state, interval, intervals):
    """Move time 0 forward by a number of intervals of a length [s]; even, because of `RENEWAL`."""
    state.intervals[0] -= intervals
    for k in range(state.recent.shape[0]):
        for sample in range(2):  # time and normal force of each
            state.recent[k, 2 * sample] -= intervals * interval


def clearance_state(depth: Floats, angle: float, speed: float) -> ClearanceState:
    """Initial state at time 0: journals centred and at rest in their bushings; wear depth (k, 2, N) [m]."""
    shapes = state_shapes(len(depth))
    motion = np.zeros(sum(math.prod(shape) for shape in shapes.values()))
    state = ClearanceState(depth, motion, **views(motion, shapes))
    state.drive[:] = angle, speed, 0.0
    state.step[0] = 1.0e-6
    return state


def clearance_work(model: ClearanceModel, state: ClearanceState) -> ClearanceWork:
    """Work arrays for a model and a state."""
    clearance_joints, d = len(state.approach), len(state.e)
    films = 2 * len(model.film.settings)
    row = np.zeros(model.tables.motion.shape[1])
    parts = views(row, motion_shapes(clearance_joints, model.damped > 0))
    now = StepTables(
        row=row,
        speed=np.zeros(2),
        force=np.zeros(d),
        bare=np.zeros(d),
        drift=np.zeros((d, d)),
        lever_response=np.zeros((clearance_joints, d)),
        torque_0=np.zeros(1),
        torque_by_v=np.zeros(d),
        torque_by_e=np.zeros(d),
        toward=np.zeros((clearance_joints, TO_ANGLE + 1)),
        spin=np.zeros((films, d)),
        spin_turn=np.zeros(films),
        spin_response=np.zeros((films, d)),
        **parts,
    )
    return ClearanceWork(
        now=now,
        system=contact_system(clearance_joints),
        start=np.zeros((clearance_joints, COLUMNS)),
        end=np.zeros((clearance_joints, COLUMNS)),
        x=np.zeros((VECTORS, d)),
        weight=np.zeros(state.depth.shape[2]),
        by=np.zeros(model.tables.reaction.shape[1]),
        reaction=np.zeros(len(model.tables.reaction_joint)),
        toe=np.zeros(2),
        added=np.zeros((clearance_joints, ADDED)),
        drive_start=np.zeros(3),
        drive_end=np.zeros(3),
        backup=np.zeros_like(state.motion),
        pending=np.zeros_like(state.pending),
        crank=np.zeros(3),
    )


@kernel
def blend(points, angle):
    """Row before a crank angle [rad] in a table of ``points`` per turn, and the fraction to the next row."""
    u = angle * (points / (2.0 * math.pi))
    u -= points * math.floor(u / points)
    i = min(points - 1, int(u))
    return i, u - i


@kernel
def take_tables(tables, angle, speed, acceleration, out_step_tables):
    """Interpolate the step tables at a crank angle [rad]; speed [rad/s] and acceleration [rad/s^2]."""
    motion, row = tables.motion, out_step_tables.row
    i, w = blend(motion.shape[0] - 1, angle)
    for j in range(row.shape[0]):
        row[j] = motion[i, j] + w * (motion[i + 1, j] - motion[i, j])
    out_step_tables.speed[0], out_step_tables.speed[1] = speed, acceleration


@kernel
def hold_eccentricities(tables, angle, e, v, ahead, now):
    """Complete the step tables for constant eccentricities e + ahead v; ``ahead`` [s].

    The eccentricities' effect on the tables is of the order e / L; within a part of an interval it changes by
    a thousandth of that.
    """
    d, speed, acceleration = e.shape[0], now.speed[0], now.speed[1]
    square = speed * speed
    _follow_eccentricities(tables, angle, e, v, ahead, now)
    free, by, by_e, force = now.free, now.torque, now.torque_e, now.force
    now.torque_0[0] = by[0] + acceleration * by[1] + speed * (speed * by[2] + by[3])
    for i in range(d):
        force[i] = free[0, i] + acceleration * free[1, i] + square * free[2, i]
        now.torque_by_v[i] = speed * now.torque_v[0, i] + now.torque_v[1, i]
        now.torque_by_e[i] = by_e[0, i] + acceleration * by_e[1, i] + square * by_e[2, i]
        now.bare[i] = speed * now.viscous[i, d] if now.viscous.shape[0] > 0 else 0.0
        for k in range(now.lever.shape[0]):
            now.lever_response[k, i] = 0.0
    for j in range(d):
        for i in range(d):
            now.bare[i] += now.inverse_mass[j, i] * force[j]
        for k in range(now.lever.shape[0]):
            for i in range(d):
                now.lever_response[k, i] += now.inverse_mass[j, i] * now.lever[k, j]


@kernel
def _follow_eccentricities(tables, angle, e, v, ahead, now):
    """Add the first order of e + ahead v to the tables, and the terms bilinear in e' to ``drift``."""
    by_e, bend, row, speed = tables.by_e, tables.bend, now.row, now.speed[0]
    drift, coriolis = now.drift.reshape(-1), now.coriolis.reshape(-1)
    n, w = blend(by_e.shape[0] - 1, angle)
    for i in range(drift.shape[0]):
        drift[i] = speed * coriolis[i]
    for j in range(e.shape[0]):
        middle, rate = e[j] + ahead * v[j], v[j]
        before, after = (1.0 - w) * middle, w * middle
        for i in range(by_e.shape[2]):
            row[i] += before * by_e[n, j, i] + after * by_e[n + 1, j, i]
        before, after = (1.0 - w) * rate, w * rate
        for i in range(drift.shape[0]):
            drift[i] -= before * bend[n, j, i] + after * bend[n + 1, j, i]


@kernel
def crank_between(start, end, interval):
    """Angle, speed and acceleration of the crank in the middle of an interval [s], from its ends (3,)."""
    speed = 1.5 * (end[ANGLE] - start[ANGLE]) / interval - 0.25 * (start[SPEED] + end[SPEED])
    angle = 0.5 * (start[ANGLE] + end[ANGLE]) + 0.125 * interval * (start[SPEED] - end[SPEED])
    return angle, speed, (end[SPEED] - start[SPEED]) / interval
