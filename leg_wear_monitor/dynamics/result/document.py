"""Parts of a simulation's result as JSON objects."""

from typing import Any

import attrs

from leg_wear_monitor.dynamics.result.parts import (
    EnergyBalance,
    Impact,
    JointResult,
    ToeResult,
    TorqueResult,
    Trace,
)

JsonObject = dict[str, Any]

_OF_EVERY_JOINT = ("mean_force_n", "rms_force_n", "p99_force_n", "max_force_n")


def part_document(part: TorqueResult | EnergyBalance | ToeResult | Impact | None) -> JsonObject | None:
    """Fields of a part; null for a part without data."""
    return None if part is None else attrs.asdict(part)


def joint_document(joint: JointResult) -> JsonObject:
    """Fields of a joint; contact and wear are present for clearance joints only."""
    record = attrs.asdict(joint)
    return record if joint.has_clearance else {name: record[name] for name in _OF_EVERY_JOINT}


def trace_document(trace: Trace) -> JsonObject:
    """Columns of a trace as lists; without toe columns for a mechanism without a toe."""
    columns = {"crank_angle_rad": trace.crank_angle_rad}
    if trace.toe_x_m is not None and trace.toe_y_m is not None:
        columns |= {"toe_x_m": trace.toe_x_m, "toe_y_m": trace.toe_y_m}
    columns["drive_torque_nm"] = trace.drive_torque_nm
    force = {name: force.tolist() for name, force in trace.force_n.items()}
    return {name: column.tolist() for name, column in columns.items()} | {"force_n": force}
