"""The tables of mechanism_file.md are those of the classes; run this file as a script to renew them."""

import re
from pathlib import Path
from typing import Any

import attrs
import pytest

from leg_wear_monitor.mechanism import spec
from leg_wear_monitor.mechanism import spec as clearance

PAGE = Path(__file__).parents[2] / "docs" / "reference" / "mechanism_file.md"
TABLE = re.compile(r"(<!-- keys of (\w+) -->\n).*?(<!-- end -->)", re.DOTALL)


def bounds(metadata: Any) -> str:
    if "names" in metadata:
        return ", ".join(f"`{name}`" for name in metadata["names"])
    words = {"above": "> {:g}", "at_least": "≥ {:g}", "at_most": "≤ {:g}"}
    return ", ".join(
        text.format(metadata[key]) for key, text in words.items() if metadata.get(key) is not None
    )


def default(field: "attrs.Attribute[Any]") -> str:
    if field.default is attrs.NOTHING:
        return "required"
    if attrs.has(type(field.default)):
        return "those below"
    plain = isinstance(field.default, str | float | tuple) and field.default not in ((), "")
    if not plain:
        return "none"
    return f"`{list(field.default) if isinstance(field.default, tuple) else field.default}`"


def row(field: "attrs.Attribute[Any]") -> tuple[str, ...]:
    meta = field.metadata
    return f"`{field.name}`", meta["unit"].replace("^2", "²"), bounds(meta), default(field), meta["doc"]


def table(name: str) -> str:
    fields = attrs.fields(getattr(spec, name, None) or getattr(clearance, name))
    keys = [field for field in fields if "doc" in field.metadata and not field.metadata.get("flat")]
    rows = [f"| {' | '.join(row(field))} |" for field in keys]
    return "\n".join(["| key | unit | bounds | default | what it is |", "|---|---|---|---|---|", *rows, ""])


def renewed(page: str) -> str:
    return TABLE.sub(lambda found: found[1] + table(found[2]) + found[3], page)


@pytest.mark.plain
def test_the_page_lists_every_key_as_the_classes_declare_it():
    page = PAGE.read_text(encoding="utf-8")
    assert renewed(page) == page
    told = {found[1] for found in TABLE.findall(page)}
    read = {
        kind.__name__ for module in (spec, clearance) for kind in vars(module).values() if attrs.has(kind)
    }
    assert told == read


if __name__ == "__main__":
    PAGE.write_text(renewed(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
