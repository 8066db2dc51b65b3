"""Material pairs: their files and limits."""

import math
from pathlib import Path
from typing import Any

import attrs
import pytest
from mechanism_of import document_of, mechanism_of
from ruamel.yaml import YAML

import leg_wear_monitor as lw
from leg_wear_monitor.mechanism.materials import (
    UNITS,
    Bushing,
    BushingLoad,
    Material,
    SourcedValue,
    bushing_of,
)

# Files of materials, and of drives: sources, units and their traps, and one line for a bad one.


def number(value: float, unit: str) -> SourcedValue:
    return SourcedValue(value=value, unit=unit, source="a", conditions="b")


FILES = {"material": (lw.materials(), lw.load_material), "drive": (lw.drives(), lw.load_drive)}


@pytest.mark.parametrize(("kind", "name"), [(kind, name) for kind in FILES for name in FILES[kind][0]])
def test_every_number_of_every_file_has_a_source(kind: str, name: str) -> None:
    """In the text of the file, whatever the classes ask for."""
    paths, load_file = FILES[kind]
    document = YAML(typ="safe").load(paths[name])
    assert document["name"] == name

    def check(part: Any) -> int:
        """Number of mappings with a number of their own, each with its source."""
        if not isinstance(part, dict):
            return 0
        assert not any(isinstance(key, int | float) for key in part)
        own = [each for each in part.values() if isinstance(each, int | float | list) and each is not False]
        if own:
            assert part["source"].strip()
            assert part["conditions"].strip()
            assert part["unit"] in UNITS
        return bool(own) + sum(check(entry) for entry in part.values())

    assert check(document) == len(list(load_file(name).values())) > 0


@pytest.mark.parametrize(
    ("value", "unit", "si"),
    [
        (39000, "psi ft/min", 1.36599e6),  # igus prints 1.37 MPa m/s
        (13050, "psi", 89.9766e6),  # and 90 MPa
        (196, "ft/min", 0.99568),
        (1.0, "N/mm^2 m/s", 1.0e6),
        (1.0, "mm^3/(N m)", 1.0e-9),  # a cube of 1 mm a N m, in m^3 a J
        (1.0, "um/km at 1 MPa", 1.0e-15),  # depth over distance and pressure
    ],
)
def test_units(value: float, unit: str, si: float) -> None:
    assert number(value, unit).si == pytest.approx(si, rel=1.0e-5)


def test_inch_units_of_the_makers_page_are_its_metric_ones() -> None:
    """RTP, Quadrant: 1e-10 in^3 min/(lbf ft h) and 1e-8 mm^3/(N m) of the same test, rounded."""
    pairs = ((13, 26), (132, 265), (61, 122), (228, 459), (4, 8), (149, 300), (80, 161), (35, 70.5))
    for inch, metric in pairs:
        rounding = 0.5e-10 * UNITS["in^3 min/(lbf ft h)"][1] + 0.5e-8 * 1.0e-9
        difference = (
            number(inch * 1.0e-10, "in^3 min/(lbf ft h)").si - number(metric * 1.0e-8, "mm^3/(N m)").si
        )
        assert abs(difference) < rounding


def test_a_k_of_a_book_is_divided_by_three_hardnesses() -> None:
    """V = K F s / (3 H), K 0.007 and H 120 kgf/mm^2; the example: 98 N over 1 m give 2e-10 m^3."""
    (k, other) = lw.load_material("steel-on-steel-dry-severe").wear_coefficients
    assert k == other == pytest.approx(7.0e-3 / (3.0 * 120.0 * 9.80665e6), rel=1.0e-12)
    assert k * 98.0 * 1.0 == pytest.approx(2.0e-10, rel=0.05)


def test_a_range_stands_for_its_geometric_middle() -> None:
    value = SourcedValue(unit="1", source="a", conditions="b", range=(0.02, 0.25))
    assert value.si == pytest.approx(math.sqrt(0.02 * 0.25))


def test_a_pair_with_one_unknown_side_has_no_coefficient() -> None:
    pair = lw.load_material("ferritic-stainless-on-steel-dry")
    assert pair.bushing.wear_coefficient is not None
    assert pair.wear_coefficients is None


def test_a_side_whose_wear_is_not_counted_has_none() -> None:
    """Closed form of the unit: 1 in^3 over 1 lbf at 1 ft/min for 1 h, which is 60 ft."""
    pair = lw.load_material("pa66-on-steel-dry")
    volume, work = 80e-10 * 0.0254**3, 4.4482216152605 * 60.0 * 0.3048
    assert pair.journal.wear_coefficient is None
    assert pair.wear_coefficients == (pytest.approx(volume / work), 0.0)


PAIR = """
name: mine
title: a pair
bushing: {material: bronze}
journal: {material: steel}
lubricant: none
regime: dry
friction: {value: 0.1, unit: "1", source: a book, conditions: dry}
"""


def load(path: Path, text: str) -> Material:
    file = path / "mine.yaml"
    file.write_text(text)
    return lw.load_material(file)


