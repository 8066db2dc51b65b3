"""The drive torque of one simulated leg, whose crank turns in the same way in each gait cycle."""

from typing import NamedTuple

import numpy as np

from leg_wear_monitor.dynamics.clearance.stepper import INTERVALS, ClearanceStepper, Snapshot
from leg_wear_monitor.dynamics.run.drive import quintic
from leg_wear_monitor.dynamics.run.protocol import DONE
from leg_wear_monitor.dynamics.run.run_statistics import TORQUE, new_run_statistics
from leg_wear_monitor.dynamics.simulation import prepare
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ideal import TURN
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.twin.reference.crank_profile import CrankProfile
from leg_wear_monitor.twin.reference.leg_parameters import LegParameters
from leg_wear_monitor.twin.reference.reference import worn_to

POINTS = INTERVALS // 4  # of a gait cycle: whole intervals of the stepper


class LegSimulationSnapshot(NamedTuple):
    """State of a `LegSimulation`: that of its stepper, and the impulse of the torque [N m s]."""

    stepper: Snapshot
    impulse: float


class LegSimulation:
    """Simulates legs without wear, one after the other.

    Parameters
    ----------
    mechanism : Mechanism

    Attributes
    ----------
    profile : CrankProfile
    """

    profile: CrankProfile

    def __init__(self, mechanism: Mechanism) -> None:
        self._mechanism = mechanism
        self._parameters: LegParameters | None = None
        self._statistics = new_run_statistics(len(mechanism.joints))

    def use(self, profile: CrankProfile) -> None:
        """Turn the crank as a profile does, from the next leg on."""
        self.profile = profile
        self._period = TURN / abs(profile.speed)
        self._turn = float(np.copysign(TURN, profile.speed))
        motions = [profile.at(phi) for phi in even_angles(profile)]
        step = self._period / POINTS
        self._pieces = np.array([quintic(i * step, motions[i], step, motions[i + 1]) for i in range(POINTS)])

    def begin(self, parameters: LegParameters, clearance_m: Floats, depth: Floats) -> None:
        """Set a leg in motion.

        Parameters
        ----------
        parameters : LegParameters
        clearance_m : (k,) array
            Mean clearances [m].
        depth : (k, 2, N) array
            Wear depths [m], which show where joints are worn.

        Raises
        ------
        AssemblyError
            If its bodies do not close.
        """
        if parameters != self._parameters:
            self._prepare(parameters)
        clearance, worn = worn_to(self._fresh, depth, clearance_m)
        self._setup.contacts.clearance[:] = clearance
        self._setup.surfaces.depth[:] = worn
        self._stepper = ClearanceStepper(self._setup, self._period / INTERVALS, tables=self._tables)
        start = self.profile.at(0.0)
        self._stepper.init(start.angle, start.speed)
        self._statistics.drive_integral[TORQUE] = 0.0

    def cycle(self, number: int) -> Floats | None:
        """Mean torque (POINTS,) [N m] in a gait cycle, the next one; None if it cannot be simulated."""
        impulses = np.empty(POINTS + 1)
        impulses[0] = self._statistics.drive_integral[TORQUE]
        for i in range(POINTS):
            piece = self._pieces[i].copy()
            piece[0] += number * self._period
            piece[1] += number * self._turn
            # a little past the end of an interval, or rounding could leave it out
            end = (number * POINTS + i + 1.01) * self._period / POINTS
            status, _ = self._stepper.advance(piece, end, self._statistics)
            if status != DONE:
                return None
            impulses[i + 1] = self._statistics.drive_integral[TORQUE]
        return np.asarray(np.diff(impulses) * (POINTS / self._period))

    def snapshot(self) -> LegSimulationSnapshot:
        """A copy of the state of the leg that is in motion."""
        impulse = float(self._statistics.drive_integral[TORQUE])
        return LegSimulationSnapshot(self._stepper.snapshot(), impulse)

    def restore(self, snapshot: LegSimulationSnapshot) -> None:
        """Restore the state of a leg that has begun in the same way."""
        self._stepper.restore(snapshot.stepper)
        self._statistics.drive_integral[TORQUE] = snapshot.impulse

    def _prepare(self, parameters: LegParameters) -> None:
        """Prepare the simulation of legs with given masses, lengths and friction."""
        self._setup = prepare(parameters.applied(self._mechanism), wear=True)
        self._setup.contacts.wear_coefficient[:] = 0.0
        self._fresh = self._setup.contacts.clearance.copy()
        self._tables = ClearanceStepper(self._setup).model.tables
        self._parameters = parameters


def even_angles(profile: CrankProfile) -> Floats:
    """Angles (POINTS + 1,) [rad] of the evenly turning crank at equal steps of a gait cycle."""
    return np.linspace(0.0, np.copysign(TURN, profile.speed), POINTS + 1)
