"""The verdict: state, joints, reason, what to do; and the words for each cause of a torque."""

import math
from collections.abc import Iterable, Sequence

import attrs

from leg_wear_monitor.estimate.cause import Cause, Change, NamedCause, TorqueExplanation
from leg_wear_monitor.files import with_same_fields
from leg_wear_monitor.monitor.alarms import amount, guide_of
from leg_wear_monitor.monitor.config.inputs import AT_START, Crank, DriveTorque
from leg_wear_monitor.monitor.diagnosis.state import Diagnosis, DiagnosisState
from leg_wear_monitor.state import Evidence, Figure, Level, State, Verdict

# A verdict and the findings it is made of; everything here is immutable.


@attrs.frozen(kw_only=True)
class Finding:
    """One rule that holds.

    Attributes
    ----------
    code : str
        Of the rule, such as ``TORQUE_MISMATCH``.
    state : State
    joints : tuple of str
        The joints concerned; empty if that is not known, or none is.
    why, do : str
        What was found, and what a person does next.
    since_ns : int
        Stamp since which it has been valid; 0 if it is not known.
    evidence : tuple of Evidence
    not_valid : tuple of Figure
    """

    code: str
    state: State
    why: str
    do: str
    joints: tuple[str, ...] = ()
    since_ns: int = 0
    evidence: tuple[Evidence, ...] = ()
    not_valid: tuple[Figure, ...] = ()


NO_GAIT_CYCLE, NONE = "NO_GAIT_CYCLE", "NONE"


def level_of(verdict: Verdict) -> Level:
    """Level in diagnostics: a leg that did not walk yet is no fault."""
    if verdict.state is State.HEALTHY:
        return Level.OK
    if verdict.state is State.WATCH or verdict.fault_code == NO_GAIT_CYCLE:
        return Level.WARN
    return Level.ERROR


def code_of_rule(verdict: Verdict) -> str:
    """The verdict's code without its joints: that of the rule, such as ``CLEARANCE_SEEN``."""
    return verdict.fault_code.removesuffix("".join(f"_{joint}" for joint in verdict.joints))


def guide_to(verdict: Verdict) -> str:
    """Page that says what to do about a verdict's reason, as a path below the share directory."""
    return guide_of(code_of_rule(verdict))


def verdict_of(findings: Sequence[Finding]) -> Verdict:
    """Verdict of at least one finding: the first of the most severe ones is its reason."""
    lead = max(findings, key=lambda finding: finding.state.severity)
    evidence: dict[str, Evidence] = {}
    for each in (each for finding in (lead, *findings) for each in finding.evidence):
        evidence.setdefault(each.name, each)
    found = {figure for finding in findings for figure in finding.not_valid}
    return with_same_fields(
        Verdict,
        lead,
        why=lead.why + _unmonitored(lead, findings),
        evidence=tuple(evidence.values()),
        not_valid=tuple(figure for figure in Figure if figure in found),
        fault_code="_".join((lead.code, *lead.joints)),
    )


def _unmonitored(lead: Finding, findings: Iterable[Finding]) -> str:
    """Why the leg is not monitored, beside a more severe reason; empty if it is monitored."""
    if lead.state is State.NOT_MONITORED:
        return ""
    blind = next((finding for finding in findings if finding.state is State.NOT_MONITORED), None)
    return f"; the leg is not monitored now: {blind.why}" if blind else ""


def dated(findings: Iterable[Finding], before: Iterable[Finding], stamp_ns: int) -> tuple[Finding, ...]:
    """Findings with the stamp since which each holds: its own, that of the same one before, or this one."""
    known = {(finding.code, finding.joints): finding.since_ns for finding in before}
    return tuple(
        attrs.evolve(
            finding, since_ns=finding.since_ns or known.get((finding.code, finding.joints)) or stamp_ns
        )
        for finding in findings
    )


