"""Drives by name: every figure has a source; drives.md lists them. Run this file as a script to renew it."""

import re
from pathlib import Path

import attrs
import pytest
from ruamel.yaml import YAML

import leg_wear_monitor as lw
from leg_wear_monitor.mechanism.sourced import UNITS

PAGE = Path(__file__).parents[2] / "docs" / "reference" / "drives.md"
TABLE = re.compile(r"(<!-- (drives|units|keys of Drive) -->\n).*?(<!-- end -->)", re.DOTALL)
FIGURES = ("lag", "bandwidth", "load_friction", "coulomb", "viscous", "stiffness", "torque_constant")

pytestmark = pytest.mark.plain


def table(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    return "\n".join(f"| {' | '.join(row)} |" for row in [head, ("---",) * len(head), *rows]) + "\n"


def listed() -> str:
    rows = []
    for name in lw.drives():
        drive = lw.load_drive(name)
        known = {key: value.text for key, value in drive.values()}
        rows.append((f"`{name}`", drive.title, *(known.get(key, "") for key in FIGURES)))
    return table(("name", "drive", *(figure.replace("_", " ") for figure in FIGURES)), rows)


def keys() -> str:
    rows = []
    for field in attrs.fields(lw.Drive):
        need = "yes" if field.default is attrs.NOTHING else ""
        rows.append((f"`{field.name}`", field.metadata.get("dimension", ""), need, field.metadata["doc"]))
    return table(("key", "measures", "required", "what it is"), rows)


def units() -> str:
    of_drives = {field.metadata.get("dimension") for field in attrs.fields(lw.Drive)}
    known = {name: unit for name, unit in UNITS.items() if unit.dimension in of_drives}
    rows = [(f"`{name}`", unit.dimension, f"{unit.factor:.6g}") for name, unit in known.items()]
    return table(("unit", "measures", "factor to SI"), rows)


def renewed(page: str) -> str:
    parts = {"drives": listed, "units": units, "keys of Drive": keys}
    return TABLE.sub(lambda found: found[1] + parts[found[2]]() + found[3], page)


def test_the_page_lists_the_drives_the_keys_and_the_units() -> None:
    page = PAGE.read_text(encoding="utf-8")
    assert renewed(page) == page
    assert {found[2] for found in TABLE.finditer(page)} == {"drives", "units", "keys of Drive"}


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


if __name__ == "__main__":
    PAGE.write_text(renewed(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
