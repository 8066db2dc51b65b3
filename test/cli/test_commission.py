"""`commission` on the healthy sample recording."""

import json
from pathlib import Path

from leg_wear_monitor.commissioning import detection
from leg_wear_monitor.files import share_directory
from leg_wear_monitor.monitor.config.parameters import load_config
from leg_wear_monitor.monitor.diagnosis.reference_file import shipped_references

HEALTHY = share_directory() / "bags" / "healthy.mcap"


def test_the_sample_recording_gives_a_file_that_check_accepts(run, tmp_path: Path) -> None:
    result = run("commission", str(HEALTHY), "--out", "monitor.yaml", "--json", "found.json")
    assert result.exit_code == 1  # one cadence does not tell a lag from an offset
    assert "not enough to tell: lag" in result.stdout
    assert "drive_torque.sign" in result.stdout
    config = load_config(tmp_path / "monitor.yaml")
    assert config.crank_joint == "crank"
    assert (config.crank.sign, config.crank.gear_ratio) == (1, 1.0)
    assert abs(config.crank.offset_rad) < 0.03
    assert (config.drive_torque.source, config.drive_torque.axis, config.drive_torque.sign) == (
        "wrench",
        "z",
        1,
    )
    assert config.cadence.commanded_rpm == 60.0
    assert run("check", "monitor.yaml").exit_code == 0
    found = json.loads((tmp_path / "found.json").read_text())
    signs = next(item for item in found["items"] if item["name"] == "crank.sign")
    assert signs["mismatch"] < 0.1 < 0.5 < signs["other_mismatch"]
    assert "this torque is good enough for joints A, B, G" in result.stdout
    assert "better known: lag: record two cadences in one recording" in result.stdout
    assert [one["joint"] for one in found["joints"] if one["is_good"]][:3] == ["A", "B", "G"]
    assert found["reference_used"] == "the one that comes with the package"
    assert found["judgement"] in result.stdout
    # the lag is not determined: what is there may be better
    (tmp_path / "monitor.yaml").write_text("by hand")
    result = run("commission", str(HEALTHY), "--out", "monitor.yaml")
    assert result.exit_code == 1
    assert "not written: monitor.yaml exists" in result.stderr
    assert (tmp_path / "monitor.yaml").read_text() == "by hand"


def test_a_reference_is_written_beside_the_parameters(run, tmp_path: Path, monkeypatch) -> None:
    def simulated(mechanism, _profiles, _progress):
        return shipped_references(mechanism)

    monkeypatch.setattr(detection, "simulated_under", simulated)
    result = run("commission", str(HEALTHY), "--out", "monitor.yaml", "--reference", "leg.npz")
    assert "written: leg.npz" in result.stdout
    assert load_config(tmp_path / "monitor.yaml").diagnosis.reference == "leg.npz"
    result = run("check", "monitor.yaml")
    assert result.exit_code == 0
    assert "references at 60 rpm" in result.stdout


def test_an_unknown_crank_is_named_with_the_joints_that_there_are(refused) -> None:
    assert "'knee' is not a joint of the recording, it has crank" in refused(
        "commission", str(HEALTHY), "--crank-joint", "knee"
    )