def has_changed(before: Verdict | None, after: Verdict) -> bool:
    """Whether a verdict is to be reported again: not for values alone, which change in each gait cycle."""
    return before is None or _identity(before) != _identity(after)


def _identity(verdict: Verdict) -> tuple[object, ...]:
    return (verdict.state, verdict.fault_code, verdict.not_valid)


# Values in the verdict's sentences: units that operators read, in three digits.


_KEYS = {"m/h": "m_per_hour", "N m": "nm"}


def with_unit(name: str, unit: str) -> str:
    """Key of a value in a status: a name that ends in the value's unit."""
    key = _KEYS.get(unit, unit.lower())
    return f"{name}_{key}" if key and not name.endswith(f"_{key}") else name


def estimate(value: float, sigma: float, unit: str) -> str:
    """A value [SI] and its standard deviation, such as ``0.62 mm ± 0.03 mm``."""
    return f"{amount(value, unit)} ± {amount(sigma, unit)}"


# What explains a drive torque, in words: causes with values, and what a person does about them.
#
# One sentence a cause, whether a torque mismatch, an alarm of the torque or the diagnosis shows it.


_SURE = 3.0  # standard deviations
_MOST = 3  # alternatives in words
_NEAR = 0.03  # by which a factor may differ from that of a known mistake

EVIDENCE = {
    Cause.SIGN: ("torque_factor", ""),
    Cause.SCALE: ("torque_factor_size", ""),
    Cause.TIMING: ("crank_angle_ahead", "rad"),
    Cause.CRANK_OFFSET: ("crank_angle_ahead", "rad"),
    Cause.LAG: ("torque_late", "s"),
    Cause.NOISE: ("torque_noise", "N m"),
    Cause.BIAS: ("impossible_friction", "N m"),
    Cause.FRICTION: ("friction", "N m"),
    Cause.LOAD_FRICTION: ("load_friction", ""),
    Cause.JOINT_FRICTION: ("joint_friction_fraction", ""),
    Cause.LOAD: ("foot_load", "N"),
    Cause.MASS: ("mass_fraction", ""),
    Cause.LENGTH: ("length_fraction", ""),
    Cause.UNKNOWN: ("unknown_change", ""),
}
"""Name and unit of each cause's value; that of a clearance has the name of its joint."""

_DELAY, _ZERO = "look for a delay of the torque", "check the zero of the torque sensor"
# grease is stiff in the cold, and a warm motor has less torque
_WITH_TEMPERATURE = (Cause.FRICTION, Cause.LOAD_FRICTION, Cause.SCALE)
_COMPARED = {Cause.MASS: ("lighter", "heavier"), Cause.LENGTH: ("shorter", "longer")}


