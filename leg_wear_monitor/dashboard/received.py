"""Statuses as other processes sent them, back to what the monitor said; nothing in them is trusted."""

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from itertools import islice
from typing import Any

import attrs
import numpy as np

from leg_wear_monitor.errors import printable
from leg_wear_monitor.files import or_nan
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.monitor.alarms import Level
from leg_wear_monitor.monitor.forecast.forecast import Answer, JointForecast, Quantiles
from leg_wear_monitor.monitor.verdict.verdict import unit_of, with_unit
from leg_wear_monitor.playback.history import CYCLE_COLUMNS, SUMMARY_COLUMNS
from leg_wear_monitor.playback.result import LegLife, ReplayAlarm, ReplayHistory, ReplayStatus
from leg_wear_monitor.state import Evidence, Figure, State, Verdict

MOST = 200
"""Statuses in a message, values in a status, joints: what exceeds it is not from a monitor."""

NO_DATA = "no_data_s"

_LIMIT = re.compile(r"(?P<name>.+)_limit(?P<unit>_.+)?")
_DO = ". To do: "
_CODE = "fault_code"
_FRACTIONS = ("p10", "p50", "p90")


def received_status(name: str, level: int, message: str, values: Mapping[str, str]) -> ReplayStatus:
    """A status from the parts of a message: its texts on one line and not too long, its values numbers."""
    first = islice(values.items(), MOST)
    return ReplayStatus(
        name=printable(name),
        level=Level(min(max(level, Level.OK), Level.ERROR)),
        message=printable(message),
        values={printable(key): _number(value) for key, value in first if key != _CODE},
        fault_code=printable(values.get(_CODE, "")),
    )


def own_statuses(node: str, statuses: Iterable[ReplayStatus]) -> dict[str, ReplayStatus]:
    """The statuses of a node by their names without the node's; those of other nodes are left out."""
    prefix, own = f"{node.lstrip('/')}: ", {}
    for status in islice((each for each in statuses if each.name.startswith(prefix)), MOST):
        name = status.name.removeprefix(prefix)
        own[name] = attrs.evolve(status, name=name)
    return own


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan


def verdict_of(status: ReplayStatus) -> Verdict:
    """The verdict that a status says; names in its evidence have spaces for underscores."""
    values = status.values
    severity = values.get("severity")
    state = list(State)[min(max(int(severity or 0.0), 0), len(State) - 1)]
    if severity is None:  # that is no verdict of ours
        state = State.NOT_MONITORED
    joints = tuple(key.removeprefix("joint_") for key in values if key.startswith("joint_"))
    why, do = _why_and_do(status, state, joints)
    return Verdict(
        state=state,
        joints=joints,
        why=why,
        since_ns=_stamp_ns(values.get("since_s")),
        do=do,
        evidence=tuple(_evidence(values)),
        not_valid=tuple(figure for figure in Figure if values.get(f"not_valid_{figure.value}")),
        fault_code=status.fault_code,
    )


def _why_and_do(status: ReplayStatus, state: State, joints: tuple[str, ...]) -> tuple[str, str]:
    whose = f" joint {', '.join(joints)}" if joints else ""
    reason, _, do = status.message.removeprefix(f"{state.words}{whose}: ").rpartition(_DO)
    return (reason, do) if reason else (do, "")


def _evidence(values: Mapping[str, float | None]) -> Iterable[Evidence]:
    """Each value that has a limit beside it, known or not."""
    for key, limit in values.items():
        found = _LIMIT.fullmatch(key)
        if found is None:
            continue
        name, unit = found["name"], unit_of(key, f"{found['name']}_limit")
        value = with_unit(name, unit)
        if value in values:
            yield Evidence(name.replace("_", " "), values[value], limit, unit)


def alarm_of(status: ReplayStatus) -> ReplayAlarm:
    """An alarm of the topic ``~/alarms``."""
    values = status.values
    unit = next((unit_of(key, "value") for key in values if key.split("_")[0] == "value"), "")
    value, limit, worst = (values.get(with_unit(name, unit)) for name in ("value", "limit", "worst"))
    return ReplayAlarm(
        name=status.name,
        level=status.level,
        state=status.message,
        value=value,
        limit=limit,
        unit=unit,
        worst=worst,
        raised_ns=_stamp_ns(values.get("raised_s")),
    )


