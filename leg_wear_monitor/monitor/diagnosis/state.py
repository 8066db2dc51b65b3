"""State of the torque observer; every value is immutable, so a shallow copy is a snapshot."""

import math
from typing import NamedTuple

import attrs
import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.monitor.diagnosis.change_detector import DetectorState
from leg_wear_monitor.monitor.diagnosis.clearance_fit import ClearanceFit
from leg_wear_monitor.monitor.diagnosis.diagnosis import Change, NotUsed
from leg_wear_monitor.monitor.diagnosis.signature import TorqueSensor
from leg_wear_monitor.monitor.diagnosis.torque_samples import NO_TORQUE_SAMPLES, TorqueSamples
from leg_wear_monitor.monitor.ledger.entry import CommissionedTorque
from leg_wear_monitor.twin.reference.crank_profile import CrankProfile
from leg_wear_monitor.twin.reference.leg_parameters import LegParameters
from leg_wear_monitor.twin.reference.torque_reference import TorqueReference

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
    cycles : tuple of SignedCycle
        The last gait cycles.
    reference : TorqueReference or None
    counted_m : (k,) array
        Counted clearances that the detector compares with.
    commissioned : CommissionedTorque or None
        Of the reference's cadence.
    set_aside : tuple of CommissionedTorque
        Of the same leg, each of another cadence.
    made : tuple of TorqueReference
        The last references that were simulated, each for another motion of the crank.
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
    unlike : int
        Gait cycles in a row whose crank turned otherwise than in the reference.
    not_used : dict of str to int
        Gait cycles that were not used, by the values of `NotUsed`; replaced, never changed.
    unused : tuple of NotUsed
        Reasons of the last gait cycles in a row that were not used.
    off_cadence_rpm : float
        Cadence of the last gait cycle if it is not the commanded one, else NaN.
    parameters : LegParameters or None
        Identified ones, of which references are made; None before.
    rounds : int
        How often parameters were identified.
    is_identifying : bool
        Whether the run simulates legs with other parameters.
    has_failed : bool
        Whether the leg could not be simulated for a reference.
    """

    counted_m: Floats
    samples: TorqueSamples = NO_TORQUE_SAMPLES
    due: tuple[tuple[int, int], ...] = ()
    sensor: TorqueSensor | None = None
    cycles: tuple[SignedCycle, ...] = ()
    reference: TorqueReference | None = None
    commissioned: CommissionedTorque | None = None
    set_aside: tuple[CommissionedTorque, ...] = ()
    made: tuple[TorqueReference, ...] = ()
    detector: DetectorState | None = None
    fit: ClearanceFit | None = None
    fit_cycles: int = 0
    fit_due: int = 0
    changes: tuple[Change, ...] = ()
    settled: tuple[Change, ...] = ()
    unlike: int = 0
    not_used: dict[str, int] = attrs.field(factory=dict)
    unused: tuple[NotUsed, ...] = ()
    off_cadence_rpm: float = math.nan
    parameters: LegParameters | None = None
    rounds: int = 0
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
