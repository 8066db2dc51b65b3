"""docs/reference/ledger.md lists the tables of the schema; this file as a script renews it."""

import re
import sqlite3
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest

from leg_wear_monitor.monitor.ledger.schema import FORMAT, TABLES, create_tables

PAGE = Path(__file__).parents[3] / "docs" / "reference" / "ledger.md"
PART = re.compile(r"(<!-- tables -->\n).*?(<!-- end -->)", re.DOTALL)
COMMENTED = re.compile(r"((?:^-- .*\n)+)CREATE TABLE (\w+)", re.MULTILINE)
UNITS = {"ns": "ns", "s": "s", "m": "m", "cycles": "gait cycles"}

pytestmark = pytest.mark.plain


def comments() -> dict[str, str]:
    """What the definition of each table says of it."""
    found = COMMENTED.findall(TABLES)
    return {name: " ".join(line[3:] for line in text.splitlines()) for text, name in found}


def columns(db: sqlite3.Connection, table: str) -> Iterator[str]:
    yield from ("| column | type | unit | |", "|---|---|---|---|")
    for _, name, kind, is_not_null, _, key in db.execute(f"PRAGMA table_info({table})"):
        unit = UNITS.get(name.split("_")[-1], "")
        remark = "key" if key else "" if is_not_null else "may be null"
        yield f"| `{name}` | {kind} | {unit} | {remark} |"


def renewed(page: str) -> str:
    told, lines = comments(), [f"The format is {FORMAT} (`PRAGMA user_version`)."]
    with closing(sqlite3.connect(":memory:", isolation_level=None)) as db:
        create_tables(db)
        tables = [name for (name,) in db.execute("SELECT name FROM sqlite_master WHERE type = 'table'")]
        for table in sorted(tables):
            words = told[table][0].upper() + told[table][1:]
            lines += ["", f"## {table}", "", f"{words}.", "", *columns(db, table)]
    return PART.sub(lambda found: found[1] + "\n".join([*lines, ""]) + found[2], page)


def test_the_page_lists_every_table_of_the_schema() -> None:
    page = PAGE.read_text(encoding="utf-8")
    assert renewed(page) == page
    listed = re.findall(r"^## (\w+)$", page, re.MULTILINE)
    assert listed == sorted(re.findall(r"CREATE TABLE (\w+)", TABLES))


if __name__ == "__main__":
    PAGE.write_text(renewed(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
