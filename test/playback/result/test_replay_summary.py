"""What a replay found as classes: its JSON comes back as it went out, its tables have what the JSON has."""

import json
import math

import attrs
import numpy as np
import pytest

from leg_wear_monitor import ConfigError
from leg_wear_monitor.bags.findings import Severity
from leg_wear_monitor.monitor.alarms.alarm import Level
from leg_wear_monitor.monitor.config.settings import Limits
from leg_wear_monitor.monitor.encoders.clearance_estimate import ClearanceObservation
from leg_wear_monitor.monitor.forecast.forecast import Answer, JointForecast, Quantiles
from leg_wear_monitor.monitor.ledger.entry import Measurement
from leg_wear_monitor.monitor.reports import Lost
from leg_wear_monitor.playback.history import CYCLE_COLUMNS, JOINT_COLUMNS
from leg_wear_monitor.playback.result.parts import (
    AlarmChange,
    ClearanceChange,
    LegLife,
    ReplayAlarm,
    ReplayAlarms,
    ReplayJoint,
    ReplayStatus,
    SeenClearance,
    WornDepth,
)
from leg_wear_monitor.playback.result.recording import (
    ReplayFinding,
    ReplayGait,
    ReplayMonitor,
    ReplayRecording,
)
from leg_wear_monitor.playback.result.replay_history import ReplayHistory
from leg_wear_monitor.playback.result.replay_summary import ReplaySummary, summary_of
from leg_wear_monitor.playback.result.tables import joint_columns

pytestmark = pytest.mark.plain

LIFE = Quantiles(1.0, 2.0, 3.0)


@pytest.fixture
def summary():
    """Joint A as encoders show it and with a forecast; joint B with neither."""
    alarm = ReplayAlarm(
        name="clearance A", level=Level.WARN, state="present", value=5e-4, limit=6e-4, unit="m",
        worst=math.nan, raised_ns=1_700_000_000_000_000_001,
    )  # fmt: skip
    forecast = JointForecast(
        answer=Answer.KNOWN, cycles=LIFE, hours=LIFE, days=None, clearance_m=LIFE, measurements=1
    )
    joint = ReplayJoint(
        clearance_m=ClearanceChange(3e-4, 4e-4, 5e-4), growth_m_per_cycle=1e-12,
        growth_error_m_per_cycle=1e-13, growth_mps=None, forecast=forecast, peak_force_n=np.float64(9.0),
        mean_force_n=4.0, impacts=7,
        seen=SeenClearance(
            observation=ClearanceObservation.SEEN, clearance_m=5e-4, sigma_m=math.nan, departure_m=1e-4,
            believed=True, is_other=True,
        ),
    )  # fmt: skip
    stamps = np.array([1_700_000_000_000_000_001, 1_700_000_000_000_000_003])
    over_time = np.array([1.0, math.nan])
    columns = dict.fromkeys(CYCLE_COLUMNS, over_time)
    columns |= {name: {"A": over_time, "B": np.array([3.0, 4.0])} for name in JOINT_COLUMNS}
    return ReplaySummary(
        recording=ReplayRecording(
            files=("a.mcap",), topics={"joint_states": "/joint_states"}, time="header", is_partial=True,
            findings=(ReplayFinding(file="a.mcap", text="ends at byte 7", weight=Severity.LOSS),),
            crank_samples=5, torque_samples=6, begin_ns=int(stamps[0]), end_ns=int(stamps[1]),
            duration_s=2e-9,
        ),
        monitor=ReplayMonitor(
            mechanism="leg", hardware_id="leg 1", clearance_joints=("A", "B"), commanded_rpm=60.0,
            wear_acceleration=1.0, bushing_radius_m={"A": 0.01, "B": 0.01},
            limits=Limits(joint_clearance_m=(5e-4, 6e-4)), duty_hours_per_day=8.0,
        ),
        wall_s=0.5,
        real_time_factor=4e-9,
        cycles=2,
        gait=ReplayGait(believable_cycles=2, doubtful_cycles=0, missing="", is_counted=False),
        joints={"A": joint, "B": attrs.evolve(joint, forecast=None, seen=None, peak_force_n=math.inf)},
        forecast=LegLife(
            answer=Answer.PARTLY_KNOWN, cycles=LIFE, hours=LIFE, days=LIFE, first_probability={"A": 1.0},
            simulated_lives=0, first="A",
        ),
        measurements=(Measurement(7, "A", "ann", 3e-4, 1e-6, 0.0, 9, 0, 0.2, True, id=3),),
        alarms=ReplayAlarms(now=(alarm,), changes=(AlarmChange(stamp_ns=4, alarm=alarm),)),
        status=(ReplayStatus(name="gait", level=Level.OK, message="m", values={"cadence_rpm": math.nan}),),
        lost=Lost(
            unmonitored_s=0.5, already_counted=0, faulty={"out_of_range": 1}, conflicting=0, implausible=0,
            duplicates=1, late=2, stray_stamps=3, outliers=4, gaps_bridged=5, gaps_lost=6, backward_jumps=7,
            failures=8,
        ),
        history=ReplayHistory(stamp_ns=stamps, **columns),
        wear_depth_m={"A": WornDepth(np.array([1e-9, 0.0]), np.zeros(2))},
        advice="advice",
        made_with={"leg_wear_monitor": "1"},
    )  # fmt: skip


