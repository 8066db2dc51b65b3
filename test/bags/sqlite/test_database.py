"""A .db3 file with all that was committed to it, whatever it is called and however it was left."""

import shutil
import sqlite3
from contextlib import closing
from functools import partial
from pathlib import Path

import pytest
from recordings import losses

from leg_wear_monitor.bags import sqlite
from leg_wear_monitor.bags.findings import RecordingError


@pytest.fixture(scope="module")
def sent(traffic):
    return traffic(0.5)


@pytest.fixture
def path(tmp_path, sent, write_database):
    """A closed database."""
    return Path(shutil.copy(write_database(tmp_path / "bag", sent), tmp_path / "x.db3"))


@pytest.mark.parametrize("name", ["a.db3", "a%41.db3", "a?mode=rwc.db3", "a#b.db3", "a b&c.db3"])
def test_rows_that_wait_in_a_wal_are_read(tmp_path, path, sent, expected, read, name):
    """As a recorder leaves them that was killed; what lies there is not touched."""
    home = tmp_path / "left"
    home.mkdir()
    with closing(sqlite3.connect(path, isolation_level=None)) as database:
        rows = database.execute("SELECT * FROM messages WHERE id > 20").fetchall()
        database.execute("DELETE FROM messages WHERE id > 20")
        database.execute("PRAGMA journal_mode = wal")
        database.executemany("INSERT INTO messages VALUES (?, ?, ?, ?)", rows)
        for end in ("", "-wal"):
            shutil.copy(f"{path}{end}", home / f"{name}{end}")
    before = {file.name: file.read_bytes() for file in home.iterdir()}
    samples, recording = read(home / name)
    assert samples.tobytes() == expected(sent).tobytes()
    assert not losses(recording)
    assert any(f"{name}-wal" in finding.text for finding in recording.findings)
    assert {file.name: file.read_bytes() for file in home.iterdir()} == before


def test_rows_that_only_a_wal_has_are_no_more_work_than_its_size_explains(
    tmp_path, path, sent, expected, read, monkeypatch
):
    """Seen before: the work that was allowed was that of the database alone, which is nearly empty here."""
    monkeypatch.setattr(sqlite, "_LEAST_INSTRUCTIONS", 0)
    monkeypatch.setattr(sqlite, "_INSTRUCTIONS_PER_BYTE", 0.05)
    monkeypatch.setattr(sqlite, "_INSTRUCTIONS_PER_CHECK", 1)
    left = tmp_path / "left.db3"
    with closing(sqlite3.connect(path, isolation_level=None)) as database:
        rows = database.execute("SELECT * FROM messages").fetchall()
        database.execute("DELETE FROM messages")
        database.execute("VACUUM")
        database.execute("PRAGMA journal_mode = wal")
        database.executemany("INSERT INTO messages VALUES (?, ?, ?, ?)", rows)
        for end in ("", "-wal"):
            shutil.copy(f"{path}{end}", f"{left}{end}")
    samples, recording = read(left)
    assert samples.tobytes() == expected(sent).tobytes()
    assert not losses(recording)


def test_what_was_not_committed_is_rolled_back(tmp_path, path, sent, expected, read):
    with closing(sqlite3.connect(path, isolation_level=None)) as database:
        database.execute("PRAGMA cache_size = 1")
        database.execute("BEGIN")
        database.execute("UPDATE messages SET data = zeroblob(length(data))")
        left = tmp_path / "left.db3"
        for end in ("", "-journal"):
            shutil.copy(f"{path}{end}", f"{left}{end}")
    assert left.read_bytes() != path.read_bytes()
    samples, recording = read(left)
    assert samples.tobytes() == expected(sent).tobytes()
    assert not losses(recording)


@pytest.mark.parametrize("name", ["a%41.db3", "a?mode=rwc.db3", "a#b.db3"])
def test_a_name_is_a_name(path, sent, expected, read, name):
    samples, _ = read(path.rename(path.with_name(name)))
    assert samples.tobytes() == expected(sent).tobytes()
    assert sorted(file.name for file in path.parent.iterdir()) == sorted([name, "bag"])


def test_messages_of_no_topic_are_reported(path, read):
    with closing(sqlite3.connect(path)) as database, database:
        database.execute("UPDATE messages SET topic_id = 77 WHERE id % 2 = 0")
        (count,) = database.execute("SELECT COUNT(*) FROM messages WHERE topic_id = 77").fetchone()
    _, recording = read(path)
    assert losses(recording) == [f"contains {count} messages of topics that it does not list: they are lost"]


_ENDLESS = (
    "AS WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) "
    "SELECT i AS id, 1 AS topic_id, i AS timestamp, x'00' AS data FROM n"
)
# a table without a text is passed over, and beside an index of its name it is no error
_BESIDE = f"""
ALTER TABLE messages RENAME TO hidden; CREATE VIEW seen {_ENDLESS}; CREATE INDEX i ON hidden(id);
PRAGMA writable_schema = ON;
INSERT INTO sqlite_master VALUES ('table', 'messages', 'messages', 3, '');
UPDATE sqlite_master SET name = 'MESSAGES', tbl_name = 'MESSAGES',
    sql = 'CREATE VIEW MESSAGES {_ENDLESS.replace(chr(39), 2 * chr(39))}' WHERE name = 'seen';
UPDATE sqlite_master SET name = 'messages', sql = 'CREATE INDEX messages ON hidden(id)' WHERE name = 'i'
"""
_NUMBERS = "WITH RECURSIVE n(i) AS (SELECT 10 UNION ALL SELECT i + 1 FROM n WHERE i < {}) "


