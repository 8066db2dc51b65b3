"""What a replay found as columns of tables: a value's name is its path, parts after a dot."""

from collections.abc import Iterator, Mapping
from enum import Enum
from typing import Any, get_args

import attrs

from leg_wear_monitor.playback.result.parts import ReplayJoint

_Path = tuple[str, ...]


def joint_columns(joints: Mapping[str, ReplayJoint]) -> dict[str, list[Any]]:
    """One row a joint; None for what is not known, or is not there."""
    columns: dict[str, list[Any]] = {"joint": list(joints)}
    for path in _paths(ReplayJoint):
        columns[".".join(path)] = [_value(joint, path) for joint in joints.values()]
    return columns


def _paths(kind: type) -> Iterator[_Path]:
    """Paths of all plain values below a class of parts."""
    for field in attrs.fields(attrs.resolve_types(kind)):
        part = next((each for each in (field.type, *get_args(field.type)) if attrs.has(each)), None)
        if part is None:
            yield (field.name,)
        else:
            yield from ((field.name, *inner) for inner in _paths(part))


def _value(part: Any, path: _Path) -> Any:
    for name in path:
        part = None if part is None else getattr(part, name)
    return part.value if isinstance(part, Enum) else part
