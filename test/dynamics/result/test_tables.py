"""A result's tables have what its JSON has, a value's column named by its path."""

import numpy as np
import pytest

from leg_wear_monitor.dynamics.result import impact_columns, joint_columns, trace_columns

pytestmark = pytest.mark.plain


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
