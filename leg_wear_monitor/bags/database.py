"""Recordings in SQLite (.db3), read by rosbags."""

import errno
import shutil
import sqlite3
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, closing
from pathlib import Path
from typing import Any

import apsw
import numpy as np
from rosbags.interfaces import MessageDefinitionFormat
from rosbags.rosbag2 import Reader, ReaderError

from leg_wear_monitor.bags.budget import Budget
from leg_wear_monitor.bags.findings import Finding, RecordingError, Severity, open_regular
from leg_wear_monitor.bags.piece import Channel, Due, Piece
from leg_wear_monitor.messages.cdr import MESSAGE

_JOURNALS = ("-wal", "-journal")  # endings of the files of transactions that were not written back
_UNREADABLE = (ReaderError, apsw.Error, sqlite3.Error, ValueError, KeyError, TypeError, MemoryError)
_TOGETHER = 4096  # messages of a piece
_NO_CHECKSUMS = "has no checksums, like all .db3 files: a damaged number would not be detected"
_ENCODINGS = {MessageDefinitionFormat.MSG: "ros2msg", MessageDefinitionFormat.IDL: "ros2idl"}


class DatabaseFile:
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
    OSError
        If the system cannot read it.
    """

    def __init__(self, path: Path, file: Path, budget: Budget, stack: ExitStack) -> None:
        self.path, self._budget = path, budget
        self.findings = [Finding(path, _NO_CHECKSUMS, Severity.NOTE)]
        journals = [each for end in _JOURNALS if _size(each := file.with_name(file.name + end))]
        self.size = sum(map(_size, (file, *journals)))
        try:
            open_regular(file).close()  # SQLite does not say why it cannot open a file
            self._reader: Any = stack.enter_context(Reader(_prepared(file, journals, budget, stack)))
        except apsw.IOError as error:
            raise OSError(errno.EIO, str(error)) from error
        except _UNREADABLE as error:
            # the message of rosbags names the link, its cause does not
            cause = error.__cause__ or (None if isinstance(error, ReaderError) else error)
            why = _one_line(cause) if cause else "it has no tables of a recording"
            fault = f"is not a readable .db3 file: {why}"
            raise RecordingError(str(path), "", fault) from error
        if journals:
            names = " and ".join(each.name for each in journals)
            text = f"was not closed: the content of {names} beside it is read as well"
            self.findings.append(Finding(path, text, Severity.NOTE))
        self._connections = {one.id: one for one in self._reader.connections}
        self.channels = {
            number: Channel(
                one.topic,
                one.msgtype,
                getattr(one.ext, "serialization_format", ""),
                one.msgdef.data,
                _ENCODINGS.get(one.msgdef.format, ""),
            )
            for number, one in self._connections.items()
        }
        unlisted = self._reader.message_count - sum(one.msgcount for one in self._connections.values())
        if unlisted:
            text = f"contains {unlisted} messages of topics that it does not list: they are lost"
            self.findings.append(Finding(path, text))

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
        room = most = self._budget.part_limit // 4
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
            self.findings.append(Finding(self.path, f"ends early: {_one_line(error)}"))
        if rows:
            yield self._due(rows, expected)
        if read != expected:
            text = f"{read} messages could be read of the {expected} that it counts"
            self.findings.append(Finding(self.path, text))

    def _due(self, rows: list[tuple[int, int, bytes]], expected: int) -> Due:
        """Messages with log time, stream code and content."""
        messages = np.zeros(len(rows), MESSAGE)
        messages["log_time_ns"], messages["type"] = [row[0] for row in rows], [row[1] for row in rows]
        messages["publish_time_ns"] = messages["log_time_ns"]
        messages["end"] = np.cumsum([len(row[2]) for row in rows])
        messages["begin"][1:] = messages["end"][:-1]
        data = np.frombuffer(b"".join(row[2] for row in rows), np.uint8)
        piece = Piece(rows[0][0], data, messages, self.size * len(rows) // max(expected, 1))
        return Due(piece.start_ns, lambda: piece)


def _prepared(file: Path, journals: list[Path], budget: Budget, stack: ExitStack) -> Path:
    """A path for rosbags, which takes some names for options: a link to a database, or a copy of one.

    SQLite recovers a database with transactions beside it by writing, so the recovery takes place in a copy.
    """
    place = Path(stack.enter_context(tempfile.TemporaryDirectory())) / "content.db3"
    if not journals:
        place.symlink_to(file.absolute())
        return place
    budget.reserve(sum(map(_size, (file, *journals))))
    for each in (file, *journals):
        shutil.copyfile(each, place.with_name(place.name + each.name.removeprefix(file.name)))
    with closing(sqlite3.connect(place)) as database:
        database.execute("PRAGMA journal_mode = DELETE").fetchall()
    return place


def _size(file: Path) -> int:
    """Size of a file [bytes]; 0 if it does not exist."""
    try:
        return file.stat().st_size
    except FileNotFoundError:
        return 0


def _one_line(error: BaseException) -> str:
    return " ".join(str(error).split())[:200] or type(error).__name__
