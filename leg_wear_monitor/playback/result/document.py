"""Parts of what a replay found as summary.json has them, and back: the only place of its keys."""

import math
from enum import Enum
from typing import Any

import attrs
import numpy as np

from leg_wear_monitor.playback.result.parts import AlarmChange, ReplayAlarms, ReplayJoint

JsonObject = dict[str, Any]


def part_document(part: Any) -> Any:
    """Fields of a part, or a plain value; null for what is not known."""
    if attrs.has(type(part)):
        return part_document(attrs.asdict(part, recurse=False))
    if isinstance(part, dict):
        return {name: part_document(value) for name, value in part.items()}
    if isinstance(part, tuple | list):
        return [part_document(value) for value in part]
    if isinstance(part, np.ndarray):
        return part_document(part.tolist())
    if isinstance(part, Enum):
        return part.name if isinstance(part, int) else part.value  # as configuration.strict reads them
    return None if isinstance(part, float) and not math.isfinite(part) else part


def joint_document(joint: ReplayJoint) -> JsonObject:
    """A joint; no key for a clearance that no encoder shows."""
    record: JsonObject = part_document(joint)
    return record if joint.seen is not None else {key: record[key] for key in record if key != "seen"}


def alarms_document(alarms: ReplayAlarms) -> JsonObject:
    """All alarms, and their changes with the stamp before what the alarm was."""
    return {
        "now": part_document(alarms.now),
        "changes": [_change(change) for change in alarms.changes],
    }


def _change(change: AlarmChange) -> JsonObject:
    return {"stamp_ns": change.stamp_ns, **part_document(change.alarm)}
