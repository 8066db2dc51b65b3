"""Parameters as the classes declare them, and config/monitor.yaml, which says the same."""

from typing import Any

from hypothesis import given
from hypothesis import strategies as st
from ruamel.yaml import YAML

from leg_wear_monitor.monitor.config.parameters import (
    PARAMETERS,
    config_from,
    load_config,
    shipped_config,
    values_of,
)
from leg_wear_monitor.monitor.config.settings import MonitorConfig


def test_the_shipped_file_holds_every_parameter_but_empty_lists_at_its_default():
    assert load_config() == MonitorConfig()
    document = YAML(typ="safe", pure=True).load(shipped_config().read_text(encoding="utf-8"))

    def names(mapping: Any, prefix: str = "") -> list[str]:
        return [
            name
            for key, value in mapping.items()
            for name in (names(value, f"{prefix}{key}.") if isinstance(value, dict) else [prefix + key])
        ]

    shipped = names(document["/**"]["ros__parameters"])
    assert shipped == [name for name, parameter in PARAMETERS.items() if parameter.default != ()]


def test_the_comment_of_each_parameter_is_its_description():
    lines = shipped_config().read_text(encoding="utf-8").splitlines()
    for name, parameter in PARAMETERS.items():
        key, comment = name.rpartition(".")[2], f" # {parameter.description}"
        assert any(
            line.strip().removeprefix("# ").startswith(f"{key}:") and line.endswith(comment) for line in lines
        ), name


def test_defaults_are_within_their_own_bounds():
    assert config_from(values_of(MonitorConfig())) == MonitorConfig()


@given(st.sampled_from([p for p in PARAMETERS.values() if p.type == "double"]), st.data())
def test_what_is_within_the_bounds_is_taken_and_kept(parameter, data):
    least = parameter.above if parameter.at_least is None else parameter.at_least
    # a crank that stands, and what is as good as 0 where that cannot be, are refused
    smallest = {"cadence.commanded_rpm": 0.1}.get(parameter.name, 1.0e-30 if parameter.above == 0.0 else 0.0)
    values = st.floats(least, parameter.at_most, exclude_min=parameter.above is not None)
    value = data.draw(values.filter(lambda value: abs(value) >= smallest))
    assert values_of(config_from({parameter.name: value}))[parameter.name] == value


def test_every_parameter_says_what_it_is():
    for parameter in PARAMETERS.values():
        assert parameter.description
        assert parameter.type not in ("double", "double_array") or parameter.bounds