def test_json_comes_back_as_it_went_out(summary):
    text = summary.to_json()
    again = summary_of(json.loads(text), "summary.json")
    assert again.to_json() == text
    assert again.joints == summary.joints
    assert again.alarms == summary.alarms
    assert again.measurements[0].id == 3
    assert again.history.stamp_ns.tolist() == summary.history.stamp_ns.tolist()
    assert np.array_equal(again.history.cycle, summary.history.cycle, equal_nan=True)


def test_json_has_a_version_and_null_for_what_is_not_known(summary):
    record = json.loads(summary.to_json())
    assert list(record)[:2] == ["schema_version", "recording"] and list(record)[-1] == "made_with"
    assert record["joints"]["A"]["seen"]["sigma_m"] is None
    assert record["joints"]["A"]["seen"]["observation"] == "seen by encoders"
    assert record["joints"]["B"]["peak_force_n"] is None and "seen" not in record["joints"]["B"]
    assert list(record["alarms"]["changes"][0])[:3] == ["stamp_ns", "name", "level"]
    assert record["alarms"]["now"][0]["level"] == "WARN" and record["alarms"]["now"][0]["worst"] is None
    assert record["status"][0]["values"] == {"cadence_rpm": None}
    assert record["history"]["cycle"] == [1.0, None]
    assert list(record["history"]) == ["stamp_ns", *CYCLE_COLUMNS, *JOINT_COLUMNS]


@pytest.mark.parametrize(
    ("path", "value", "fault"),
    [
        ("joints.A.peak_force_n", "9", "'9' is not a number"),
        ("joints.A.forecast.answer", "soon", "'soon' is not one of 'from the growth so far"),
        ("joints.A.weight", 1.0, "unknown key"),
        ("monitor.limits.clearance_m", -1.0, "-1.0 is not above 0 m"),
        ("cycles", 1.5, "1.5 is not a whole number"),
        ("history.stamp_ns", [2**70], "has a number that is too large"),
        ("history.clearance_m.B", [1.0, "2"], "'2' is not a number"),
        ("history.cycle", {}, "{} is not a list of numbers"),
        ("status", [7], "7 is not a mapping"),
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


def test_what_is_missing_is_named(summary):
    record = json.loads(summary.to_json())
    del record["gait"]["missing"]
    with pytest.raises(ConfigError, match=r"^summary.json: gait.missing: is missing$"):
        summary_of(record, "summary.json")


@pytest.mark.parametrize("record", [None, [], 7, "text"])
def test_what_is_no_object_is_refused(record):
    with pytest.raises(ConfigError, match=r"^summary.json: .* is not a mapping of keys$"):
        summary_of(record, "summary.json")


def test_a_row_of_the_table_has_what_the_json_of_the_joint_has(summary):
    columns = joint_columns(summary.joints)
    rows = [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
    for row in rows:
        joint = row.pop("joint")
        known = {name: value for name, value in row.items() if value is not None}
        record = flat(summary.to_dict()["joints"][joint])
        assert known == {name: value for name, value in record.items() if value is not None}
    assert {"forecast.hours.p50", "seen.is_other", "clearance_m.last"} <= set(columns)
    assert set(joint_columns({})) == set(columns)


def flat(record, path=""):
    """Values of a JSON object by path."""
    found = {}
    for key, value in record.items():
        found |= flat(value, f"{path}{key}.") if isinstance(value, dict) else {path + key: value}
    return found


def test_the_table_over_time_has_a_column_a_joint(summary):
    columns = summary.history.columns()
    assert columns["clearance_m.B"].tolist() == [3.0, 4.0]
    assert {len(column) for column in columns.values()} == {2}
    assert len(columns) == 1 + len(CYCLE_COLUMNS) + 2 * len(JOINT_COLUMNS)


def test_with_pandas_they_are_frames(summary):
    pytest.importorskip("pandas")
    joints, over_time = summary.to_pandas(), summary.history.to_pandas()
    assert joints.loc["A", "forecast.hours.p90"] == 3.0
    assert list(over_time.index) == summary.history.stamp_ns.tolist()
    assert np.isnan(over_time["clearance_m.A"].iloc[1])
