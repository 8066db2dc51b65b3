"""State of the torque observer; every value is immutable, so a shallow copy is a snapshot."""

import math
from collections.abc import Mapping, Sequence
from enum import Enum
from typing import Any, NamedTuple

import attrs
import numpy as np

from leg_wear_monitor.estimate.cause import SURE_SIGMAS, Cause, Change, TorqueExplanation
from leg_wear_monitor.estimate.clearance_fit import ClearanceFit, DetectorState
from leg_wear_monitor.estimate.drive import DIRECT, Channel
from leg_wear_monitor.estimate.ground_load import GroundLoad
from leg_wear_monitor.estimate.signature import CommissionedTorque, TorqueSensor
from leg_wear_monitor.files import finite_or_none
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.state import FootLoad
from leg_wear_monitor.twin import TORQUE
from leg_wear_monitor.twin.reference import (
    UNLIKE,
    CrankProfile,
    LegParameters,
    mean_profile,
)
from leg_wear_monitor.twin.references import TorqueReference
from leg_wear_monitor.twin.sample import (
    GAIT_SAMPLE,
    Samples,
    has_value_of,
    is_valid,
    newest,
    of_crank,
)

# Samples of the crank and of the drive torque, kept until their gait cycle ends.


@attrs.frozen(eq=False)
class TorqueSamples:
    """Samples with a crank angle, and samples with a drive torque, in the order of arrival."""

    crank: Samples = attrs.field(factory=lambda: np.zeros(0, GAIT_SAMPLE))
    torque: Samples = attrs.field(factory=lambda: np.zeros(0, GAIT_SAMPLE))

    def extended(self, piece: Samples) -> "TorqueSamples":
        """With the valid ones of a piece."""
        torque = piece[is_valid(piece) & has_value_of(piece, TORQUE) & np.isfinite(piece["torque_nm"])]
        return TorqueSamples(
            np.concatenate([self.crank, of_crank(piece)]), np.concatenate([self.torque, torque])
        )

    def after(self, stamp_ns: int) -> "TorqueSamples":
        """Those from a stamp on."""
        return TorqueSamples(newest(self.crank, stamp_ns), newest(self.torque, stamp_ns))


def mean_of(values: Floats) -> float:
    """Mean of those values (n,) that are finite; NaN without any."""
    known = values[np.isfinite(values)]
    return float(known.mean()) if len(known) else math.nan


# Clearances that the measured drive torque shows, compared with the modelled ones.


class DiagnosisState(Enum):
    """Possible states of the diagnosis; the value is the word that files contain."""

    OFF = "off"
    WAITING = "waiting"
    AS_MODELLED = "as_modelled"
    CHANGED = "changed"


class NotUsed(Enum):
    """Why a gait cycle contains no information on clearances; files contain the value."""

    CADENCE = "cadence"
    STANDSTILL = "standstill"
    GAP = "gap"
    JITTER = "jitter"
    TORQUE_CAUSE = "torque_cause"
    UNLIKE = "unlike"


@attrs.frozen
class Body:
    """Identified mass and length of a body, as factors on the mechanism file's values."""

    name: str
    mass: float
    length: float


