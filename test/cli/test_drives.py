"""``leg-wear-monitor drives``, and what ``check`` prints of a drive."""

import json
from pathlib import Path

import pytest

import leg_wear_monitor as lw

pytestmark = pytest.mark.plain


def test_the_list_has_every_drive(run):
    result = run("drives")
    assert result.exit_code == 0
    assert [line for line in result.stdout.splitlines() if not line.startswith(" ")] == list(lw.drives())
    assert "viscous 1.403 N m s/rad" in result.stdout


def test_a_drive_in_full_has_every_source(run):
    drive = lw.load_drive("pulse115-60")
    text = run("drives", drive.name).stdout
    assert "those of the output shaft" in text
    for key, value in drive.values():
        assert f"{key}: {value.central:g}" in text
        assert value.source in text


def test_json_has_the_numbers_of_the_files(run):
    document = json.loads(run("drives", "--json", "-").stdout)
    assert [drive["name"] for drive in document["drives"]] == list(lw.drives())
    bandwidth = next(drive for drive in document["drives"] if drive["name"] == "pulse115-60")["bandwidth"]
    assert bandwidth["value"] == bandwidth["si"] == 66.3


def test_an_unknown_drive_is_one_line(run, complaints):
    result = run("drives", "erob8050")
    assert result.exit_code == 2
    (line,) = complaints(result)
    assert "did you mean erob80-50?" in line


def test_check_prints_what_is_declared_of_the_drive(run, tmp_path: Path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    drive = "{type: erob80-50, gear_ratio: 2.0, lag_s: 0.004, stiffness_nm_per_rad: 800.0}"
    Path("monitor.yaml").write_text(f"/**: {{ros__parameters: {{drive: {drive}}}}}", encoding="utf-8")
    result = run("check", "monitor.yaml")
    assert result.exit_code == 0
    line = next(line for line in result.stdout.splitlines() if "at the crank" in line)
    assert line.strip() == (
        "drive erob80-50, at the crank: lag 0.004 s, load friction 0.036, "
        "Coulomb friction 6.52 N m, viscous friction 5.612 N m s/rad, stiffness 800 N m/rad; "
        "the rest is estimated"
    )


def test_check_names_the_nearest_drive(run, tmp_path: Path, monkeypatch, complaints):
    monkeypatch.chdir(tmp_path)
    Path("monitor.yaml").write_text("/**: {ros__parameters: {drive: {type: ak80}}}", encoding="utf-8")
    result = run("check", "monitor.yaml")
    assert result.exit_code == 2
    (line,) = complaints(result)
    assert "monitor.yaml: drive.type: 'ak80': no drive of this name" in line
    assert "did you mean ak80-9?" in line
