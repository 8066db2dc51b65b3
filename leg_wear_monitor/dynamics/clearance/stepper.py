"""Stepper of the leg in clearance coordinates: advance, observe, snapshot (physics.md section 7)."""

import math
from collections.abc import Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from typing import Any, NamedTuple

import attrs
import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.compiled.kernel import compile_for
from leg_wear_monitor.compiled.vectors import padded
from leg_wear_monitor.contact.arrays import ContactArrays
from leg_wear_monitor.dynamics.clearance.advance import ADVANCE, advance_clearances, observe
from leg_wear_monitor.dynamics.clearance.contact import (
    A0,
    E0,
    V0,
    contact_laws,
    have_usual_laws,
)
from leg_wear_monitor.dynamics.clearance.model import (
    ANGLE,
    SPEED,
    ClearanceModel,
    ClearanceState,
    ClearanceWork,
    clearance_state,
    clearance_work,
    rigid_coupling,
)
from leg_wear_monitor.dynamics.clearance.tables import (
    COARSER,
    UNDER_LOAD,
    ClearanceTables,
    build_basis,
    build_tables,
    motion_shapes,
    stored_shapes,
    views,
)
from leg_wear_monitor.dynamics.joint import F_N, F_T, SAMPLE
from leg_wear_monitor.dynamics.run import (
    DONE,
    RunStatistics,
    Sample,
    Setup,
    new_run_statistics,
    steady_drive,
    stop,
)
from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.mechanism.arrays import Flags, Floats, Ints, Singles
from leg_wear_monitor.mechanism.position import TURN, Linkage, build_linkage
from leg_wear_monitor.mechanism.spec import Load, Mechanism, SpeedDrive, TorqueDrive
from leg_wear_monitor.wear import BUSHING
from leg_wear_monitor.workers import compiled_beside

INTERVALS = 2048  # intervals per turn at the setup's speed
# Used if only statistics and wear are needed, and the drive is rigid; the errors are in physics.md section 7.
STATISTICS_INTERVALS = 1024
_MOST_PARTS = 8  # largest number of parts of an interval, which bounds its cost
TOLERANCE_M = 5.0e-9  # local error of a step in the eccentricities [m]; a smaller error does not change means
TOLERANCE_RATE = 1.0e4  # 1/s: ratio of the rates' tolerance to it, the reciprocal duration of a contact


