"""State of the torque observer; every value is immutable, so a shallow copy is a snapshot."""

import math
from typing import NamedTuple

import attrs
import numpy as np

from leg_wear_monitor.estimate.cause import Change
from leg_wear_monitor.estimate.change_detector import DetectorState
from leg_wear_monitor.estimate.clearance_fit import ClearanceFit
from leg_wear_monitor.estimate.commissioned_torque import CommissionedTorque
from leg_wear_monitor.estimate.ground_load import GroundLoad
from leg_wear_monitor.estimate.signature import TorqueSensor
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.monitor.diagnosis.diagnosis import NotUsed
from leg_wear_monitor.monitor.diagnosis.torque_samples import NO_TORQUE_SAMPLES, TorqueSamples
from leg_wear_monitor.twin.reference.crank_profile import CrankProfile, mean_profile
from leg_wear_monitor.twin.reference.leg_parameters import LegParameters
from leg_wear_monitor.twin.reference.torque_reference import CADENCES, TorqueReference

WINDOW_CYCLES = 60  # that are kept at a cadence, and that clearances are estimated from
UNUSED_CYCLES = 20  # in a row, after which a result is not one of the leg as it walks now


class SignedCycle(NamedTuple):
    """A gait cycle: stamps of its begin and end [ns], its signature (F,), and how the crank turned.

    ``late`` is the time from its begin to its first torque sample, in periods of the sensor.
    """

    begin_ns: int
    end_ns: int
    signature: Floats
    profile: CrankProfile
    late: float


@attrs.frozen(eq=False)
class AtCadence:
    """What is known of a leg at one cadence, more precisely under one motion of the crank.

    Attributes
    ----------
    reference : TorqueReference
    sensor : TorqueSensor
        With the channel and the noise that were found with the reference.
    commissioned : CommissionedTorque or None
    cycles : tuple of SignedCycle
        The last gait cycles.
    is_final : bool
        Whether a reference with the identified parameters explained the leg less well.
    """

    reference: TorqueReference
    sensor: TorqueSensor
    commissioned: CommissionedTorque | None = None
    cycles: tuple[SignedCycle, ...] = ()
    is_final: bool = False


