"""`commission` on the healthy sample recording."""

import json
from pathlib import Path

import command_line
import pytest

import leg_wear_monitor as lw

HEALTHY = lw.share_directory() / "bags" / "healthy.mcap"


@pytest.fixture(scope="module")
def commissioned(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, command_line.Done]:
    """Directory with what it wrote, and what it said; the base is a section of a file for two legs."""
    place = tmp_path_factory.mktemp("commissioned")
    text = "/{0}/leg_wear_monitor: {{ros__parameters: {{hardware_id: {0} leg}}}}\n"
    (place / "two.yaml").write_text(text.format("left") + text.format("right"))
    line = ["commission", HEALTHY, "--config", place / "two.yaml", "--node", "/right/leg_wear_monitor"]
    line += ["--out", place / "monitor.yaml", "--json", place / "found.json"]
    return place, command_line.run(*line)


def test_the_sample_recording_gives_files_that_check_accepts(commissioned, run) -> None:
    place, result = commissioned
    assert result.code == 1  # a lag that is not declared looks like an offset
    assert "not determined: lag" in result.out
    assert "drive_torque.sign" in result.out
    config = lw.load_config(place / "monitor.yaml")
    assert config.hardware_id == "right leg"
    assert config.crank_joint == "crank"
    assert (config.crank.sign, config.crank.gear_ratio) == (1, 1.0)
    assert abs(config.crank.offset_rad) < 0.03
    torque = config.drive_torque
    assert (torque.source, torque.axis, torque.sign) == ("wrench", "z", 1)
    assert config.cadence.commanded_rpm == 60.0
    assert run("check", place / "monitor.yaml").code == 0
    found = json.loads((place / "found.json").read_text())
    signs = next(item for item in found["items"] if item["name"] == "crank.sign")
    assert signs["mismatch"] < 0.1 < 0.5 < signs["other_mismatch"]


def test_a_file_that_is_there_may_be_better_than_what_is_not_certain(run, tmp_path: Path) -> None:
    (tmp_path / "monitor.yaml").write_text("by hand")
    result = run("commission", HEALTHY, "--out", "monitor.yaml")
    assert result.code == 1
    assert "not written: monitor.yaml exists" in result.err
    assert (tmp_path / "monitor.yaml").read_text() == "by hand"


@pytest.mark.slow
def test_a_reference_is_written_beside_the_parameters_that_name_it(run, tmp_path: Path) -> None:
    result = run("commission", HEALTHY, "--out", "monitor.yaml", "--reference", "leg.npz")
    assert "written: leg.npz" in result.out
    assert lw.load_config(tmp_path / "monitor.yaml").diagnosis.reference == "leg.npz"
    checked = run("check", "monitor.yaml")
    assert (checked.code, "references at 60 rpm" in checked.out) == (0, True)


def test_an_unknown_crank_is_named_with_the_joints_that_there_are(refused) -> None:
    assert "'knee' is not a joint of the recording, which has crank" in refused(
        "commission", HEALTHY, "--crank-joint", "knee"
    )
