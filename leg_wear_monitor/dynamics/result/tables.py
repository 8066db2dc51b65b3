"""Tables of a simulation's result; a column's name is the path of the value, joined by dots."""

from collections.abc import Mapping, Sequence
from typing import Any

import attrs

from leg_wear_monitor.dynamics.result.parts import ClearanceResult, Impact, JointResult, Trace, WearDepth
from leg_wear_monitor.mechanism.arrays import Floats

Columns = dict[str, Sequence[Any] | Floats]

_PARTS = {
    "wear_depth_m_per_cycle": tuple(field.name for field in attrs.fields(WearDepth)),
    "wear_zone_deg": ("from", "to"),
    "clearance_m": tuple(field.name for field in attrs.fields(ClearanceResult)),
}


def joint_columns(joints: Mapping[str, JointResult]) -> Columns:
    """Columns with a row for each joint; None for contact and wear of joints without clearance."""
    rows = [{"joint": name, **_cells(joint)} for name, joint in joints.items()]
    return {name: [row[name] for row in rows] for name in rows[0]}


def impact_columns(impacts: Mapping[str, Sequence[Impact]]) -> Columns:
    """Columns with a row for each impact, joint by joint."""
    rows = [(name, impact) for name, all_ in impacts.items() for impact in all_]
    columns: Columns = {"joint": [name for name, _ in rows]}
    for field in attrs.fields(Impact):
        columns[field.name] = [getattr(impact, field.name) for _, impact in rows]
    return columns


def trace_columns(trace: Trace) -> Columns:
    """Columns with a row for each sample."""
    toe = {"toe_x_m": trace.toe_x_m, "toe_y_m": trace.toe_y_m}
    return {
        "crank_angle_rad": trace.crank_angle_rad,
        **{name: column for name, column in toe.items() if column is not None},
        "drive_torque_nm": trace.drive_torque_nm,
        **{f"force_n.{name}": force for name, force in trace.force_n.items()},
    }


def _cells(joint: JointResult) -> dict[str, float | str | None]:
    cells: dict[str, float | str | None] = {}
    for name, value in attrs.asdict(joint, recurse=False).items():
        if name not in _PARTS:
            cells[name] = value
        else:
            values = (None,) * len(_PARTS[name]) if value is None else _values(value)
            cells |= {f"{name}.{part}": one for part, one in zip(_PARTS[name], values, strict=True)}
    return cells


def _values(part: WearDepth | ClearanceResult | tuple[float, float]) -> tuple[float, ...]:
    return part if isinstance(part, tuple) else attrs.astuple(part)
