"""``leg-wear-monitor drives`` and ``materials``, and what ``check`` prints of a drive."""

import json
from pathlib import Path

import pytest

import leg_wear_monitor as lw

EACH = pytest.mark.parametrize(
    ("verb", "names", "one"),
    [
        ("drives", lw.drives(), lw.load_drive("pulse115-60")),
        ("materials", lw.materials(), lw.load_material("steel-on-steel-dry-severe")),
    ],
    ids=["drives", "materials"],
)  # fmt: skip


@EACH
def test_the_list_has_every_name(run, verb, names, one):
    result = run(verb)
    assert result.code == 0
    assert [line.partition(":")[0] for line in result.out.splitlines()] == list(names)
    assert f"{one.name}: {one.title}" in result.out.splitlines()
    assert [each["name"] for each in json.loads(run(verb, "--json", "-").out)[verb]] == list(names)


@EACH
def test_one_is_its_file(run, verb, names, one):
    assert run(verb, one.name).out == names[one.name].read_text(encoding="utf-8")


def test_json_has_the_numbers_of_the_files(run):
    (drive,) = json.loads(run("drives", "pulse115-60", "--json", "-").out)["drives"]
    assert drive["bandwidth"]["value"] == drive["bandwidth"]["si"] == 66.3
    (pair,) = json.loads(run("materials", "du-on-steel-dry", "--json", "-").out)["materials"]
    assert (pair["limits"]["pressure_speed"]["value"], pair["limits"]["pressure_speed"]["si"]) == (1.8, 1.8e6)
    assert pair["friction"]["range"] == [0.02, 0.25]


@pytest.mark.parametrize(
    ("verb", "name", "near"),
    [
        ("drives", "erob8050", "erob80-50"),
        ("materials", "steel-on-stel-dry-mild", "steel-on-steel-dry-mild"),
    ],
)
def test_an_unknown_name_is_one_line(refused, verb, name, near):
    assert f"did you mean {near}?" in refused(verb, name)


def test_check_prints_what_is_declared_of_the_drive(run, tmp_path: Path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    drive = "{type: erob80-50, gear_ratio: 2.0, lag_s: 0.004, stiffness_nm_per_rad: 800.0}"
    Path("monitor.yaml").write_text(f"/**: {{ros__parameters: {{drive: {drive}}}}}", encoding="utf-8")
    result = run("check", "monitor.yaml")
    assert result.code == 0
    line = next(line for line in result.out.splitlines() if "at the crank" in line)
    assert line.strip() == (
        "drive erob80-50, at the crank: lag_s 0.004, load_friction 0.036, coulomb_nm 6.52, "
        "viscous_nms 5.612, stiffness_nm_per_rad 800; the rest is estimated"
    )


def test_check_names_the_nearest_drive(refused, tmp_path: Path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("monitor.yaml").write_text("/**: {ros__parameters: {drive: {type: ak80}}}", encoding="utf-8")
    line = refused("check", "monitor.yaml")
    assert "monitor.yaml: drive.type: 'ak80': no drive of this name" in line
    assert "did you mean ak80-9?" in line