@attrs.frozen(kw_only=True)
class Diagnosis:
    """Clearances estimated from the drive torque, and changes of the leg.

    Attributes
    ----------
    state : DiagnosisState
    reason : str
        Why there is no estimate yet, or why it is not valid now; empty otherwise.
    next_step : str
        Next result, and after how many gait cycles; empty if walking adds nothing.
    cycles : int
        Gait cycles in the estimate.
    cycles_not_used : mapping of str to int
        Gait cycles of this run that were not used, by reason: a different cadence; a stop and a start in it;
        a bridged gap, or too few torque samples; irregular stamps; a torque that is wrong as received; a
        crank that turns otherwise.
    clearance_m, sigma_m : tuple of float
        Estimated clearance of each clearance joint and its standard deviation; NaN if it is not observable.
    least_m : tuple of float
        Clearance that each joint surely has: the least by `SURE_SIGMAS` in the last estimates, as many in a
        row as an alarm waits for; minus infinity before.
    baseline_m : tuple of float
        Modelled clearances when the baseline was taken; empty without a baseline.
    tolerance_m : tuple of float
        Standard deviations of the modelled clearances. The torque shows the change since the baseline, so an
        estimated clearance contains this error in addition to its own.
    changes : tuple of Change
        Significant departures, the oldest first: corrections of modelled clearances, and, if the state is
        CHANGED, the change that is not settled yet.
    channel : Channel
        Delay, low-pass and load friction of the drive by the commissioned gait cycles; of a drive that adds
        nothing before.
    bodies : tuple of Body
        Identified masses and lengths in the wear model; empty while the model uses the file's values.
    friction : float
        Factor on the friction in the joints in the wear model.
    load : FootLoad or None
        Force of the ground that the foot surely carries.
    is_load_unknown : bool
        True if the leg walks on the ground, and neither a sensor nor the torque shows the ground's force.
    compliance : float
        Compliance between the measured crank angle and the crank in the wear model [rad/(N m)]; 0 if rigid.
    temperature_c, commissioned_c : float or None
        Temperature of the drive in the last gait cycles, and in the baseline's gait cycles [°C]; None if it
        was not measured.
    """

    state: DiagnosisState = DiagnosisState.OFF
    reason: str = ""
    next_step: str = ""
    cycles: int = 0
    cycles_not_used: Mapping[str, int] = attrs.field(factory=dict)
    clearance_m: tuple[float, ...] = ()
    sigma_m: tuple[float, ...] = ()
    least_m: tuple[float, ...] = ()
    baseline_m: tuple[float, ...] = ()
    tolerance_m: tuple[float, ...] = ()
    changes: tuple[Change, ...] = ()
    channel: Channel = DIRECT
    bodies: tuple[Body, ...] = ()
    friction: float = 1.0
    load: FootLoad | None = None
    is_load_unknown: bool = False
    compliance: float = 0.0
    temperature_c: float | None = attrs.field(default=None, converter=finite_or_none)
    commissioned_c: float | None = attrs.field(default=None, converter=finite_or_none)

    def of_joint(self, k: int) -> tuple[float, float] | None:
        """Clearance of joint k, and its standard deviation; None where it is not observable."""
        if not self.clearance_m or not math.isfinite(self.clearance_m[k]):
            return None
        return self.clearance_m[k], self.with_tolerance(k, self.sigma_m[k])

    def least_of_joint(self, k: int) -> float:
        """Clearance that joint k surely has, if the modelled one was too large in the baseline."""
        reach_m = max(self.clearance_m[k] - self.least_m[k], 0.0)
        return self.clearance_m[k] - self.with_tolerance(k, reach_m, SURE_SIGMAS)

    def change_of_joint(self, k: int) -> tuple[float, float] | None:
        """Change of joint k since the baseline, and its standard deviation; None where it is not observable.

        It does not contain the error of the modelled clearance.
        """
        if self.of_joint(k) is None or not self.baseline_m:
            return None
        return self.clearance_m[k] - self.baseline_m[k], self.sigma_m[k]

    def with_tolerance(self, k: int, error_m: float, sigmas: float = 1.0) -> float:
        """An error of joint k together with the error of its modelled clearance."""
        return math.hypot(error_m, sigmas * self.tolerance_m[k]) if self.tolerance_m else error_m

    def replaces(self, explained: TorqueExplanation) -> bool:
        """True if the causes that the diagnosis names are in force, and not different gross causes.

        The gross causes have wide priors about the model of a leg. The diagnosis has narrow ones about this
        leg as it was, but it cannot use a torque that is wrong as received.
        """
        if explained.is_input_fault or self.state is not DiagnosisState.CHANGED:
            return False
        causes = {each.cause for each in self.changes if each.is_named and not each.is_corrected}
        codes = {cause.fault_code for cause in causes - {Cause.NOISE, Cause.UNKNOWN}}
        return bool(codes) and (explained.named is None or explained.named.cause.fault_code not in codes)


