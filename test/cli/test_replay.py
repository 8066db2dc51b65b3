"""The verb `replay`: what it writes, what it says, and its exit codes."""

import html
import json
import re
from pathlib import Path

import numpy as np
import pytest

from leg_wear_monitor.cli.verbs import replay as verb
from leg_wear_monitor.state import Level, State

pytest.importorskip("mcap")
pytest.importorskip("rosbags")

from leg_wear_monitor.recordings import encode
from leg_wear_monitor.recordings.mcap_file import McapWriter
from leg_wear_monitor.recordings.reader import TIMES

SECONDS, RATE_HZ = 4, 200
N = SECONDS * RATE_HZ
STAMPS = 1_700_000_000 * 10**9 + np.arange(N, dtype=np.int64) * (10**9 // RATE_HZ)
TURNING = 2.0 * np.pi * np.arange(N) / RATE_HZ


def write(path, stamps, angle):
    """A crank's motion without a drive torque, in chunks of a quarter of a second, logged in order."""
    rows = encode.joint_states(stamps, ["crank"], position=angle[:, None])
    with McapWriter(path) as writer:
        joints = writer.channel("/joint_states", encode.JOINT_STATE)
        writer.channel("/drive_torque", encode.WRENCH_STAMPED)
        for begin in range(0, N, 50):
            writer.write_many(joints, STAMPS[begin : begin + 50], rows[begin : begin + 50])
            writer.flush()
    return path


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    """A steady gait."""
    return write(tmp_path_factory.mktemp("bag") / "walk.mcap", STAMPS, TURNING)


def test_the_lists_of_the_verb_are_the_librarys():
    assert verb.TIMES == TIMES


def test_a_whole_recording(run, bag, complaints, tmp_path, unpainted):
    result = run("replay", str(bag), "--out", "out")
    assert result.exit_code == 0
    assert complaints(result) == []
    files = ("reports.mcap", "summary.json", "report.html")
    assert [f"written: out/{name}" in result.stdout for name in files] == [True] * 3
    assert "does not mean the joints are healthy" in result.stdout
    (code, guide) = re.findall(r"^code +(\w+), see (.+)$", result.stdout, re.MULTILINE)[0]
    record = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert code == record["verdict"]["fault_code"] and f"`{code}`" in Path(guide).read_text(encoding="utf-8")
    assert record["recording"]["crank_samples"] == SECONDS * RATE_HZ
    page = (tmp_path / "out" / "report.html").read_text()
    (tmp_path / "out" / "report.html").unlink()
    assert run("report", "out").exit_code == 0
    assert (tmp_path / "out" / "report.html").read_text() == page


def test_the_same_recording_again_keeps_the_report_and_exits_with_findings(
    run, bag, complaints, tmp_path, unpainted
):
    arguments = ("replay", str(bag), "--ledger", "own.db", "--out", "out")
    assert run(*arguments).exit_code == 0
    before = {path.name: path.read_bytes() for path in (tmp_path / "out").iterdir()}
    again = run(*arguments, "--json", "again.json")
    assert again.exit_code == 1
    assert complaints(again) == [
        f"note: {bag}: everything in this recording is in the ledger already, so no wear was added",
        "warning: out: no wear was added, so the earlier report stays as it is",
    ]
    assert re.search("^code +ALREADY_COUNTED, see .+node.md$", again.stdout, re.MULTILINE)
    assert "written: out" not in again.stdout
    assert {path.name: path.read_bytes() for path in (tmp_path / "out").iterdir()} == before
    assert json.loads((tmp_path / "again.json").read_text())["verdict"]["fault_code"] == "ALREADY_COUNTED"


def test_another_wear_coefficient_than_that_of_the_ledger_is_reported(
    run, bag, complaints, tmp_path, unpainted
):
    config = tmp_path / "monitor.yaml"
    config.write_text("/**:\n  ros__parameters:\n    wear_coefficients_per_pa: [2.0e-15]\n")
    first, again = (
        run("replay", str(bag), "--ledger", "own.db", *more) for more in ((), ("--config", config))
    )
    line = f"warning: {config}: wear coefficient of joints A, B, G, I, J: 4e-15 1/Pa (bushing and journal "
    assert not any("coefficient" in each for each in complaints(first))
    assert any(each.startswith(line) for each in complaints(again))


def test_a_value_in_another_unit_is_doubted(run, bag, complaints, tmp_path):
    config = tmp_path / "monitor.yaml"
    config.write_text("/**:\n  ros__parameters:\n    wear_coefficients_per_pa: [2.0e-7]\n")
    (line,) = (each for each in complaints(run("replay", str(bag), "--config", config)) if "usual" in each)
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


def test_an_alarm_asked_for_fails(run, bag, tmp_path):
    strict = tmp_path / "strict.yaml"
    strict.write_text("/**: {ros__parameters: {limits: {impact_force_n: 0.1}}}")
    asked = ("replay", str(bag), "--config", str(strict), "--json", "-")
    alone = run(*asked)
    assert alone.exit_code == 0
    assert json.loads(alone.stdout)["cycles"] >= 1  # all that is there is the document
    assert run(*asked, "--fail-on", "clearance", "--fail-on", "impact_force").exit_code == 1


@pytest.mark.parametrize(
    ("name", "level", "asked", "raised"),
    [
        ("clearance", Level.OK, ("alarm", "warning", "clearance"), False),
        ("clearance", Level.WARN, ("alarm", "clearance"), False),
        ("clearance", Level.WARN, ("warning",), True),
        ("clearance", Level.ERROR, ("alarm",), True),
        ("clearance", Level.ERROR, ("growth",), False),
        ("clearance", Level.ERROR, (), False),
        ("clearance_departure", Level.ERROR, ("clearance",), False),
        ("input_gaps", Level.ERROR, ("input",), True),
        ("input_gaps", Level.ERROR, ("input_torque",), False),
    ],
)
def test_what_counts_as_an_alarm_asked_for(name, level, asked, raised):
    assert verb.is_raised({name: level}, asked) == raised


@pytest.mark.parametrize("state", list(State))
def test_a_verdict_that_asks_to_act_fails_where_it_is_asked_for(state):
    assert verb.asks_to_act(state) == (state.value in ("not_monitored", "inspect", "stop"))


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (["nowhere.mcap"], "error: nowhere.mcap: does not exist. Expected a bag directory"),
        ([], "error: Missing argument 'BAG...'. (see leg-wear-monitor replay --help)"),
        (["{bag}", "--joint-states", "/x"], "error: {bag}: /x: is not a topic of the recording; it has"),
        (["{bag}", "--config", "nowhere.yaml"], "error: nowhere.yaml: "),
        (["{bag}", "--time", "wall"], "error: Invalid value for '--time'"),
        (["{bag}", "--fail-on", "wear"], "error: Invalid value for '--fail-on'"),
        (["{bag}", "--out", "{bag}"], "error: --out: {bag}: cannot be written: Not a directory"),
        (["empty.mcap", "--out", "out"], "error: empty.mcap: is empty. Expected an MCAP file"),
    ],
)
def test_what_cannot_be_is_said_in_a_line(refused, bag, tmp_path, arguments, line):
    (tmp_path / "empty.mcap").touch()
    said = refused("replay", *(text.format(bag=bag) for text in arguments))
    assert said.startswith(line.format(bag=bag))
    assert [path.name for path in tmp_path.iterdir()] == ["empty.mcap"]


