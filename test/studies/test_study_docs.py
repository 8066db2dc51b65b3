"""study.md lists the keys of descriptions as the classes declare them; a script renews the table.

python test/studies/test_study_docs.py
"""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import attrs
import pytest

from leg_wear_monitor.studies.kinds import STUDIES

PAGE = Path(__file__).parents[2] / "docs" / "appendix" / "study.md"
TABLE = re.compile(r"(<!-- keys -->\n).*?(<!-- end -->)", re.DOTALL)


def keys_of(kind: type, prefix: str = "") -> Iterator[tuple[str, "attrs.Attribute[Any]"]]:
    for field in attrs.fields(kind):
        if attrs.has(field.type):
            yield from keys_of(field.type, f"{prefix}{field.name}.")
        else:
            yield f"{prefix}{field.name}", field


def bounds(told: Any) -> str:
    words = (("above", "above"), ("at_least", "at least"), ("at_most", "at most"))
    return ", ".join(f"{word} {told[key]:g}" for key, word in words if told.get(key) is not None)


def default(field: "attrs.Attribute[Any]") -> str:
    if field.default is attrs.NOTHING:
        return "required"
    return ", ".join(map(str, field.default)) if isinstance(field.default, tuple) else str(field.default)


def renewed(page: str) -> str:
    users: dict[str, list[str]] = {}
    fields: dict[str, attrs.Attribute[Any]] = {}
    for name, kind in STUDIES.items():
        for key, field in keys_of(kind):
            users.setdefault(key, []).append(name)
            fields[key] = field
    lines = ["| key | unit | default | bounds | studies | what it is |", "|---|---|---|---|---|---|"]
    for key, field in fields.items():
        told = field.metadata
        studies = "all" if len(users[key]) == len(STUDIES) else ", ".join(users[key])
        cells = (f"`{key}`", told["unit"], default(field), bounds(told), studies, told["doc"])
        lines.append(f"| {' | '.join(cells)} |")
    return TABLE.sub(lambda found: found[1] + "\n".join([*lines, ""]) + found[2], page)


@pytest.mark.plain
def test_the_page_lists_every_key_as_it_is_declared():
    page = PAGE.read_text(encoding="utf-8")
    assert renewed(page) == page


if __name__ == "__main__":
    PAGE.write_text(renewed(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
