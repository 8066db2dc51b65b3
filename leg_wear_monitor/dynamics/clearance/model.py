"""Model, state and step tables of the leg in clearance coordinates (physics.md section 7)."""

import math
from typing import NamedTuple

import numpy as np

from leg_wear_monitor.compiled.kernel import kernel
from leg_wear_monitor.compiled.vectors import (
    WIDTH,
    every,
    fetch,
    padded,
    part_at,
    put_part,
    put_vector,
    vector_at,
)
from leg_wear_monitor.contact.arrays import ContactArrays
from leg_wear_monitor.dynamics.clearance.contact import (
    ADDED,
    TO_ANGLE,
    VECTORS,
    ContactSystem,
    contact_system,
    fresh_sample,
)
from leg_wear_monitor.dynamics.clearance.tables import ClearanceTables, motion_shapes, start_of, views
from leg_wear_monitor.dynamics.run import JOINT_RATES
from leg_wear_monitor.mechanism.arrays import Floats, Ints

# Connection of drive and crank: rigid, or a coupling or a belt (physics.md section 7).


STIFFNESS, DAMPING, PARTS = 0, 1, 2  # indices of a coupling's law

# rad: longest part of an interval, measured in the oscillation on its coupling of a crank with open joints;
# and fewest parts. The mean torque of the default leg is then within 0.6 % of its RMS of full coordinates, on
# 200 to 5000 N m/rad. With a half and a quarter of the parts it is off by 0.7 and 7 % on 1000 N m/rad.
_LONGEST, _FEWEST = 0.25, 4


class Coupling(NamedTuple):
    """The elastic connection between the drive and the crank.

    ``law`` (3,): stiffness [N m/rad], 0 for a rigid drive, damping [N m s/rad], and number of parts of an
    interval; ``inertia`` (N + 1,) [kg m^2]: inertia of the crank with all clearance joints open, at the
    angles of the tables.
    """

    law: Floats
    inertia: Floats


def rigid_coupling() -> Coupling:
    """A drive that turns the crank as it turns itself."""
    return Coupling(np.zeros(3), np.zeros(1))


def coupling_of(
    tables: ClearanceTables,
    joints: int,
    interval: float,
    stiffness: float,
    damping_ratio: float,
) -> Coupling:
    """Coupling of a leg with the given tables and number of clearance joints.

    Parameters
    ----------
    tables : ClearanceTables
    joints : int
    interval : float
        Interval of the stepper [s].
    stiffness : float
        [N m/rad]
    damping_ratio : float
        Damping ratio of the crank on the coupling, with the mean inertia of the ideal leg over a turn.
    """
    shapes, inertia, whole = motion_shapes(joints), np.zeros(len(tables.motion)), 0.0
    for i, row in enumerate(tables.motion):
        parts = views(row, shapes)
        by_rate, ideal = parts["torque_a"], parts["torque"][1]
        inertia[i] = ideal - by_rate @ parts["inverse_mass"] @ by_rate
        whole += ideal if i else 0.0  # the last row is the first one
    damping = 2.0 * damping_ratio * np.sqrt(stiffness * whole / (len(inertia) - 1))
    turned = interval * np.sqrt(stiffness / inertia.min())
    return Coupling(np.array([stiffness, damping, max(_FEWEST, np.ceil(turned / _LONGEST))]), inertia)


ANGLE, SPEED, ACCELERATION = 0, 1, 2


class ClearanceModel(NamedTuple):
    """Constants of a run.

    ``interval`` [s]: time between the instants at which the state exists; ``tolerance`` (2,): reciprocals of
    the local error allowed in a step, of eccentricities [1/m] and of their rates [s/m]; ``law`` (LAW_ROWS,
    room): of `contact_laws`, ``usual``: 1 if `have_usual_laws`, else 0;
    ``coupling``: between the drive and the crank; ``parts`` (N,): number of parts of an interval that starts
    at each point of the tables.
    """

    contacts: ContactArrays
    tables: ClearanceTables
    interval: float
    tolerance: Floats
    law: Floats
    usual: int
    coupling: Coupling
    parts: Ints


