"""Tables of a study: a row a point, a row a joint, each statistic with its mean and its deviation."""

import numpy as np
import pytest

from leg_wear_monitor.studies.study import Point
from leg_wear_monitor.studies.tables import joint_columns, point_columns

ERRORS = ("toe_position_m", "toe_velocity_mps", "toe_acceleration_mps2", "drive_torque_nm")

OF_CONTACT = (
    "contact_fraction", "friction_work_j_per_cycle", "archard_integral_j_per_cycle", "impact_speed_mps",
)  # fmt: skip


def response(factor, clearance_joints):
    """Arrays of two runs, three cycles and the joints A, G and J."""
    k = len(clearance_joints)
    runs = factor * np.array([1.0, 3.0])
    of_joints = np.broadcast_to(runs[:, None], (2, k))
    arrays = {f"error_{name}": np.broadcast_to(runs[:, None], (2, 3)) for name in ERRORS}
    arrays |= {name: np.broadcast_to(runs[:, None], (2, 3)) for name in ("mean_force_n", "rms_force_n")}
    arrays |= dict.fromkeys(OF_CONTACT, of_joints)
    return arrays | {
        "ideal_drive_torque_nm": np.zeros(4),
        "p99_force_n": np.array([[1.0, 5.0, 9.0], [1.0, 7.0, 9.0]]),
        "peak_force_n": np.broadcast_to(np.array([10.0, 20.0, 30.0]), (2, 3, 3)),
        "impacts": np.full((2, 3, k), 4.0),
        "rms_torque_nm": runs,
        "wear_depth_m_per_cycle": np.broadcast_to(runs[:, None, None, None] * [[[[1e-12]]]], (2, k, 2, 8)),
        "joints": np.array(["A", "G", "J"]),
        "clearance_joints": np.array(clearance_joints),
    }


def point(label, clearance_joints, clearance_m):
    settings = {"clearances": clearance_joints, "clearance_m": clearance_m, "speed_rpm": 60.0}
    return Point(label=label, task="response", settings=settings)


@pytest.fixture
def found():
    return [
        (point("small", ["G", "J"], 1e-4), response(1.0, ["G", "J"])),
        (point("large", ["G"], 2e-4), response(2.0, ["G"])),
    ]


def test_a_row_a_point(found):
    columns = point_columns(found)
    assert {len(column) for column in columns.values()} == {2}
    assert columns["point"] == ["small", "large"]
    assert columns["clearances"] == ["G, J", "G"]
    assert columns["clearance_m"] == [1e-4, 2e-4]
    assert columns["drive_torque_nm.mean"] == [2.0, 4.0]
    assert columns["rms_torque_nm.deviation"] == [1.0, 2.0]


def test_a_toe_that_is_not_there_has_no_errors(found):
    assert point_columns(found)["toe_position_m.mean"] == [None, None]


def test_a_row_a_point_and_clearance_joint(found):
    columns = joint_columns(found)
    assert {len(column) for column in columns.values()} == {3}
    assert list(zip(columns["point"], columns["joint"], strict=True)) == [
        ("small", "G"), ("small", "J"), ("large", "G"),
    ]  # fmt: skip
    assert columns["p99_force_n.mean"] == [6.0, 9.0, 6.0]
    assert columns["peak_force_n.mean"] == [20.0, 30.0, 20.0]
    assert columns["wear_depth_m_per_cycle.mean"] == pytest.approx([2e-12, 2e-12, 4e-12])


def test_without_a_result_the_columns_are_the_same(found):
    for table in (point_columns, joint_columns):
        assert {name: [] for name in table(found)} == table([])
