"""Many independent legs in parallel threads.

`advance_batch` advances their steppers (used for lives), `simulate_batch` returns the complete result of each
leg (used for validation and the scaling benchmark).

Every leg has its own state and run statistics, and the compiled code releases the interpreter's lock. Threads
therefore run in parallel and share the tables; results do not depend on the number of threads.
"""

import math
import os
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, as_completed
from threading import Event

import numpy as np
from numpy.typing import ArrayLike

from leg_wear_monitor.dynamics.batch.leg import Leg, SharedTables, prepare_legs, share_tables
from leg_wear_monitor.dynamics.clearance.stepper import ClearanceStepper
from leg_wear_monitor.dynamics.ideal_result import ideal_result
from leg_wear_monitor.dynamics.result.simulation_result import SimulationResult
from leg_wear_monitor.dynamics.result.statistics import drive_torque, joint_statistics, toe_errors
from leg_wear_monitor.dynamics.run.drive import steady_drive
from leg_wear_monitor.dynamics.run.protocol import DONE, Setup, stop
from leg_wear_monitor.dynamics.run.run_statistics import RunStatistics, new_run_statistics
from leg_wear_monitor.errors import AssemblyError, ConfigError, SimulationError
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ideal import TURN

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
    workers: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> list[Outcome]:
    """Simulate many legs in clearance coordinates.

    Parameters
    ----------
    legs : sequence of Leg
    cycles, skip_cycles : float
        Counted gait cycles of each leg, and gait cycles before counting starts.
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
                i: pool.submit(_simulate, legs[i], setup, tables, cycles, skip_cycles, stopped)
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
    leg: Leg, setup: Setup, tables: SharedTables, cycles: float, skip_cycles: float, stopped: Event
) -> SimulationResult:
    """Result of one leg."""
    if not setup.clearance_joints:
        return ideal_result(setup, cycles, 0)
    stepper = ClearanceStepper(setup, tables=tables.get())
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
