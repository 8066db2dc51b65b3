"""Input of the rules: the situation of leg and joints, and the best estimate of the clearance."""

import math
from collections.abc import Iterable, Mapping, Sequence

import attrs

from leg_wear_monitor.estimate.cause import SURE_SIGMAS, NamedCause, TorqueExplanation
from leg_wear_monitor.monitor.alarms import Alarm, amount
from leg_wear_monitor.monitor.diagnosis.state import Diagnosis
from leg_wear_monitor.monitor.input_health import InputFault
from leg_wear_monitor.monitor.verdict.verdict import estimate
from leg_wear_monitor.state import Level, State, Verdict
from leg_wear_monitor.twin import KINDS

# All inputs of a verdict; the defaults describe a leg without a fault.


ACTS = "FOOT_LOAD"
"""Key of the note on the acting foot load."""


@attrs.frozen
class KnownClearance:
    """A clearance and its source.

    Attributes
    ----------
    by : str
        ``encoders``, ``torque``, ``measured`` for a measurement by an operator, ``modelled``, or
        ``wear_and_measurement`` for model and measurements together.
    clearance_m, sigma_m : float
        Mean radial clearance and its standard deviation; NaN if that is not known.
    least_m : float
        Clearance that it surely has; by default, two standard deviations less.
    """

    by: str
    clearance_m: float
    sigma_m: float
    least_m: float = attrs.field()

    @least_m.default
    def _surely(self) -> float:
        return self.clearance_m - SURE_SIGMAS * self.sigma_m

    @property
    def words(self) -> str:
        """Such as ``0.62 mm ± 0.03 mm``; without the second if that is not known."""
        if math.isnan(self.sigma_m):
            return amount(self.clearance_m, "m")
        return estimate(self.clearance_m, self.sigma_m, "m")


@attrs.frozen(kw_only=True)
class JointSituation:
    """A clearance joint.

    Attributes
    ----------
    joint : str
    label : str
        Operators' name of the joint, such as ``knee``; empty if it has no label.
    modelled_m, limit_m : float
        Modelled mean radial clearance, and its limit.
    best_estimate_m : float
        Median of the clearance in the forecast; NaN before the first forecast.
    measured : KnownClearance or None
        Last measurement on the present part.
    seen : tuple of KnownClearance
        Estimates from measurements, as far as there are any.
    change : (float, float) or None
        Change since the baseline by the drive torque [m], and its standard deviation.
    sigma_m : float
        Standard deviation of the modelled clearance.
    is_used : bool
        True if the forecast uses the encoders' estimate of this joint.
    is_measurement_used : bool
        True if it rests on `measured`; not on one that contradicts the model.
    replaced_ns, part_cycles : int
        When its part was replaced, 0 if it never was, and the gait cycles of this part.
    """

    joint: str
    modelled_m: float
    limit_m: float
    best_estimate_m: float = math.nan
    measured: KnownClearance | None = None
    seen: tuple[KnownClearance, ...] = ()
    change: tuple[float, float] | None = None
    sigma_m: float = math.nan
    is_used: bool = False
    is_measurement_used: bool = False
    replaced_ns: int = 0
    part_cycles: int = 0
    label: str = ""


@attrs.frozen(kw_only=True)
class Situation:
    """The monitor's results at one instant.

    Attributes
    ----------
    joints : tuple of JointSituation
    alarms : tuple of Alarm
    has_cycle : bool
        True if a whole gait cycle was monitored in this run.
    has_torque : bool
        True if the last gait cycle has samples of the drive torque.
    mismatch, mismatch_limit : float
        Part of the drive torque that is not explained, as a fraction of the predicted RMS; NaN if it is not
        known.
    torque_causes : mapping of str to NamedCause
        Causes of an impossible bias, drift or lag of the torque, by the alarm.
    notes : mapping of str to sequence of str
        Notes of observers for a rule, a sentence each, by the rule's code.
    input_causes : tuple of str
        Sentences on unused samples.
    input_faults : tuple of InputFault
        Faults of the streams of crank and drive torque that are present.
    trusted_before_ns : mapping of int to int
        By the kinds of the streams with a fault: from this stamp on, they say nothing of the leg.
    diagnosis : Diagnosis
        Results from the drive torque.
    explained : TorqueExplanation or None
        Explanation of a torque residual; None without one, and in its first gait cycles.
    """

    joints: tuple[JointSituation, ...] = ()
    alarms: tuple[Alarm, ...] = ()
    has_cycle: bool = True
    has_torque: bool = True
    mismatch: float = 0.0
    mismatch_limit: float = math.nan
    torque_causes: Mapping[str, NamedCause] = attrs.field(factory=dict)
    notes: Mapping[str, Sequence[str]] = attrs.field(factory=dict)
    input_causes: tuple[str, ...] = ()
    input_faults: tuple[InputFault, ...] = ()
    trusted_before_ns: Mapping[int, int] = attrs.field(factory=dict)
    diagnosis: Diagnosis = Diagnosis()
    explained: TorqueExplanation | None = None

    def joint_words(self, joint: str) -> str:
        """A joint with its label, such as ``G (knee)``."""
        own = self.joint(joint)
        return f"{joint} ({own.label})" if own is not None and own.label else joint

    def joint(self, name: str) -> JointSituation | None:
        """A clearance joint by its name; None for any other."""
        return next((each for each in self.joints if each.joint == name), None)

    def joints_words(self, joints: Sequence[str]) -> str:
        """Joints with their labels."""
        return ", ".join(map(self.joint_words, joints))

    def is_trusted(self, kind: str, since_ns: int) -> bool:
        """True if a case began before a fault of the samples that show it, by the name of their kind."""
        ends_ns = [end_ns for code, end_ns in self.trusted_before_ns.items() if KINDS[code].name == kind]
        return all(0 < since_ns < end_ns for end_ns in ends_ns)

    @property
    def unobserved(self) -> tuple[str, ...]:
        """Clearance joints that no encoder shows."""
        return tuple(each.joint for each in self.joints if "encoders" not in [one.by for one in each.seen])


