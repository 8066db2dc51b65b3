"""What a replay found as classes: its JSON comes back as it went out, its tables have what the JSON has."""

import json

import numpy as np
import pytest
from made_up_summary import made_up_summary

from leg_wear_monitor import ConfigError
from leg_wear_monitor.playback.history import CYCLE_COLUMNS, SUMMARY_COLUMNS
from leg_wear_monitor.playback.result import ReplayJoint, columns_of, summary_of
from leg_wear_monitor.state import JointClearance

pytestmark = pytest.mark.plain


@pytest.fixture
def summary():
    return made_up_summary()


def test_json_comes_back_as_it_went_out(summary):
    text = summary.to_json()
    again = summary_of(json.loads(text), "summary.json")
    assert again.to_json() == text
    for part in ("verdict", "clearances", "life", "joints", "alarms", "leg", "measurements"):
        assert getattr(again, part) == getattr(summary, part), part
    assert again.history.stamp_ns.tolist() == summary.history.stamp_ns.tolist()
    assert np.array_equal(again.history.cycle, summary.history.cycle, equal_nan=True)


def test_a_file_of_before_the_leg_was_in_it_is_read(summary):
    record = json.loads(summary.to_json())
    assert summary.leg.joint_words("B") == "B (knee)"
    del record["leg"]
    assert summary_of(record, "summary.json").leg.joint_words("B") == "B"


def test_json_has_null_for_what_is_not_known(summary):
    record = json.loads(summary.to_json())
    assert list(record)[:3] == ["schema_version", "verdict", "clearances"]
    assert record["joints"]["A"]["encoders"]["sigma_m"] is None
    assert record["verdict"]["evidence"][0]["limit"] is None
    assert record["clearances"]["B"]["seen_m"] is None and record["life"]["B"] is None
    assert record["joints"]["B"]["peak_force_n"] is None and record["joints"]["B"]["encoders"] is None
    assert record["alarms"]["now"][0]["worst"] is None
    assert record["status"][0]["values"] == {"cadence_rpm": None}
    assert record["history"]["cycle"] == [1.0, None]


@pytest.mark.parametrize(
    ("path", "value", "fault"),
    [
        ("joints.A.peak_force_n", "9", "'9' is not a number"),
        ("joints.A.forecast.answer", "soon", "'soon' is not one of 'from the growth so far"),
        ("joints.A.weight", 1.0, "unknown key"),
        ("monitor.limits.clearance_m", -1.0, "-1.0 is not above 0 m"),
        ("cycles", 1.5, "1.5 is not a whole number"),
        ("history.stamp_ns", [2**70], "has a number that is too large"),
        ("history.counted_m.B", [1.0, "2"], "'2' is not a number"),
        ("history.cycle", {}, "{} is not a list of numbers"),
        ("recording.findings", "none", "'none' is not a list of mappings"),
    ],
)
def test_a_fault_of_the_file_is_named(summary, path, value, fault):
    record = json.loads(summary.to_json())
    *above, last = path.split(".")
    place = record
    for key in above:
        place = place[key]
    place[last] = value
    with pytest.raises(ConfigError) as caught:
        summary_of(record, "summary.json")
    assert str(caught.value).startswith(f"summary.json: {path}: ")
    assert fault in str(caught.value)


def test_what_is_missing_and_an_entry_of_a_list_are_named(summary):
    record = json.loads(summary.to_json())
    with pytest.raises(ConfigError, match=r"summary\.json: status\.1: 7 is not a mapping"):
        summary_of(record | {"status": [7]}, "summary.json")
    del record["gait"]["missing"]
    with pytest.raises(ConfigError, match=r"^summary.json: gait.missing: is missing$"):
        summary_of(record, "summary.json")


@pytest.mark.parametrize("record", [None, [], 7, "text"])
def test_what_is_no_object_is_refused(record):
    with pytest.raises(ConfigError, match=r"^summary.json: .* is not a mapping of keys$"):
        summary_of(record, "summary.json")


def test_a_row_of_the_table_has_what_the_json_of_the_joint_has(summary):
    def table(clearances, joints):
        return columns_of(JointClearance, list(clearances)) | columns_of(ReplayJoint, list(joints))

    columns, written = table(summary.clearances.values(), summary.joints.values()), summary.to_dict()
    assert {"forecast.hours.p50", "encoders.is_other", "believed_m"} <= set(columns)
    assert set(table((), ())) == set(columns)
    for joint, row in zip(summary.joints, zip(*columns.values(), strict=True), strict=True):
        record = flat(written["clearances"][joint]) | flat(written["joints"][joint])
        record["seen_by"] = ", ".join(record["seen_by"])
        known = {name: value for name, value in zip(columns, row, strict=True) if value is not None}
        assert known == {name: value for name, value in record.items() if value is not None}


def flat(record, path=""):
    """Values of a JSON object by path."""
    found = {}
    for key, value in record.items():
        found |= flat(value, f"{path}{key}.") if isinstance(value, dict) else {path + key: value}
    return found


def test_the_table_over_time_has_a_column_a_joint(summary):
    columns = summary.history.columns()
    assert columns["counted_m.B"].tolist() == [3.0, 4.0]
    assert {len(column) for column in columns.values()} == {2}
    assert len(columns) == 1 + len(CYCLE_COLUMNS) + 2 * len(SUMMARY_COLUMNS)


def test_with_pandas_they_are_frames(summary):
    pytest.importorskip("pandas")
    joints, over_time = summary.to_pandas(), summary.history.to_pandas()
    assert joints.loc["A", "forecast.hours.p90"] == 3.0
    assert set(joints["not_valid"]) == {", ".join(each.value for each in summary.verdict.not_valid)}
    assert list(over_time.index) == summary.history.stamp_ns.tolist()
    assert np.isnan(over_time["counted_m.A"].iloc[1])