class ClearanceState(NamedTuple):
    """Complete state of a run; a snapshot consists of copies of ``motion`` and ``depth``.

    ``depth`` (k, 2, N) [m]: wear depth of bushing and journal; ``motion`` (s,): everything else; the
    remaining fields are views of it: ``intervals`` (1,): number of intervals since time 0; ``e`` [m], ``v``
    [m/s] (d,): eccentricities and rates; ``drive`` (3,): angle [rad], speed and acceleration of the crank;
    ``step`` (1,) [s]: next trial step; ``approach`` (k,) [m/s]: approach speed of each joint in contact, 0
    for open joints; ``recent`` (k, 4): its last two samples of time [s] and normal force [N]; ``pending`` (4,
    k): Archard integral that is not yet deposited as wear [J], and the integrals of its product with the
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
    ``speed`` (2,): speed [rad/s] and acceleration [rad/s^2] of the crank. ``middle`` (d,): these
    eccentricities. For both: ``force`` (d,) [N]: on e at rest, without contact; ``bare`` (d,): its
    acceleration; ``drift`` (d, d): accelerations per e', ``drift_line`` and ``coriolis_line`` (room for d d):
    the entries of ``drift`` and ``coriolis`` in vectors, ``angle_line`` and ``turn_line`` the entries of
    ``angle`` and ``turn``; ``moment`` (k, d): forces on e per friction force in each joint, ``lever``
    transposed; drive torque: ``torque_0`` (1,) [N m] at rest, ``torque_by_v`` (d,) per e', ``torque_by_e``
    (d,) per e. ``toward`` (3, k): reference directions of the eccentricities at the start of the interval.
    """

    row: Floats
    speed: Floats
    middle: Floats
    force: Floats
    bare: Floats
    drift: Floats
    drift_line: Floats
    coriolis_line: Floats
    angle_line: Floats
    turn_line: Floats
    moment: Floats
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


class ClearanceWork(NamedTuple):
    """Work arrays of an interval.

    ``now``: step tables; ``system``: contact system; ``start``, ``end`` (SAMPLE_ROWS, room): samples of the
    joints at a step's start and end; ``x`` (VECTORS, 2 room): vectors of a step; ``weight`` (N,): weights of
    the wear on an arc; ``by`` (c,): factors of the reactions' table; ``reaction`` (room,), ``toe`` (2,):
    observed; ``added`` (ADDED, room): increments of the joints' integrals in a step, ``sums`` (JOINT_RATES,
    room): in an interval; ``drive_start``, ``drive_end`` (3,): values of the drive at its ends; ``backup``
    (s,): state to restore after a failed interval; ``pending`` (4, room): the state's ``pending``, within an
    interval; ``crank`` (3,): drive at the start of the interval.
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
    sums: Floats
    drive_start: Floats
    drive_end: Floats
    backup: Floats
    pending: Floats
    crank: Floats


def state_shapes(k: int) -> dict[str, tuple[int, ...]]:
    """Shapes of the parts of ``ClearanceState.motion`` in their order, for k clearance joints."""
    return {
        "intervals": (1,), "e": (2 * k,), "v": (2 * k,), "drive": (3,), "step": (1,),
        "approach": (k,), "recent": (k, 4), "pending": (4, k),
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
    row = np.zeros(model.tables.motion.shape[1])
    shapes = motion_shapes(clearance_joints)
    parts, start = views(row, shapes), start_of("coriolis", shapes)
    drift = np.zeros(padded(d * d))
    now = StepTables(
        row=row,
        speed=np.zeros(2),
        middle=np.zeros(d),
        force=np.zeros(d),
        bare=np.zeros(d),
        drift=drift[: d * d].reshape(d, d),
        drift_line=drift,
        coriolis_line=row[start : start + padded(d * d)],
        moment=np.zeros((clearance_joints, d)),
        torque_0=np.zeros(1),
        torque_by_v=np.zeros(d),
        torque_by_e=np.zeros(d),
        toward=np.zeros((TO_ANGLE + 1, clearance_joints)),
        angle_line=parts["angle"].reshape(-1),
        turn_line=parts["turn"].reshape(-1),
        **parts,
    )
    return ClearanceWork(
        now=now,
        system=contact_system(clearance_joints),
        start=fresh_sample(model.law),
        end=fresh_sample(model.law),
        x=np.zeros((VECTORS, 2 * padded(clearance_joints))),
        weight=np.zeros(state.depth.shape[2]),
        by=np.zeros(model.tables.reaction.shape[1]),
        reaction=np.zeros(model.tables.reaction.shape[2]),
        toe=np.zeros(2),
        added=np.zeros((ADDED, padded(clearance_joints))),
        sums=np.zeros((JOINT_RATES, padded(clearance_joints))),
        drive_start=np.zeros(3),
        drive_end=np.zeros(3),
        backup=np.zeros_like(state.motion),
        pending=np.zeros((len(state.pending), padded(clearance_joints))),
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
    for j in range(0, row.shape[0], WIDTH):
        before = vector_at(motion, (i, j))
        put_vector(row, j, before + w * (vector_at(motion, (i + 1, j)) - before))
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
    now.torque_0[0] = by[0] + acceleration * by[1] + speed * (speed * by[2])
    for i in range(d):
        force[i] = free[0, i] + acceleration * free[1, i] + square * free[2, i]
        now.torque_by_v[i] = speed * now.torque_v[i]
        now.torque_by_e[i] = by_e[0, i] + acceleration * by_e[1, i] + square * by_e[2, i]
        now.bare[i] = 0.0
    for i in range(0, d, WIDTH):
        bare = part_at(now.bare, i)
        for j in range(d):
            bare += force[j] * part_at(now.inverse_mass, (j, i))
        put_part(now.bare, i, bare)
    for j in range(d):
        for k in range(now.lever.shape[1]):
            now.moment[k, j] = now.lever[j, k]


@kernel
def _follow_eccentricities(tables, angle, e, v, ahead, now):
    """Add the first order of e + ahead v to the tables, and the terms bilinear in e' to ``drift``."""
    by_e, bend, row, speed = tables.by_e, tables.bend, now.row, now.speed[0]
    drift, coriolis = now.drift_line, now.coriolis_line
    n, w = blend(by_e.shape[0] - 1, angle)
    for j in range(e.shape[0]):
        now.middle[j] = e[j] + ahead * v[j]
    for block in range(by_e.shape[1]):
        i = WIDTH * block
        put_vector(row, i, vector_at(row, i) + _times_table(by_e, n, w, block, now.middle))
    for block in range(bend.shape[1]):
        i = WIDTH * block
        put_vector(drift, i, speed * vector_at(coriolis, i) - _times_table(bend, n, w, block, v))


