"""Alarms that a reset or a measurement has cleared, for when it is taken back: as the ledger knows them."""

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from itertools import takewhile

import attrs

from leg_wear_monitor.files import or_nan
from leg_wear_monitor.monitor.alarm_specs import CLEARANCE, MISMATCH
from leg_wear_monitor.monitor.alarms import Alarm, joint_of
from leg_wear_monitor.monitor.ledger.entry import AlarmEvent
from leg_wear_monitor.monitor.ledger.ledger import Ledger
from leg_wear_monitor.monitor.verdict.conditions import ERROR_OF
from leg_wear_monitor.monitor.verdict.situation import BOTH, MEASURED, SEEN
from leg_wear_monitor.monitor.verdict.verdict import code_of_rule
from leg_wear_monitor.state import Level, Verdict


def cleared_at(ledger: Ledger | None, stamps: Collection[int], now: Mapping[str, Alarm]) -> tuple[Alarm, ...]:
    """Alarms that were cleared or acknowledged at some stamps and have not changed since: raised again.

    They are not acknowledged: what they rested on is as it was, and nobody has seen to it.

    Parameters
    ----------
    ledger : Ledger
    stamps : collection of int
        Of what is taken back.
    now : mapping of str to Alarm
        Present alarms by name; one that is still raised knows more of itself than the history does.
    """
    if ledger is None:
        return ()
    history: dict[str, list[AlarmEvent]] = {}
    for event in ledger.alarm_history:
        history.setdefault(event.alarm.name, []).append(event)
    found = []
    for name, events in history.items():
        before, last = [each for each in events if each.stamp_ns not in stamps], events[-1]
        if last.stamp_ns not in stamps or not before or not _is_eased(before[-1].alarm, last.alarm):
            continue
        own = now.get(name)
        is_kept = own is not None and own.level >= before[-1].alarm.level
        found.append(attrs.evolve(own, acknowledged=False) if own and is_kept else _as_it_was(ledger, before))
    return tuple(found)


def rested_on(alarms: Iterable[Alarm], joint: str, named: Iterable[str]) -> tuple[str, ...]:
    """Names of the raised alarms that rested on the part of a joint that was replaced.

    The joint's own ones; and the torque mismatch if this joint explains it: if its clearance was at a limit,
    or the verdict named it for its clearance.

    Parameters
    ----------
    alarms : iterable of Alarm
    joint : str
    named : iterable of str
        Joints that the verdict named for their clearance.
    """
    raised = [alarm for alarm in alarms if alarm.level is not Level.OK]
    own = [alarm for alarm in raised if joint_of(alarm.name) == joint]
    explains = joint in named or any(alarm.kind == CLEARANCE.kind for alarm in own)
    mismatch = [alarm for alarm in raised if explains and alarm.kind == MISMATCH.kind]
    return tuple(alarm.name for alarm in (*own, *mismatch))


def named_for_clearance(findings: Iterable[Verdict]) -> frozenset[str]:
    """Joints that findings name for their clearance."""
    of_clearance = (each for each in findings if code_of_rule(each).startswith("CLEARANCE"))
    return frozenset(joint for each in of_clearance for joint in each.joints)


def eased(before: Iterable[Alarm], after: Iterable[Alarm], joint: str) -> str:
    """What became of the alarm of a clearance that an earlier measurement had raised; empty if it stays."""
    name = CLEARANCE.name(joint)
    was = next((each for each in before if each.name == name), None)
    now = next((each for each in after if each.name == name), None)
    if was is None or was.level is Level.OK or was.cause not in (MEASURED, BOTH):
        return ""
    if now is None or now.level < was.level:
        return "is lowered" if now and now.level is not Level.OK else "ends"
    return "is acknowledged" if now.acknowledged and not was.acknowledged else ""


def _is_eased(before: Alarm, after: Alarm) -> bool:
    """Whether a raised alarm has a lower level or is acknowledged."""
    is_acknowledged = after.acknowledged and not before.acknowledged
    return after.level < before.level or (is_acknowledged and before.level is not Level.OK)


def _as_it_was(ledger: Ledger, events: Sequence[AlarmEvent]) -> Alarm:
    """An alarm as its changes left it; its value and its source are those of the last verdict with it.

    It is present until a value is evaluated: the history does not say what the value was at last.
    """
    last = events[-1].alarm
    same = list(takewhile(lambda event: event.alarm.level >= last.level, reversed(events)))
    values = (event.alarm.value for event in same)
    alarm = attrs.evolve(
        last,
        present=last.level,
        acknowledged=False,
        value=math.nan,
        worst=next((value for value in values if not math.isnan(value)), math.nan),
        limit=next((event.alarm.limit for event in same if not math.isnan(event.alarm.limit)), math.nan),
        raised_ns=same[-1].stamp_ns,
    )
    known = ledger.last_evidence(alarm.name).get(alarm.name)
    sources = {f"{alarm.name} by {source}": source for source in SEEN}
    sources[f"measured {alarm.name}"] = MEASURED
    for name, source in sources.items():
        evidence = ledger.last_evidence(name)  # an acknowledged one has no source in later verdicts
        value = evidence[name].value if name in evidence else None
        if known is not None and value is not None and value == known.value:
            error = evidence.get(f"{ERROR_OF}{name}")  # in ledgers of earlier versions, there is none
            return attrs.evolve(
                alarm, worst=value, cause=source, sigma=or_nan(error.value if error else None)
            )
    return alarm
