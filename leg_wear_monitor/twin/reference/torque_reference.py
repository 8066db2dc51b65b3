"""The drive torque of a leg with given clearances, by simulation under the crank's own motion.

A clearance shows in where in the gait cycle the torque is rough. That depends on how the crank turns, so the
leg is simulated under the measured profile of the crank: with the clearances that are expected, and with each
of them wider in turn. That takes a minute of a processor, so it goes on a gait cycle at a time, in a thread:
preparing a leg alone takes longer than the samples of a live leg may wait.

It depends on the leg's masses, lengths and friction, too: legs with each body heavier and longer in turn, and
one with more friction, show which of them a leg has.
"""

from collections.abc import Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from typing import NamedTuple

import attrs
import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.errors import AssemblyError
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.twin.reference.crank_profile import CrankProfile
from leg_wear_monitor.twin.reference.leg_parameters import LegParameters
from leg_wear_monitor.twin.reference.leg_simulation import (
    POINTS,
    LegSimulation,
    LegSimulationSnapshot,
    even_angles,
)

CYCLES = 40  # simulated for each wider leg, and twice as many for each other one
WIDER = (1.2, 1.35, 1.5, 2.0, 3.0, 5.0, 8.0)  # factors on the expected clearance, one joint at a time

WORN, NARROWER = 1.2, 0.8  # a clearance over the new one, and a factor on the others beside it

HEAVIER, LONGER = 0.04, 0.004  # of a body's mass and length, one body at a time
ROUGHER = 1.5  # factor on the friction in the joints

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
    parameters : LegParameters
        Those of the expected leg.
    """

    profile: CrankProfile
    clearance_m: Floats
    torque_nm: tuple[HalfFloats, ...]
    parameters: LegParameters

    @property
    def is_whole(self) -> bool:
        """Whether all legs are simulated: a part of a reference has the torques of the first ones."""
        return len(self.torque_nm) == len(self.clearance_m)

    @property
    def angle(self) -> Floats:
        """Crank angle (POINTS + 1,) [rad] between the steps, from the profile's angle 0 on."""
        return self.profile.angles(even_angles(self.profile))


class _Leg(NamedTuple):
    """A leg to be simulated: its parameters, and its clearances (k,) [m]."""

    parameters: LegParameters
    clearance_m: Floats


class TorqueReferenceSnapshot(NamedTuple):
    """State of a `TorqueReferenceRun`; plain arrays and numbers.

    ``ahead`` holds the torque (POINTS,) of the gait cycle that is simulated but not counted yet, None instead
    of it where the leg failed; it is empty before the first. ``simulation`` is the state after it.
    """

    profile: CrankProfile
    legs: tuple[_Leg, ...]
    depth: Floats
    done: tuple[HalfFloats, ...]
    torque: HalfFloats
    cycle: int
    ahead: tuple[Floats | None, ...]
    simulation: LegSimulationSnapshot | None