@kernel
def _times_table(table, n, w, block, values):
    """Product of values (d,) and a block of a table (M + 1, blocks, d, WIDTH), w rows after row n."""
    before, after = every(0.0), every(0.0)
    for j in range(values.shape[0]):
        before += values[j] * vector_at(table, (n, block, j, 0))
        after += values[j] * vector_at(table, (n + 1, block, j, 0))
    return (1.0 - w) * before + w * after


@kernel
def fetch_tables(tables, angle, speed):
    """Prefetch the rows that the next intervals need, while this interval is computed."""
    motion, by_e, bend = tables.motion, tables.by_e, tables.bend
    ahead = 2 if speed > 0.0 else -1
    i, w = blend(motion.shape[0] - 1, angle)
    if (w < 0.5) == (speed > 0.0):  # the first of two intervals between two rows, at the usual length
        i = (i + ahead) % motion.shape[0]
        for j in range(0, motion.shape[1], WIDTH):
            fetch(motion, (i, j))
    i, w = blend(by_e.shape[0] - 1, angle)
    if (w < 0.25 and speed > 0.0) or (w > 0.75 and speed <= 0.0):  # the first of four
        i = (i + ahead) % by_e.shape[0]
        _fetch_blocks(by_e, i)
        _fetch_blocks(bend, i)


@kernel
def _fetch_blocks(table, i):
    """Fetch row i of a table in blocks of single vectors; a memory line contains two of them."""
    for block in range(table.shape[1]):
        for j in range(0, table.shape[2], 2):
            fetch(table, (i, block, j, 0))


@kernel
def crank_between(start, end, interval):
    """Angle, speed and acceleration of the crank in the middle of an interval [s], from its ends (3,)."""
    speed = 1.5 * (end[ANGLE] - start[ANGLE]) / interval - 0.25 * (start[SPEED] + end[SPEED])
    angle = 0.5 * (start[ANGLE] + end[ANGLE]) + 0.125 * interval * (start[SPEED] - end[SPEED])
    return angle, speed, (end[SPEED] - start[SPEED]) / interval
