"""`commission` on the healthy sample recording."""

import json
from pathlib import Path

from leg_wear_monitor.commissioning import commission
from leg_wear_monitor.commissioning.result import CommissioningItem, CommissioningResult
from leg_wear_monitor.files import share_directory
from leg_wear_monitor.monitor.config.parameters import load_config
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.diagnosis.reference_file import shipped_references

HEALTHY = share_directory() / "bags" / "healthy.mcap"


def test_the_sample_recording_gives_files_that_check_accepts(run, tmp_path: Path, monkeypatch) -> None:
    """Parameters, and a reference beside them: that of the package, in place of one that is simulated."""
    monkeypatch.setattr(commission, "simulated_under", lambda mechanism, *_: shipped_references(mechanism))
    line = ("--out", "monitor.yaml", "--reference", "leg.npz", "--json", "found.json")
    result = run("commission", str(HEALTHY), *line)
    assert result.exit_code == 1  # one cadence does not tell a lag from an offset
    assert "not determined: lag" in result.stdout
    assert "drive_torque.sign" in result.stdout
    assert "written: leg.npz" in result.stdout
    config = load_config(tmp_path / "monitor.yaml")
    assert config.crank_joint == "crank"
    assert (config.crank.sign, config.crank.gear_ratio) == (1, 1.0)
    assert abs(config.crank.offset_rad) < 0.03
    torque = config.drive_torque
    assert (torque.source, torque.axis, torque.sign) == ("wrench", "z", 1)
    assert config.cadence.commanded_rpm == 60.0
    assert config.diagnosis.reference == "leg.npz"
    checked = run("check", "monitor.yaml")
    assert (checked.exit_code, "references at 60 rpm" in checked.stdout) == (0, True)
    found = json.loads((tmp_path / "found.json").read_text())
    signs = next(item for item in found["items"] if item["name"] == "crank.sign")
    assert signs["mismatch"] < 0.1 < 0.5 < signs["other_mismatch"]


def test_a_file_that_is_there_may_be_better_than_what_is_not_certain(
    run, tmp_path: Path, monkeypatch
) -> None:
    item = CommissioningItem(name="crank.sign", value=1)
    found = CommissioningResult(
        items=(item,), not_told=("lag: why",), findings=(), notes=(), config=MonitorConfig(), turns=60.0
    )
    monkeypatch.setattr(commission, "commission", lambda *_, **__: found)
    (tmp_path / "monitor.yaml").write_text("by hand")
    result = run("commission", str(HEALTHY), "--out", "monitor.yaml")
    assert result.exit_code == 1
    assert "not written: monitor.yaml exists" in result.stderr
    assert (tmp_path / "monitor.yaml").read_text() == "by hand"


def test_the_section_of_a_file_for_two_legs_is_chosen_by_its_node(run, tmp_path: Path, monkeypatch) -> None:
    given = []
    found = CommissioningResult(items=(), not_told=(), findings=(), notes=(), config=None, turns=60.0)
    monkeypatch.setattr(commission, "commission", lambda _, base, **__: given.append(base) or found)
    text = "/{0}/leg_wear_monitor: {{ros__parameters: {{hardware_id: {0} leg}}}}\n"
    (tmp_path / "two.yaml").write_text(text.format("left") + text.format("right"))
    run("commission", str(HEALTHY), "--config", "two.yaml", "--node", "/right/leg_wear_monitor")
    assert [base.hardware_id for base in given] == ["right leg"]


def test_an_unknown_crank_is_named_with_the_joints_that_there_are(refused) -> None:
    assert "'knee' is not a joint of the recording, it has crank" in refused(
        "commission", str(HEALTHY), "--crank-joint", "knee"
    )
