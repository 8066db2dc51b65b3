"""Alarms that need a clock or the ROS graph: a silent input, stamps of a time to come, several publishers."""

from collections.abc import Mapping

import attrs

from leg_wear_monitor.monitor.alarms.alarm import Alarm, Level, Limit, acknowledged, evaluated, has_changed
from leg_wear_monitor.monitor.evaluation import specs
from leg_wear_monitor.monitor.reports import AlarmList
from leg_wear_monitor.ros.health.silence import SILENT_FROM_S
from leg_wear_monitor.twin.kinds import CRANK, KINDS

SILENCE, AHEAD = "input_silence", "stamps_ahead"
AHEAD_FROM_S = 1.0  # more than what a network's clocks differ by
_SILENT = Limit(SILENT_FROM_S, SILENT_FROM_S, is_latched=False)
_AHEAD = Limit(AHEAD_FROM_S, 2.0 * AHEAD_FROM_S, is_latched=False)
SOURCES = specs.SOURCES.kind
_TWO_SOURCES = Limit(2.0, 2.0)
_CRANK = KINDS[CRANK].name
_LIMITS = {SILENCE: _SILENT, AHEAD: _AHEAD, SOURCES: _TWO_SOURCES}

QUANTITIES = {
    **{f"{SILENCE} {kind.name}": f"time without {kind.name} samples" for kind in KINDS.values()},
    **{f"{AHEAD} {kind.name}": f"lead of the {kind.name}'s stamps over the clock" for kind in KINDS.values()},
    **{f"{SOURCES} {kind.name}": f"number of publishers of the {kind.name}" for kind in KINDS.values()},
    SOURCES: f"number of publishers of the {_CRANK}",
}
"""Nouns of the alarms' values, by the alarms' names."""


def sources_alarm(kind: str) -> Alarm:
    """Name of the alarm for several publishers; for the crank, the monitor's alarm without a subject."""
    return Alarm(kind=SOURCES, subject="" if kind == _CRANK else kind)


class NodeAlarms:
    """Alarms of the node, in addition to those of the monitor.

    The list of alarms contains them only while they are raised; otherwise live runs and replays publish the
    same bytes. ``input_sources`` is also an alarm of the monitor; the higher level of both is published.

    Parameters
    ----------
    kinds : tuple of str
        Names of the input kinds.
    """

    def __init__(self, kinds: tuple[str, ...]) -> None:
        alarms = [Alarm(kind=each, subject=kind, unit="s") for each in (SILENCE, AHEAD) for kind in kinds]
        alarms += [sources_alarm(kind) for kind in kinds]
        self._alarms = {alarm.name: alarm for alarm in alarms}

    def evaluate(self, values: Mapping[str, float], stamp_ns: int) -> tuple[Alarm, ...]:
        """Evaluate values by alarm name; return the alarms whose published state has changed."""
        changed = []
        for name, value in values.items():
            before = self._alarms[name]
            after = evaluated(before, value, _LIMITS[before.kind], stamp_ns)
            if has_changed(before, after):
                changed.append(after)
            self._alarms[name] = after
        return tuple(changed)

    def acknowledge(self) -> tuple[tuple[Alarm, ...], tuple[Alarm, ...]]:
        """Acknowledge all raised alarms; return the cleared ones and the remaining ones."""
        now = [acknowledged(alarm) for alarm in self.raised]
        self._alarms |= {alarm.name: alarm for alarm in now}
        cleared = tuple(alarm for alarm in now if alarm.level is Level.OK)
        return cleared, tuple(alarm for alarm in now if alarm.level is not Level.OK)

    @property
    def raised(self) -> tuple[Alarm, ...]:
        """Alarms that are published."""
        return tuple(alarm for alarm in self._alarms.values() if alarm.level is not Level.OK)

    def beside(self, alarms: AlarmList) -> AlarmList:
        """Merge the monitor's alarms with those of the node."""
        if not self.raised:
            return alarms
        named = {alarm.name: alarm for alarm in alarms.alarms}
        for own in self.raised:
            if own.name not in named or own.level > named[own.name].level:
                named[own.name] = own
        return attrs.evolve(alarms, alarms=tuple(named.values()))