def joint_forecast_of(status: ReplayStatus) -> JointForecast | None:
    """A joint's forecast of the topic ``~/forecast``; None if there is none yet."""
    answer, clearance = _answer(status), _quantiles(status, "clearance_{}_m")
    if answer is None or clearance is None:
        return None
    return JointForecast(
        answer=answer,
        cycles=_quantiles(status, "{}_cycles"),
        hours=_quantiles(status, "{}_hours"),
        days=_quantiles(status, "{}_days"),
        clearance_m=clearance,
        measurements=int(status.values.get("measurements") or 0.0),
    )


def leg_life_of(status: ReplayStatus) -> LegLife | None:
    """The leg's forecast of the topic ``~/forecast``."""
    answer, end = _answer(status), "_first_probability"
    if answer is None:
        return None
    first = {key.removesuffix(end): value or 0.0 for key, value in status.values.items() if key.endswith(end)}
    return LegLife(
        answer=answer,
        cycles=_quantiles(status, "{}_cycles"),
        hours=_quantiles(status, "{}_hours"),
        days=_quantiles(status, "{}_days"),
        first_probability=first,
        simulated_lives=int(status.values.get("simulated_lives") or 0.0),
        first=max(first, key=lambda joint: first[joint], default=None),
    )


def hours_of(status: ReplayStatus) -> Quantiles | None:
    """Remaining hours of walking in a joint's status; None if they are not known."""
    return _quantiles(status, "{}_hours")


def _answer(status: ReplayStatus) -> Answer | None:
    return next((answer for answer in Answer if status.message.startswith(answer.value)), None)


def _quantiles(status: ReplayStatus, key: str) -> Quantiles | None:
    p10, p50, p90 = (status.values.get(key.format(fraction)) for fraction in _FRACTIONS)
    return None if p10 is None or p50 is None or p90 is None else Quantiles(p10, p50, p90)


def _stamp_ns(seconds: float | None) -> int:
    return 0 if seconds is None else round(1.0e9 * seconds)


# What was heard of a leg over time, in a bounded number of rows.


MOST_ROWS = 600
"""So many points are as many as a screen shows; twice as many are thinned by two."""

_MAXIMA = ("peak_force_n",)  # of a group of gait cycles, its largest value


@attrs.frozen
class Row:
    """Values at a stamp, by column and, for those of a joint, by its name; what is absent is not known."""

    stamp_ns: int
    leg: Mapping[str, float | None]
    joints: Mapping[str, Mapping[str, float | None]]


class Trends:
    """The rows, the older ones thinned like the newer ones: always every so many."""

    def __init__(self) -> None:
        self._begin()

    def _begin(self) -> None:
        self._rows: list[Row] = []
        self._every = 1  # rows that were given, for one that is kept
        self._waiting: list[Row] = []

    def add(self, row: Row) -> None:
        """Keep a row; one of another time base, before the last, begins anew."""
        if self._rows and row.stamp_ns < self._rows[-1].stamp_ns:
            self._begin()
        self._waiting.append(row)
        if len(self._waiting) < self._every:
            return
        self._rows.append(_merged(self._waiting))
        self._waiting.clear()
        if len(self._rows) >= 2 * MOST_ROWS:
            self._rows = [_merged(self._rows[k : k + 2]) for k in range(0, len(self._rows), 2)]
            self._every *= 2

    def history(self, joints: Sequence[str]) -> ReplayHistory:
        """The rows as columns; all NaN in columns that were never heard."""
        rows = [*self._rows, *self._waiting[-1:]]
        columns: dict[str, Any] = {name: _column(row.leg.get(name) for row in rows) for name in CYCLE_COLUMNS}
        columns |= {
            name: {joint: _column(row.joints.get(name, {}).get(joint) for row in rows) for joint in joints}
            for name in (*SUMMARY_COLUMNS.values(), "seen_m")
        }
        stamps = np.array([row.stamp_ns for row in rows], np.int64)
        return ReplayHistory(stamp_ns=stamps, **columns)


def _merged(rows: Sequence[Row]) -> Row:
    """One row for some: the last values that are known, and the largest of what counts as such."""
    leg: dict[str, float | None] = {}
    joints: dict[str, dict[str, float | None]] = {}
    for row in rows:
        leg |= {name: value for name, value in row.leg.items() if value is not None}
        for name, values in row.joints.items():
            kept = joints.setdefault(name, {})
            for joint, value in values.items():
                before = kept.get(joint)
                if value is not None and (name not in _MAXIMA or before is None or value > before):
                    kept[joint] = value
    return Row(rows[-1].stamp_ns, leg, joints)


def _column(values: Iterable[float | None]) -> Floats:
    return np.array([or_nan(value) for value in values], float)
