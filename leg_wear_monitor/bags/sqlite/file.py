"""Reader of one rosbag2 .db3 file: its topics, and its messages in pieces ordered by log time."""

import sqlite3
from collections import deque
from collections.abc import Iterator
from contextlib import ExitStack
from functools import partial
from pathlib import Path

import numpy as np

from leg_wear_monitor.bags.budget import Budget
from leg_wear_monitor.bags.findings import DamageError, Finding, RecordingError, Severity
from leg_wear_monitor.bags.mcap.file import Due, Piece
from leg_wear_monitor.bags.mcap.layout import Channel
from leg_wear_monitor.bags.sqlite.database import UNREADABLE, allow_rows, one_line, open_database
from leg_wear_monitor.messages.cdr import MESSAGE

_Row = tuple[int, int, int]  # id, time, topic
_TOGETHER = 4096
_MOST_TOPICS = 65536
_OF_A_ROW, _OF_A_CHARACTER = 1000, 16  # memory of a topic or definition, with its copies and escapes [bytes]
_NO_CHECKSUMS = "has no checksums, like all .db3 files: a damaged number would not be detected"


class SqliteFile:
    """An open .db3 file; its faults are listed in `findings`.

    Parameters
    ----------
    path : pathlib.Path
        Name of the file in findings and errors.
    file : pathlib.Path
        File that is opened; nothing is written to it.
    budget : Budget
    stack : contextlib.ExitStack
        Closes the file.

    Raises
    ------
    RecordingError
        If the file is not a rosbag2 database.
    """

    def __init__(self, path: Path, file: Path, budget: Budget, stack: ExitStack) -> None:
        self.path, self.budget = path, budget
        self.findings: list[Finding] = [Finding(path, _NO_CHECKSUMS, Severity.NOTE)]
        self._database, notes = open_database(path, file, budget, stack)
        self.findings += [Finding(path, note, Severity.NOTE) for note in notes]
        try:
            self.size = file.stat().st_size
            self.channels = _channels(self._database, budget)
            allow_rows(self._database, budget)
            self._counts = _counts(self._database)
        except DamageError as error:
            raise RecordingError(str(path), "", str(error)) from error
        except (*UNREADABLE, OSError) as error:
            raise RecordingError(str(path), "", f"is not a readable .db3 file: {one_line(error)}") from error
        self._found = 0
        self._report_unknown()

    def pieces(self, types: dict[int, int]) -> Iterator[Due]:
        """Pieces of the requested channels; unreadable messages are skipped.

        Parameters
        ----------
        types : dict
            Stream code by channel number.
        """
        expected = sum(self._counts.get(number, 0) for number in types)
        for rows in self._pages(types):
            while rows:
                yield Due(rows[0][1], partial(self._piece, rows, types, self.size // max(expected, 1)))
        if self._found != expected:
            text = f"{self._found} messages could be read of the {expected} that it counts"
            self.findings.append(Finding(self.path, text))

    def _pages(self, types: dict[int, int]) -> Iterator[deque[_Row]]:
        """Message rows without content, in order of log time, many at a time."""
        if not types:
            return
        places = ", ".join("?" * len(types))
        try:
            cursor = self._database.execute(
                f"SELECT id, timestamp, topic_id FROM messages WHERE topic_id IN ({places}) "
                "AND typeof(timestamp) = 'integer' AND typeof(data) = 'blob' ORDER BY timestamp, id",
                list(types),
            )
            while rows := cursor.fetchmany(_TOGETHER):
                yield deque(rows)
        except UNREADABLE as error:
            self.findings.append(Finding(self.path, f"ends early: {one_line(error)}"))

    def _piece(self, rows: deque[_Row], types: dict[int, int], stored: int) -> Piece:
        """Read the messages of the next rows, as memory permits; these rows are removed from `rows`."""
        contents: list[bytes] = []
        kept: list[_Row] = []
        start_ns, room, number = rows[0][1], self.budget.at_once // 4, len(rows)
        while rows and room > 0:
            row = rows.popleft()
            content = self._content(row[0])
            if content is not None:
                contents.append(content)
                kept.append(row)
                room -= len(content)
        self._found += len(kept)
        messages = np.zeros(len(kept), MESSAGE)
        messages["end"] = np.cumsum([len(content) for content in contents])
        messages["begin"][1:] = messages["end"][:-1]
        messages["log_time_ns"] = messages["publish_time_ns"] = [time for _, time, _ in kept]
        messages["type"] = [types[topic] for _, _, topic in kept]
        data = np.frombuffer(b"".join(contents), np.uint8)
        return Piece(start_ns, data, messages, stored * (number - len(rows)))

    def _content(self, number: int) -> bytes | None:
        """Content of one message; None if it is unreadable or too large."""
        try:
            row = self._database.execute(
                "SELECT data FROM messages WHERE id = ? AND length(data) <= ?",
                (number, self.budget.at_once // 8),
            ).fetchone()
        except UNREADABLE:
            return None  # counted as unreadable
        return row[0] if row and isinstance(row[0], bytes) else None

    def _report_unknown(self) -> None:
        """Report the number of messages that belong to no listed topic."""
        count = sum(count for topic, count in self._counts.items() if topic not in self.channels)
        if count:
            text = f"contains {count} messages of topics that it does not list: they are lost"
            self.findings.append(Finding(self.path, text))


def _counts(database: sqlite3.Connection) -> dict[int | None, int]:
    """Number of messages by topic number; None where that is no integer.

    Raises
    ------
    DamageError
        If there are more topics than anybody has.
    """
    number = "CASE WHEN typeof(topic_id) = 'integer' THEN topic_id END"
    query = f"SELECT {number}, COUNT(*) FROM messages NOT INDEXED GROUP BY 1 LIMIT ?"
    counts = dict(database.execute(query, (_MOST_TOPICS + 1,)).fetchall())
    if len(counts) > _MOST_TOPICS:
        raise DamageError(f"has messages of more than {_MOST_TOPICS} topics")
    return counts


def _channels(database: sqlite3.Connection, budget: Budget) -> dict[int, Channel]:
    """Channels by topic number, with the definitions of their types if the file has them.

    Raises
    ------
    DamageError
        If their texts do not fit into memory.
    """
    texts: dict[str, tuple[str, str]] = {}
    query = "SELECT 1 FROM sqlite_master WHERE type = 'table' AND name = 'message_definitions'"
    size = 0

    def rows(query: str) -> Iterator[tuple[object, ...]]:
        nonlocal size
        for row in database.execute(f"{query} LIMIT ?", (_MOST_TOPICS + 1,)):
            size += _OF_A_ROW + _OF_A_CHARACTER * sum(
                len(text) for text in row if isinstance(text, str | bytes)
            )
            budget.check(size)
            yield row

    if database.execute(query).fetchone():
        query = "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions"
        for name, encoding, text in rows(query):
            texts[str(name)] = str(encoding), str(text)
    channels = {}
    for number, name, kind, encoding in rows("SELECT id, name, type, serialization_format FROM topics"):
        definition_encoding, text = texts.get(str(kind), ("ros2msg", ""))
        if isinstance(number, int):
            channels[number] = Channel(str(name), str(kind), str(encoding), text, definition_encoding)
    if len(channels) > _MOST_TOPICS:
        raise DamageError(f"has more than {_MOST_TOPICS} topics")
    return channels
