"""A result's tables have what its JSON has, a value's column named by its path."""

import json

import numpy as np
import pytest

import leg_wear_monitor as lw


@pytest.fixture(scope="module")
def result() -> lw.SimulationResult:
    """Joints A and D without clearance, B and C with; the last contact of one still lasts."""
    return lw.simulate("four_bar", cycles=0.25, skip_cycles=0.0, wear=True, trace=12)


@pytest.fixture(scope="module")
def frames(result):
    pytest.importorskip("pandas")
    return result.to_pandas()


def flat(record, path=""):
    """Values of a JSON object by path; two ends of a zone as from and to, lists of places as x and y."""
    found = {}
    for key, value in record.items():
        if isinstance(value, dict):
            found |= flat(value, f"{path}{key}.")
        elif key == "wear_zone_deg" and value is not None:
            found |= {f"{path}{key}.from": value[0], f"{path}{key}.to": value[1]}
        elif isinstance(value, list) and isinstance(value[0], list):
            found |= {f"{path}{key}.{axis}": [pair[k] for pair in value] for k, axis in enumerate("xy")}
        elif value is not None:
            found[path + key] = value
    return found


def rows(frame):
    """Values of each row by column, without those that are not known."""
    known = [{key: each for key, each in row.items() if each == each} for row in frame.to_dict("records")]
    return [{key: each for key, each in row.items() if each is not None} for row in known]


def test_json_has_lists_and_null(result):
    record = json.loads(result.to_json())
    assert len(record["joints"]["B"]["wear_zone_deg"]) == 2
    ends = [impact["end_s"] for joint in record["impacts"].values() for impact in joint]
    assert None in ends and any(ends)


def test_joints(result, frames):
    record = result.to_dict()["joints"]
    assert list(frames["joints"].index) == list(record)
    for row, joint in zip(rows(frames["joints"]), record.values(), strict=True):
        assert row == flat(joint)
    assert np.isnan(frames["joints"].loc["A", "contact_fraction"])


def test_impacts(result, frames):
    record = result.to_dict()["impacts"]
    impacts = [{"joint": joint, **one} for joint, all_of in record.items() for one in all_of]
    assert [{"end_s": None, **row} for row in rows(frames["impacts"])] == impacts


def test_trace(result, frames):
    columns = flat(result.to_dict()["trace"])
    assert {"crank_angle_rad", "drive_torque_nm", "force_n.A", "force_n.B"} <= set(columns)
    assert {name: frames["trace"][name].tolist() for name in columns} == columns
