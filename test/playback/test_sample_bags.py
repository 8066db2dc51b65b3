"""The sample recordings, replayed, give what is written beside them."""

import json
from pathlib import Path
from typing import Any

import pytest

import leg_wear_monitor as lw
from leg_wear_monitor.playback.result.replay_summary import ReplaySummary
from leg_wear_monitor.share import share_directory

BAGS = share_directory() / "bags"
# Relative bounds of forces and wear over eight or ten cycles: 5.3 sigma of the difference of two such means,
# by the sigma over five cycles in test/dynamics/clearance/test_sets.py (32 runs, 2026-11-23), a fifth more.
SCATTER = {
    "A": (0.02, 0.03), "B": (0.02, 0.16), "G": (0.02, 0.15), "I": (0.03, 0.31), "J": (0.13, 0.58),
}  # fmt: skip


@pytest.fixture(scope="module", params=["healthy", "knocking", "bad_input"])
def bag(request: pytest.FixtureRequest) -> tuple[ReplaySummary, dict[str, Any]]:
    """What a replay finds, and what it should."""
    path: Path = BAGS / f"{request.param}.mcap"
    result = lw.replay(path, path.with_suffix(".yaml"))
    return result.summary(), json.loads(path.with_suffix(".json").read_text())


def test_every_message_is_taken_or_counted(bag: tuple[ReplaySummary, dict[str, Any]]) -> None:
    found, expected = bag
    for kind in ("crank_samples", "torque_samples"):
        assert getattr(found.recording, kind) == expected[kind]
    assert [finding.text for finding in found.recording.findings] == expected["findings"]
    for count in ("faulty", "duplicates", "gaps_lost", "backward_jumps"):
        assert getattr(found.lost, count) == expected["lost"][count]
    assert found.lost.unmonitored_s == pytest.approx(expected["lost"]["unmonitored_s"], abs=0.3)


@pytest.mark.chaotic
def test_alarms_are_those_that_must_be_raised(bag: tuple[ReplaySummary, dict[str, Any]]) -> None:
    found, expected = bag
    alarms = [change.alarm for change in found.alarms.changes]  # to WARN before, and back to OK, too
    worst = {one.name: max(each.level for each in alarms if each.name == one.name) for one in alarms}
    assert sorted(f"{name}: {level.name}" for name, level in worst.items()) == expected["alarms"]


@pytest.mark.chaotic
def test_forces_and_wear_are_the_same_within_their_scatter(
    bag: tuple[ReplaySummary, dict[str, Any]],
) -> None:
    found, expected = bag
    assert found.cycles == expected["cycles"]
    assert found.joints.keys() == expected["opened_m"].keys()
    for name, joint in found.joints.items():
        opened, (force, wear) = joint.clearance_m.last - joint.clearance_m.first, SCATTER[name]
        assert opened == pytest.approx(expected["opened_m"][name], rel=wear)
        assert joint.mean_force_n == pytest.approx(expected["mean_force_n"][name], rel=force)


@pytest.mark.chaotic
def test_the_verdict_is_the_one_that_is_written_beside(bag: tuple[ReplaySummary, dict[str, Any]]) -> None:
    found, expected = bag
    verdict = found.verdict
    told = {"state": verdict.state.value, "fault_code": verdict.fault_code}
    assert told | {"not_valid": [figure.value for figure in verdict.not_valid]} == expected["verdict"]
    is_believed = "forecast" not in expected["verdict"]["not_valid"]
    assert is_believed or not any(found.life.values())
    assert all(0.99 * new.new_m < new.counted_m < new.limit_m for new in found.clearances.values())
