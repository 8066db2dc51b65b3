"""The sample recordings through the command line: summary, messages, page and exit code as promised."""

import json
import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import attrs
import pytest

import leg_wear_monitor as lw

BAGS = lw.share_directory() / "bags"
# Relative bounds of forces and wear over eight or ten cycles: 5.3 sigma of the difference of two such means,
# by the sigma over five cycles (32 runs, 2026-11-23), a fifth more.
SCATTER = {
    "A": (0.02, 0.03), "B": (0.02, 0.16), "G": (0.02, 0.15), "I": (0.03, 0.31), "J": (0.13, 0.58),
}  # fmt: skip
TYPES = {
    "/diagnostics": "diagnostic_msgs/msg/DiagnosticArray",
    "/leg_wear_monitor/alarms": "diagnostic_msgs/msg/DiagnosticArray",
    "/leg_wear_monitor/clearance_states": "sensor_msgs/msg/JointState",
    "/leg_wear_monitor/forecast": "diagnostic_msgs/msg/DiagnosticArray",
    "/leg_wear_monitor/impact_forces": "sensor_msgs/msg/JointState",
    "/leg_wear_monitor/predicted_torque": "geometry_msgs/msg/WrenchStamped",
    "/leg_wear_monitor/state": "std_msgs/msg/String",
    "/leg_wear_monitor/verdict": "diagnostic_msgs/msg/DiagnosticArray",
}
# Messages of the topics whose number does not depend on the motion.
NUMBERS = {
    "healthy": {"diagnostics": 14, "clearance_states": 10, "impact_forces": 2349, "predicted_torque": 4697},
    "knocking": {"diagnostics": 14, "clearance_states": 10, "impact_forces": 2349, "predicted_torque": 4697},
    "bad_input": {"diagnostics": 13, "clearance_states": 8, "impact_forces": 1911, "predicted_torque": 3816},
    "ground": {"diagnostics": 98, "clearance_states": 96, "impact_forces": 19513, "predicted_torque": 19513},
}
SECTIONS = [
    "Joints", "Are these values valid?", "Alarms", "Guide", "Guide", "How sure is the verdict?",
    "Joints over time", "Forecast", "Wear around each bushing",
    "Changes of alarms", "Input health", "The recording", "Made with",
]  # fmt: skip


def messages(path: Path, decoder: Any = None) -> Iterator[tuple[str, str, Any]]:
    """Topic, type, and bytes or decoded message of all messages of a file, checksums looked at."""
    reader = pytest.importorskip("mcap.reader")
    with path.open("rb") as file:
        source = reader.make_reader(file, validate_crcs=True, decoder_factories=[decoder] if decoder else [])
        if decoder:
            for schema, channel, _, message in source.iter_decoded_messages():
                yield channel.topic, schema.name, message
        else:
            for schema, channel, message in source.iter_messages():
                yield channel.topic, schema.name, message.data


@attrs.frozen
class Replayed:
    """A recording, its exit code, what was printed and written, its summary, and what it should be."""

    path: Path
    code: int
    printed: str
    out: Path
    found: dict[str, Any]
    expected: dict[str, Any]


# the diagnosis of a leg on the ground simulates 812 gait cycles for its references
RECORDINGS = ["healthy", "knocking", "bad_input", pytest.param("ground", marks=pytest.mark.slow)]


@pytest.fixture(scope="module", params=RECORDINGS)
def bag(request: pytest.FixtureRequest, run, tmp_path_factory: pytest.TempPathFactory) -> Replayed:
    path, out = BAGS / f"{request.param}.mcap", tmp_path_factory.mktemp(request.param)
    done = run("replay", path, "--config", path.with_suffix(".yaml"), "--out", out, "--fail-on", "verdict")
    found = json.loads((out / "summary.json").read_text())
    return Replayed(path, done.code, done.out, out, found, json.loads(path.with_suffix(".json").read_text()))


def test_every_message_is_taken_or_counted(bag: Replayed) -> None:
    recording, lost = bag.found["recording"], bag.found["lost"]
    for kind in ("crank_samples", "torque_samples"):
        assert recording[kind] == bag.expected[kind]
    assert [finding["text"] for finding in recording["findings"]] == bag.expected["findings"]
    for count in ("faulty", "duplicates", "gaps_lost", "backward_jumps"):
        assert lost[count] == bag.expected["lost"][count]
    assert lost["unmonitored_s"] == pytest.approx(bag.expected["lost"]["unmonitored_s"], abs=0.3)


@pytest.mark.chaotic
def test_alarms_are_those_that_must_be_raised(bag: Replayed) -> None:
    order = ("OK", "WARN", "ERROR")
    worst: dict[str, str] = {}
    for change in bag.found["alarms"]["changes"]:  # to WARN before, and back to OK, too
        worst[change["name"]] = max(worst.get(change["name"], "OK"), change["level"], key=order.index)
    assert sorted(f"{name}: {level}" for name, level in worst.items()) == bag.expected["alarms"]


