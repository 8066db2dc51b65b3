"""`reference` writes a file that a parameter file can name."""

from pathlib import Path

import pytest

from leg_wear_monitor.monitor.diagnosis import reference_file
from leg_wear_monitor.twin import torque_reference


def test_references_of_two_cadences_are_written_and_named(run, tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr(reference_file, "BEFOREHAND_CYCLES", 1)
    monkeypatch.setattr(torque_reference, "WIDER", (2.0,))
    monkeypatch.setattr(torque_reference, "_SETTLING", 0)
    result = run("reference", "bionic_leg", "--cadence", "57", "--cadence", "-60", "--out", "leg.npz")
    assert result.exit_code == 0, result.stderr
    assert "bionic_leg at 57 rpm: 6 legs, 1 gait cycles each" in result.stdout
    assert "written: leg.npz, after " in result.stdout
    assert result.stderr == ""  # no progress bar in a pipe
    (tmp_path / "monitor.yaml").write_text("/**: {ros__parameters: {diagnosis: {reference: leg.npz}}}")
    assert ", references at 57, -60 rpm" in run("check", "monitor.yaml").stdout
    (tmp_path / "jansen.yaml").write_text(
        "/**: {ros__parameters: {mechanism: jansen_leg, diagnosis: {reference: leg.npz}}}"
    )
    result = run("check", "jansen.yaml")
    assert result.exit_code == 2
    assert "leg.npz: has torque references of another leg (bionic_leg)" in result.stderr


@pytest.mark.parametrize(
    ("arguments", "fault"),
    [
        (["--cadence", "nan", "--out", "leg.npz"], "--cadence"),
        (["--cadence", "0.0", "--out", "leg.npz"], "does not turn the crank"),
        (["no_leg", "--out", "leg.npz"], "no mechanism of this name"),
        (["--out", "nowhere/leg.npz"], "there is no directory nowhere"),
        ([], "--out"),
    ],
)
def test_bad_command_lines_are_one_line(run, arguments: list[str], fault: str) -> None:
    result = run("reference", *arguments)
    assert result.exit_code == 2
    assert fault in result.stderr
    assert len(result.stderr.splitlines()) == 1