@attrs.frozen
class CauseWords:
    """Words for causes, of a monitor whose crank and drive torque have some parameters.

    Attributes
    ----------
    crank, torque : Crank, DriveTorque
    speed_radps : float
        Mean speed of the crank; NaN if it is not known.
    diagnosis : Diagnosis
        With the temperatures of the drive.
    """

    crank: Crank
    torque: DriveTorque
    speed_radps: float = math.nan
    diagnosis: Diagnosis = Diagnosis()

    def explanation(self, explained: TorqueExplanation) -> str:
        """All alternatives with their values, and what stays unexplained."""
        left = estimate(explained.after, explained.after_sigma, "")
        rest = f"{left} of the predicted RMS stays unexplained"
        other = "the mechanism is another one, or a clearance has changed"
        if not explained.alternatives:
            return (
                "no reversed sign, factor, crank angle, lag, load at the foot or mass of a body explains "
                f"half of it: {rest}; {other}"
            )
        alternatives = [" and ".join(map(self.cause, causes)) for causes in explained.alternatives]
        words = ", or ".join([*alternatives[:_MOST], *(["others"] if len(alternatives) > _MOST else [])])
        if len(alternatives) > 1:
            words += " (these explain the torque equally well and cannot be distinguished)"
        if abs(explained.bias.value) > _SURE * explained.bias.sigma:
            words += f"; {self.cause(explained.bias)}"
        return words if explained.is_whole else f"{words}; {rest}: {other}"

    def cause(self, one: NamedCause) -> str:
        """A cause other than a clearance, with its value; the drive torque is *it*."""
        return self._sentence(one) + (self._temperatures() if one.cause in _WITH_TEMPERATURE else "")

    def _sentence(self, one: NamedCause) -> str:
        size = estimate(abs(one.value), one.sigma, EVIDENCE[one.cause][1])
        match one.cause:
            case Cause.SIGN:
                return f"it is {estimate(one.value, one.sigma, '')} times the predicted one"
            case Cause.SCALE:
                return f"its size is {size} times the predicted one{self._known_factor(one)[0]}"
            case Cause.TIMING:
                return self._timing(one)
            case Cause.CRANK_OFFSET:
                return f"the crank is {size} {'ahead of' if one.value > 0.0 else 'behind'} its measured angle"
            case Cause.LAG:
                return f"the torque is {size} {'late' if one.value > 0.0 else 'early'}"
            case Cause.NOISE:
                then = f" instead of {amount(one.counted, 'N m')}" if isinstance(one, Change) else ""
                return f"its samples scatter by {size}{then}"
            case Cause.BIAS if one.value < 0.0:
                return f"a constant torque of {size} drives the crank; friction cannot drive"
            case Cause.BIAS:
                return f"a constant torque exceeds the largest friction of the drive by {size}"
            case Cause.FRICTION:
                return f"the constant torque has {_way(one)} by {size} since this leg was commissioned"
            case Cause.LOAD_FRICTION:
                return f"the part of the torque that is friction has {_way(one)} by {size}, of 1"
            case Cause.LOAD if isinstance(one, Change) and one.counted:
                return f"the load at the foot has {_way(one)} by {size}"
            case Cause.LOAD:
                return f"a load of {size} {'lifts' if one.value > 0.0 else 'pulls down'} the foot"
            case Cause.JOINT_FRICTION:
                percent = estimate(100.0 * abs(one.value), 100.0 * one.sigma, "%")
                return f"the friction in the joints has {_way(one)} by {percent}"
            case Cause.MASS | Cause.LENGTH:
                percent = estimate(100.0 * abs(one.value), 100.0 * one.sigma, "%")
                return f"body {one.subject} is {percent} {_COMPARED[one.cause][one.value > 0.0]}"
        return "no single cause explains the change"

    def remedy(self, one: NamedCause) -> str:
        """What a person does about a cause."""
        match one.cause:
            case Cause.SIGN:
                return f"set drive_torque.sign to {-self.torque.sign}"
            case Cause.SCALE:
                return self._known_factor(one)[1]
            case Cause.TIMING:
                shift = f"{self._shift(one.value)} if its angle is wrong, else {_DELAY}"
                return f"turn the crank to a known angle and compare: {shift}"
            case Cause.CRANK_OFFSET:
                return self._shift(one.value)
            case Cause.LAG:
                return _DELAY
            case Cause.NOISE:
                return (
                    "check the cable, the shield and the filter of the torque sensor, and the drive's control"
                )
            case Cause.BIAS:
                more = ", and the friction of the drive" if one.value > 0.0 else ""
                return f"{_ZERO}, drive_torque.sign, scale and gear_ratio{more}"
            case Cause.FRICTION | Cause.LOAD_FRICTION:
                return f"{_ZERO}, the lubrication and the temperature of the drive"
            case Cause.JOINT_FRICTION:
                return "check the lubrication of the joints, and look for dirt in them"
            case Cause.LOAD:
                return "check the load at the foot; if the leg walks on the ground, set load.model to ground"
            case Cause.MASS:
                return (
                    f"check for loose or added parts, and the mass of {one.subject} in the mechanism's file"
                )
        return "look for loose, bent or added parts, and rock each joint"

    def _known_factor(self, one: NamedCause) -> tuple[str, str]:
        """What a factor looks like, and the remedy."""
        torque, gear = self.torque, self.crank.gear_ratio
        scale = f"set drive_torque.scale to {torque.scale / one.value:.4g}"
        if _is_near(one, 1000.0):
            return ": it is in N mm", scale
        if gear != 1.0 and _is_near(one, 1.0 / gear):
            return (
                f": it is the torque on the joint's shaft; crank.gear_ratio is {amount(gear, '')}",
                f"set drive_torque.gear_ratio to {torque.gear_ratio * gear:.4g}",
            )
        if torque.gear_ratio != 1.0 and _is_near(one, torque.gear_ratio):
            return (
                ": it is already the torque on the crank; drive_torque.gear_ratio is "
                f"{amount(torque.gear_ratio, '')}",
                "set drive_torque.gear_ratio to 1",
            )
        return "", f"{scale}, or correct drive_torque.gear_ratio"

    def _temperatures(self) -> str:
        """Temperatures of the drive now and when the leg was commissioned; empty where one is not known."""
        found = self.diagnosis
        if found.temperature_c is None or found.commissioned_c is None:
            return ""
        return (
            f" (the drive is at {found.temperature_c:.0f} °C, and was at {found.commissioned_c:.0f} °C then)"
        )

    def _timing(self, one: NamedCause) -> str:
        """An angle that an offset of the crank explains as well as a lag does."""
        speed = self.speed_radps
        offset = self.cause(NamedCause(Cause.CRANK_OFFSET, one.value, one.sigma))
        if not abs(speed) > 0.0:
            return f"{offset}, or the torque is {'early' if one.value > 0.0 else 'late'}"
        lag = self.cause(NamedCause(Cause.LAG, -one.value / speed, one.sigma / abs(speed)))
        return f"{offset}, or {lag}: at one speed the two cannot be distinguished"

    def _shift(self, angle_rad: float) -> str:
        if self.crank.zero == AT_START:
            return "restart the monitor while the leg walks steadily, so that the crank's zero is found again"
        right = f"set crank.offset_rad to {self.crank.offset_rad + angle_rad:.4g}"
        return right if angle_rad else "correct crank.offset_rad"