@pytest.mark.chaotic
def test_forces_and_wear_are_the_same_within_their_scatter(bag: Replayed) -> None:
    assert bag.found["cycles"] == bag.expected["cycles"]
    assert bag.found["joints"].keys() == bag.expected["opened_m"].keys()
    for name, joint in bag.found["joints"].items():
        force, wear = SCATTER[name]
        assert joint["opened_m"] == pytest.approx(bag.expected["opened_m"][name], rel=wear)
        assert joint["mean_force_n"] == pytest.approx(bag.expected["mean_force_n"][name], rel=force)


@pytest.mark.chaotic
def test_the_verdict_is_the_one_that_is_written_beside(bag: Replayed) -> None:
    verdict, expected = bag.found["verdict"], bag.expected["verdict"]
    assert {key: verdict[key] for key in expected} == expected
    assert bag.code == (0 if expected["state"] == "healthy" else 1)  # by --fail-on verdict
    assert "forecast" not in expected["not_valid"] or not any(bag.found["life"].values())
    if verdict["fault_code"].startswith("CLEARANCE_DETECTED"):
        assert [bag.found["clearances"][joint]["status"] for joint in verdict["joints"]] == ["stop"]
    for name, joint in bag.found["clearances"].items():
        is_at_limit = joint["best_estimate_m"] is not None and joint["best_estimate_m"] >= joint["limit_m"]
        assert is_at_limit == (expected["state"] == "stop" and name in verdict["joints"])
        assert 0.99 * joint["new_m"] < joint["modelled_m"] < joint["limit_m"]


def test_the_terminal_names_the_guide_of_the_code(bag: Replayed) -> None:
    ((code, guide),) = re.findall(r"^code +(\w+), see (\S+)$", bag.printed, re.MULTILINE)
    assert code == bag.found["verdict"]["fault_code"]
    stem = re.sub("(_[A-Z])*$", "", code).lower()  # without the joints
    assert f"](../../reference/codes.md#{stem})" in Path(guide).read_text()


def test_the_terminal_gives_no_number_that_the_verdict_does_not_believe(bag: Replayed) -> None:
    row = r"^A \(hip, drive side\) +(\S+(?: ± \S+)?) +\S+ +(\S+) +(\S+) "
    ((clearance, p10, p50),) = re.findall(row, bag.printed, re.MULTILINE)
    known, life = bag.found["clearances"]["A"], bag.found["life"]["A"]
    best_estimate_m, sigma_m = known["best_estimate_m"], known["best_estimate_sigma_m"]
    if best_estimate_m is None:
        assert clearance == "-"
    else:
        around = f" ± {1e3 * sigma_m:.3f}" if sigma_m else ""
        assert clearance == f"{1e3 * best_estimate_m:.3f}{around}"
    assert ([p10, p50] == ["-", "-"]) == (life is None)


def test_the_summary_has_no_fields_but_those_that_are_kept(bag: Replayed, unknown) -> None:
    assert unknown("replay", bag.found) == set()


def test_messages_are_those_of_the_node_by_topic_type_and_number(bag: Replayed) -> None:
    found = Counter((topic, kind) for topic, kind, _ in messages(bag.out / "reports.mcap"))
    assert sorted(found) == sorted(TYPES.items())
    numbers = {topic.rpartition("/")[2]: number for (topic, _), number in found.items()}
    expected = NUMBERS[bag.path.stem]
    assert {name: numbers[name] for name in expected} == expected


def test_clearances_and_forces_in_messages_are_those_of_the_summary_to_the_bit(bag: Replayed) -> None:
    factory = pytest.importorskip("mcap_ros2.decoder").DecoderFactory()
    history, joints = bag.found["history"], bag.found["monitor"]["clearance_joints"]
    states = [
        state
        for topic, _, state in messages(bag.out / "reports.mcap", factory)
        if topic.endswith("/clearance_states")
    ]
    for number, joint in enumerate(joints):
        assert {state.name[number] for state in states} == {f"{joint}_clearance"}
        assert [state.position[number] for state in states] == history["modelled_m"][joint]
        assert [state.effort[number] for state in states] == history["peak_force_n"][joint]


def test_python_gives_what_the_command_line_writes_byte_for_byte(bag: Replayed, tmp_path: Path) -> None:
    result = lw.replay(bag.path, bag.path.with_suffix(".yaml"), out=tmp_path)
    assert (tmp_path / "reports.mcap").read_bytes() == (bag.out / "reports.mcap").read_bytes()
    clock = {"wall_s", "real_time_factor", "made_with"}
    summary = json.loads(result.summary().to_json())
    assert summary.keys() == bag.found.keys()
    assert [key for key in summary.keys() - clock if summary[key] != bag.found[key]] == []


def test_the_page_is_one_file_that_the_data_give_again(bag: Replayed, run) -> None:
    page, verdict = bag.out / "report.html", bag.found["verdict"]
    text = page.read_text()
    assert verdict["state"].replace("_", " ").upper() in text and verdict["fault_code"] in text
    assert [title.partition(":")[0] for title in re.findall("<h2>(.*)</h2>", text)] == SECTIONS
    assert not re.search(r'<img src="(?!data:)', text) and "<script src" not in text
    assert run("report", bag.out).code == 0
    assert page.read_text() == text
