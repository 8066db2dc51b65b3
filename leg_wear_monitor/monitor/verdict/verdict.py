"""The verdict: state, joints, reason, action."""

from collections.abc import Iterable, Sequence

import attrs

from leg_wear_monitor.monitor.alarms import amount, guide_of
from leg_wear_monitor.monitor.verdict.table import NO_GAIT_CYCLE
from leg_wear_monitor.state import Evidence, Figure, Level, State, Verdict

_TIMING = "TORQUE_TIMING"


def level_of(verdict: Verdict) -> Level:
    """Level in diagnostics: a leg that has not walked yet is not a fault."""
    if verdict.state is State.HEALTHY:
        return Level.OK
    if verdict.state is State.WATCH or verdict.fault_code == NO_GAIT_CYCLE:
        return Level.WARN
    return Level.ERROR


def code_of_rule(verdict: Verdict) -> str:
    """The verdict's code without its joints: the rule's code, such as ``CLEARANCE_DETECTED``."""
    return verdict.fault_code.removesuffix("".join(f"_{joint}" for joint in verdict.joints))


def guide_to(verdict: Verdict) -> str:
    """Page with the remedy for a verdict's reason, as a path below the share directory."""
    return guide_of(code_of_rule(verdict))


def verdict_of(findings: Sequence[Verdict]) -> Verdict:
    """Verdict of at least one rule's: the first of the most severe ones is its reason."""
    lead = max(findings, key=lambda finding: finding.state.severity)
    evidence: dict[str, Evidence] = {}
    for each in (each for finding in (lead, *findings) for each in finding.evidence):
        evidence.setdefault(each.name, each)
    found = {figure for finding in findings for figure in finding.not_valid}
    why, blind = lead.why, [each for each in findings if each.state is State.NOT_MONITORED]
    if blind and lead.state is not State.NOT_MONITORED:
        why += f"; the leg is not monitored now: {blind[0].why}"
    inspected = [one for one in findings if one.state.severity >= State.INSPECT.severity]
    # a reason without a joint does not hide a joint, and a joint does not hide a wrong time of the torque
    also = [one for one in inspected if (one.fault_code == _TIMING if lead.joints else one.joints)]
    why += "".join(f"; also: {one.why}. To do: {one.do}" for one in also)
    not_valid = tuple(figure for figure in Figure if figure in found)
    return attrs.evolve(lead, why=why, evidence=tuple(evidence.values()), not_valid=not_valid)


def dated(findings: Iterable[Verdict], before: Iterable[Verdict], stamp_ns: int) -> tuple[Verdict, ...]:
    """Findings with the stamp since which each holds: its own, the same earlier one's, or the given stamp."""
    known = {each.fault_code: each.since_ns for each in before}
    return tuple(
        attrs.evolve(each, since_ns=each.since_ns or known.get(each.fault_code) or stamp_ns)
        for each in findings
    )


def has_changed(before: Verdict | None, after: Verdict) -> bool:
    """True if a verdict must be reported again; values alone change in each gait cycle."""
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
