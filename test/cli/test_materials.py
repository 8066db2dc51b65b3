"""``leg-wear-monitor materials``."""

import json

import pytest

import leg_wear_monitor as lw

pytestmark = pytest.mark.plain


def test_the_list_has_every_pair(run):
    result = run("materials")
    assert result.exit_code == 0
    assert [line for line in result.stdout.splitlines() if not line.startswith(" ")] == list(lw.materials())
    assert "p v up to 1.8 N/mm^2 m/s" in result.stdout


def test_a_pair_in_full_has_every_source(run):
    pair = lw.load_material("steel-on-steel-dry-severe")
    text = run("materials", pair.name).stdout
    for key, value in pair.values():
        assert f"{key}: {value.central:g}" in text
        assert value.source in text
    assert "1.98e-12" in text


def test_json_has_the_numbers_of_the_files(run):
    document = json.loads(run("materials", "--json", "-").stdout)
    assert [pair["name"] for pair in document["materials"]] == list(lw.materials())
    du = next(pair for pair in document["materials"] if pair["name"] == "du-on-steel-dry")
    assert du["limits"]["pressure_speed"]["value"] == 1.8
    assert du["limits"]["pressure_speed"]["si"] == 1.8e6
    assert du["friction"]["range"] == [0.02, 0.25]


def test_an_unknown_pair_is_one_line(run, complaints):
    result = run("materials", "steel-on-stel-dry-mild")
    assert result.exit_code == 2
    (line,) = complaints(result)
    assert "did you mean steel-on-steel-dry-mild?" in line