class ClearanceStepper:
    """The leg in clearance coordinates, advanced over an arbitrary smooth motion of its crank.

    Parameters
    ----------
    setup : Setup
        The stepper wears its surfaces.
    interval_s : float, optional
        Time between the instants at which the state exists; default: `INTERVALS` per turn at the setup's
        speed.
    tolerance_m : float
        Local error allowed in a step [m]; the rates' allowed error is `TOLERANCE_RATE` times it [m/s].
    tables : ClearanceTables, optional
        Tables of this setup, to reuse existing tables.

    Raises
    ------
    ConfigError
        As `check_is_for_clearances`.
    """

    def __init__(
        self,
        setup: Setup,
        interval_s: float | None = None,
        tolerance_m: float = TOLERANCE_M,
        tables: ClearanceTables | None = None,
    ) -> None:
        check_is_for_clearances(setup.linkage.mechanism)
        self._setup = setup
        interval = interval_s or length_of(setup, INTERVALS)
        tables = tables or build_tables(setup.linkage, setup.contacts)
        self.model = ClearanceModel(
            contacts=setup.contacts,
            tables=tables,
            interval=interval,
            tolerance=np.array([1.0, 1.0 / TOLERANCE_RATE]) / tolerance_m,
            law=contact_laws(setup.contacts),
            usual=int(have_usual_laws(setup.contacts)),
            coupling=rigid_coupling(),
            parts=np.empty(len(tables.parts), np.int64),
        )
        self.take_tables()
        self.state: ClearanceState = clearance_state(setup.surfaces.depth, 0.0, setup.speed)
        self.work = clearance_work(self.model, self.state)

    @property
    def time(self) -> float:
        """Time of the last whole interval [s]."""
        return float(self.state.intervals[0] * self.model.interval)

    def init(self, crank_angle: float, speed: float) -> None:
        """Reset to time 0, a crank angle [rad] and speed [rad/s], journals centred; the wear stays."""
        start = clearance_state(self.state.depth, crank_angle, speed)
        self.state.motion[:] = start.motion

    @property
    def crank_angle(self) -> float:
        """Crank angle at that time [rad]."""
        return float(self.state.drive[ANGLE])

    @property
    def speed(self) -> float:
        """Crank speed at that time [rad/s]."""
        return float(self.state.drive[SPEED])

    @property
    def last_force(self) -> Floats:
        """Magnitude (k,) of the contact forces [N] at the last sample before that time."""
        sample = self._sample()
        return np.asarray(np.hypot(sample[F_N], sample[F_T]))

    def _sample(self) -> Floats:
        """The last sample before that time (SAMPLE_ROWS, k)."""
        return self.work.start[:, : len(self.state.approach)]

    def set_eccentricities(self, eccentricity: Floats) -> None:
        """Set the eccentricities (k, 2) [m]."""
        self.state.e[:] = eccentricity.ravel()

    def observe(self) -> Sample:
        """The leg at that time; does not change the state."""
        self.elastic_energy()
        work, state, joints, tables = self.work, self.state, self.model.contacts.joint, self.model.tables
        x, now, reaction = work.x[:, : len(state.e)], work.now, work.reaction[: len(tables.reaction_joint)]
        force = np.zeros(len(self._setup.linkage.mechanism.joints))
        force[joints] = self.last_force
        np.add.at(force, tables.reaction_joint[1:], reaction[1:] ** 2)
        ideal = tables.reaction_joint[1::2]
        force[ideal] = np.sqrt(force[ideal])
        return Sample(
            self.crank_angle,
            _toe_deviations(now.toe, now.speed[0], x[E0], x[V0], x[A0]),
            float(reaction[0]),
            force,
            self._sample()[:SAMPLE].copy(),
            state.approach > 0.0,
            state.depth[:, BUSHING].max(axis=1),
        )

    def elastic_energy(self) -> float:
        """Elastic energy [J] of the contacts at that time."""
        return float(observe(self.model, self._setup.surfaces.feeds_back, self.state, self.work))

    def advance(self, polynomial: Floats, t_end: float, statistics: RunStatistics) -> tuple[int, int]:
        """Advance by all whole intervals up to a time, and add to run statistics.

        Parameters
        ----------
        polynomial : (7,) array
            Crank motion since the last call: reference time [s], then six coefficients of the angle [rad].
        t_end : float, s
        statistics : RunStatistics

        Returns
        -------
        status, k : int
            `DONE`, or the reason for stopping and the clearance joint concerned (-1: none); the state is then
            the state of the last whole interval.
        """
        status, k = advance_clearances(
            self.model, self._setup.surfaces.feeds_back, self.state, polynomial, t_end, statistics, self.work
        )
        return int(status), int(k)

    def advance_address(self, polynomial: Floats, statistics: RunStatistics) -> int:
        """Address of `ADVANCE` for calls with this stepper from compiled code; compiles it if need be."""
        feeds_back = self._setup.surfaces.feeds_back
        return ADVANCE.address(self.model, feeds_back, self.state, polynomial, 0.0, statistics, self.work)

    def take_tables(self) -> None:
        """Divide intervals into parts according to the tables, which were changed in place."""
        model = self.model
        model.parts[:] = _parts(model.tables, INTERVALS * model.interval * abs(self._setup.speed) / TURN)


def length_of(setup: Setup, intervals: int) -> float:
    """Length of an interval [s], from the number of intervals per turn at the setup's speed."""
    return float(TURN / abs(setup.speed) / intervals)


def _parts(tables: ClearanceTables, length: float) -> Ints:
    """Number of parts (N,) of an interval at the tables' points; ``length``: ratio to the usual interval.

    A longer interval has more parts, so that none is longer where the linkage moves fast.
    """
    length = max(1.0, round(length, 3))
    return np.clip(np.ceil(length * tables.parts), 1, round(_MOST_PARTS * length)).astype(np.int64)


def check_is_for_clearances(mechanism: Mechanism) -> None:
    """Check that the crank's motion is given, and that no spring has a damper.

    Raises
    ------
    ConfigError
        If the mechanism is for full coordinates only.
    """
    if not isinstance(mechanism.drive, SpeedDrive):
        key = "drive.torque" if isinstance(mechanism.drive, TorqueDrive) else "drive.track"
        raise ConfigError(mechanism.source, key, "the clearance model needs drive.speed; try --model full")
    for name, spring in mechanism.springs.items():
        if spring.damping > 0.0:
            fault = "the clearance model has no dampers; try --model full"
            raise ConfigError(mechanism.source, f"springs.{name}.damping", fault)


