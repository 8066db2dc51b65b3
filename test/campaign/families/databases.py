"""Databases with hostile schemas, trees of pages and texts: refused, reported, or as if whole."""

import sqlite3
from contextlib import closing
from pathlib import Path

import numpy as np

from campaign import recordings_stored
from campaign.case import Case
from campaign.recordings_damaged import Generator, compared

SHORT, LONG = 40, 1000

_ENDLESS = "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n)"
_ROWS = "SELECT i AS id, 1 AS topic_id, i AS timestamp, x'00' AS data"
_NUMBERS = "WITH RECURSIVE n(i) AS (SELECT 10 UNION ALL SELECT i + 1 FROM n WHERE i < {count})"
_VIEWS = (
    f"{_ENDLESS} {_ROWS} FROM n",
    "SELECT a.id, a.topic_id, a.timestamp, zeroblob(100000000) AS data FROM hidden a, hidden b, hidden c",
    "SELECT key AS id, 1 AS topic_id, value AS timestamp, x'00' AS data FROM json_each('[1, 2, 3]')",
    "SELECT * FROM hidden",
)
_STATEMENTS = (
    # an entry without a text is passed over beside an index of its name
    "ALTER TABLE {table} RENAME TO hidden; CREATE VIEW seen AS {view}; CREATE INDEX i ON hidden(id); "
    "PRAGMA writable_schema = ON; "
    "INSERT INTO sqlite_master VALUES ('table', '{table}', '{table}', {count} % 9, ''); "
    "UPDATE sqlite_master SET name = upper('{table}'), tbl_name = upper('{table}'), "
    "sql = replace(sql, 'VIEW seen', 'VIEW ' || upper('{table}')) WHERE name = 'seen'; "
    "UPDATE sqlite_master SET name = '{table}', sql = 'CREATE INDEX {table} ON hidden(id)' WHERE name = 'i'",
    "ALTER TABLE {table} RENAME TO hidden; CREATE VIEW {table} AS {view}",
    "DROP TABLE {table}; CREATE VIRTUAL TABLE {table} USING fts5(id, name, type, topic_id, timestamp, data)",
    "ALTER TABLE {table} ADD COLUMN more AS (hex(zeroblob(100000000)))",
    "PRAGMA writable_schema = ON; UPDATE sqlite_master SET sql = NULL WHERE name = '{table}'",
    "PRAGMA writable_schema = ON; UPDATE sqlite_master SET type = 'index' WHERE name = '{table}'",
    "PRAGMA writable_schema = ON; UPDATE sqlite_master SET rootpage = {count} % 20 WHERE name = '{table}'",
    "PRAGMA writable_schema = ON; UPDATE sqlite_master SET sql = sql || hex(zeroblob({count} * 100))",
    "PRAGMA writable_schema = ON; {numbers} INSERT INTO sqlite_master SELECT 'table', 't' || i, 't' || i, 2, "
    "'CREATE TABLE t' || i || '(a, b, c, d, e, f, g, h)' FROM n",
    "{numbers} INSERT INTO topics SELECT i, hex(zeroblob(2000)), 't', 'cdr', '', '' FROM n",
    "{numbers} INSERT INTO message_definitions SELECT i, 't' || i, hex(zeroblob(2000)), 'x', '' FROM n",
    "{numbers} INSERT INTO messages SELECT i + 100000, i, i, x'' FROM n",
    "UPDATE messages SET topic_id = hex(zeroblob(100000)) || id WHERE id % 3 = 0",
    "UPDATE topics SET type = hex(zeroblob({count} * 1000))",
    "CREATE TRIGGER x AFTER INSERT ON messages BEGIN SELECT 1; END",
    "CREATE VIEW harmless AS {view}",
    "VACUUM",
)


def warm() -> None:
    """Read one."""
    recordings_stored.expected()


def _tree(path: Path, rng: Generator) -> str:
    """Make branches of trees meet again."""
    with closing(sqlite3.connect(path, isolation_level=None)) as database:
        database.execute("PRAGMA page_size = 512")
        database.execute("VACUUM")
    content = bytearray(path.read_bytes())
    size = int.from_bytes(content[16:18], "big")
    branches = [at for at in range(size, len(content), size) if content[at] in (2, 5)]
    number = int(rng.integers(1, 5))
    for at in branches:
        cells = [
            int.from_bytes(content[at + 12 + 2 * k : at + 14 + 2 * k], "big") for k in range(content[at + 4])
        ]
        places = [at + 8, *(at + cell for cell in cells if cell < size - 4)]
        target = content[places[-1] : places[-1] + 4]
        for place in places[::number]:
            content[place : place + 4] = target
    path.write_bytes(content)
    return f"every {number}th branch of {len(branches)} pages leads to one page"


def case(seed: int) -> Case:
    """Of the statements in turn, with another table, view and number each time; then trees."""
    rng = np.random.default_rng(seed)
    kind = seed % (len(_STATEMENTS) + 2)
    choices = {
        "table": str(rng.choice(["topics", "messages", "message_definitions"])),
        "view": _VIEWS[int(rng.integers(len(_VIEWS)))],
        "count": int(rng.choice([11, 500, 20_000, 70_000])),
    }
    text = "" if kind >= len(_STATEMENTS) else _STATEMENTS[kind]
    text = text.replace("{numbers}", _NUMBERS).format(**choices)

    def prepare(directory: Path) -> None:
        path = directory / "x.db3"
        path.write_bytes(recordings_stored.stored()["db3"][1]["x.db3"])
        if not text:
            _tree(path, rng)
            return
        with closing(sqlite3.connect(path)) as database:
            database.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, 10**9)
            try:
                database.executescript(text)
            except sqlite3.Error:
                return  # what was done before stays

    return Case(
        description=text or "branches that meet again",
        prepare=prepare,
        run=lambda directory: compared(directory / "x.db3"),
        memory_mb=560.0,
    )
