"""The tables of fleet_file.md are those of the classes; run this file as a script to renew them."""

import re
from pathlib import Path
from typing import Any

import attrs
import pytest

from leg_wear_monitor.fleet import description

PAGE = Path(__file__).parents[2] / "docs" / "reference" / "fleet_file.md"
TABLE = re.compile(r"(<!-- keys of (\w+) -->\n).*?(<!-- end -->)", re.DOTALL)


def default(field: "attrs.Attribute[Any]") -> str:
    if field.default is attrs.NOTHING:
        return "required"
    return f"`{field.default}`" if isinstance(field.default, str) and field.default else "none"


def table(name: str) -> str:
    rows = [
        f"| `{field.name}` | {default(field)} | {field.metadata['doc']} |"
        for field in attrs.fields(getattr(description, name))
    ]
    return "\n".join(["| key | default | what it is |", "|---|---|---|", *rows, ""])


def renewed(page: str) -> str:
    return TABLE.sub(lambda found: found[1] + table(found[2]) + found[3], page)


@pytest.mark.plain
def test_the_page_lists_every_key_as_the_classes_declare_it():
    page = PAGE.read_text(encoding="utf-8")
    assert renewed(page) == page
    assert {found[1] for found in TABLE.findall(page)} == {"FleetFile", "Defaults", "LegEntry"}


if __name__ == "__main__":
    PAGE.write_text(renewed(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
