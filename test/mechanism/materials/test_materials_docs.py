"""materials.md lists the files, the classes and the units; run this file as a script to renew it."""

import re
from pathlib import Path
from typing import Any, get_args

import attrs
import pytest

from leg_wear_monitor.mechanism import materials as material
from leg_wear_monitor.mechanism import sourced
from leg_wear_monitor.mechanism.materials import Material, load_material, materials
from leg_wear_monitor.mechanism.sourced import UNITS, Drive

PAGE = Path(__file__).parents[3] / "docs" / "reference" / "materials.md"
TABLE = re.compile(r"(<!-- (pairs|units|keys of (\w+)) -->\n).*?(<!-- end -->)", re.DOTALL)


def table(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    return "\n".join(f"| {' | '.join(row)} |" for row in [head, ("---",) * len(head), *rows]) + "\n"


def given(value: sourced.SourcedValue | None) -> str:
    return "" if value is None else f"{value.si:.3g}"


def pairs() -> str:
    rows = []
    for name in materials():
        pair = load_material(name)
        wear = pair.wear_coefficients
        coefficients = "none" if wear is None else f"{wear[0]:.2g}, {wear[1]:.2g}"
        limits = pair.limits
        pressure = limits.dynamic_pressure or limits.static_pressure
        numbers = (pair.friction, pressure, limits.sliding_speed, limits.pressure_speed)
        rows.append((f"`{name}`", pair.title, pair.regime, coefficients, *map(given, numbers)))
    head = ("name", "pair", "regime", "wear [1/Pa]", "friction", "p [Pa]", "v [m/s]", "p v [Pa m/s]")
    return table(head, rows)


def keys(name: str) -> str:
    kind: Any = getattr(material, name, None) or getattr(sourced, name)
    inherited = {field.name for field in attrs.fields(sourced.SourcedValue)}
    rows = []
    for field in attrs.fields(kind):
        if kind is sourced.WearCoefficient and field.name in inherited:
            continue
        need = "yes" if field.default is attrs.NOTHING else ""
        rows.append((f"`{field.name}`", field.metadata.get("dimension", ""), need, field.metadata["doc"]))
    return table(("key", "measures", "required", "what it is"), rows)


def units() -> str:
    of_drives = {field.metadata.get("dimension") for field in attrs.fields(Drive)} - {"number"}
    known = {name: unit for name, unit in UNITS.items() if unit.dimension not in of_drives}
    rows = [(f"`{name}`", unit.dimension, f"{unit.factor:.6g}") for name, unit in known.items()]
    return table(("unit", "measures", "factor to SI"), rows)


def renewed(page: str) -> str:
    parts = {"pairs": pairs, "units": units}
    return TABLE.sub(
        lambda found: found[1] + (keys(found[3]) if found[3] else parts[found[2]]()) + found[4], page
    )


def classes_in(kind: Any) -> set[type]:
    """A class of a file and, in turn, those of its keys; what a key of values is made of."""
    found = {kind}
    for field in attrs.fields(attrs.resolve_types(kind)):
        parts = {field.type, *get_args(field.type)}
        found |= {each for part in parts if attrs.has(part) for each in classes_in(part)}
    return found


@pytest.mark.plain
def test_the_page_lists_the_files_the_keys_and_the_units() -> None:
    page = PAGE.read_text(encoding="utf-8")
    assert renewed(page) == page
    told = {found[3] for found in TABLE.finditer(page) if found[3]}
    assert told == {kind.__name__ for kind in classes_in(Material)}


if __name__ == "__main__":
    PAGE.write_text(renewed(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