def _way(one: NamedCause) -> str:
    return "risen" if one.value > 0.0 else "fallen"


def _is_near(one: NamedCause, factor: float) -> bool:
    return abs(one.value - factor) <= max(_SURE * one.sigma, _NEAR * factor)


# State of the diagnosis in words, without the values that change in each gait cycle.


_STATES = {
    DiagnosisState.OFF: "off",
    DiagnosisState.WAITING: "waiting",
    DiagnosisState.AS_COUNTED: "the drive torque shows the counted clearances",
    DiagnosisState.CHANGED: "the drive torque shows a change",
}


def diagnosis_words(diagnosis: Diagnosis, joints: Sequence[str]) -> str:
    """State, reason, and the joints (k,) that the drive torque does not show."""
    sentences = [_STATES[diagnosis.state]]
    if diagnosis.reason:
        sentences.append(diagnosis.reason)
    if diagnosis.next_step:
        sentences.append(diagnosis.next_step)
    hidden = unseen(diagnosis, joints)
    if diagnosis.clearance_m and hidden:
        sentences.append(f"not observable: {', '.join(hidden)}")
    if diagnosis.bodies:
        sentences.append("wear is counted with the masses, lengths and friction that the drive torque shows")
    return "; ".join(sentences)


def unseen(diagnosis: Diagnosis, joints: Sequence[str]) -> tuple[str, ...]:
    """Joints whose clearance the drive torque does not show."""
    if not diagnosis.clearance_m:
        return tuple(joints)
    return tuple(
        joint for joint, value in zip(joints, diagnosis.clearance_m, strict=True) if math.isnan(value)
    )
