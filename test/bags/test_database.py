"""A .db3 file with all that was committed to it, whatever it is called and however it was left."""

import shutil
import sqlite3
from contextlib import closing
from pathlib import Path

import pytest
from recordings import losses

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
