"""Reports of the monitor: samples, gait cycles, changes of alarms and of the verdict, and its own status."""

import math
from collections.abc import Sequence
from enum import Enum

import attrs

from leg_wear_monitor.mechanism.materials import BushingLoad
from leg_wear_monitor.monitor.alarms import NO_FAULT, Alarm
from leg_wear_monitor.monitor.forecast.forecast import Forecast, JointForecast, LegForecast
from leg_wear_monitor.monitor.ledger.entry import Measurement
from leg_wear_monitor.monitor.verdict.situation import joint_status
from leg_wear_monitor.monitor.verdict.verdict import verdict_of
from leg_wear_monitor.state import LegState, Level, Verdict
from leg_wear_monitor.twin.statistics import SampleStatistics

SampleReports = SampleStatistics
"""The leg at each processed sample; NaN while it is not tracked."""


_SURE_SIGMAS = 4.0  # of a significant departure by encoders
_LEAST_M = 5.0e-5  # smallest departure that is reported


class ClearanceObservation(Enum):
    """Observability of a clearance; the value is human-readable."""

    WAITING = "not enough gait cycles with encoders yet"
    COMMISSIONING = "the encoders are being commissioned"
    NOT_OBSERVABLE = "not observable with these encoders"
    SEEN = "seen by encoders"


@attrs.frozen(kw_only=True)
class ClearanceEstimate:
    """A clearance estimated from encoders.

    Attributes
    ----------
    observation : ClearanceObservation
    clearance_m, sigma_m : float
        Clearance and its standard deviation; NaN unless it is estimated.
    departure_m : float
        Estimated minus modelled clearance; NaN unless it is estimated.
    believed : bool
        True if the forecast uses it: not if the model gives it a tail probability below 0.135 %.
    """

    observation: ClearanceObservation
    clearance_m: float = math.nan
    sigma_m: float = math.nan
    departure_m: float = math.nan
    believed: bool = False

    @property
    def is_other(self) -> bool:
        """True if the clearance differs significantly from the modelled clearance."""
        return abs(self.departure_m) >= max(_LEAST_M, _SURE_SIGMAS * self.sigma_m)

    @property
    def surely_m(self) -> float:
        """Size of a significant departure; 0 if there is none, NaN if it is not estimated."""
        return abs(self.departure_m) if self.is_other else 0.0 * self.departure_m


@attrs.frozen(kw_only=True)
class JointReport:
    """A clearance joint over a gait cycle.

    Attributes
    ----------
    joint : str
    clearance_m, clearance_max_m : float
        Mean and largest radial clearance around the bushing at the cycle's end.
    growth_m_per_cycle, growth_mps : float or None
        Growth of the mean clearance per cycle and per second of walking, averaged over gait cycles; None
        while there is not enough data.
    growth_error_m_per_cycle : float or None
        Standard deviation of the growth: cycles scatter, and real masses differ from the file.
    peak_force_n, p99_force_n, mean_force_n : float
        Of the contact force in this cycle; the peak is a sample of a heavy tail.
    impacts : int
    forecast : JointForecast or None
        Renewed once a minute, and when more is known.
    seen : ClearanceEstimate or None
        The clearance estimated from further encoders; None without encoders.
    measured : Measurement or None
        The last measured clearance of this part.
    load : BushingLoad or None
        Pressure and sliding speed in this cycle, against the limits of the joint's material.
    estimated_m, estimated_sigma_m : float or None
        Clearance that encoders or the drive torque show, the surer one; None if neither shows it.
    """

    joint: str
    clearance_m: float
    clearance_max_m: float
    growth_m_per_cycle: float | None
    growth_mps: float | None
    growth_error_m_per_cycle: float | None
    peak_force_n: float
    p99_force_n: float
    mean_force_n: float
    impacts: int
    forecast: JointForecast | None = None
    seen: ClearanceEstimate | None = None
    measured: Measurement | None = None
    load: BushingLoad | None = None
    estimated_m: float | None = None
    estimated_sigma_m: float | None = None

    @property
    def judged_clearance_m(self) -> float:
        """Clearance that is compared with the limit: the modelled one, or a larger one by measurement.

        A measurement that does not count for the forecast is still a finding on the leg.
        """
        measured, best_m = self.measured, self.forecast.now_m if self.forecast else math.nan
        if measured is None:
            return self.clearance_m
        believed = [best_m] if measured.counts and not math.isnan(best_m) else []
        return max(self.clearance_m, measured.clearance_m, *believed)


@attrs.frozen(kw_only=True)
class CycleReport:
    """One whole gait cycle.

    Attributes
    ----------
    cycle : int
        Modelled over the whole life in the ledger.
    begin_ns, stamp_ns : int
        Its begin and end.
    cadence_rpm : float
        Mean crank speed while moving, negative for clockwise.
    moving_s, bridged_s : float
        Time in motion, and of it the time bridged in gaps.
    joints : tuple of JointReport
        In the order of `WearMonitor.clearance_joints`.
    torque_samples : int
        Torque samples in it; the torque values are NaN without any.
    measured_torque_rms_nm, predicted_torque_rms_nm, residual_torque_rms_nm : float
    torque_mismatch : float
        RMS of the torque that foot load, frictions and lag do not explain, as a fraction of the predicted
        RMS.
    load_n, load_sigma_n : float
        Foot load estimated from the measured torque, up positive, and its standard deviation.
    load_acting_n : float
        Foot load that acts in the model: `load_n` if it is accepted, else 0.
    friction_nm, torque_lag_s : float
        Friction of the drive and delay of the measured torque, as estimated; implausible values raise
        ``torque_bias`` and ``torque_lag``.
    load_friction : float
        Friction of the drive over the size of the torque that it transmits.
    friction_sigma_nm, torque_lag_sigma_s, load_friction_sigma : float
        Standard deviations of these three.
    forecast : LegForecast or None
        Renewed once a minute.
    """

    cycle: int
    begin_ns: int
    stamp_ns: int
    cadence_rpm: float
    moving_s: float
    bridged_s: float
    joints: tuple[JointReport, ...]
    torque_samples: int
    measured_torque_rms_nm: float
    predicted_torque_rms_nm: float
    residual_torque_rms_nm: float
    torque_mismatch: float
    load_n: float
    load_sigma_n: float
    load_acting_n: float
    friction_nm: float
    torque_lag_s: float
    load_friction: float = math.nan
    friction_sigma_nm: float = math.nan
    torque_lag_sigma_s: float = math.nan
    load_friction_sigma: float = math.nan
    forecast: LegForecast | None = None


