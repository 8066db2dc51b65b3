"""A foot load on the twin: its effect on the leg's tables and on the drive torque (physics.md section 9).

The tables are linear in the load. The first part writes a measured force into their rows, sample by sample
(kernels); the second one sets a load of a given shape and size, which may change with every gait cycle
(`FootLoad`).
"""

import math
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.compiled.kernel import kernel
from leg_wear_monitor.contact.arrays import ContactArrays
from leg_wear_monitor.dynamics.clearance.basis import COARSER, Basis
from leg_wear_monitor.dynamics.clearance.stepper import (
    LoadedTables,
    loaded_tables,
    put_force,
    under_trial_force,
)
from leg_wear_monitor.dynamics.clearance.tables import POINTS, build_basis, build_tables
from leg_wear_monitor.mechanism.arrays import Floats, body_names
from leg_wear_monitor.mechanism.person import PHASES, nominal_stance, upwards
from leg_wear_monitor.mechanism.position import Linkage, one_cycle, point_motion
from leg_wear_monitor.twin.follower_state import pass_low
from leg_wear_monitor.twin.sample import GROUND, STANCE
from leg_wear_monitor.twin.steps import AHEAD_NS

# A measured force on the toe, at each point of the leg's tables.
#
# The kernels take ``load``, the `LoadRows`; ``push``, the state of the force's filter, a record of
# `follower_state.LOAD_FILTER`; and ``step``, a record of `steps.STEP` whose code is PUSH. A row is the number
# of a point of the tables, POINTS in a turn of the crank; between two points it has a fraction.
#
# The tables are linear in the force at each point. A sample writes the rows that the crank passes until the
# next sample; a row that no sample reaches keeps the force of the cycle before. White noise of a sensor would
# wear an unloaded joint: noise of 5 % of the peak nearly four times as fast as the load itself (joint J under
# 300 N, samples at 200 Hz, 2026-11-25). So the force that acts is the mean over gait cycles, plus the
# filtered departure of the present cycle from it.


# time constant of each of the two stages of the departure's filter: they delay by the lead of the sample
# ahead
_STAGE_S = 0.5e-9 * AHEAD_NS
# s: a longer time between samples is a gap; at twenty samples a second a stance has eight
LONGEST_PUSH = 0.05
_LEARNED = 10.0  # gait cycles over which the mean force is averaged
# Fractions of the peak: a smaller vertical force than the first counts as none, a larger one than the second
# acts as it is, with a smooth transition, since a jump would be an impact. Gait analysis takes 20 to 30 N as
# the least force of a standing foot.
_NONE, _SURE = 0.02, 0.08
# rows written beyond the next sample: the coarsest table is interpolated up to its next row
_MARGIN = COARSER


class LoadRows(NamedTuple):
    """The force at the points of the tables, and the tables that it changes.

    Attributes
    ----------
    force : (N, 2) array
        Force along the axes of the mechanism [N]; (0, 2) if no measured force acts.
    axis : (N, 2) array
        First axis of the samples' frame at each row; the second axis is a quarter turn further.
    up : (2,) array
        Unit vector upwards.
    mean : (N, 2) array
        Mean force over gait cycles [N]; (0, 2) as `force`.
    learned : (N,) array
        Number of gait cycles in the mean, at most 10.
    tables : LoadedTables
    """

    force: Floats
    axis: Floats
    up: Floats
    mean: Floats
    learned: Floats
    tables: LoadedTables


def load_rows(linkage: Linkage, tables: LoadedTables, acts: bool, is_of_foot: bool) -> LoadRows:
    """Rows at the start: no force yet.

    Parameters
    ----------
    linkage : Linkage
    tables : LoadedTables
        Tables of this linkage; the kernels change them.
    acts : bool
        Whether the force acts on the leg.
    is_of_foot : bool
        Whether the samples' frame is fixed to the toe's body instead of the ground.
    """
    mechanism = linkage.mechanism
    force = np.zeros((POINTS if acts and mechanism.toe else 0, 2))
    axis, up = _axis(linkage, is_of_foot), upwards(mechanism)
    return LoadRows(force, axis, up, force.copy(), np.zeros(len(force)), tables)


def _axis(linkage: Linkage, is_of_foot: bool) -> Floats:
    """First axis (N, 2) of the samples' frame."""
    mechanism = linkage.mechanism
    if not is_of_foot or mechanism.toe is None:
        up = upwards(mechanism)
        return np.tile([up[1], -up[0]], (POINTS, 1))
    angle = one_cycle(linkage, POINTS, 1.0).q[:, body_names(mechanism).index(mechanism.toe[0]), 2]
    return np.stack([np.cos(angle), np.sin(angle)], axis=1)


