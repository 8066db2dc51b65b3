"""config/monitor.yaml says what the classes declare."""

from typing import Any

from ruamel.yaml import YAML

from leg_wear_monitor.monitor.config.parameters import PARAMETERS, load_config, shipped_config
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
