"""The verb `replay`: what it writes, what it says, and its exit codes."""

import html
import json
import re
from pathlib import Path

import numpy as np
import pytest

import leg_wear_monitor as lw

pytest.importorskip("mcap")
rosbag2, typesys = pytest.importorskip("rosbags.rosbag2"), pytest.importorskip("rosbags.typesys")

HEALTHY = lw.share_directory() / "bags" / "healthy.mcap"
SECONDS, RATE_HZ = 4, 200
N = SECONDS * RATE_HZ
STAMPS = 1_700_000_000 * 10**9 + np.arange(N, dtype=np.int64) * (10**9 // RATE_HZ)
TURNING = 2.0 * np.pi * np.arange(N) / RATE_HZ
TOPICS = {"/joint_states": "sensor_msgs/msg/JointState", "/drive_torque": "geometry_msgs/msg/WrenchStamped"}


def write(path, stamps, angle):
    """A bag of a crank's motion without a drive torque, logged in order."""
    store = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
    header, time, joint = (
        store.types[name]
        for name in ("std_msgs/msg/Header", "builtin_interfaces/msg/Time", TOPICS["/joint_states"])
    )
    with rosbag2.Writer(path, version=9, storage_plugin=rosbag2.StoragePlugin.MCAP) as writer:
        joints, _ = (writer.add_connection(*each, typestore=store) for each in TOPICS.items())
        none = np.zeros(0)
        for log_time, stamp, position in zip(STAMPS.tolist(), stamps.tolist(), angle, strict=True):
            at = header(time(*divmod(stamp, 10**9)), "")
            message = joint(at, ["crank"], np.array([position]), none, none)
            writer.write(joints, log_time, store.serialize_cdr(message, joint.__msgtype__))
    return path


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    """A steady gait."""
    return write(tmp_path_factory.mktemp("bag") / "walk", STAMPS, TURNING)


def test_the_sources_of_stamps_that_help_shows_are_the_library_s(run, bag):
    """The help does not wait for the library."""
    (shown,) = re.findall(r"--time \[(.+?)\]", run("replay", "--help").out)
    for time in set(shown.split("|")) - {"header"}:
        assert json.loads(run("replay", bag, "--time", time, "--json", "-").out)["recording"]["time"] == time


def test_a_whole_recording(run, bag, tmp_path, unpainted):
    result = run("replay", str(bag), "--out", "out")
    assert result.code == 0
    assert result.lines == []
    files = ("reports.mcap", "summary.json", "report.html")
    assert [f"written: out/{name}" in result.out for name in files] == [True] * 3
    assert "does not mean the joints are healthy" in result.out
    (code, guide) = re.findall(r"^code +(\w+), see (.+)$", result.out, re.MULTILINE)[0]
    record = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert code == record["verdict"]["fault_code"] and f"`{code}`" in Path(guide).read_text(encoding="utf-8")
    assert record["recording"]["crank_samples"] == SECONDS * RATE_HZ
    page = (tmp_path / "out" / "report.html").read_text()
    (tmp_path / "out" / "report.html").unlink()
    assert run("report", "out").code == 0
    assert (tmp_path / "out" / "report.html").read_text() == page


def test_the_same_recording_again_keeps_the_report_and_exits_with_findings(run, bag, tmp_path, unpainted):
    arguments = ("replay", str(bag), "--ledger", "own.db", "--out", "out")
    assert run(*arguments).code == 0
    before = {path.name: path.read_bytes() for path in (tmp_path / "out").iterdir()}
    again = run(*arguments, "--json", "again.json")
    assert again.code == 1
    assert again.lines == [
        f"note: {bag}/walk.mcap: everything in this recording is in the ledger already, so no wear was added",
        "warning: out: no wear was added, so the earlier report stays as it is",
    ]
    assert re.search("^code +ALREADY_COUNTED, see .+node.md$", again.out, re.MULTILINE)
    assert "written: out" not in again.out
    assert {path.name: path.read_bytes() for path in (tmp_path / "out").iterdir()} == before
    assert json.loads((tmp_path / "again.json").read_text())["verdict"]["fault_code"] == "ALREADY_COUNTED"


def test_another_wear_coefficient_than_that_of_the_ledger_is_reported(run, bag, tmp_path, unpainted):
    config = tmp_path / "monitor.yaml"
    config.write_text("/**:\n  ros__parameters:\n    wear_coefficients_per_pa: [2.0e-15]\n")
    first, again = (
        run("replay", str(bag), "--ledger", "own.db", *more) for more in ((), ("--config", config))
    )
    line = f"warning: {config}: wear coefficient of joints A, B, G, I, J: 4e-15 1/Pa (bushing and journal "
    assert not any("coefficient" in each for each in first.lines)
    assert any(each.startswith(line) for each in again.lines)


def test_a_value_in_another_unit_is_doubted(run, bag, tmp_path):
    config = tmp_path / "monitor.yaml"
    config.write_text("/**:\n  ros__parameters:\n    wear_coefficients_per_pa: [2.0e-7]\n")
    done = run("replay", bag, "--config", config, "--joint-states", "/x")  # ends before the first sample
    (line,) = (each for each in done.lines if "usual" in each)
    assert line.startswith(f"warning: {config}: wear_coefficients_per_pa: 2e-07 1/Pa, usually below")


@pytest.mark.parametrize(
    "text", ["", "[]", "{", "7", '{"schema_version": 4}', '{"schema_version": 4, "joints": 1}']
)
def test_a_damaged_summary_is_refused_in_one_line(refused, tmp_path, text):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "summary.json").write_text(text)
    assert refused("report", "out").startswith("error: out/summary.json: ")


