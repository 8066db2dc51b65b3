"""Recordings in SQLite (.db3), read by rosbags."""

import errno
import sqlite3
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import apsw
import numpy as np
from rosbags.rosbag2 import Reader, ReaderError

from leg_wear_monitor.errors import one_line
from leg_wear_monitor.recordings.cdr import MESSAGE
from leg_wear_monitor.recordings.findings import MOST_BYTES, Channel, Due, Finding, Piece, RecordingError

_JOURNALS = ("-wal", "-journal")  # endings of the files of transactions that were not written back
_UNREADABLE = (ReaderError, apsw.Error, sqlite3.Error, ValueError, KeyError, TypeError, MemoryError)
_TOGETHER = 4096  # messages of a piece


class DatabaseFile:
    """An open .db3 file; its faults are listed in `findings`.

    Parameters
    ----------
    path : pathlib.Path
        Nothing is written to it.
    stack : contextlib.ExitStack
        Closes the file.

    Raises
    ------
    RecordingError
        If the file is not a rosbag2 database.
    OSError
        If the system cannot read it.
    """

    def __init__(self, path: Path, stack: ExitStack) -> None:
        self.path, self.size = path, path.stat().st_size
        self.findings: list[Finding] = []
        try:
            self._reader: Any = stack.enter_context(Reader(path))
        except apsw.IOError as error:
            raise OSError(errno.EIO, str(error)) from error
        except _UNREADABLE as error:
            cause = error.__cause__ or (None if isinstance(error, ReaderError) else error)
            why = one_line(cause) if cause else "it has no tables of a recording"
            raise RecordingError(str(path), "", f"is not a readable .db3 file: {why}") from error
        for journal in (path.with_name(path.name + end) for end in _JOURNALS):
            if journal.exists() and journal.stat().st_size:
                remedy = f'Run: sqlite3 {path.name} "PRAGMA wal_checkpoint"'
                self.findings.append(Finding(path, f"was not closed: {journal.name} is not read. {remedy}"))
        self._connections = {one.id: one for one in self._reader.connections}
        self.channels = {
            number: Channel(one.topic, one.msgtype, getattr(one.ext, "serialization_format", ""))
            for number, one in self._connections.items()
        }

    def pieces(self, types: dict[int, int]) -> Iterator[Due]:
        """Pieces of the requested channels; unreadable messages are skipped.

        Parameters
        ----------
        types : dict
            Stream code by channel number.
        """
        chosen = [self._connections[number] for number in types]
        expected, read = sum(one.msgcount for one in chosen), 0
        rows: list[tuple[int, int, bytes]] = []
        room = most = MOST_BYTES // 4
        try:
            for one, time_ns, raw in self._reader.messages(chosen) if chosen else ():
                if not isinstance(time_ns, int) or not isinstance(raw, bytes) or len(raw) > most:
                    continue
                rows.append((time_ns, types[one.id], raw))
                read, room = read + 1, room - len(raw)
                if len(rows) == _TOGETHER or room < 0:
                    yield self._due(rows, expected)
                    rows, room = [], most
        except apsw.IOError as error:
            raise OSError(errno.EIO, str(error)) from error
        except _UNREADABLE as error:
            self.findings.append(Finding(self.path, f"ends early: {one_line(error)}"))
        if rows:
            yield self._due(rows, expected)
        if read != expected:
            text = f"{read} messages could be read of the {expected} that it counts"
            self.findings.append(Finding(self.path, text))

    def _due(self, rows: list[tuple[int, int, bytes]], expected: int) -> Due:
        """Messages with log time, stream code and content."""
        messages = np.zeros(len(rows), MESSAGE)
        messages["log_time_ns"], messages["type"] = [row[0] for row in rows], [row[1] for row in rows]
        messages["end"] = np.cumsum([len(row[2]) for row in rows])
        messages["begin"][1:] = messages["end"][:-1]
        data = np.frombuffer(b"".join(row[2] for row in rows), np.uint8)
        piece = Piece(rows[0][0], data, messages, self.size * len(rows) // max(expected, 1))
        return piece.start_ns, lambda: piece