def test_a_crank_that_is_in_no_message_is_refused_with_the_names_that_are_there(run, bag, complaints):
    result = run("replay", str(bag), "--crank-joint", "wheel", "--json", "-")
    assert result.exit_code == 2
    assert result.stdout == ""
    assert complaints(result) == [
        f"error: {bag}: wheel: is not among the joints of {SECONDS * RATE_HZ} messages; they have crank; set "
        "the crank with --crank-joint (crank_joint in the parameters)"
    ]


@pytest.mark.parametrize(
    ("stamps", "angle", "why"),
    [
        (STAMPS, 4.0 * TURNING, "the crank turns at 240 rpm; the commanded cadence is 60 rpm"),
        (0 * STAMPS, TURNING, f"no crank sample can be used ({N} zero_stamp)"),
    ],
    ids=["a wheel", "no clock"],
)
def test_without_a_believable_gait_cycle_there_are_no_forces(
    run, tmp_path, stamps, angle, why, complaints, unpainted
):
    result = run("replay", str(write(tmp_path / "x.mcap", stamps, angle)), "--out", "out")
    assert result.exit_code == 1
    assert f"warning: no gait cycle fits this leg, so no forces are reported: {why}" in complaints(result)
    assert "speed" not in result.stdout
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
    result = run("replay", str(write(tmp_path / "x.mcap", stamps, TURNING)), "--json", "-")
    assert json.loads(result.stdout)["recording"]["duration_s"] == pytest.approx(SECONDS, abs=0.1)