@attrs.define
class TorqueState:
    """State of a `TorqueObserver`, its reference run aside.

    Attributes
    ----------
    samples : TorqueSamples
    due : tuple of (int, int)
        Begin and end [ns] of ended gait cycles that are not evaluated yet.
    sensor : TorqueSensor or None
        As found in the first gait cycle with torques.
    waiting : tuple of SignedCycle
        The last gait cycles alike whose motion of the crank has no reference.
    odd : tuple of SignedCycle
        Others without a reference, of which the next may be like some.
    reference : TorqueReference or None
    cycles : tuple of SignedCycle
        The last gait cycles at the reference's cadence.
    counted_m : (k,) array
        Counted clearances that the detector compares with.
    commissioned : CommissionedTorque or None
        At the reference's cadence.
    is_final : bool
        As of `AtCadence`.
    set_aside : tuple of AtCadence
        Other cadences, the last one first.
    baselines : tuple of CommissionedTorque
        Those of the ledger whose cadence was not walked yet.
    detector : DetectorState or None
    fit : ClearanceFit or None
    fit_cycles : int
        Gait cycles in the fit.
    fit_due : int
        Gait cycles until the next fit.
    changes : tuple of Change
        Unsettled changes; the last one is being observed.
    settled : tuple of Change
        Changes by which the counted clearances were corrected.
    not_used : dict of str to int
        Gait cycles that were not used, by the values of `NotUsed`; replaced, never changed.
    unused : tuple of NotUsed
        Reasons of the last gait cycles in a row that were not used.
    off_cadence_rpm : float
        Cadence of the last gait cycle if it is not the commanded one, else NaN.
    parameters : LegParameters or None
        Identified ones, of which references are made; None before.
    rounds, load_rounds : int
        How often parameters were identified, and the ground's force.
    load : GroundLoad or None
        The force of the ground by the commissioned leg.
    is_identifying : bool
        Whether the run simulates legs with other parameters.
    has_failed : bool
        Whether the leg could not be simulated for a reference.
    """

    counted_m: Floats
    samples: TorqueSamples = NO_TORQUE_SAMPLES
    due: tuple[tuple[int, int], ...] = ()
    sensor: TorqueSensor | None = None
    waiting: tuple[SignedCycle, ...] = ()
    odd: tuple[SignedCycle, ...] = ()
    reference: TorqueReference | None = None
    cycles: tuple[SignedCycle, ...] = ()
    commissioned: CommissionedTorque | None = None
    is_final: bool = False
    set_aside: tuple[AtCadence, ...] = ()
    baselines: tuple[CommissionedTorque, ...] = ()
    detector: DetectorState | None = None
    fit: ClearanceFit | None = None
    fit_cycles: int = 0
    fit_due: int = 0
    changes: tuple[Change, ...] = ()
    settled: tuple[Change, ...] = ()
    not_used: dict[str, int] = attrs.field(factory=dict)
    unused: tuple[NotUsed, ...] = ()
    off_cadence_rpm: float = math.nan
    parameters: LegParameters | None = None
    rounds: int = 0
    load_rounds: int = 0
    load: GroundLoad | None = None
    is_identifying: bool = False
    has_failed: bool = False

    def leave_out(self, reason: NotUsed, cycles: int = 1) -> None:
        """Count gait cycles that are not used."""
        self.not_used = {**self.not_used, reason.value: self.not_used.get(reason.value, 0) + cycles}
        self.unused = (*self.unused, reason)[-UNUSED_CYCLES:]

    @property
    def signatures(self) -> Floats:
        """Signatures (n, F) of the kept cycles."""
        return np.array([cycle.signature for cycle in self.cycles])

    @property
    def profile(self) -> CrankProfile:
        """Mean motion of the crank in the kept cycles, or in those that wait where there are none."""
        return mean_profile([cycle.profile for cycle in self.cycles or self.waiting])

    @property
    def is_compared(self) -> bool:
        """Whether gait cycles are tested: not before a further cadence has a baseline of its own."""
        return self.commissioned is not None or not any(one.commissioned for one in self.set_aside)

    @property
    def known(self) -> tuple[AtCadence, ...]:
        """All cadences with a reference, the present one first."""
        if self.reference is None or self.sensor is None:
            return self.set_aside
        own = AtCadence(self.reference, self.sensor, self.commissioned, self.cycles, self.is_final)
        return own, *self.set_aside

    @property
    def all_commissioned(self) -> tuple[CommissionedTorque, ...]:
        """Baselines of all cadences."""
        return (*(one.commissioned for one in self.known if one.commissioned), *self.baselines)

    def at(self, profile: CrankProfile) -> AtCadence | None:
        """Another cadence than the present one whose crank turns as in a profile."""
        return next((one for one in self.set_aside if profile.is_like(one.reference.profile)), None)

    def turn_to(self, one: AtCadence) -> None:
        """Make another cadence the present one; what was found of changes stays."""
        self.set_aside = tuple(each for each in self.known if each is not one)[: CADENCES - 1]
        self.reference, self.sensor, self.commissioned = one.reference, one.sensor, one.commissioned
        self.cycles, self.is_final, self.fit_due = one.cycles, one.is_final, 0

    def wait_with(self, cycle: SignedCycle) -> None:
        """Keep a gait cycle for a reference that is to be made, with those before that are like it.

        One odd cycle in five must not begin the wait anew.
        """
        kept = sorted((*self.odd, *self.waiting), key=lambda one: one.begin_ns)[1 - WINDOW_CYCLES :]
        alike = {one.begin_ns for one in kept if one.profile.is_like(cycle.profile)}
        self.waiting = (*(one for one in kept if one.begin_ns in alike), cycle)
        self.odd = tuple(one for one in kept if one.begin_ns not in alike)

    def forget_cycles(self, since_ns: int = 0) -> None:
        """Forget the gait cycles that began at a stamp or later, at all cadences."""

        def rest(cycles: tuple[SignedCycle, ...]) -> tuple[SignedCycle, ...]:
            return tuple(cycle for cycle in cycles if cycle.begin_ns < since_ns)

        self.cycles, self.waiting, self.odd = rest(self.cycles), rest(self.waiting), rest(self.odd)
        self.set_aside = tuple(attrs.evolve(one, cycles=rest(one.cycles)) for one in self.set_aside)

    def forget_baselines(self, since_ns: int = 0) -> None:
        """Forget the baselines with gait cycles after a stamp, at all cadences."""

        def rest(one: CommissionedTorque | None) -> CommissionedTorque | None:
            return None if one and one.stamp_ns > since_ns else one

        self.commissioned = rest(self.commissioned)
        self.set_aside = tuple(
            attrs.evolve(one, commissioned=rest(one.commissioned)) for one in self.set_aside
        )
        self.baselines = tuple(one for one in self.baselines if rest(one))
