"""A result's tables have what its JSON has, a value's column named by its path."""

import json

import numpy as np
import pytest

from leg_wear_monitor import Impact, JointResult, SimulationResult, TorqueResult, Trace
from leg_wear_monitor.dynamics.result import (
    ClearanceResult,
    WearDepth,
    impact_columns,
    joint_columns,
    trace_columns,
)


@pytest.fixture
def result():
    """Joint A without clearance, B with; its second contact still lasts."""
    worn = JointResult(
        *(2.0, 3.0, 5.0, 7.0), 0.9, 0.1, 0.2, WearDepth(4e-9, 3e-9, 2e-9, 1e-9), (10.0, 90.0),
        ClearanceResult(3e-4, 3.1e-4),
    )  # fmt: skip
    return SimulationResult(
        mechanism="two",
        model="full",
        speed_rpm=60.0,
        cycles=1.0,
        simulated_s=1.0,
        drive_torque_nm=TorqueResult(*np.arange(7.0)),
        energy_j=None,
        toe=None,
        joints={"A": JointResult(1.0, 1.0, 1.0, 1.0), "B": worn},
        impacts={"B": (Impact(0.1, 0.01, 0.2, 30.0), Impact(0.5, 0.02, None, 40.0))},
        trace=Trace(
            crank_angle_rad=np.arange(3.0),
            drive_torque_nm=np.arange(3.0),
            force_n={"A": np.ones(3), "B": np.zeros(3)},
        ),
        clearance_joints=("B",),
    )


def flat(record, path=""):
    """Values of a JSON object by path; the two ends of a zone as from and to."""
    found = {}
    for key, value in record.items():
        if isinstance(value, dict):
            found |= flat(value, f"{path}{key}.")
        elif key == "wear_zone_deg":
            found |= {f"{path}{key}.from": value[0], f"{path}{key}.to": value[1]}
        else:
            found[path + key] = value
    return found


def test_json_has_lists_and_null(result):
    record = json.loads(result.to_json())
    assert record["joints"]["B"]["wear_zone_deg"] == [10.0, 90.0]
    assert record["impacts"]["B"][1]["end_s"] is None


def test_joints(result):
    columns, record = joint_columns(result.joints), result.to_dict()["joints"]
    rows = [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
    assert rows[1] == {"joint": "B", **flat(record["B"])}
    assert {name: value for name, value in rows[0].items() if value is not None} == {
        "joint": "A",
        **flat(record["A"]),
    }


def test_impacts(result):
    columns, record = impact_columns(result.impacts), result.to_dict()["impacts"]
    rows = [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
    assert rows == [{"joint": "B", **impact} for impact in record["B"]]
    assert set(impact_columns({})) == set(columns)


def test_trace(result):
    columns = {name: column.tolist() for name, column in trace_columns(result.trace).items()}
    assert columns == flat(result.to_dict()["trace"])
    assert set(columns) == {"crank_angle_rad", "drive_torque_nm", "force_n.A", "force_n.B"}


def test_with_pandas_they_are_frames(result):
    pytest.importorskip("pandas")
    frames = result.to_pandas()
    assert frames["joints"].loc["B", "clearance_m.mean"] == 3e-4
    assert np.isnan(frames["joints"].loc["A", "contact_fraction"])
    assert len(frames["impacts"]) == 2
    assert len(frames["trace"]) == 3