def _toe_deviations(toe: Floats, speed: float, e: Floats, v: Floats, a: Floats) -> Floats:
    """Deviation (3, 2) of the toe's position, velocity and acceleration from the ideal linkage.

    Parameters
    ----------
    toe : (2, 1 + 2 d) array
        Of the step tables: position, its derivative by e, and the derivative of the latter by the crank
        angle.
    speed : float, rad/s
    e, v, a : (d,) arrays
        Eccentricities and their rates.
    """
    d = len(e)
    by, turning = toe[:, 1 : 1 + d], speed * toe[:, 1 + d :]
    # Same formula as in the run statistics, without the second derivative by the crank angle, which
    # contributes 1e-3.
    return np.stack([by @ e, by @ v + turning @ e, by @ a + 2.0 * (turning @ v)])


# The clearance formulation as a `Run`.


class ClearanceRun:
    """A leg in clearance coordinates with constant crank speed.

    Parameters
    ----------
    setup : Setup
    intervals : int
        Number of intervals per turn, see `INTERVALS`.

    Raises
    ------
    ConfigError
        As `check_is_for_clearances`.
    """

    def __init__(self, setup: Setup, intervals: int = INTERVALS) -> None:
        self.stepper = ClearanceStepper(setup, length_of(setup, intervals))
        self._setup = setup
        self._polynomial = steady_drive(0.0, setup.speed)

    @property
    def time(self) -> float:
        """Time reached [s]."""
        return self.stepper.time

    @property
    def stored_energy(self) -> float:
        """Kinetic plus potential energy of gravity, springs and contacts [J], to the order of e / L."""
        state, tables = self.stepper.state, self.stepper.model.tables
        angle, speed, _ = state.drive
        u = angle / TURN % 1.0 * (len(tables.stored) - 1)
        i = min(int(u), len(tables.stored) - 2)
        row = tables.stored[i] + (u - i) * (tables.stored[i + 1] - tables.stored[i])
        at, e, v = views(row, stored_shapes(len(state.approach))), state.e, state.v
        moving = 0.5 * v @ at["a"] @ v + speed * v @ (at["b"] + at["b_e"] @ e)
        moving += 0.5 * speed**2 * (at["c"][0] + at["c_e"] @ e + 0.5 * e @ at["c_ee"] @ e)
        resting = at["potential"][0] - at["push"] @ e - 0.5 * e @ at["push_e"] @ e
        return float(moving + resting) + self.stepper.elastic_energy()

    def advance(self, t_end: float, statistics: RunStatistics) -> None:
        """Advance to the last whole interval before a time [s] and add to run statistics.

        Raises
        ------
        SimulationError
            If the motion diverges; names the joint, the time and a remedy.
        """
        status, k = self.stepper.advance(self._polynomial, t_end, statistics)
        if status != DONE:
            raise stop(self._setup, status, k, self.time)

    def sample(self) -> Sample:
        """The present state of the leg."""
        return self.stepper.observe()


# Compilation of the motion before a leg exists, because the types of arguments do not depend on the
# mechanism.


def _contacts() -> ContactArrays:
    """Settings of one clearance joint, all 0."""
    whole, line, pair = np.zeros(1, np.int64), np.zeros(1), np.zeros((1, 2))
    return ContactArrays(
        joint=whole, bushing_radius=line, clearance=line, width=line, modulus=line, normal_form=whole,
        stiffness=line, hysteresis=line, speed_floor=line, friction_law=whole, friction=np.zeros((1, 3)),
        wear_coefficient=pair,
    )  # fmt: skip


def _tables() -> ClearanceTables:
    """The smallest tables of one clearance joint, all 0."""
    width = padded(sum(math.prod(shape) for shape in motion_shapes(1).values()))
    return ClearanceTables(
        motion=np.zeros((1, width)),
        reaction=np.zeros((1, 1, 1)),
        reaction_joint=np.zeros(1, np.int64),
        stored=np.zeros((1, 1)),
        parts=np.zeros(1),
        by_e=np.zeros((1, 1, 1, 1), np.float32),
        bend=np.zeros((1, 1, 1, 1), np.float32),
    )


def _leg() -> tuple[ClearanceModel, ClearanceState, ClearanceWork]:
    """A leg that has the types of all legs, and nothing else."""
    contacts, line = _contacts(), np.zeros(2)
    model = ClearanceModel(
        contacts,
        _tables(),
        1.0,
        tolerance=line,
        law=contact_laws(contacts),
        usual=1,
        coupling=rigid_coupling(),
        parts=np.zeros(1, np.int64),
    )
    state = clearance_state(np.zeros((1, 2, 1)), 0.0, 1.0)
    return model, state, clearance_work(model, state)


