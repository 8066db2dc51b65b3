"""Drives by name: every figure has a source."""

import pytest
from ruamel.yaml import YAML

import leg_wear_monitor as lw
from leg_wear_monitor.mechanism.sourced import UNITS

pytestmark = pytest.mark.plain


@pytest.mark.parametrize("name", lw.drives())
def test_every_figure_of_every_file_has_a_source(name: str) -> None:
    """In the text of the file, whatever the class asks for."""
    document = YAML(typ="safe").load(lw.drives()[name])
    assert document["name"] == name
    figures = {key: part for key, part in document.items() if isinstance(part, dict)}
    assert list(figures) == [key for key, _ in lw.load_drive(name).values()]
    for part in figures.values():
        assert part["source"].strip()
        assert part["conditions"].strip()
        assert part["unit"] in UNITS


def test_the_known_drives_have_files() -> None:
    expected = "actpack ak60 ak80-9 erob80-100 erob80-50 mx-106 mx-64 pulse115-60 xl330"
    assert list(lw.drives()) == expected.split()