def test_a_file_of_ones_own(tmp_path: Path) -> None:
    assert load(tmp_path, PAIR).friction.si == 0.1


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (", source: a book", "", ["friction.source", "missing", "origin of the value"]),
        ("source: a book", "source: ' '", ["friction.source", "empty"]),
        (", conditions: dry", "", ["friction.conditions", "missing"]),
        ("friction:", "frictoin:", ["frictoin", "did you mean friction?"]),
        ("value: 0.1,", "valeu: 0.1,", ["friction.valeu", "did you mean value?"]),
        ("value: 0.1, ", "", ["friction.value", "range"]),
        ('unit: "1"', "unit: Nm", ["friction.unit", "'Nm'", "MPa"]),
        ('unit: "1"', "unit: MPa", ["friction", "'MPa'", "number", "Expected 1"]),
        ("value: 0.1", "value: -0.1", ["friction", "-0.1", "above 0"]),
        ("value: 0.1", "range: [0.2, 0.1]", ["friction.range", "does not rise"]),
        ("value: 0.1", "value: soft", ["friction.value", "'soft'", "not a number"]),
        ("{material: steel}", "{}", ["journal.material", "missing"]),
    ],
)
def test_a_bad_file_is_one_line(tmp_path: Path, old: str, new: str, words: list[str]) -> None:
    assert old in PAIR
    with pytest.raises(lw.ConfigError) as caught:
        load(tmp_path, PAIR.replace(old, new))
    line = str(caught.value)
    assert "\n" not in line
    assert "mine.yaml: " in line
    assert [word for word in words if word not in line] == []


def test_an_unknown_name_is_one_line_with_a_similar_one() -> None:
    with pytest.raises(lw.ConfigError, match=r"no material of this name.*did you mean du-on-steel-dry"):
        lw.load_material("du-on-steel-dri")


# p, v and p v of a joint against the limits of its material.


SETTINGS = attrs.evolve(lw.load_mechanism().clearances["G"], material="du-on-steel-dry")


def loaded(pressure: float, speed: float, product: float, material: str = "du-on-steel-dry") -> BushingLoad:
    bushing = Bushing.of(attrs.evolve(SETTINGS, material=material))
    return bushing.loaded(0.1 * pressure, pressure, speed, product)


@pytest.mark.parametrize(
    ("load", "beyond"),
    [
        ((139.0e6, 2.4, 1.7e6), None),
        ((141.0e6, 2.4, 1.7e6), "p 1.41e+08 Pa above 1.4e+08"),
        ((139.0e6, 2.6, 1.7e6), "v 2.6 m/s above 2.5"),
        ((139.0e6, 2.4, 1.9e6), "p v 1.9e+06 Pa m/s above 1.8e+06"),
        ((141.0e6, 2.6, 1.7e6), "p 1.41e+08 Pa above 1.4e+08, v 2.6 m/s above 2.5"),
    ],
)
def test_what_is_beyond_the_limits_is_one_line(load: tuple[float, float, float], beyond: str | None) -> None:
    wanted = beyond and f"outside the limits of du-on-steel-dry: {beyond}"
    assert loaded(*load).outside_limits == wanted


def test_the_fraction_is_that_of_the_value_nearest_its_limit() -> None:
    assert loaded(70.0e6, 2.0, 1.5 * 1.8e6).fraction == pytest.approx(1.5)
    assert loaded(70.0e6, 2.0, 0.1e6).fraction == pytest.approx(0.8)


def test_without_limits_nothing_is_outside_and_there_is_no_fraction() -> None:
    for material in ("", "steel-on-steel-greased-mild"):
        load = loaded(1e12, 1e6, 1e15, material)
        assert (load.outside_limits, load.fraction, load.compared) == (None, None, {})


def test_one_that_gives_a_static_limit_only_is_held_to_it() -> None:
    load = loaded(41.0e6, 0.0, 0.0, "iglidur-b-on-steel")
    assert "p 4.1e+07 Pa above 4e+07" in (load.outside_limits or "")


def test_the_load_follows_from_forces_and_rubbing() -> None:
    """A diameter of 20 mm, 20 mm wide: 4e-4 m^2. 800 N in the mean that rub with 240 W slide by 0.3 m/s."""
    load = Bushing.of(SETTINGS).load(800.0, 2000.0, 240.0)
    assert load.mean_pressure_pa == pytest.approx(2.0e6)
    assert load.p99_pressure_pa == pytest.approx(5.0e6)
    assert load.mean_sliding_speed_mps == pytest.approx(0.3)
    assert load.mean_pressure_speed_pa_mps == pytest.approx(0.6e6)
    assert Bushing.of(SETTINGS).load(0.0, 0.0, 0.0).mean_sliding_speed_mps == 0.0


def test_joints_that_swing_have_limits_of_their_own() -> None:
    """iglidur H: 196 ft/min where it turns, 137 ft/min where it swings; A and B are the crank's."""
    document = document_of("bionic_leg")
    document["clearances"]["defaults"] |= {"material": "iglidur-h-on-steel", "wear_coefficient": 0}
    limited = mechanism_of(document)
    speeds = {joint: bushing_of(limited, joint).sliding_speed_mps for joint in limited.clearances}
    assert speeds["G"] == pytest.approx(137 * 0.3048 / 60)
    turning = {joint for joint in speeds if speeds[joint] == pytest.approx(196 * 0.3048 / 60)}
    assert turning == {joint for joint in speeds if limited.drive.body in limited.sides(joint)} != set()
