"""Many independent legs in parallel threads.

`advance_batch` advances their steppers (used for lives), `simulate_batch` returns the complete result of each
leg (used for validation and the scaling benchmark).

Every leg has its own state and run statistics, and the compiled code releases the interpreter's lock. Threads
therefore run in parallel and share the tables; results do not depend on the number of threads.
"""

import math
import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, as_completed
from threading import Event, Lock

import attrs
import numpy as np
from numpy.typing import ArrayLike

from leg_wear_monitor.dynamics.clearance.basis import Basis
from leg_wear_monitor.dynamics.clearance.stepper import (
    INTERVALS,
    ClearanceStepper,
    length_of,
    needs_speed,
)
from leg_wear_monitor.dynamics.clearance.tables import ClearanceTables, build_basis, build_tables
from leg_wear_monitor.dynamics.result import SimulationResult
from leg_wear_monitor.dynamics.run import DONE, RunStatistics, Setup, new_run_statistics, steady_drive, stop
from leg_wear_monitor.dynamics.simulation import ideal_result, prepare
from leg_wear_monitor.dynamics.statistics import drive_torque, joint_statistics, toe_errors
from leg_wear_monitor.errors import AssemblyError, ConfigError, SimulationError
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.mechanism.spec import Mechanism, SpeedDrive
from leg_wear_monitor.wear import fresh_surfaces

# Preparation of the legs of a batch: initial states and shared tables.


@attrs.frozen(kw_only=True, eq=False)
class Leg:
    """One leg of a batch; fields in common with the parameters of `simulate` have the same meaning.

    Attributes
    ----------
    mechanism : Mechanism
    clearances : sequence of str, optional
    clearance_m, speed_rpm : float, optional
    normal_law : str, optional
    wear : bool
    crank_angle_rad : float
        Initial crank angle, from which cycles are counted.
    perturb_m : float
        Largest initial eccentricity; initial positions of the journals are uniform over this disc.
    seed : int
        Seed of the initial positions.
    """

    mechanism: Mechanism
    clearances: Sequence[str] | None = None
    clearance_m: float | None = None
    speed_rpm: float | None = None
    normal_law: str | None = None
    wear: bool = False
    crank_angle_rad: float = 0.0
    perturb_m: float = 0.0
    seed: int = 0

    def prepare(self) -> Setup:
        """Setup of the leg.

        Raises
        ------
        ConfigError
            For invalid values.
        AssemblyError
            If the linkage does not close or has a dead point.
        """
        setup = prepare(
            self.mechanism,
            clearances=self.clearances,
            clearance_m=self.clearance_m,
            speed_rpm=self.speed_rpm,
            wear=self.wear,
            normal_law=self.normal_law,
        )
        if not isinstance(self.mechanism.drive, SpeedDrive):
            raise needs_speed(self.mechanism)
        smallest = setup.contacts.clearance.min(initial=math.inf)
        if not 0.0 <= self.perturb_m <= smallest:
            raise ConfigError(
                "perturb_m", "", f"{self.perturb_m} m is not from 0 to the smallest clearance, {smallest:g} m"
            )
        return setup

    def start(self, stepper: ClearanceStepper) -> None:
        """Set a stepper of this leg to the leg's initial state."""
        stepper.init(self.crank_angle_rad, stepper.speed)
        chance = np.random.default_rng(self.seed)
        joints = len(stepper.eccentricity)
        away = self.perturb_m * np.sqrt(chance.random(joints))
        direction = TURN * chance.random(joints)
        stepper.set_eccentricities(np.stack([away * np.cos(direction), away * np.sin(direction)], axis=1))


def prepare_legs(legs: Sequence[Leg]) -> list[Setup | AssemblyError]:
    """Setups of the legs; an AssemblyError in place of the setup if a linkage does not close or turn.

    Legs that differ only in their initial state are prepared once; each setup has its own surfaces.

    Raises
    ------
    ConfigError
        For invalid values.
    """
    known: dict[str, Setup | AssemblyError] = {}
    setups = []
    for leg in legs:
        # as a dict, for the text of a mechanism leaves out materials and labels, which results name
        key = repr(attrs.asdict(attrs.evolve(leg, crank_angle_rad=0.0, seed=0)))
        if key not in known:
            try:
                known[key] = leg.prepare()
            except AssemblyError as error:
                known[key] = error
        setup = known[key]
        if isinstance(setup, Setup):
            setup = attrs.evolve(setup, surfaces=fresh_surfaces(setup.contacts, leg.wear))
        setups.append(setup)
    return setups


