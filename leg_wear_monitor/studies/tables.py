"""Responses of a study's points as columns of tables; mean and deviation of a statistic after a dot."""

from collections.abc import Iterator, Sequence
from typing import Any

from leg_wear_monitor.studies.point import Arrays, Point
from leg_wear_monitor.studies.summary import (
    RANGES,
    Spread,
    clearance_joints_of,
    depth_per_cycle,
    joint_force,
    largest_error,
    of_clearance_joints,
    peak_force,
    spread,
)

Columns = dict[str, list[Any]]
_Found = Sequence[tuple[Point, Arrays]]

_FORCES = ("mean_force_n", "rms_force_n", "p99_force_n")
_OF_CONTACT = (
    "impacts",
    "impact_speed_mps",
    "contact_fraction",
    "friction_work_j_per_cycle",
    "archard_integral_j_per_cycle",
)


def point_columns(found: _Found) -> Columns:
    """One row a point: largest errors of toe and drive in a cycle against the ideal leg, and the torque.

    None for the errors of a toe that the leg does not have.
    """
    columns: Columns = {
        "point": [point.label for point, _ in found],
        "clearance_joints": [", ".join(clearance_joints_of(arrays)) for _, arrays in found],
        "clearance_m": [point.clearance_m for point, _ in found],
        "speed_rpm": [point.speed_rpm for point, _ in found],
    }
    for name, ideal in RANGES.items():
        errors = [largest_error(arrays, name) if ideal in arrays else None for _, arrays in found]
        columns |= _means(name, errors)
    return columns | _means("rms_torque_nm", [spread(arrays["rms_torque_nm"]) for _, arrays in found])


def joint_columns(found: _Found) -> Columns:
    """One row a point and clearance joint: forces, impacts, contact, and wear of the bushing."""
    rows = [(point, arrays, joint) for point, arrays in found for joint in clearance_joints_of(arrays)]
    columns: Columns = {
        "point": [point.label for point, _, _ in rows],
        "joint": [joint for _, _, joint in rows],
        "clearance_m": [point.clearance_m for point, _, _ in rows],
        "speed_rpm": [point.speed_rpm for point, _, _ in rows],
    }
    statistics = [dict(_statistics(arrays, joint)) for _, arrays, joint in rows]
    names = ("peak_force_n", *_FORCES, *_OF_CONTACT, "wear_depth_m_per_cycle")
    for name in names:
        columns |= _means(name, [each[name] for each in statistics])
    return columns


def _statistics(arrays: Arrays, joint: str) -> Iterator[tuple[str, Spread]]:
    yield "peak_force_n", peak_force(arrays, joint)
    for name in _FORCES:
        yield name, joint_force(arrays, name, joint)
    for name in _OF_CONTACT:
        yield name, of_clearance_joints(arrays, name, joint)
    yield "wear_depth_m_per_cycle", depth_per_cycle(arrays, joint)


def _means(name: str, values: Sequence[Spread | None]) -> Columns:
    return {
        f"{name}.mean": [None if value is None else value.mean for value in values],
        f"{name}.deviation": [None if value is None else value.deviation for value in values],
    }
