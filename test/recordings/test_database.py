"""A .db3 file with all that was committed to it, whatever it is called and however it was left."""

import shutil
import sqlite3
from contextlib import closing
from pathlib import Path

import pytest
from made_recordings import losses

from leg_wear_monitor.recordings.findings import RecordingError


@pytest.fixture(scope="module")
def sent(traffic):
    return traffic(0.5)


@pytest.fixture
def path(tmp_path, sent, write_database):
    """A closed database."""
    return Path(shutil.copy(write_database(tmp_path / "bag", sent), tmp_path / "x.db3"))


def test_a_file_that_was_not_closed_is_a_loss_with_the_remedy(tmp_path, path, sent, read):
    """As a recorder leaves it that was killed."""
    with closing(sqlite3.connect(path, isolation_level=None)) as database:
        rows = database.execute("SELECT * FROM messages WHERE id > 20").fetchall()
        database.execute("DELETE FROM messages WHERE id > 20")
        database.execute("PRAGMA journal_mode = wal")
        database.executemany("INSERT INTO messages VALUES (?, ?, ?, ?)", rows)
        for end in ("", "-wal"):
            shutil.copy(f"{path}{end}", tmp_path / f"left.db3{end}")
    _, recording = read(tmp_path / "left.db3")
    (text,) = losses(recording)
    assert text == ('was not closed: left.db3-wal is not read. Run: sqlite3 left.db3 "PRAGMA wal_checkpoint"')


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