class SharedBasis:
    """Basis of the tables of legs that differ in radii, contacts, speed and initial state only.

    Parameters
    ----------
    setup : Setup
        Setup of any of these legs.
    """

    def __init__(self, setup: Setup) -> None:
        self._lock, self._setup = Lock(), setup
        self._basis: Basis | None = None
        self.tables: ClearanceTables | None = None  # the first that were built with it

    def get(self) -> Basis:
        """The basis; the first call builds it, other threads wait meanwhile."""
        with self._lock:
            if self._basis is None:
                self._basis = build_basis(self._setup.linkage, self._setup.contacts)
            return self._basis


class SharedTables:
    """Tables of a group of legs, built when the first of them runs.

    Parameters
    ----------
    setup : Setup
        Setup of any leg of the group.
    basis : SharedBasis, optional
        That of this group and of others.
    """

    def __init__(self, setup: Setup, basis: SharedBasis | None = None) -> None:
        self._lock, self._setup, self._basis = Lock(), setup, basis
        self._tables: ClearanceTables | None = None

    def get(self) -> ClearanceTables:
        """The tables; the first call builds them, other threads wait meanwhile."""
        with self._lock:
            if self._tables is None:
                self._tables = self._build()
                self._basis = None
            return self._tables

    def _build(self) -> ClearanceTables:
        linkage, contacts, shared = self._setup.linkage, self._setup.contacts, self._basis
        if shared is None:
            return build_tables(linkage, contacts, basis=None)
        tables = build_tables(linkage, contacts, basis=shared.get(), like=shared.tables)
        shared.tables = shared.tables or tables
        return tables


def share_tables(setups: Sequence[Setup | AssemblyError]) -> Iterator[tuple[int, Setup, SharedTables]]:
    """Index, setup and tables of the valid legs; legs with common tables, then bases, follow each other.

    Therefore hardly more tables and bases exist at a time than legs are running.
    """
    groups: dict[object, dict[object, list[tuple[int, Setup]]]] = {}
    for i, setup in enumerate(setups):
        if isinstance(setup, Setup):
            mechanism, contacts = setup.linkage.mechanism, setup.contacts
            bare = repr(attrs.evolve(mechanism, clearances={}, clearance_joints=()))
            radii = contacts.bushing_radius.tobytes(), contacts.clearance.tobytes()
            group = groups.setdefault((bare, setup.clearance_joints), {})
            group.setdefault(radii, []).append((i, setup))
    for group in groups.values():
        (first, *_), *others = group.values()
        basis = SharedBasis(first[1]) if others else None
        for legs in group.values():
            tables = SharedTables(legs[0][1], basis)
            for i, setup in legs:
                yield i, setup, tables


Outcome = SimulationResult | AssemblyError | SimulationError


def advance_batch(
    steppers: Sequence[ClearanceStepper],
    polynomials: Sequence[Floats],
    t_end: ArrayLike,
    statistics_of_all: Sequence[RunStatistics],
    workers: int | None = None,
) -> list[tuple[int, int]]:
    """Advance many steppers, each to its own time, and add to their run statistics.

    Parameters
    ----------
    steppers : sequence of n ClearanceStepper
        Each of its own setup: steppers of one setup would wear the same surfaces.
    polynomials : sequence of n arrays (7,)
        Motions of the cranks, as in `ClearanceStepper.advance`.
    t_end : float or (n,) array, s
    statistics_of_all : sequence of n RunStatistics
    workers : int, optional
        Number of threads; default: the number of cores.

    Returns
    -------
    list of (status, k)
        Status of each stepper, as in `ClearanceStepper.advance`; a failed one does not stop the others.

    Raises
    ------
    ValueError
        If the lengths differ, or a state or run statistics occur twice.
    """
    for what in (
        [stepper.state.depth for stepper in steppers],
        [statistics.time for statistics in statistics_of_all],
    ):
        if len({id(array) for array in what}) < len(what):
            raise ValueError("two legs of a batch share their surfaces or their run statistics")
    times = np.broadcast_to(np.asarray(t_end, dtype=float), len(steppers)).tolist()
    jobs = list(zip(steppers, polynomials, times, statistics_of_all, strict=True))
    with ThreadPoolExecutor(workers or os.cpu_count()) as pool:
        return list(pool.map(lambda job: job[0].advance(*job[1:]), jobs))