class TorqueReferenceRun:
    """Simulates a torque reference, a gait cycle at a time.

    A thread simulates the next gait cycle while the caller goes on. `advance` waits for it: what it returns
    depends on the number of calls alone.

    Parameters
    ----------
    mechanism : Mechanism
    """

    def __init__(self, mechanism: Mechanism) -> None:
        self._mechanism = mechanism
        joints = [mechanism.clearances[joint] for joint in mechanism.clearance_joints]
        self._radius = np.array([joint.bushing_radius for joint in joints])
        self._fresh = np.array([joint.radial_clearance for joint in joints])
        self._legs: tuple[_Leg, ...] = ()
        self._done: tuple[HalfFloats, ...] = ()
        self._torque, self._cycle = np.zeros((0, POINTS), np.float16), 0
        self._pool = ThreadPoolExecutor(1, "torque-reference")
        self._ahead: Future[Floats | None] | None = None
        self._simulation = LegSimulation(mechanism)  # of the thread alone while that is at work

    @property
    def is_busy(self) -> bool:
        """Whether there is something to simulate."""
        return len(self._done) < len(self._legs)

    @property
    def progress(self) -> float:
        """Fraction of the gait cycles that are done; 0 where nothing was begun."""
        return sum(len(one) for one in self._done) / max(1, sum(map(self._cycles_of, self._legs)))

    def begin(
        self,
        clearance_m: Floats,
        depth: Floats,
        profile: CrankProfile,
        parameters: LegParameters | None = None,
    ) -> None:
        """Begin a reference: the expected leg, and each of its joints wider in turn.

        Parameters
        ----------
        clearance_m : (k,) array
                Expected mean clearances [m].
        depth : (k, 2, N) array
            Wear depths [m], which show where joints are worn.
        profile : CrankProfile
        parameters : LegParameters, optional
            Those of the mechanism file by default.
        """
        parameters = parameters or LegParameters.none(self._mechanism)
        centre = np.maximum(clearance_m, _LEAST_CLEARANCE_M)
        # no clearance is wider than its journal is thick; a worn joint may have got a new part without a word
        widest, is_worn = 0.5 * self._radius, centre > WORN * self._fresh
        narrower = np.where(is_worn, self._fresh, NARROWER * centre)
        legs = [_Leg(parameters, centre)]
        for k in range(len(centre)):
            sizes = [min(factor * centre[k], widest[k]) for factor in WIDER]
            for size in [*sizes, narrower[k]] if is_worn.any() else sizes:
                other = centre.copy()
                other[k] = size
                legs.append(_Leg(parameters, other))
        self._begin(legs, depth, profile)

    def go_on(self, part: TorqueReference, depth: Floats) -> None:
        """Go on with a reference of which the first legs were simulated in an earlier run.

        Parameters
        ----------
        part : TorqueReference
        depth : (k, 2, N) array
            Wear depths [m], as of `begin`.
        """
        legs = [_Leg(part.parameters, clearance_m) for clearance_m in part.clearance_m]
        self._begin(legs, depth, part.profile)
        self._done = part.torque_nm
        if self.is_busy:
            self._clear()

    @property
    def part(self) -> TorqueReference | None:
        """The legs of a reference that are simulated so far; None where none is, or all are."""
        if not (self._done and self.is_busy):
            return None
        clearance_m = np.array([leg.clearance_m for leg in self._legs])
        return TorqueReference(self._simulation.profile, clearance_m, self._done, self._legs[0].parameters)

    def begin_identification(
        self, clearance_m: Floats, depth: Floats, profile: CrankProfile, near: LegParameters
    ) -> None:
        """Begin the leg with given parameters, then each body heavier, each longer, and more friction."""
        clearance_m = np.maximum(clearance_m, _LEAST_CLEARANCE_M)
        changed = [near]
        for one in np.eye(len(near.mass)):
            changed.append(attrs.evolve(near, mass=near.mass + HEAVIER * one))
        for one in np.eye(len(near.mass)):
            changed.append(attrs.evolve(near, length=near.length + LONGER * one))
        changed.append(attrs.evolve(near, friction=near.friction * ROUGHER))
        self._begin([_Leg(each, clearance_m) for each in changed], depth, profile)

    def advance(self) -> TorqueReference | None:
        """Count the gait cycle that was simulated, and begin the next; the reference after the last one.

        A leg that cannot be simulated ends it without one.
        """
        if not self.is_busy:
            return None
        if self._ahead is not None:
            torque, self._ahead = self._ahead.result(), None
            if torque is None:
                self._legs, self._done = (), ()
                return None
            self._count(torque)
        if self.is_busy:
            leg = self._legs[len(self._done)]
            self._ahead = self._pool.submit(self._simulated, leg, self._depth, self._cycle)
            return None
        clearance_m = np.array([leg.clearance_m for leg in self._legs])
        return TorqueReference(self._simulation.profile, clearance_m, self._done, self._legs[0].parameters)

    def snapshot(self) -> TorqueReferenceSnapshot:
        """A copy of the whole state."""
        ahead = () if self._ahead is None else (self._ahead.result(),)
        return TorqueReferenceSnapshot(
            self._simulation.profile,
            self._legs,
            self._depth,
            self._done,
            self._torque.copy(),
            self._cycle,
            ahead,
            self._simulation.snapshot() if ahead and ahead[0] is not None else None,
        )

    def restore(self, snapshot: TorqueReferenceSnapshot) -> None:
        """Restore a snapshot of a run of the same mechanism; it continues bit for bit."""
        self._settle()
        self._legs, self._depth, self._done = snapshot.legs, snapshot.depth, snapshot.done
        self._simulation.use(snapshot.profile)
        self._torque, self._cycle = snapshot.torque.copy(), snapshot.cycle
        if snapshot.simulation is not None:
            leg = self._legs[len(self._done)]
            self._simulation.begin(leg.parameters, leg.clearance_m, self._depth)
            self._simulation.restore(snapshot.simulation)
        if snapshot.ahead:
            self._ahead = Future()
            self._ahead.set_result(snapshot.ahead[0])

    def _settle(self) -> None:
        """Wait for the thread, and forget what it simulated."""
        if self._ahead is not None:
            wait([self._ahead])
            self._ahead = None

    def _begin(self, legs: Sequence[_Leg], depth: Floats, profile: CrankProfile) -> None:
        self._settle()
        self._legs, self._depth, self._done = tuple(legs), depth.copy(), ()
        self._simulation.use(profile)
        self._clear()

    def _clear(self) -> None:
        """Make room for the next leg."""
        cycles = self._cycles_of(self._legs[len(self._done)])
        self._torque, self._cycle = np.zeros((cycles, POINTS), np.float16), 0

    def _count(self, torque: Floats) -> None:
        """Count a gait cycle with its torque (POINTS,)."""
        if self._cycle >= _SETTLING:
            self._torque[self._cycle - _SETTLING] = torque
        self._cycle += 1
        if self._cycle == _SETTLING + len(self._torque):
            self._done = (*self._done, self._torque)
            if self.is_busy:
                self._clear()

    def _cycles_of(self, leg: _Leg) -> int:
        """Gait cycles that are simulated for a leg."""
        return CYCLES if (leg.clearance_m != self._legs[0].clearance_m).any() else 2 * CYCLES

    def _simulated(self, leg: _Leg, depth: Floats, cycle: int) -> Floats | None:
        """Mean torque (POINTS,) in the next gait cycle of a leg; None if it cannot be simulated."""
        if cycle == 0:
            try:
                self._simulation.begin(leg.parameters, leg.clearance_m, depth)
            except AssemblyError:  # with such lengths it does not close
                return None
        return self._simulation.cycle(cycle)
