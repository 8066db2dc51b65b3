"""The drive torque of a leg with given clearances, by simulation under the crank's own motion.

A clearance shows in where in the gait cycle the torque is rough. That depends on how the crank turns, so the
leg is simulated under the measured profile of the crank: with the clearances that are expected, and with each
of them wider in turn. That takes half a minute of a processor, so it goes on a gait cycle at a time.

It depends on the leg's masses and lengths, too: legs with each body heavier and longer in turn show which
bodies a leg has.
"""

from collections.abc import Sequence
from typing import NamedTuple

import attrs
import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.dynamics.clearance.stepper import INTERVALS, ClearanceStepper, Snapshot
from leg_wear_monitor.dynamics.run.drive import quintic
from leg_wear_monitor.dynamics.run.protocol import DONE
from leg_wear_monitor.dynamics.run.run_statistics import TORQUE, new_run_statistics
from leg_wear_monitor.dynamics.simulation import prepare
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ideal import TURN
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.twin.reference.body_factors import BodyFactors
from leg_wear_monitor.twin.reference.crank_profile import CrankProfile
from leg_wear_monitor.twin.reference.reference import worn_to

POINTS = INTERVALS // 4  # of a gait cycle: whole intervals of the stepper
CYCLES = 40  # simulated for each wider leg, and twice as many for each other one
WIDER = (1.2, 1.35, 1.5, 2.0, 3.0, 5.0, 8.0)  # factors on the expected clearance, one joint at a time

HEAVIER, LONGER = 0.04, 0.004  # of a body's mass and length, one body at a time

_SETTLING = 2  # gait cycles before those that count
_LEAST_CLEARANCE_M = 5.0e-5

HalfFloats = NDArray[np.float16]


@attrs.frozen(eq=False)
class TorqueReference:
    """Drive torque of simulated legs.

    Attributes
    ----------
    profile : CrankProfile
    clearance_m : (legs, k) array
        Mean radial clearances of each leg; the first leg is the expected one, then each joint is wider in
        turn, all sizes of the first joint before those of the next.
    torque_nm : tuple of (cycles, POINTS) arrays
        Mean drive torque between equal steps of time of a gait cycle, which begins at the profile's angle 0.
    bodies : BodyFactors
        Those of the expected leg.
    """

    profile: CrankProfile
    clearance_m: Floats
    torque_nm: tuple[HalfFloats, ...]
    bodies: BodyFactors

    @property
    def angle(self) -> Floats:
        """Crank angle (POINTS + 1,) [rad] between the steps, from the profile's angle 0 on."""
        return self.profile.angles(_even_angles(self.profile))


class _Leg(NamedTuple):
    """A leg to be simulated: its bodies, and its clearances (k,) [m]."""

    bodies: BodyFactors
    clearance_m: Floats


class TorqueReferenceSnapshot(NamedTuple):
    """State of a `TorqueReferenceRun`; plain arrays and numbers."""

    profile: CrankProfile
    legs: tuple[_Leg, ...]
    depth: Floats
    done: tuple[HalfFloats, ...]
    torque: HalfFloats
    cycle: int
    impulse: float
    stepper: Snapshot | None


