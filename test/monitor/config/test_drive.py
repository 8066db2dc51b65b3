"""Declared figures of a drive: by name, by file and by number, at the crank."""

from pathlib import Path

import pytest

from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.mechanism.loader import load_mechanism
from leg_wear_monitor.monitor.config.fitting import fitted
from leg_wear_monitor.monitor.config.parameters import config_from
from leg_wear_monitor.monitor.config.sections import drive_figures

pytestmark = pytest.mark.plain

OWN = """
name: own
title: "a motor with a belt"
shaft: motor
gear_ratio: {value: 10, unit: "1", source: a, conditions: b}
lag: {value: 4, unit: ms, source: a, conditions: b}
coulomb: {value: 0.02, unit: N m, source: a, conditions: b}
viscous: {value: 0.001, unit: N m s/rad, source: a, conditions: b}
stiffness: {value: 5, unit: N m/rad, source: a, conditions: b}
load_friction: {value: 0.1, unit: "1", source: a, conditions: b}
"""


def declared(**values: float | str) -> dict[str, float]:
    config = config_from({f"drive.{name}": value for name, value in values.items()}, "leg.yaml")
    return drive_figures(config.drive, "leg.yaml").declared


def test_a_drive_by_name_has_what_its_sources_state() -> None:
    assert declared(type="erob80-50") == {"load_friction": 0.036, "coulomb_nm": 3.26, "viscous_nms": 1.403}


def test_a_number_overrides_the_file() -> None:
    assert declared(type="pulse115-60", bandwidth_hz=50.0, lag_s=0.0) == {
        "lag_s": 0.0,
        "bandwidth_hz": 50.0,
        "coulomb_nm": 0.37,
    }


def test_figures_of_the_output_are_converted_to_the_crank() -> None:
    """Equal power: with two turns a turn of the crank, twice the torque, four times torque over speed."""
    found = declared(type="erob80-50", gear_ratio=2.0)
    assert found == {"load_friction": 0.036, "coulomb_nm": 6.52, "viscous_nms": pytest.approx(5.612)}


def test_figures_of_a_motor_are_converted_by_its_gear(tmp_path: Path) -> None:
    file = tmp_path / "own.yaml"
    file.write_text(OWN, encoding="utf-8")
    assert declared(type=str(file), gear_ratio=2.0) == pytest.approx(
        {
            "lag_s": 0.004,
            "load_friction": 0.1,
            "coulomb_nm": 0.02 * 20.0,
            "viscous_nms": 0.001 * 20.0**2,
            "stiffness_nm_per_rad": 5.0 * 20.0**2,
        }
    )


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("type", "erob8050", ["'erob8050': no drive of this name", "did you mean erob80-50?"]),
        ("load_friction", -0.1, ["-0.1 is not within its bounds", "0 to 0.9, or -1.0 if not declared"]),
        ("load_friction", 31.0, ["31.0", "at most 0.9"]),
        ("bandwidth_hz", 0.0, ["0.0 is not within its bounds", "0.01 to 100000 Hz"]),
        ("lag_s", 10.0, ["10.0", "at most 1 s"]),
        ("lag_ms", 10.0, ["unknown parameter", "did you mean drive.lag_s?"]),
    ],
)
def test_what_cannot_be_is_one_line(name: str, value: float | str, said: list[str]) -> None:
    with pytest.raises(ConfigError) as caught:
        declared(**{name: value})
    line = str(caught.value)
    assert line.startswith(f"leg.yaml: drive.{name}: ")
    assert "\n" not in line
    assert all(each in line for each in said)


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ('gear_ratio: {value: 10, unit: "1", source: a, conditions: b}', "gear_ratio: is missing"),
        (
            "{value: 4, unit: ms, source: a, conditions: b}",
            "lag: unit 'Hz' is not one of time, expected s or ms",
        ),
        ("shaft: motor", "shaft: 'wheel' is not one of output, motor"),
    ],
)
def test_a_fault_of_a_file_names_its_key(tmp_path: Path, wrong: str, said: str) -> None:
    instead = {"g": "", "{": "{value: 4, unit: Hz, source: a, conditions: b}", "s": "shaft: wheel"}[wrong[0]]
    file = tmp_path / "own.yaml"
    file.write_text(OWN.replace(wrong, instead), encoding="utf-8")
    with pytest.raises(ConfigError) as caught:
        declared(type=str(file))
    assert str(caught.value).startswith(f"{file}: {said}")


@pytest.mark.parametrize(
    ("figure", "said"),
    [
        (
            "lag: {value: 4, unit: s, source: a, conditions: b}",
            "lag_s: 4.0 is not at most 1 s",
        ),
        ("coulomb: {value: 2, unit: N m, source: a, conditions: b}", "coulomb_nm: 2000000.0 is not"),
        ('load_friction: {value: 0.95, unit: "1", source: a, conditions: b}', "load_friction: 0.95 is not"),
    ],
)
def test_a_figure_of_a_file_has_the_bounds_of_the_number_that_overrides_it(
    tmp_path: Path, figure: str, said: str
) -> None:
    """It was taken as it is: a lag of 4 s, which was meant in ms."""
    file = tmp_path / "own.yaml"
    gear = 'gear_ratio: {value: 1000, unit: "1", source: a, conditions: b}'
    file.write_text(f"name: own\ntitle: a\nshaft: motor\n{gear}\n{figure}\n", encoding="utf-8")
    with pytest.raises(ConfigError) as caught:
        declared(type=str(file), gear_ratio=1000.0)
    assert str(caught.value).startswith(f"leg.yaml: drive.type: '{file}' gives at the crank {said}")
    own = {"lag_s": 0.004, "coulomb_nm": 2.0, "load_friction": 0.1}
    name = next(name for name in own if said.startswith(name))
    assert declared(type=str(file), gear_ratio=1000.0, **{name: own[name]}) == {name: own[name]}


def test_a_fault_ends_the_start_of_whatever_reads_the_parameters() -> None:
    config = config_from({"drive.type": "ak80"}, "leg.yaml")
    with pytest.raises(ConfigError, match=r"drive.type: 'ak80': no drive .* did you mean ak80-9\?"):
        fitted(load_mechanism(), config, "leg.yaml")


@pytest.mark.parametrize("source", ["wrench", "effort"])
def test_a_temperature_needs_the_messages_that_have_it(source: str) -> None:
    given = {"drive.temperature_interface": "temperature", "drive_torque.source": source}
    fault = rf"leg.yaml: drive.temperature_interface: 'temperature' needs .* 'interface', which is '{source}'"
    with pytest.raises(ConfigError, match=fault):
        fitted(load_mechanism("bionic_leg"), config_from(given, "leg.yaml"), "leg.yaml")
    fitted(
        load_mechanism("bionic_leg"), config_from({**given, "drive_torque.source": "interface"}, "leg.yaml")
    )