@kernel
def in_mechanism(axis, row, fx, fy):
    """A force of a sample at a row of the tables, along the axes of the mechanism."""
    i = math.floor(row + 0.5) % axis.shape[0]
    return axis[i, 0] * fx - axis[i, 1] * fy, axis[i, 1] * fx + axis[i, 0] * fy


@kernel
def take_push(load, push, row, rate, step, force):
    """Let a sample of the foot load act, ``force`` (2,) [N], at a row that changes by ``rate`` [1/s].

    Three parts: the mean force by phase is learned from the rows that the crank has passed; the departure
    from it, which contains noise and the differences from step to step, is filtered; both are written into
    the rows up to the next sample. The filter takes a sample that is ahead by its delay, so the force acts at
    the right time.
    """
    if load.force.shape[0] == 0 or push.is_frozen != 0:
        return
    since, until = 1.0e-9 * (step.begin_ns - push.last_ns), 1.0e-9 * step.until_next_ns
    if push.last_ns != 0 and since <= LONGEST_PUSH:
        _learn(load, row - rate * since, row, push.last, force)
    _filter(load, push, row + rate * 1.0e-9 * (step.end_ns - step.begin_ns), step)
    _write(load, push, row, rate, until if until <= LONGEST_PUSH else 0.0, step.begin_ns)


@kernel
def _learn(load, before, row, force_before, force):
    """Learn the mean force of the rows between two rows, from the forces (2,) there."""
    n, step = load.force.shape[0], 1 if row >= before else -1
    first = math.floor(before) + 1 if step > 0 else math.ceil(before) - 1
    last = math.floor(row) if step > 0 else math.ceil(row)
    for k in range(min(step * (last - first) + 1, n)):
        at = first + step * k
        w, i = (at - before) / (row - before), at % n
        load.learned[i] = min(load.learned[i] + 1.0, _LEARNED)
        for c in range(2):
            now = force_before[c] + w * (force[c] - force_before[c])
            load.mean[i, c] += (now - load.mean[i, c]) / load.learned[i]


@kernel
def _filter(load, push, row, step):
    """Filter the departure of the sample ahead, at a row, from the mean force.

    At the start and after a gap it begins at 0: a force that is there at once would be an impact.
    """
    dt = 1.0e-9 * (step.end_ns - push.ahead_ns)
    if dt <= 0.0:
        return
    fresh = push.ahead_ns == 0 or dt > LONGEST_PUSH
    dt = 0.0 if fresh else dt
    n, fraction, i = load.force.shape[0], 1.0 - math.exp(-dt / _STAGE_S), math.floor(row)
    w = row - i
    fx, fy = in_mechanism(load.axis, row, step.motion[2], step.motion[3])
    for c in range(2):
        mean = load.mean[i % n, c] + w * (load.mean[(i + 1) % n, c] - load.mean[i % n, c])
        if fresh:
            push.stages[c, 0], push.stages[c, 1], push.departure[1, c] = 0.0, 0.0, 0.0
        push.departure[0, c] = push.departure[1, c]
        push.departure[1, c] = pass_low(fraction, False, (fx if c == 0 else fy) - mean, push.stages[c])
    push.reaches_ns[0] = (step.end_ns if fresh else push.ahead_ns) - AHEAD_NS
    push.reaches_ns[1], push.ahead_ns = step.end_ns - AHEAD_NS, step.end_ns


@kernel
def _write(load, push, row, rate, until, stamp):
    """Write the rows from one at a stamp on, over a time [s] and a few more.

    Between steps the ground does not push, and it never pulls: a small force is none.
    """
    n, step = load.force.shape[0], 1 if rate >= 0.0 else -1
    first = math.ceil(row) if step > 0 else math.floor(row)
    last = math.floor(row + rate * until) if step > 0 else math.ceil(row + rate * until)
    whole = float(push.reaches_ns[1] - push.reaches_ns[0])
    for k in range(min(step * (last - first) + 1 + _MARGIN, n)):
        at = first + step * k
        passed = float(stamp - push.reaches_ns[0]) + (1.0e9 * (at - row) / rate if rate != 0.0 else 0.0)
        w, i = min(max(passed / whole, 0.0), 1.0) if whole > 0.0 else 1.0, at % n
        up = 0.0
        for c in range(2):
            departure = push.departure[0, c] + w * (push.departure[1, c] - push.departure[0, c])
            load.force[i, c] = load.mean[i, c] + departure
            up += load.up[c] * load.force[i, c]
        stands = (
            min(max((up / push.peak_n - _NONE) / (_SURE - _NONE), 0.0), 1.0) if push.peak_n > 0.0 else 1.0
        )
        # smooth from 0 to 1, the fraction of the force that acts
        stands = stands * stands * (3.0 - 2.0 * stands) if up > 0.0 else 0.0
        load.force[i, 0] *= stands
        load.force[i, 1] *= stands
        put_row(load, i)