def compile_advance() -> None:
    """Compile `advance_clearances` for the types that it is called with, or load it."""
    model, state, work = _leg()
    compile_for(advance_clearances, model, 0, state, np.zeros(7), 0.0, new_run_statistics(1), work)


def advance_beside() -> AbstractContextManager[None]:
    """Have a second process compile `advance_clearances` while the work inside compiles all else."""
    return compiled_beside(compile_advance, advance_clearances)


@contextmanager
def motion_beside() -> Iterator[None]:
    """Have two processes compile the motion: the second `advance_clearances`, this process `observe`."""
    with advance_beside():
        model, state, work = _leg()
        compile_for(observe, model, 0, state, work)
        yield


# A force on the toe, at each point of the leg's tables (physics.md section 9).
#
# The tables are linear in the force, point by point.


_TRIAL_N = 100.0


class LoadedTable(NamedTuple):
    """A table that the force changes: its rows (n, w), columns (c,), parts (3, n, c): bare, per x, per y."""

    rows: Floats | Singles
    columns: Ints
    parts: Floats


def under_trial_force(linkage: Linkage) -> list[Linkage]:
    """A linkage under a force on its toe along each axis, for `build_basis`; empty without a toe."""
    mechanism = linkage.mechanism
    if mechanism.toe is None:
        return []
    body, point = mechanism.toe
    loads = [Load(body=body, point=point, force=(push,)) for push in ((_TRIAL_N, 0.0), (0.0, _TRIAL_N))]
    return [
        build_linkage(attrs.evolve(mechanism, loads={**mechanism.loads, "trial of a toe force": load}))
        for load in loads
    ]


def loaded_tables(
    linkage: Linkage, contacts: ContactArrays, into: ClearanceTables | None = None
) -> tuple[ClearanceTables, list[LoadedTable]]:
    """Tables of a linkage without a force on its toe, and the tables that a force changes.

    Parameters
    ----------
    linkage : Linkage
        Without a toe, no force acts.
    contacts : ContactArrays
    into : ClearanceTables, optional
        Tables of the same joints that are overwritten.
    """
    basis = build_basis(linkage, contacts, under_trial_force(linkage))
    tables = build_tables(linkage, contacts, basis)
    if into is not None:
        pairs: Iterable[tuple[NDArray[Any], NDArray[Any]]] = zip(into, tables, strict=True)
        for own, table in pairs:
            own[...] = table
        tables = into
    found = []
    for name, make in UNDER_LOAD.items():
        rows = getattr(tables, name).reshape(len(getattr(tables, name)), -1)  # a view
        slopes = [_slope(make(linkage, contacts, each), rows) for each in basis.loaded]
        found.append(_loaded(rows, slopes))
    return tables, found


def put_force(loaded: Sequence[LoadedTable], force: Floats) -> None:
    """Set the tables to a force (N, 2) [N] along the axes of the mechanism, at their points of a turn."""
    fine = np.concatenate([force, force[:1]])
    for table, step in zip(loaded, (1, 1, 1, COARSER), strict=True):
        fx, fy = fine[::step].T[:, :, None]
        table.rows[:, table.columns] = table.parts[0] + fx * table.parts[1] + fy * table.parts[2]


def _slope(table: Floats | Singles, rows: Floats | Singles) -> tuple[Flags, Floats]:
    """Columns of a table that a trial force changes, and their change per N."""
    slope: Floats = np.subtract(table.reshape(rows.shape), rows, dtype=float)
    slope /= _TRIAL_N
    changed = np.asarray(slope.any(axis=0))
    return changed, slope[:, changed]


def _loaded(rows: Floats | Singles, slopes: Sequence[tuple[Flags, Floats]]) -> LoadedTable:
    none = np.zeros(rows.shape[1], dtype=bool)
    columns = np.flatnonzero(np.any([none, *(changed for changed, _ in slopes)], axis=0))
    parts = np.zeros((3, len(rows), len(columns)))
    parts[0] = rows[:, columns]
    for part, (changed, slope) in zip(parts[1:], slopes, strict=False):  # no column without a toe
        part[:, changed[columns]] = slope
    return LoadedTable(rows, columns.astype(np.int64), parts)