WINDOW_CYCLES = 60  # gait cycles that are kept per cadence and used for the estimate of clearances
LAST_CYCLES = 10  # gait cycles whose mean temperature is the present temperature of the drive
# per gait cycle: where a drive passed 11 and 13, I was taken for J; with 17 and more, no joint was
_LEAST_HARMONICS = 15.0
FIRST_CYCLES = 5  # gait cycles before the first reference is chosen
UNUSABLE_CYCLES = 3  # number in a row, because a start has two cycles unlike the rest
UNUSED_CYCLES = 20  # number in a row after which a result no longer describes the present gait


class SignedCycle(NamedTuple):
    """A gait cycle: stamps of its start and end [ns], its signature (F,), and the crank's motion.

    ``temperature_c`` is the drive's temperature, NaN if it is not measured.
    """

    begin_ns: int
    end_ns: int
    signature: Floats
    profile: CrankProfile
    temperature_c: float = math.nan


def temperature_of(cycles: Sequence[SignedCycle]) -> float:
    """Mean temperature of the drive in some gait cycles [°C]; NaN where it was not measured."""
    return mean_of(np.array([cycle.temperature_c for cycle in cycles], float))


@attrs.define
class TorqueState:
    """State of a `TorqueObserver`, its reference run aside.

    Attributes
    ----------
    samples : TorqueSamples
    due : tuple of (int, int)
        Start and end [ns] of ended gait cycles that are not evaluated yet.
    sensor : TorqueSensor or None
        As found in the first gait cycle with torques, or where its rate has changed.
    waiting : tuple of SignedCycle
        The last gait cycles alike whose motion of the crank has no reference.
    odd : tuple of SignedCycle
        Other cycles without a reference; the next cycles may be like some of them.
    reference : TorqueReference or None
    cycles : tuple of SignedCycle
        The last gait cycles at the reference's cadence.
    modelled_m : (k,) array
        Modelled clearances that the detector compares with.
    commissioned : CommissionedTorque or None
        At the reference's cadence.
    baselines : tuple of CommissionedTorque
        Baselines of other cadences and of other sensors, the last one first.
    detector : DetectorState or None
    fit : ClearanceFit or None
    fit_cycles : int
        Gait cycles in the fit.
    fit_due : int
        Gait cycles until the next fit.
    least_m : tuple of (k,) arrays
        Clearances that joints surely have by the last fits in a row, by their changes where these show more.
    changes : tuple of Change
        Unsettled changes; the last one is being observed.
    settled : tuple of Change
        Changes that corrected the modelled clearances, and sure changes from before the load changed.
    not_used : dict of str to int
        Gait cycles that were not used, by the values of `NotUsed`; replaced, never changed.
    unused : tuple of NotUsed
        Reasons of the last gait cycles in a row that were not used.
    off_cadence_rpm : float
        Cadence of the last gait cycle if it is not the commanded one, else NaN.
    parameters : LegParameters or None
        Identified parameters for simulating references; None before.
    rounds, load_rounds : int
        How often parameters were identified, and the ground's force.
    load : GroundLoad or None
        The force of the ground by the commissioned leg.
    carried_n : tuple of float
        Size of the load in the last gait cycles, by the twin.
    renewed_n : float
        Load under which the leg was commissioned anew; NaN before.
    is_load_other : bool
        True if the foot's load differs from the reference's load: gait cycles are not compared.
    is_identifying : bool
        True if the run simulates legs with other parameters.
    has_failed : bool
        True if the leg could not be simulated for a reference.
    failure : str
        Why the torques before gave no estimate; empty once there is a baseline.
    """

    modelled_m: Floats
    samples: TorqueSamples = TorqueSamples()
    due: tuple[tuple[int, int], ...] = ()
    sensor: TorqueSensor | None = None
    waiting: tuple[SignedCycle, ...] = ()
    odd: tuple[SignedCycle, ...] = ()
    reference: TorqueReference | None = None
    cycles: tuple[SignedCycle, ...] = ()
    commissioned: CommissionedTorque | None = None
    baselines: tuple[CommissionedTorque, ...] = ()
    detector: DetectorState | None = None
    fit: ClearanceFit | None = None
    fit_cycles: int = 0
    fit_due: int = 0
    least_m: tuple[Floats, ...] = ()
    changes: tuple[Change, ...] = ()
    settled: tuple[Change, ...] = ()
    not_used: dict[str, int] = attrs.field(factory=dict)
    unused: tuple[NotUsed, ...] = ()
    off_cadence_rpm: float = math.nan
    parameters: LegParameters | None = None
    rounds: int = 0
    load_rounds: int = 0
    load: GroundLoad | None = None
    carried_n: tuple[float, ...] = ()
    renewed_n: float = math.nan
    is_load_other: bool = False
    is_identifying: bool = False
    has_failed: bool = False
    failure: str = ""

    def leave_out(self, reason: NotUsed, cycles: int = 1) -> None:
        """Count gait cycles that are not used."""
        self.not_used = {**self.not_used, reason.value: self.not_used.get(reason.value, 0) + cycles}
        self.unused = (*self.unused, reason)[-UNUSED_CYCLES:]

    @property
    def signatures(self) -> Floats:
        """Signatures (n, F) of the kept cycles."""
        return np.array([cycle.signature for cycle in self.cycles])

    def baseline(self, cycles: Sequence[SignedCycle], modelled_m: Floats, **more: Any) -> CommissionedTorque:
        """Baseline of some gait cycles by the present sensor; ``more`` are further attributes."""
        signatures, temperature_c = np.array([one.signature for one in cycles]), temperature_of(cycles)
        own = {"speed": self.profile.speed, "temperature_c": temperature_c, **more}
        found = CommissionedTorque(cycles[-1].end_ns, modelled_m, signatures, **own)
        return found.measured_by(self.sensor) if self.sensor else found

    @property
    def profile(self) -> CrankProfile:
        """Mean motion of the crank in the kept cycles, or in those that wait where there are none."""
        return mean_profile([cycle.profile for cycle in self.cycles or self.waiting])

    @property
    def temperature_c(self) -> float:
        """Mean temperature of the drive in the last gait cycles; NaN where it is not measured."""
        return temperature_of((self.cycles or self.waiting)[-LAST_CYCLES:])

    @property
    def is_loaded(self) -> bool:
        """True if the reference walks on the ground."""
        return self.reference is not None and self.reference.parameters.load.size > 0

    @property
    def is_narrow(self) -> bool:
        """True if the drive passes too little of the torque to tell the joints apart surely."""
        one = self.sensor
        return one is not None and one.channel.bandwidth_hz * one.cycle_s < _LEAST_HARMONICS

    @property
    def is_compared(self) -> bool:
        """True if gait cycles are tested: not under a different load than the reference's.

        A further cadence has to have a baseline of its own before.
        """
        return not self.is_load_other and (self.commissioned is not None or not self.compared_at)

    @property
    def compared_at(self) -> tuple[CommissionedTorque, ...]:
        """Baselines of the sensor at other cadences."""
        sensor = self.sensor
        return tuple(one for one in self.baselines if sensor and one.speed and one.is_of(sensor))

    @property
    def all_commissioned(self) -> tuple[CommissionedTorque, ...]:
        """Baselines of all cadences, the present one first."""
        return (self.commissioned, *self.baselines) if self.commissioned else self.baselines

    @property
    def corrections(self) -> tuple[Change, ...]:
        """Changes that corrected the modelled clearances."""
        return tuple(change for change in self.settled if change.is_corrected)

    @property
    def all_changes(self) -> tuple[Change, ...]:
        """All changes, the oldest first."""
        return self.settled + self.changes

    @property
    def not_corrected(self) -> tuple[Change, ...]:
        """Changes that did not correct modelled clearances."""
        return tuple(change for change in self.all_changes if not change.is_corrected)

    @property
    def not_by_load(self) -> tuple[Change, ...]:
        """Surely changed clearances: a changed load at the foot does not end them."""
        return tuple(change for change in self.changes if change.is_sure)

    @property
    def corrected(self) -> CommissionedTorque | None:
        """A baseline after a correction, of any cadence; None without one."""
        return next((one for one in self.all_commissioned if not one.is_as_modelled), None)

    @property
    def is_elsewhere(self) -> bool:
        """True if the last gait cycles wait for a reference of their motion."""
        return self.reference is None or self.unused[-1:] == (NotUsed.UNLIKE,)

    def turn_to(self, reference: TorqueReference) -> None:
        """Make the cadence of a reference the present one, with the gait cycles that waited for it.

        Changes that were reported at the former cadence stay until they are explained anew.
        """
        self.baselines = self.all_commissioned
        self.reference, self.commissioned = reference, self.take_baseline(reference.profile.speed)
        self.cycles = tuple(one for one in self.waiting if one.profile.is_like(reference.profile))
        self.waiting, self.detector = (), None

    def take_baseline(self, speed: float) -> CommissionedTorque | None:
        """The baseline of the sensor at a speed of the crank; it is removed from the stored baselines.

        Forces of inertia depend on the speed: compared with the baseline of 60 rpm, a healthy leg at 57 rpm
        seemed to have a loose joint A. Roughness depends on the rate, and on how many samples are averaged.
        """
        alike = (one for one in self.baselines if not one.speed or abs(one.speed / speed - 1.0) <= UNLIKE)
        own = next((one for one in alike if self.sensor and one.is_of(self.sensor)), None)
        self.baselines = tuple(one for one in self.baselines if one is not own)
        return own

    def measure_with(self, sensor: TorqueSensor) -> None:
        """Continue with a different sensor; baselines, gait cycles and results belong to the former one."""
        self.baselines = self.all_commissioned
        self.forget_cycles()
        self.sensor, self.reference, self.commissioned = sensor, None, None
        self.detector, self.fit, self.changes, self.least_m = None, None, (), ()

    def wait_with(self, cycle: SignedCycle) -> None:
        """Keep a gait cycle for a reference that is to be made, with those before that are like it.

        One odd cycle in five must not begin the wait anew.
        """
        kept = sorted((*self.odd, *self.waiting), key=lambda one: one.begin_ns)[1 - WINDOW_CYCLES :]
        alike = {one.begin_ns for one in kept if one.profile.is_like(cycle.profile)}
        self.waiting = (*(one for one in kept if one.begin_ns in alike), cycle)
        self.odd = tuple(one for one in kept if one.begin_ns not in alike)

    def surely_m(self, number: int) -> tuple[float, ...]:
        """Clearances that joints surely have by so many last fits; minus infinity where there are fewer."""
        least_m = self.least_m[-number:]
        if len(least_m) < number:
            return (-math.inf,) * len(self.modelled_m)
        return tuple(np.min(least_m, axis=0).tolist())

    def forget_cycles(self, since_ns: int = 0) -> None:
        """Forget the gait cycles that began at a stamp or later."""

        def rest(cycles: tuple[SignedCycle, ...]) -> tuple[SignedCycle, ...]:
            return tuple(cycle for cycle in cycles if cycle.begin_ns < since_ns)

        self.cycles, self.waiting, self.odd = rest(self.cycles), rest(self.waiting), rest(self.odd)

    def forget_baselines(self, since_ns: int = 0) -> None:
        """Forget the baselines with gait cycles after a stamp, at all cadences."""
        self.baselines = tuple(one for one in self.baselines if one.stamp_ns <= since_ns)
        if self.commissioned is not None and self.commissioned.stamp_ns > since_ns:
            self.commissioned = None
