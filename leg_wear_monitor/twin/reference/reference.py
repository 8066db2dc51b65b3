"""Encoder angles of a leg with given clearances, and their derivatives by each clearance, from simulation.

The linear model of `joint_angles` contains the effect of an eccentricity on an angle. A wider clearance also
changes the eccentricities of the other joints, so a regression on the linear model alone attributes the
effect to wrong joints. Therefore the leg is simulated with the expected clearances, and with each of them
widened in turn; the differences are the columns of the regression. This takes seconds and is therefore done
one gait cycle at a time. The simulated crank turns as the measured one: ripple of 3 % under a reference of a
steady crank looks like clearances that are 65 um off.
"""

from typing import NamedTuple

import attrs
import numpy as np

from leg_wear_monitor.dynamics.clearance.stepper import ClearanceStepper, Snapshot
from leg_wear_monitor.dynamics.run.drive import quintic
from leg_wear_monitor.dynamics.run.protocol import DONE
from leg_wear_monitor.dynamics.run.run_statistics import new_run_statistics
from leg_wear_monitor.dynamics.simulation import prepare
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ideal import TURN
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.twin.reference.crank_profile import CrankProfile
from leg_wear_monitor.twin.reference.joint_angles import PHASES, AngleModel, design

CYCLES = 48  # simulated cycles of each leg: the scatter equals that of as many observed cycles
OPENED_M = 1.5e-4  # increase of each clearance in turn [m]

_FINE = 64  # points of a profile per phase, between which the time of a crank angle is interpolated
_LEAST_CLEARANCE_M = 5.0e-5
_LEAST_WEAR_M = 5.0e-6  # least mean wear whose profile is scaled; with less, a joint is widened evenly


@attrs.frozen(eq=False)
class Reference:
    """Deviations of a leg with given clearances from the ideal linkage, and their derivatives.

    Attributes
    ----------
    clearance_m : (k,) array
        Mean radial clearances.
    deviation : (P, m) array, rad
        Deviations for these clearances and encoders without errors.
    columns : (P, m, k + 1 + 2 m) array
        Derivatives by clearances [rad/m], the crank encoder's offset, each encoder's offset and scale error.
    cycles : int
        Number of simulated cycles of each leg.
    profile : CrankProfile
        How their crank turned.
    """

    clearance_m: Floats
    deviation: Floats
    columns: Floats
    cycles: int
    profile: CrankProfile


class ReferenceSnapshot(NamedTuple):
    """Complete state of a `ReferenceRun` as plain arrays and numbers."""

    profile: CrankProfile
    clearance_m: Floats
    depth: Floats
    total: Floats
    means: tuple[Floats, ...]
    cycle: int
    stepper: Snapshot | None