@pytest.mark.parametrize(
    ("statements", "fault"),
    [
        (
            f"ALTER TABLE messages RENAME TO hidden; CREATE VIEW messages {_ENDLESS}",
            "it has no table messages, or not a plain one",
        ),
        (_BESIDE, "it has no table messages, or not a plain one"),
        ("ALTER TABLE messages RENAME COLUMN data TO stuff", r"is not a readable \.db3 file: its"),
        ("DROP TABLE topics", "it has no table topics, or not a plain one"),
        (
            "DROP TABLE topics; CREATE VIRTUAL TABLE topics USING fts5(id, name, type)",
            "no table topics, or not a plain one",
        ),
        ("UPDATE topics SET name = hex(zeroblob(20000000))", "too big"),
        (
            f"{_NUMBERS.format(30000)} INSERT INTO topics "
            "SELECT i, hex(zeroblob(1000)), 't', 'cdr', '', '' FROM n",
            "needs [0-9]+ MB to be read",
        ),
        (
            f"{_NUMBERS.format(66000)} INSERT INTO messages SELECT i + 100000, i, i, x'' FROM n",
            "has messages of more than 65536 topics",
        ),
        (f"CREATE TABLE wide ({', '.join(f'c{k}' for k in range(100))})", "too many columns"),
    ],
    ids=[
        "a view without end",
        "a view beside a table",
        "a column less",
        "a table less",
        "a virtual table",
        "a name",
        "names",
        "topic numbers",
        "a wide table",
    ],
)
def test_a_hostile_schema_is_one_line(path, read, statements, fault):
    with closing(sqlite3.connect(path)) as database, database:
        database.executescript(statements)
    with pytest.raises(RecordingError, match=fault) as caught:
        read(path)
    assert str(caught.value).isprintable()


def test_a_tree_whose_branches_meet_again_ends(path, read):
    """All branches lead to one: a few pages with more rows than anybody can count."""
    with closing(sqlite3.connect(path)) as database, database:
        database.execute("PRAGMA page_size = 512")
        database.execute("VACUUM")
        rows = [(k + 10**6, 1, k, b"x" * 300) for k in range(20000)]
        database.executemany("INSERT INTO messages VALUES (?, ?, ?, ?)", rows)
        database.commit()
        (root,) = database.execute("SELECT rootpage FROM sqlite_master WHERE name = 'messages'").fetchone()
    content = bytearray(path.read_bytes())
    size = int.from_bytes(content[16:18], "big")

    def branches(page):
        """Places of the pointers of a page; none of a leaf's."""
        begin = (page - 1) * size
        if content[begin] != 5:
            return []
        cells = [begin + 12 + 2 * k for k in range(int.from_bytes(content[begin + 3 : begin + 5], "big"))]
        return [begin + int.from_bytes(content[cell : cell + 2], "big") for cell in cells] + [begin + 8]

    page = root
    while places := branches(page):
        below = content[places[-2] : places[-2] + 4]
        for place in places:
            content[place : place + 4] = below
        page = int.from_bytes(below, "big")
    path.write_bytes(content)
    try:
        assert losses(read(path)[1])
    except RecordingError as error:
        assert "reading it takes more work than its size explains" in str(error)


def test_without_an_index_of_time_the_order_is_the_same(path, sent, expected, read):
    with closing(sqlite3.connect(path)) as database, database:
        query = "SELECT name FROM sqlite_master WHERE sql LIKE 'CREATE INDEX%'"
        for (name,) in database.execute(query).fetchall():
            database.execute(f"DROP INDEX {name}")
    samples, _ = read(path)
    assert samples.tobytes() == expected(sent).tobytes()


def test_a_complaint_that_is_no_text_is_one(path, read):
    """SQLite repeats what it cannot understand, byte by byte."""
    content = path.read_bytes()
    assert b"CREATE TABLE messages(" in content
    path.write_bytes(content.replace(b"CREATE TABLE messages(", b"CR\x89ATE TABLE messages("))
    with pytest.raises(RecordingError, match=r"x\.db3: is not a readable \.db3 file: ") as caught:
        read(path)
    assert str(caught.value).isprintable()


@pytest.mark.parametrize(
    "query", ["SELECT name", "SELECT CASE", "SELECT id, timestamp", "SELECT data"], ids=lambda text: text[7:]
)
def test_what_the_system_cannot_read_is_no_damage(path, read, monkeypatch, query):
    """As of other files: neither is the rest taken for the whole, nor does a fleet report it as damaged."""

    class OnBadDisk(sqlite3.Connection):
        def execute(self, text, *values):
            if text.startswith(query):
                error = sqlite3.OperationalError("disk I/O error")
                error.sqlite_errorcode = sqlite3.SQLITE_IOERR_READ
                raise error
            return super().execute(text, *values)

    monkeypatch.setattr(sqlite3, "connect", partial(sqlite3.connect, factory=OnBadDisk))
    with pytest.raises(RecordingError, match=r"x\.db3: cannot be read: disk I/O error$") as caught:
        read(path)
    assert caught.value.is_passing