def simulate_batch(
    legs: Sequence[Leg],
    *,
    cycles: float = 5.0,
    skip_cycles: float = 1.0,
    intervals: int = INTERVALS,
    workers: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> list[Outcome]:
    """Simulate many legs in clearance coordinates.

    Parameters
    ----------
    legs : sequence of Leg
    cycles, skip_cycles : float
        Counted gait cycles of each leg, and gait cycles before counting starts.
    intervals : int
        As in `simulate`.
    workers : int, optional
        Number of threads; default: the number of cores. Results do not depend on it.
    progress : callable, optional
        Called with the completed fraction of the legs.

    Returns
    -------
    list of SimulationResult, AssemblyError or SimulationError
        In the order of the legs; an error in place of the result if a leg has a dead point or its motion
        diverges. Results contain no energy balance, no single impacts and no trace.

    Raises
    ------
    ConfigError
        For invalid values.
    """
    if not (math.isfinite(cycles) and cycles > 0.0):
        raise ConfigError("cycles", "", f"{cycles:g} is not above 0")
    if not (math.isfinite(skip_cycles) and skip_cycles >= 0.0):
        raise ConfigError("skip-cycles", "", f"{skip_cycles:g} is below 0 cycles")
    setups, stopped = prepare_legs(legs), Event()
    with ThreadPoolExecutor(workers or os.cpu_count()) as pool:
        try:
            futures = {
                i: pool.submit(_simulate, legs[i], setup, tables, cycles, skip_cycles, intervals, stopped)
                for i, setup, tables in share_tables(setups)
            }
            for done, future in enumerate(as_completed(futures.values()), 1):
                _outcome(future)  # raises other errors than SimulationError at once
                if progress:
                    progress(done / len(futures))
        finally:  # after an interrupt, also stop the legs that are running
            stopped.set()
            pool.shutdown(cancel_futures=True)
    return [
        setup if isinstance(setup, AssemblyError) else _outcome(futures[i]) for i, setup in enumerate(setups)
    ]


def _outcome(future: Future[SimulationResult]) -> SimulationResult | SimulationError:
    try:
        return future.result()
    except SimulationError as error:
        return error


def _simulate(
    leg: Leg,
    setup: Setup,
    tables: SharedTables,
    cycles: float,
    skip_cycles: float,
    intervals: int,
    stopped: Event,
) -> SimulationResult:
    """Result of one leg."""
    if not setup.clearance_joints:
        begin = (leg.crank_angle_rad + skip_cycles * math.copysign(TURN, setup.speed)) / TURN
        return ideal_result(setup, cycles, 0, begin)
    stepper = ClearanceStepper(setup, length_of(setup, intervals), tables=tables.get())
    leg.start(stepper)
    joints = len(setup.linkage.mechanism.joints)
    _turn(leg, setup, stepper, skip_cycles, new_run_statistics(joints), stopped)
    statistics, depth = new_run_statistics(joints), setup.surfaces.depth.copy()
    _turn(leg, setup, stepper, skip_cycles + cycles, statistics, stopped)
    return SimulationResult(
        mechanism=setup.linkage.mechanism.name,
        model="clearance",
        speed_rpm=60.0 * setup.speed / TURN,
        cycles=cycles,
        simulated_s=(skip_cycles + cycles) * TURN / abs(setup.speed),
        drive_torque_nm=drive_torque(statistics),
        energy_j=None,
        toe=toe_errors(statistics) if setup.linkage.mechanism.toe else None,
        joints=joint_statistics(setup, statistics, setup.surfaces.depth - depth, cycles),
        clearance_joints=setup.clearance_joints,
        surfaces=setup.surfaces,
    )


def _turn(
    leg: Leg,
    setup: Setup,
    stepper: ClearanceStepper,
    cycles: float,
    statistics: RunStatistics,
    stopped: Event,
) -> None:
    """Advance to a number of cycles since the start, or until ``stopped`` is set; checked once per cycle."""
    polynomial, period = steady_drive(leg.crank_angle_rad, setup.speed), TURN / abs(setup.speed)
    for cycle in [*np.arange(stepper.time / period + 1.0, cycles), cycles]:
        if stopped.is_set():
            return
        status, k = stepper.advance(polynomial, cycle * period, statistics)
        if status != DONE:
            raise stop(setup, status, k, stepper.time)
