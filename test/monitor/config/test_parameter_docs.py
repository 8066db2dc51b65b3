"""parameters.md and config/monitor.yaml say what the classes declare; a script renews the table."""

import re
from pathlib import Path
from typing import Any

import pytest
from ruamel.yaml import YAML

from leg_wear_monitor.monitor.config.parameters import PARAMETERS, Parameter, load_config, shipped_config
from leg_wear_monitor.monitor.config.settings import MonitorConfig

PAGE = Path(__file__).parents[3] / "docs" / "reference" / "parameters.md"
TABLE = re.compile(r"(<!-- parameters -->\n).*?(<!-- end -->)", re.DOTALL)


def as_yaml(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return repr(list(value)) if isinstance(value, tuple) else repr(value).replace("''", "none")


def row(parameter: Parameter) -> str:
    cells = (
        f"`{parameter.name}`",
        parameter.type,
        parameter.unit,
        as_yaml(parameter.default),
        parameter.bounds,
        "" if parameter.read_only else "yes",
        parameter.description,
    )
    return f"| {' | '.join(cells)} |"


def renewed(page: str) -> str:
    head = ["| name | type | unit | default | bounds | live | what it is |", "|---|---|---|---|---|---|---|"]
    table = "\n".join([*head, *map(row, PARAMETERS.values()), ""])
    return TABLE.sub(lambda found: found[1] + table + found[2], page)


@pytest.mark.plain
def test_the_page_lists_every_parameter_as_it_is_declared():
    page = PAGE.read_text(encoding="utf-8")
    assert renewed(page) == page


@pytest.mark.plain
def test_the_shipped_file_holds_every_parameter_but_empty_lists_at_its_default():
    assert load_config() == MonitorConfig()
    document = YAML(typ="safe", pure=True).load(shipped_config().read_text(encoding="utf-8"))

    def names(mapping: Any, prefix: str = "") -> list[str]:
        return [
            name
            for key, value in mapping.items()
            for name in (names(value, f"{prefix}{key}.") if isinstance(value, dict) else [prefix + key])
        ]

    told = names(document["/**"]["ros__parameters"])
    assert told == [name for name, parameter in PARAMETERS.items() if parameter.default != ()]


if __name__ == "__main__":
    PAGE.write_text(renewed(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
