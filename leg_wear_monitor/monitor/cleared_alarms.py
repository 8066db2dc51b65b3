"""Alarms that a reset or a measurement has cleared, for when it is taken back: as the ledger knows them."""

import math
from collections.abc import Collection, Mapping, Sequence
from itertools import takewhile

import attrs

from leg_wear_monitor.files import or_nan
from leg_wear_monitor.monitor.alarms import Alarm
from leg_wear_monitor.monitor.ledger.entry import AlarmEvent
from leg_wear_monitor.monitor.ledger.ledger import Ledger
from leg_wear_monitor.monitor.verdict.situation import ERROR_OF, MEASURED, SEEN
from leg_wear_monitor.state import Level


def cleared_at(ledger: Ledger, stamps: Collection[int], now: Mapping[str, Alarm]) -> tuple[Alarm, ...]:
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
    evidence = ledger.last_evidence(alarm.name)
    sources = {f"{alarm.name} by {source}": source for source in SEEN}
    sources[f"measured {alarm.name}"] = MEASURED
    for name, source in sources.items():
        value = evidence[name].value if name in evidence else None
        if value is not None and value == evidence[alarm.name].value:
            error = evidence.get(f"{ERROR_OF}{name}")  # in ledgers of earlier versions, there is none
            return attrs.evolve(
                alarm, worst=value, cause=source, sigma=or_nan(error.value if error else None)
            )
    return alarm