# The best estimate of a joint's clearance and its source, for all views and the clearance alarm.


COUNTED, MEASURED, BOTH = "modelled", "measured", "wear_and_measurement"
SEEN = ("torque", "encoders")
SOURCES = {
    COUNTED: "the wear model",
    MEASURED: "a measurement",
    BOTH: "wear model and measurements together",
    "torque": "the drive torque",
    "encoders": "the joint encoders",
}


def judged(joint: JointSituation) -> KnownClearance:
    """The modelled clearance, or a larger measured clearance, because a measurement on the leg counts."""
    found = [KnownClearance(COUNTED, joint.modelled_m, math.nan)]
    if joint.measured is not None:
        found.append(joint.measured)
    rests_on_it = joint.measured is not None and joint.is_measurement_used
    if rests_on_it or joint.best_estimate_m >= joint.limit_m:  # never with NaN
        found.append(KnownClearance(BOTH, joint.best_estimate_m, math.nan))
    return max((one for one in found if not math.isnan(one.clearance_m)), key=lambda one: one.clearance_m)


def surest(seen: Iterable[KnownClearance]) -> KnownClearance | None:
    """The estimate with the smallest standard deviation; None without any."""
    return min(seen, key=lambda one: one.sigma_m, default=None)


def surely_at(limit_m: float, seen: Sequence[KnownClearance]) -> KnownClearance | None:
    """The most certain estimate that is surely beyond a limit; None if there is no such estimate."""
    return surest(one for one in seen if one.least_m >= limit_m)


def is_surely_below(limit_m: float, known: KnownClearance) -> bool:
    """True if a clearance contradicts that a joint is at its limit."""
    return known.clearance_m + SURE_SIGMAS * known.sigma_m < limit_m


def is_overruled(joint: JointSituation, alarm: Alarm | None) -> bool:
    """True if a measurement contradicts the estimate behind an alarm of the clearance.

    The modelled clearance is below the limit as well: a measurement does not end an alarm of the model. The
    alarm was acknowledged with the measurement, and rises again, not acknowledged, if the estimate returns
    below the limit and then passes it again.
    """
    if alarm is None or joint.measured is None or not alarm.acknowledged or alarm.cause not in SEEN:
        return False
    is_modelled_below = not judged(joint).clearance_m >= joint.limit_m
    return is_modelled_below and is_surely_below(joint.limit_m, joint.measured)


def at_limit_by_estimate(joint: JointSituation, alarm: Alarm | None) -> KnownClearance | None:
    """Clearance surely at the limit by encoders or the drive torque, now or as the latched alarm keeps it."""
    if is_overruled(joint, alarm):
        return None
    now = surely_at(joint.limit_m, joint.seen)
    if now is None and alarm is not None and alarm.level is Level.ERROR and alarm.cause in SEEN:
        return KnownClearance(alarm.cause, alarm.worst, alarm.sigma)
    return now


def believed(joint: JointSituation, alarm: Alarm | None, is_counted_leg: bool) -> KnownClearance | None:
    """The clearance that the verdict rests on; None where nothing known of the joint is valid.

    Parameters
    ----------
    joint : JointSituation
    alarm : Alarm or None
        Alarm of the joint's clearance.
    is_counted_leg : bool
        True if the verdict does not list the modelled clearances as not valid.
    """
    known, estimate = judged(joint), at_limit_by_estimate(joint, alarm)
    if estimate is not None and estimate.clearance_m > known.clearance_m:
        return estimate
    if is_counted_leg or known.clearance_m >= joint.limit_m:
        return known
    return joint.measured or surest(joint.seen)


def joint_status(joint: str, is_known: bool, findings: Sequence[Verdict]) -> State:
    """State of a joint by findings: the worst that names it, or whether anything valid is known of it."""
    found = [finding.state for finding in findings if joint in finding.joints]
    is_blind = any(finding.state is State.NOT_MONITORED for finding in findings)
    found.append(State.HEALTHY if is_known and not is_blind else State.NOT_MONITORED)
    return max(found, key=lambda state: state.severity)


def is_observed(alarm: Alarm, by: Sequence[str] = (MEASURED, BOTH, *SEEN)) -> bool:
    """True if an alarm of the clearance is present because of some sources, not the model alone."""
    return alarm.present is not Level.OK and alarm.cause in by