@kernel
def put_row(load, row):
    """Set the tables at a row to its force; the tables repeat the first row behind the last point."""
    fx, fy = load.force[row, 0], load.force[row, 1]
    for i in range(2 if row == 0 else 1):
        at = row + i * load.force.shape[0]
        _put(load.tables.motion, at, fx, fy)
        _put(load.tables.reaction, at, fx, fy)
        _put(load.tables.stored, at, fx, fy)
        if at % COARSER == 0:
            _put(load.tables.by_e, at // COARSER, fx, fy)


@kernel
def _put(table, row, fx, fy):
    """A row of one table: its part without a force, and its parts per newton along x and y."""
    for j in range(table.columns.shape[0]):
        part = table.parts[0, row, j] + fx * table.parts[1, row, j] + fy * table.parts[2, row, j]
        table.rows[row, table.columns[j]] = part


def force_of(load: LoadRows) -> tuple[Floats, ...]:
    """A copy of force, mean and number of cycles, for a snapshot."""
    return load.force.copy(), load.mean.copy(), load.learned.copy()


def set_force(load: LoadRows, force: tuple[Floats, ...]) -> None:
    """Restore the force that `force_of` returned, and set the tables accordingly."""
    for own, value in zip((load.force, load.mean, load.learned), force, strict=True):
        own[:] = value
    if len(load.force):
        put_force(load.tables, load.force)


# A load of a given shape and size.


# Deviation of measured stances from the template, RMS over the peak: 0.055 to 0.119 of the vertical force,
# and 0.034 to 0.062 of the fore-aft one (docs/appendix/benchmarks.md).
_VERTICAL, _FORE_AFT = 0.09, 0.05


class FootLoad:
    """The leg's tables under a load at the toe: of a shape and a size, or measured.

    Parameters
    ----------
    linkage : Linkage
    contacts : ContactArrays
    shape : str
        Shape of the load over the gait cycle, one of `sample.LOAD_SHAPES`; a known load (`rebuild`) has
        priority.
    is_measured, is_of_foot : bool
        Whether a measured force acts, and whether its axes are fixed to the foot.

    Attributes
    ----------
    tables : ClearanceTables
        Tables for the present load, changed in place.
    shape : str
        Present shape.
    signature : (N + 1,) array
        Drive torque per upward load [N m/N], zeros for a mechanism without a toe.
    rows : LoadRows
        The measured force.
    """

    def __init__(
        self,
        linkage: Linkage,
        contacts: ContactArrays,
        shape: str = STANCE,
        is_measured: bool = False,
        is_of_foot: bool = False,
    ) -> None:
        basis = build_basis(linkage, contacts, loaded=under_trial_force(linkage))
        self.tables = build_tables(linkage, contacts, basis=basis)
        self.signature = np.zeros(POINTS + 1)
        self._contacts, self.shape, self._load = contacts, shape, 0.0
        self._known = np.zeros((0, 2))
        self._measured = is_measured, is_of_foot
        self._set_up(linkage, basis)

    def rebuild(self, linkage: Linkage, known: Floats) -> None:
        """Set the tables, in place, for a leg with other masses or lengths under the same load.

        Parameters
        ----------
        linkage : Linkage
            Without the load.
        known : (PHASES, 2) array
            Force that gives the shape of the load [N], such as an identified one; (0, 2) for the shape by
            name.
        """
        self._known = known
        load, self._load, measured = self._load, 0.0, force_of(self.rows)
        basis = build_basis(linkage, self._contacts, loaded=under_trial_force(linkage))
        pairs: Iterable[tuple[NDArray[Any], NDArray[Any]]] = zip(
            self.tables, build_tables(linkage, self._contacts, basis=basis), strict=True
        )
        for own, table in pairs:
            own[...] = table
        self._set_up(linkage, basis)
        self.set(load)
        set_force(self.rows, measured)

    def _set_up(self, linkage: Linkage, basis: Basis) -> None:
        """Compute the effect of a load on the tables, which must be those without a load."""
        self._linkage = linkage
        self._shaped: dict[str, tuple[Floats, Floats]] = {}
        self._loaded = loaded_tables(linkage, self._contacts, self.tables, basis)
        self.rows = load_rows(linkage, self._loaded, *self._measured)
        self.take_shape(self.shape)

    def take_shape(self, shape: str) -> None:
        """Change the shape of the load, unless a known load gives it. The load is 0 afterwards."""
        self.set(0.0)
        self.shape, known = shape, self._known
        if known.size:
            self._force = known / (known @ upwards(self._linkage.mechanism)).max()
            self.signature[:] = load_signature(self._linkage, self._force)
        else:
            self._force, self.signature[:] = self._force_and_signature(shape)

    def signature_of(self, shape: str) -> Floats:
        """Drive torque (N,) per upward load of a shape [N m/N]."""
        return self._force_and_signature(shape)[1][:-1]

    def _force_and_signature(self, shape: str) -> tuple[Floats, Floats]:
        """Force and signature of a shape; cached, since a wrong leg model needs them in each gait cycle."""
        if shape not in self._shaped:
            force = load_shape(self._linkage, shape)
            self._shaped[shape] = force, load_signature(self._linkage, force)
        return self._shaped[shape]

    @property
    def peak_n(self) -> float:
        """Largest vertical part over a gait cycle of the load that acts now [N]."""
        rows = self.rows
        return float((rows.force @ rows.up).max()) if len(rows.force) else self._load

    def set(self, load: float) -> None:
        """Set the tables to a load [N], positive upwards."""
        if load != self._load:
            self._load = load
            put_force(self._loaded, load * at_points(self._force))


def load_shape(linkage: Linkage, shape: str = STANCE) -> Floats:
    """Force on the toe (PHASES, 2), divided by its largest vertical part; zeros without a toe."""
    mechanism = linkage.mechanism
    if mechanism.toe is None:
        return np.zeros((PHASES, 2))
    if shape == GROUND:
        return nominal_stance(linkage).force()
    up = upwards(mechanism)
    position, _, _ = point_motion(one_cycle(linkage, PHASES, 1.0), linkage, *mechanism.toe)
    return np.outer(_load_fraction(position @ up, shape), up)


def shape_torque(linkage: Linkage) -> float:
    """RMS difference of steps from the template, in drive torque per newton of the peak [N m/N]."""
    toe = linkage.mechanism.toe
    if toe is None:
        return 0.0
    stance = nominal_stance(linkage)
    _, velocity, _ = point_motion(one_cycle(linkage, PHASES, 1.0), linkage, *toe)
    other = _VERTICAL * (velocity @ stance.up), _FORE_AFT * (velocity @ stance.back)
    in_stance = stance.fractions() <= 1.0
    return float(np.sqrt(np.mean(np.where(in_stance, np.hypot(*other), 0.0) ** 2)))


def load_signature(linkage: Linkage, force: Floats | None = None) -> Floats:
    """Drive torque (POINTS + 1,) [N m/N] for a force on the toe (PHASES, 2); by default in stance.

    Zeros for a mechanism without a toe.
    """
    toe = linkage.mechanism.toe
    if toe is None:
        return np.zeros(POINTS + 1)
    (signature,) = load_signatures(linkage, [load_shape(linkage) if force is None else force])
    return np.append(signature, signature[0])


def load_signatures(linkage: Linkage, forces: Sequence[Floats]) -> list[Floats]:
    """Drive torques (POINTS,) [N m/N] for some forces (PHASES, 2) on the toe of a mechanism that has one."""
    toe = linkage.mechanism.toe
    if toe is None:
        raise RuntimeError("a mechanism without a toe carries no load")
    _, velocity, _ = point_motion(one_cycle(linkage, POINTS, 1.0), linkage, *toe)
    return [-(at_points(force) * velocity).sum(axis=1) for force in forces]


def at_points(force: Floats) -> Floats:
    """A force (PHASES, 2) at the points of the leg's tables (POINTS, 2)."""
    phases = np.arange(POINTS) / POINTS * len(force)
    place = np.arange(len(force))
    return np.stack([np.interp(phases, place, one, period=len(force)) for one in force.T], axis=1)


def torque_size(linkage: Linkage, speed: float) -> float:
    """RMS of the ideal linkage's drive torque [N m] over a turn, at a crank speed [rad/s]."""
    return float(np.sqrt(np.mean(one_cycle(linkage, POINTS, speed).drive_torque ** 2)))


def _load_fraction(height: Floats, shape: str) -> Floats:
    """Fraction (n,) of the full load at equal crank steps, from the toe's height (n,) [m]."""
    if shape != STANCE:
        return np.ones(len(height))
    depth = np.maximum(0.0, height.mean() - height)
    return np.asarray(depth / (depth.max() or 1.0))
