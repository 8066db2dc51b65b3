"""A verdict and the findings it is made of; everything here is immutable."""

from collections.abc import Iterable, Sequence
from enum import Enum
from typing import Any

import attrs

from leg_wear_monitor.json_text import finite_or_none
from leg_wear_monitor.monitor.alarms.alarm import Level
from leg_wear_monitor.monitor.alarms.guides import guide_of
from leg_wear_monitor.shown import Shown


class _Word(Enum):
    """Members whose value is the word that files contain."""

    @property
    def words(self) -> str:
        """The word as operators read it."""
        return str(self.value).replace("_", " ")


class State(_Word):
    """State of the leg, from the mildest to the most severe; the value is the word that files contain.

    A leg that is not monitored is worse than one to be watched, and milder than one to be inspected: a reason
    to inspect or to stop does not end because the input fails.
    """

    HEALTHY = "healthy"
    WATCH = "watch"
    NOT_MONITORED = "not_monitored"
    INSPECT = "inspect"
    STOP = "stop"

    @property
    def severity(self) -> int:
        """Rank in the order above, from 0."""
        return list(State).index(self)


class Figure(_Word):
    """Kinds of values that may not be valid; the value is the word that files contain."""

    CLEARANCES = "clearances"
    GROWTH = "growth"
    IMPACT_FORCES = "impact_forces"
    FORECAST = "forecast"

    @property
    def words(self) -> str:
        """What operators read: a clearance by torque, by encoders or by hand is not meant."""
        return "counted clearances" if self is Figure.CLEARANCES else super().words


@attrs.frozen
class Evidence:
    """A value that a finding rests on, and its limit.

    Attributes
    ----------
    name : str
        Name of the alarm, or of what was observed.
    value : float or None
        Its value; None if it is not known.
    limit : float or None
        Its limit; None where there is no limit.
    unit : str
        Of both, SI; empty for a fraction.
    """

    name: str
    value: float | None = attrs.field(converter=finite_or_none)
    limit: float | None = attrs.field(converter=finite_or_none)
    unit: str


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


@attrs.frozen(kw_only=True)
class Verdict(Shown):
    """Conclusion of the monitor on the leg.

    Attributes
    ----------
    state : State
        State of the leg.
    joints : tuple of str
        The joints that the reason concerns; empty if that is not known, or none is.
    why : str
        The reason, with values and units.
    since_ns : int
        Stamp since which the reason has been valid; 0 if it is not known.
    do : str
        Next action of a person.
    evidence : tuple of Evidence
        Of all findings, that of the reason first.
    not_valid : tuple of Figure
        Kinds of values that are not valid meanwhile.
    fault_code : str
        Stable name of the reason, such as ``CLEARANCE_G``; ``NONE`` for a healthy leg.
    """

    state: State
    joints: tuple[str, ...]
    why: str
    since_ns: int
    do: str
    evidence: tuple[Evidence, ...]
    not_valid: tuple[Figure, ...]
    fault_code: str

    @property
    def level(self) -> Level:
        """Level in diagnostics: a leg that did not walk yet is no fault."""
        if self.state is State.HEALTHY:
            return Level.OK
        if self.state is State.WATCH or self.fault_code == NO_GAIT_CYCLE:
            return Level.WARN
        return Level.ERROR

    @property
    def words(self) -> str:
        """State, joints, reason and action in one line."""
        whose = f" joint {', '.join(self.joints)}" if self.joints else ""
        return f"{self.state.words}{whose}: {self.why}. To do: {self.do}"

    @property
    def guide(self) -> str:
        """Page that says what to do about the reason, as a path below the share directory."""
        return guide_of(self.fault_code.removesuffix("".join(f"_{joint}" for joint in self.joints)))

    def to_dict(self) -> dict[str, Any]:
        """Plain data as in summary.json; an unknown value is None."""
        return {
            "state": self.state.value,
            "joints": list(self.joints),
            "why": self.why,
            "since_ns": self.since_ns,
            "do": self.do,
            "evidence": [attrs.asdict(each) for each in self.evidence],
            "not_valid": [figure.value for figure in self.not_valid],
            "fault_code": self.fault_code,
        }


NO_GAIT_CYCLE, NONE = "NO_GAIT_CYCLE", "NONE"


def verdict_of(findings: Sequence[Finding]) -> Verdict:
    """Verdict of at least one finding: the first of the most severe ones is its reason."""
    lead = max(findings, key=lambda finding: finding.state.severity)
    evidence: dict[str, Evidence] = {}
    for each in (each for finding in (lead, *findings) for each in finding.evidence):
        evidence.setdefault(each.name, each)
    found = {figure for finding in findings for figure in finding.not_valid}
    return Verdict(
        state=lead.state,
        joints=lead.joints,
        why=lead.why + _unmonitored(lead, findings),
        since_ns=lead.since_ns,
        do=lead.do,
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