class TorqueReferenceRun:
    """Simulates a torque reference, a gait cycle at a time.

    Parameters
    ----------
    mechanism : Mechanism
    """

    def __init__(self, mechanism: Mechanism) -> None:
        self._mechanism = mechanism
        self._prepare(BodyFactors.none(mechanism))
        self._radius = np.array(
            [mechanism.clearances[joint].bushing_radius for joint in mechanism.clearance_joints]
        )
        self._statistics = new_run_statistics(len(mechanism.joints))
        self._stepper: ClearanceStepper | None = None
        self._legs: tuple[_Leg, ...] = (_Leg(self._bodies, self._fresh),)
        self._depth = self._setup.surfaces.depth.copy()
        self._done: tuple[HalfFloats, ...] = ()
        self._torque, self._cycle = np.zeros((0, POINTS), np.float16), 0
        self._use(CrankProfile.steady(self._setup.speed))

    @property
    def is_busy(self) -> bool:
        """Whether there is something to simulate."""
        return self._stepper is not None

    @property
    def progress(self) -> float:
        """Fraction of the gait cycles that are done; 0 where nothing was begun."""
        return sum(len(one) for one in self._done) / sum(map(self._cycles_of, self._legs))

    def begin(
        self, clearance_m: Floats, depth: Floats, profile: CrankProfile, bodies: BodyFactors | None = None
    ) -> None:
        """Begin a reference: the expected leg, and each of its joints wider in turn.

        Parameters
        ----------
        clearance_m : (k,) array
            Expected mean clearances [m].
        depth : (k, 2, N) array
            Wear depths [m], which show where joints are worn.
        profile : CrankProfile
        bodies : BodyFactors, optional
            Those of the mechanism file by default.
        """
        bodies = bodies or BodyFactors.none(self._mechanism)
        centre = np.maximum(clearance_m, _LEAST_CLEARANCE_M)
        widest = 0.5 * self._radius  # no clearance is wider than its journal is thick
        legs = [_Leg(bodies, centre)]
        for k in range(len(centre)):
            for factor in WIDER:
                wider = centre.copy()
                wider[k] = min(factor * centre[k], widest[k])
                legs.append(_Leg(bodies, wider))
        self._begin(legs, depth, profile)

    def begin_bodies(
        self, clearance_m: Floats, depth: Floats, profile: CrankProfile, bodies: BodyFactors
    ) -> None:
        """Begin legs whose bodies are those given, then each of them heavier, then each of them longer."""
        clearance_m = np.maximum(clearance_m, _LEAST_CLEARANCE_M)
        changed = [bodies]
        for one in np.eye(len(bodies.mass)):
            changed.append(attrs.evolve(bodies, mass=bodies.mass + HEAVIER * one))
        for one in np.eye(len(bodies.mass)):
            changed.append(attrs.evolve(bodies, length=bodies.length + LONGER * one))
        self._begin([_Leg(each, clearance_m) for each in changed], depth, profile)

    def advance(self) -> TorqueReference | None:
        """Simulate one gait cycle; the reference, when that was the last one.

        A leg that cannot be simulated ends it without one.
        """
        if self._stepper is None:
            return None
        impulses = np.empty(POINTS + 1)
        impulses[0] = self._statistics.drive_integral[TORQUE]
        for i in range(POINTS):
            piece = self._pieces[i].copy()
            piece[0] += self._cycle * self._period
            piece[1] += self._cycle * self._turn
            # a little past the end of an interval, or rounding could leave it out
            end = (self._cycle * POINTS + i + 1.01) * self._period / POINTS
            status, _ = self._stepper.advance(piece, end, self._statistics)
            if status != DONE:
                self._stepper = None
                return None
            impulses[i + 1] = self._statistics.drive_integral[TORQUE]
        if self._cycle >= _SETTLING:
            self._torque[self._cycle - _SETTLING] = np.diff(impulses) * (POINTS / self._period)
        self._cycle += 1
        if self._cycle < _SETTLING + len(self._torque):
            return None
        self._done = (*self._done, self._torque)
        if len(self._done) < len(self._legs):
            self._begin_leg()
            return None
        self._stepper = None
        clearance_m = np.array([leg.clearance_m for leg in self._legs])
        return TorqueReference(self._profile, clearance_m, self._done, self._legs[0].bodies)

    def snapshot(self) -> TorqueReferenceSnapshot:
        """A copy of the whole state."""
        stepper = self._stepper.snapshot() if self._stepper else None
        impulse = float(self._statistics.drive_integral[TORQUE])
        return TorqueReferenceSnapshot(
            self._profile,
            self._legs,
            self._depth,
            self._done,
            self._torque.copy(),
            self._cycle,
            impulse,
            stepper,
        )

    def restore(self, snapshot: TorqueReferenceSnapshot) -> None:
        """Restore a snapshot of a run of the same mechanism; it continues bit for bit."""
        self._legs, self._depth, self._done = snapshot.legs, snapshot.depth, snapshot.done
        self._use(snapshot.profile)
        self._stepper = None
        if snapshot.stepper is not None:
            self._begin_leg().restore(snapshot.stepper)
        self._torque, self._cycle = snapshot.torque.copy(), snapshot.cycle
        self._statistics.drive_integral[TORQUE] = snapshot.impulse

    def _begin(self, legs: Sequence[_Leg], depth: Floats, profile: CrankProfile) -> None:
        self._legs, self._depth, self._done = tuple(legs), depth.copy(), ()
        self._use(profile)
        self._begin_leg()

    def _cycles_of(self, leg: _Leg) -> int:
        """Gait cycles that are simulated for a leg."""
        return CYCLES if (leg.clearance_m != self._legs[0].clearance_m).any() else 2 * CYCLES

    def _prepare(self, bodies: BodyFactors) -> None:
        """Prepare the simulation of a leg with given bodies."""
        self._bodies = bodies
        self._setup = prepare(bodies.applied(self._mechanism), wear=True)
        self._setup.contacts.wear_coefficient[:] = 0.0
        self._fresh = self._setup.contacts.clearance.copy()
        self._tables = ClearanceStepper(self._setup).model.tables

    def _use(self, profile: CrankProfile) -> None:
        """Prepare the drive polynomials of a gait cycle."""
        self._profile = profile
        self._period = TURN / abs(profile.speed)
        self._turn = float(np.copysign(TURN, profile.speed))
        motions = [profile.at(phi) for phi in _even_angles(profile)]
        step = self._period / POINTS
        self._pieces = np.array([quintic(i * step, motions[i], step, motions[i + 1]) for i in range(POINTS)])

    def _begin_leg(self) -> ClearanceStepper:
        """Set the next leg in motion."""
        number = len(self._done)
        leg = self._legs[number]
        if leg.bodies is not self._bodies:
            self._prepare(leg.bodies)
        clearance, depth = worn_to(self._fresh, self._depth, leg.clearance_m)
        self._setup.contacts.clearance[:] = clearance
        self._setup.surfaces.depth[:] = depth
        self._stepper = ClearanceStepper(self._setup, self._period / INTERVALS, tables=self._tables)
        start = self._profile.at(0.0)
        self._stepper.init(start.angle, start.speed)
        self._torque = np.zeros((self._cycles_of(leg), POINTS), np.float16)
        self._cycle, self._statistics.drive_integral[TORQUE] = 0, 0.0
        return self._stepper


def _even_angles(profile: CrankProfile) -> Floats:
    """Angles (POINTS + 1,) [rad] of the evenly turning crank at equal steps of a gait cycle."""
    return np.linspace(0.0, np.copysign(TURN, profile.speed), POINTS + 1)