@pytest.mark.parametrize(("version", "shown"), [(1, "1"), (None, "1"), ("x" * 999, "'xxx")])
def test_a_summary_of_another_version_is_refused(refused, tmp_path, version, shown):
    (tmp_path / "out").mkdir()
    record = {} if version is None else {"schema_version": version}
    (tmp_path / "out" / "summary.json").write_text(json.dumps(record))
    line = refused("report", "out")
    assert line.startswith(f"error: out/summary.json: schema_version: {shown}")
    assert "is not 4" in line and line.endswith("replay the recording again")
    assert len(line) < 200


@pytest.mark.parametrize(
    ("limits", "asked", "code"),
    [
        ("impact_force_n: 0.1", ("clearance", "impact_force"), 1),
        ("impact_force_n: 0.1", ("clearance", "growth", "input"), 0),
        ("clearance_m: 3.5e-4", ("alarm", "clearance"), 0),  # it warns
        ("clearance_m: 3.5e-4", ("warning",), 1),
    ],
)
def test_an_alarm_asked_for_fails(run, tmp_path, limits, asked, code):
    (tmp_path / "strict.yaml").write_text(f"/**: {{ros__parameters: {{limits: {{{limits}}}}}}}")
    line = [word for kind in asked for word in ("--fail-on", kind)]
    result = run("replay", HEALTHY, "--config", "strict.yaml", "--json", "-", *line)
    assert result.code == code
    assert json.loads(result.out)["cycles"] >= 1  # all that is there is the document


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (["nowhere.mcap"], "error: nowhere.mcap: does not exist. Expected a bag directory"),
        ([], "error: Missing argument 'BAG...'. (see "),
        (["{healthy}", "--joint-states", "/x"], "error: {healthy}: /x: is not a topic of the recording; it"),
        (["{bag}", "--config", "nowhere.yaml"], "error: nowhere.yaml: "),
        (["{bag}", "--time", "wall"], "error: Invalid value for '--time'"),
        (["{bag}", "--fail-on", "wear"], "error: Invalid value for '--fail-on'"),
        (["{bag}", "--out", "{healthy}"], "error: --out: {healthy}: cannot be written: Not a directory"),
        (["empty.mcap", "--out", "out"], "error: empty.mcap: is empty. Expected an MCAP file"),
    ],
)
def test_what_cannot_be_is_said_in_a_line(refused, bag, tmp_path, arguments, line):
    (tmp_path / "empty.mcap").touch()
    said = refused("replay", *(text.format(bag=bag, healthy=HEALTHY) for text in arguments))
    assert said.startswith(line.format(bag=bag, healthy=HEALTHY))
    assert [path.name for path in tmp_path.iterdir()] == ["empty.mcap"]


def test_a_crank_that_is_in_no_message_is_refused_with_the_names_that_are_there(refused):
    line = refused("replay", HEALTHY, "--crank-joint", "wheel", "--json", "-")
    assert line.startswith(f"error: {HEALTHY}: wheel: no joint is named 'wheel'; the joints are crank; set ")


@pytest.mark.parametrize(
    ("stamps", "angle", "why"),
    [
        (STAMPS, 4.0 * TURNING, "the crank turns at 240 rpm; the commanded cadence is 60 rpm"),
        (0 * STAMPS, TURNING, f"no crank sample can be used ({N} zero_stamp)"),
    ],
    ids=["a wheel", "no clock"],
)
def test_without_a_believable_gait_cycle_there_are_no_forces(run, tmp_path, stamps, angle, why, unpainted):
    result = run("replay", write(tmp_path / "x", stamps, angle), "--out", "out")
    assert result.code == 1
    assert f"warning: no gait cycle fits this leg, so no forces are reported: {why}" in result.lines
    assert "speed" not in result.out
    record = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert record["joints"] == {}
    assert record["gait"] == {
        "believable_cycles": 0,
        "doubtful_cycles": record["cycles"],
        "missing": why,
        "is_counted": False,
    }
    assert f"Missing: {why}" in html.unescape((tmp_path / "out" / "report.html").read_text())


def test_a_clock_that_goes_back_makes_no_negative_time(run, tmp_path):
    stamps = np.where(np.arange(N) < N // 2, STAMPS, STAMPS - 1_600_000_000 * 10**9)
    result = run("replay", write(tmp_path / "x", stamps, TURNING), "--json", "-")
    assert json.loads(result.out)["recording"]["duration_s"] == pytest.approx(SECONDS, abs=0.1)