class ReferenceRun:
    """Computes a reference, one gait cycle at a time.

    Parameters
    ----------
    mechanism : Mechanism
        Driven at the speed of the observed gait.
    model : AngleModel
    cycles : int
        Averaged gait cycles of each leg, after a first one that is left out.
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
        self._use(CrankProfile.steady(self._setup.speed))

    @property
    def is_busy(self) -> bool:
        """Whether a reference is in progress."""
        return self._stepper is not None

    def begin(self, clearance_m: Floats, depth: Floats, profile: CrankProfile | None = None) -> None:
        """Begin a reference.

        Parameters
        ----------
        clearance_m : (k,) array
            Mean clearances.
        depth : (k, 2, N) array
            Wear depths [m], which show where joints are worn.
        profile : CrankProfile, optional
            That of a steady crank by default.
        """
        self._use(profile or CrankProfile.steady(self._setup.speed))
        self._target, self._depth = np.maximum(clearance_m, _LEAST_CLEARANCE_M), depth.copy()
        self._means = ()
        self._begin_leg()

    def advance(self) -> Reference | None:
        """Simulate one gait cycle.

        Returns
        -------
        Reference or None
            The reference after its last cycle, else None. If the motion of a leg diverges, the computation
            ends without a reference.
        """
        if self._stepper is None:
            return None
        begin_s = self._cycle * self._times[-1]
        turned = np.copysign(TURN * self._cycle, self._profile.speed)
        for i in range(PHASES):
            if self._cycle:  # the first cycle is left out
                self._total[i] += self._stepper.eccentricity.ravel()
            piece = self._pieces[i].copy()
            piece[0] += begin_s
            piece[1] += turned
            status, _ = self._stepper.advance(piece, begin_s + self._times[i + 1], self._statistics)
            if status != DONE:
                self._stepper = None
                return None
        self._cycle += 1
        if self._cycle <= self._cycles:
            return None
        self._means = (*self._means, _by_angle(self._total / self._cycles, self._setup.speed))
        if len(self._means) <= len(self._fresh):
            self._begin_leg()
            return None
        self._stepper = None
        return self._reference()

    def snapshot(self) -> ReferenceSnapshot:
        """A copy of the whole state."""
        stepper = self._stepper.snapshot() if self._stepper else None
        return ReferenceSnapshot(
            self._profile, self._target, self._depth, self._total.copy(), self._means, self._cycle, stepper
        )

    def restore(self, snapshot: ReferenceSnapshot) -> None:
        """Restore a snapshot of a run of the same mechanism and model; it continues bit-identically."""
        self._use(snapshot.profile)
        self._target, self._depth, self._means = snapshot.clearance_m, snapshot.depth, snapshot.means
        self._stepper = None
        if snapshot.stepper is not None:
            self._begin_leg().restore(snapshot.stepper)
        self._total, self._cycle = snapshot.total.copy(), snapshot.cycle

    def _begin_leg(self) -> ClearanceStepper:
        """Start the next leg: first with the target clearances, then with each of them widened in turn."""
        target = self._opened(len(self._means))
        clearance, depth = worn_to(self._fresh, self._depth, target)
        self._setup.contacts.clearance[:] = clearance
        self._setup.surfaces.depth[:] = depth
        self._stepper = ClearanceStepper(self._setup, tables=self._tables)
        self._stepper.init(self._start.angle, self._start.speed)
        self._total, self._cycle = np.zeros((PHASES, 2 * len(self._fresh))), 0
        return self._stepper

    def _use(self, profile: CrankProfile) -> None:
        """Prepare the drive between the middles of the phases, in a turn."""
        self._profile = profile
        sign = np.copysign(1.0, profile.speed)
        wanted = 0.5 * TURN / PHASES + sign * np.arange(PHASES + 1) * (TURN / PHASES)
        even = sign * np.linspace(-TURN, 2.0 * TURN, 3 * PHASES * _FINE + 1)
        phi = np.interp(sign * wanted, sign * profile.angles(even), even)
        self._times = (phi - phi[0]) / profile.speed
        motions = [profile.at(at) for at in phi]
        steps = np.diff(self._times)
        self._start = motions[0]
        self._pieces = np.array(
            [quintic(self._times[i], motions[i], steps[i], motions[i + 1]) for i in range(PHASES)]
        )

    def _opened(self, leg: int) -> Floats:
        """Clearances (k,) [m]: those of the target for leg 0, with joint k widened for leg k + 1."""
        target = self._target.copy()
        target[leg - 1 : leg] += OPENED_M
        return target

    def _reference(self) -> Reference:
        joints = len(self._fresh)
        by_e = self._model.by_e
        deviations = [np.einsum("pmkd,pkd->pm", by_e, mean) for mean in self._means]
        columns = design(self._model, self._means[0] / self._target[:, None])
        for k in range(joints):
            columns[:, :, k] = (deviations[k + 1] - deviations[0]) / OPENED_M
        return Reference(self._target, deviations[0], columns, self._cycles, self._profile)


def _by_angle(mean: Floats, speed: float) -> Floats:
    """Means (P, k, 2) in the order of the crank angle, for either direction of rotation."""
    if speed < 0.0:
        mean = np.roll(mean[::-1], 1, axis=0)
    return np.asarray(mean.reshape(PHASES, -1, 2))


def worn_to(fresh: Floats, depth: Floats, target: Floats) -> tuple[Floats, Floats]:
    """Clearances when new (k,) and wear depths (k, 2, N) that give the target (k,) mean clearances [m].

    The wear profile of a worn joint is scaled; a joint without a profile is widened evenly.
    """
    worn, wanted = depth.sum(axis=1).mean(axis=1), target - fresh
    scale = np.where((worn > _LEAST_WEAR_M) & (wanted > 0.0), wanted / np.maximum(worn, _LEAST_WEAR_M), 1.0)
    return target - scale * worn, scale[:, None, None] * depth