@attrs.frozen
class AlarmList:
    """State of all alarms after a change.

    Attributes
    ----------
    stamp_ns : int
        When it changed.
    alarms : tuple of Alarm
        Always the same ones in the same order.
    """

    stamp_ns: int
    alarms: tuple[Alarm, ...]

    @property
    def level(self) -> Level:
        """The highest displayed level."""
        return max((alarm.level for alarm in self.alarms), default=Level.OK)


@attrs.frozen
class VerdictReport:
    """A changed verdict, or the state of the leg with its verdict.

    Attributes
    ----------
    stamp_ns : int
        When it changed.
    findings : tuple of Verdict
        Findings of the rules that hold; at least one.
    leg : LegState or None
        The leg then, in a report of its state; None in a report of a changed verdict.
    """

    stamp_ns: int
    findings: tuple[Verdict, ...]
    leg: LegState | None = None

    @property
    def verdict(self) -> Verdict:
        """The verdict of these findings."""
        return verdict_of(self.findings)

    @property
    def state(self) -> LegState:
        """The leg with the verdict of these findings; a node may have added some of them."""
        if self.leg is None:
            raise ValueError("a report of a changed verdict has no state of the leg")
        clearances = {
            joint: attrs.evolve(
                one, status=joint_status(joint, one.best_estimate_m is not None, self.findings)
            )
            for joint, one in self.leg.clearances.items()
        }
        return attrs.evolve(self.leg, verdict=self.verdict, clearances=clearances)


@attrs.frozen(kw_only=True)
class Lost:
    """Samples and time that were not integrated since the monitor was created; the values only grow.

    Attributes
    ----------
    unmonitored_s : float
        Time during which the leg was not tracked.
    already_counted : int
        Samples of a time whose wear is in the ledger from an earlier run.
    faulty : dict of str to int
        Faulty samples, by the name of the fault.
    conflicting : int
        Of those out of range: crank samples from two sources.
    implausible : int
        Out-of-range samples that are crank samples in a wrong unit.
    torque_outliers : int
        Drive torques left out because they are far from the others.
    duplicates : int
        Dropped samples that repeat an earlier one.
    late : int
        Dropped samples that are later than the window.
    stray_stamps : int
        Dropped samples with a stamp far off.
    outliers : int
        Dropped samples with a value far off.
    gaps_bridged : int
        Gaps over which the leg was tracked.
    gaps_lost : int
        Gaps over which it was not.
    backward_jumps : int
        Jumps back of the stamps, each a new time base.
    failures : int
        Motions that the model could not resolve.
    paused_s : float
        Time between recordings that were replayed together; it is not in the other values.
    """

    unmonitored_s: float
    already_counted: int
    faulty: dict[str, int]
    conflicting: int
    implausible: int
    torque_outliers: int
    duplicates: int
    late: int
    stray_stamps: int
    outliers: int
    gaps_bridged: int
    gaps_lost: int
    backward_jumps: int
    failures: int
    paused_s: float = 0.0


@attrs.frozen(eq=False)
class Reports:
    """Reports of an update.

    Attributes
    ----------
    samples : SampleReports
        Samples processed now; they are delayed, see `WearMonitor.update`.
    cycles : tuple of CycleReport
        Gait cycles completed now.
    alarms : tuple of AlarmList
        One for each change of an alarm.
    lost : Lost
    verdicts : tuple of VerdictReport
        One for each change of the verdict, and the first one of a monitor.
    states : tuple of VerdictReport
        With the state of the leg: one at the end of each evaluation period in which a gait cycle ended, or an
        alarm or the verdict changed.
    """

    samples: SampleReports
    cycles: tuple[CycleReport, ...]
    alarms: tuple[AlarmList, ...]
    lost: Lost
    verdicts: tuple[VerdictReport, ...] = ()
    states: tuple[VerdictReport, ...] = ()


DIAGNOSTICS_PERIOD_S = 1.0
"""Time between two lists of statuses: tools for /diagnostics expect one per second."""


@attrs.frozen
class Status:
    """A line of /diagnostics: ``name`` stable, numbers only in ``values``, by keys that end in their unit.

    ``fault_code`` is the stable name of the fault: one of `VerdictTable.codes`, of an alarm or of a verdict.
    """

    name: str
    level: Level
    message: str
    values: dict[str, float]
    fault_code: str = NO_FAULT


# A gait cycle with a newer forecast.


def with_forecast(
    report: CycleReport, forecast: Forecast, measured: Sequence[Measurement | None]
) -> CycleReport:
    """The same gait cycle with a newer forecast, and its measurements."""
    joints = zip(report.joints, forecast.joints, measured, strict=True)
    renewed = tuple(attrs.evolve(joint, forecast=new, measured=by) for joint, new, by in joints)
    return attrs.evolve(report, joints=renewed, forecast=forecast.leg)
