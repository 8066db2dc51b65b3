"""What encoders would show of a leg with given clearances, and how that changes with each: by simulation.

The linear model of `joint_angles` knows what an eccentricity does to an angle. But a wider clearance also
changes where the other journals lie: a regression on it mistakes one joint for another. So the leg is
simulated with the clearances that are expected, and with each of them wider in turn; the differences are the
columns of the regression. That takes seconds, so it goes on a gait cycle at a time.
"""

from typing import NamedTuple

import attrs
import numpy as np

from leg_wear_monitor.dynamics.clearance.stepper import ClearanceStepper, Snapshot
from leg_wear_monitor.dynamics.run.drive import steady_drive
from leg_wear_monitor.dynamics.run.protocol import DONE
from leg_wear_monitor.dynamics.run.run_statistics import new_run_statistics
from leg_wear_monitor.dynamics.simulation import prepare
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ideal import TURN
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.twin.reference.joint_angles import PHASES, AngleModel, design

CYCLES = 48  # simulated for each leg: its scatter is that of as many cycles seen
OPENED_M = 1.5e-4  # by which each clearance is wider in turn

_LEAST_CLEARANCE_M = 5.0e-5
_LEAST_WEAR_M = 5.0e-6  # from which on wear has a profile that more wear is supposed to follow


@attrs.frozen(eq=False)
class Reference:
    """Deviations of a leg with given clearances from the ideal linkage, and their derivatives.

    Attributes
    ----------
    clearance_m : (k,) array
    deviation : (P, m) array, rad
        With these clearances and encoders without an error.
    columns : (P, m, k + 1 + 2 m) array
        Derivatives by clearances [rad/m], the crank encoder's offset, each encoder's offset and scale error.
    cycles : int
        That were simulated for it.
    """

    clearance_m: Floats
    deviation: Floats
    columns: Floats
    cycles: int


class ReferenceSnapshot(NamedTuple):
    """All of a `ReferenceRun`; plain arrays and numbers."""

    clearance_m: Floats
    depth: Floats
    total: Floats
    means: tuple[Floats, ...]
    cycle: int
    stepper: Snapshot | None


class ReferenceRun:
    """Simulates a reference, a gait cycle at a time.

    Parameters
    ----------
    mechanism : Mechanism
        Driven at the speed that encoders are looked at.
    model : AngleModel
    cycles : int
        That each of the legs is simulated for, after a first one that settles.
    """

    def __init__(self, mechanism: Mechanism, model: AngleModel, cycles: int = CYCLES) -> None:
        self._setup, self._model, self._cycles = prepare(mechanism, wear=True), model, cycles
        self._setup.contacts.wear_coefficient[:] = 0.0
        self._fresh = self._setup.contacts.clearance.copy()
        self._tables = ClearanceStepper(self._setup).model.tables
        self._statistics = new_run_statistics(len(mechanism.joints))
        self._stepper: ClearanceStepper | None = None
        self._target, self._depth = self._fresh, self._setup.surfaces.depth.copy()
        self._total, self._cycle = np.zeros(0), 0
        self._means: tuple[Floats, ...] = ()

    @property
    def is_busy(self) -> bool:
        """Whether there is something to simulate."""
        return self._stepper is not None

    def begin(self, clearance_m: Floats, depth: Floats) -> None:
        """Begin a reference of mean clearances (k,) [m]; depths (k, 2, N) [m] tell where joints are worn."""
        self._target, self._depth = np.maximum(clearance_m, _LEAST_CLEARANCE_M), depth.copy()
        self._means = ()
        self._begin_leg()

    def advance(self) -> Reference | None:
        """Simulate one gait cycle; the reference, when that was the last one.

        A leg that cannot be simulated ends it without one.
        """
        if self._stepper is None:
            return None
        total, at = self._total, 0.5 * TURN / PHASES
        speed = self._setup.speed
        polynomial, period = steady_drive(at, speed), TURN / abs(speed)
        for step in range(self._cycle * PHASES, (self._cycle + 1) * PHASES):
            status, _ = self._stepper.advance(polynomial, step * period / PHASES, self._statistics)
            if status != DONE:
                self._stepper = None
                return None
            if self._cycle:  # the first cycle settles
                total[step % PHASES] += self._stepper.eccentricity.ravel()
        self._cycle += 1
        if self._cycle <= self._cycles:
            return None
        self._means = (*self._means, _by_angle(total / self._cycles, speed))
        if len(self._means) <= len(self._fresh):
            self._begin_leg()
            return None
        self._stepper = None
        return self._reference()

    def snapshot(self) -> ReferenceSnapshot:
        """A copy of the whole state."""
        stepper = self._stepper.snapshot() if self._stepper else None
        return ReferenceSnapshot(
            self._target, self._depth, self._total.copy(), self._means, self._cycle, stepper
        )

    def restore(self, snapshot: ReferenceSnapshot) -> None:
        """Go back to a snapshot of a run of the same mechanism and model; it goes on bit for bit."""
        self._target, self._depth, self._means = snapshot.clearance_m, snapshot.depth, snapshot.means
        self._stepper = None
        if snapshot.stepper is not None:
            self._begin_leg().restore(snapshot.stepper)
        self._total, self._cycle = snapshot.total.copy(), snapshot.cycle

    def _begin_leg(self) -> ClearanceStepper:
        """Set the next leg in motion: the first as expected, then each joint wider in turn."""
        target = self._opened(len(self._means))
        clearance, depth = worn_to(self._fresh, self._depth, target)
        self._setup.contacts.clearance[:] = clearance
        self._setup.surfaces.depth[:] = depth
        self._stepper = ClearanceStepper(self._setup, tables=self._tables)
        self._stepper.init(0.5 * TURN / PHASES, self._setup.speed)
        self._total, self._cycle = np.zeros((PHASES, 2 * len(self._fresh))), 0
        return self._stepper

    def _opened(self, leg: int) -> Floats:
        """Clearances of leg 0 as wanted, of leg k + 1 with joint k wider."""
        target = self._target.copy()
        target[leg - 1 : leg] += OPENED_M
        return target

    def _reference(self) -> Reference:
        joints = len(self._fresh)
        by_e = self._model.by_e
        seen = [np.einsum("pmkd,pkd->pm", by_e, mean) for mean in self._means]
        columns = design(self._model, self._means[0] / self._target[:, None])
        for k in range(joints):
            columns[:, :, k] = (seen[k + 1] - seen[0]) / OPENED_M
        return Reference(self._target, seen[0], columns, self._cycles)


def _by_angle(mean: Floats, speed: float) -> Floats:
    """Means (P, k, 2) with phases that count with the crank's angle, whichever way it turns."""
    if speed < 0.0:
        mean = np.roll(mean[::-1], 1, axis=0)
    return np.asarray(mean.reshape(PHASES, -1, 2))


def worn_to(fresh: Floats, depth: Floats, target: Floats) -> tuple[Floats, Floats]:
    """Clearances when new (k,) and depths (k, 2, N) of joints whose mean clearances are the target (k,) [m].

    A joint that is worn is supposed to be worn more, or less, where it is; what has no profile opens evenly.
    """
    worn, wanted = depth.sum(axis=1).mean(axis=1), target - fresh
    scale = np.where((worn > _LEAST_WEAR_M) & (wanted > 0.0), wanted / np.maximum(worn, _LEAST_WEAR_M), 1.0)
    return target - scale * worn, scale[:, None, None] * depth
