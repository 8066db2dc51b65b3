"""The drive torque of simulated legs, whose crank turns in the same way in each gait cycle."""

from collections.abc import Iterator

import numpy as np

from leg_wear_monitor.compiled.kernel import entry
from leg_wear_monitor.dynamics.clearance.advance import ADVANCE
from leg_wear_monitor.dynamics.clearance.basis import is_damped
from leg_wear_monitor.dynamics.clearance.model import ClearanceModel, Coupling, coupling_of, rigid_coupling
from leg_wear_monitor.dynamics.clearance.stepper import (
    INTERVALS,
    ClearanceStepper,
    LoadedTables,
    loaded_tables,
    put_force,
)
from leg_wear_monitor.dynamics.clearance.tables import POINTS as TABLE_POINTS
from leg_wear_monitor.dynamics.run import DONE, TORQUE, Setup, new_run_statistics, quintic
from leg_wear_monitor.dynamics.simulation import prepare
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.twin.reference import CrankProfile, LegParameters, worn_to

POINTS = INTERVALS // 4  # of a gait cycle: whole intervals of the stepper

# scatter of the ground's force from step to step, of its size and of its time in a gait cycle
_SIZE, _TIMING, _SEED = 0.1, 0.02, 20261125

_advance = ADVANCE.call


@entry
def simulate_torque(
    advance_address,
    model,
    feeds_back,
    state,
    pieces,
    period,
    turn,
    first,
    statistics,
    work,
    polynomial,
    torque,
):
    """Simulate gait cycles from the one with the number ``first``; write mean torques between equal times.

    ``pieces`` (POINTS, 7) are the crank's motion in cycle 0, and a cycle takes ``period`` [s] for ``turn``
    [rad]; ``torque`` (cycles, POINTS) [N m]. Returns DONE, or the reason for stopping.
    """
    cycles, points = torque.shape
    impulse = statistics.drive_integral[TORQUE]
    for cycle in range(first, first + cycles):
        for i in range(points):
            for j in range(polynomial.shape[0]):
                polynomial[j] = pieces[i, j]
            polynomial[0] += cycle * period
            polynomial[1] += cycle * turn
            # a little past the end of an interval, or rounding could leave it out
            end = (cycle * points + i + 1.01) * period / points
            status, _ = _advance(
                advance_address, (model, feeds_back, state, polynomial, end, statistics, work)
            )
            if status != DONE:
                return status
            before, impulse = impulse, statistics.drive_integral[TORQUE]
            torque[cycle - first, i] = (impulse - before) * (points / period)
    return DONE


class LegSimulation:
    """Simulates legs without wear, one after the other.

    Parameters
    ----------
    mechanism : Mechanism
    """

    def __init__(self, mechanism: Mechanism) -> None:
        self._mechanism = mechanism
        self._parameters: LegParameters | None = None
        self._loaded: LoadedTables | None = None

    def torque(
        self,
        profile: CrankProfile,
        parameters: LegParameters,
        clearance_m: Floats,
        depth: Floats,
        cycles: int,
    ) -> Floats | None:
        """Simulate a leg from the start.

        Parameters
        ----------
        profile : CrankProfile
        parameters : LegParameters
        clearance_m : (k,) array
            Mean clearances [m].
        depth : (k, 2, N) array
            Wear depths [m], which show where joints are worn.
        cycles : int

        Returns
        -------
        (cycles, POINTS) array or None
            Mean torque [N m] between equal steps of time of each gait cycle; None if it cannot be simulated.

        Raises
        ------
        AssemblyError
            If its bodies do not close.
        """
        if parameters != self._parameters:
            self._prepare(parameters)
        period, turn = TURN / abs(profile.speed), float(np.copysign(TURN, profile.speed))
        motions, step = [profile.at(phi) for phi in even_angles(profile)], period / POINTS
        pieces = np.array([quintic(i * step, motions[i], step, motions[i + 1]) for i in range(POINTS)])
        clearance, worn = worn_to(self._fresh, depth, clearance_m)
        self._setup.contacts.clearance[:] = clearance
        self._setup.surfaces.depth[:] = worn
        stepper = ClearanceStepper(self._setup, period / INTERVALS, tables=self._tables)
        coupling = drive_coupling(self._setup, stepper.model, parameters)
        stepper.model = stepper.model._replace(coupling=coupling)
        stepper.init(motions[0].angle, motions[0].speed)
        statistics = new_run_statistics(len(self._mechanism.joints))
        polynomial, torque = np.empty(7), np.empty((cycles, POINTS))
        address = stepper.advance_address(polynomial, statistics)
        for first, last in self._steps_alike(parameters.load, cycles):
            status = simulate_torque(
                address, stepper.model, self._setup.surfaces.feeds_back, stepper.state, pieces, period, turn,
                first, statistics, stepper.work, polynomial, torque[first:last],
            )  # fmt: skip
            if status != DONE:
                return None
        return torque

    def _steps_alike(self, load: Floats, cycles: int) -> Iterator[tuple[int, int]]:
        """Gait cycles, from the first to before the last, under the same load, which acts on the leg.

        A force that were the same in each step would let impacts fall at the same phases.
        """
        if self._loaded is None:
            yield 0, cycles
            return
        random, place = np.random.default_rng(_SEED), np.arange(len(load)) / len(load)
        phase = np.arange(TABLE_POINTS) / TABLE_POINTS
        for cycle in range(cycles):
            factor, late = 1.0 + _SIZE * random.standard_normal(), _TIMING * random.standard_normal()
            force = [factor * np.interp(phase - late, place, one, period=1.0) for one in load.T]
            put_force(self._loaded, np.stack(force, axis=1))
            yield cycle, cycle + 1

    def _prepare(self, parameters: LegParameters) -> None:
        """Prepare the simulation of legs with given masses, lengths and friction."""
        self._setup = prepare(parameters.in_air.applied(self._mechanism), wear=True)
        self._setup.contacts.wear_coefficient[:] = 0.0
        self._fresh = self._setup.contacts.clearance.copy()
        self._tables = ClearanceStepper(self._setup).model.tables
        self._loaded = None
        if parameters.load.size:
            self._loaded = loaded_tables(self._setup.linkage, self._setup.contacts, self._tables)
        self._parameters = parameters


def drive_coupling(setup: Setup, model: ClearanceModel, parameters: LegParameters) -> Coupling:
    """Coupling of a leg whose drive has a compliance."""
    if parameters.compliance == 0.0:
        return rigid_coupling()
    joints, damped = len(setup.clearance_joints), is_damped(setup.linkage.arrays)
    return coupling_of(
        model.tables, joints, damped, model.interval, 1.0 / parameters.compliance, parameters.damping
    )


def even_angles(profile: CrankProfile) -> Floats:
    """Angles (POINTS + 1,) [rad] of the evenly turning crank at equal steps of a gait cycle."""
    return np.linspace(0.0, np.copysign(TURN, profile.speed), POINTS + 1)
