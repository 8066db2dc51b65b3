"""One .db3 file of rosbag2, read through rosbags: its topics, and their messages piece by piece."""

import sqlite3
from collections.abc import Iterator
from contextlib import ExitStack
from itertools import islice
from pathlib import Path
from typing import Any

import apsw
import numpy as np
from rosbags.rosbag2 import Reader
from rosbags.rosbag2.errors import ReaderError

from leg_wear_monitor.recording.cdr import MESSAGE
from leg_wear_monitor.recording.findings import Finding, RecordingError, Weight
from leg_wear_monitor.recording.layout import Channel
from leg_wear_monitor.recording.mcap_file import Piece

_Row = tuple[Any, int, bytes]

_TOGETHER = 4096
_NO_CHECKSUMS = "has no checksums, as no .db3 has: a damaged number would not be seen"
_UNREADABLE = (ReaderError, apsw.Error, sqlite3.Error, UnicodeDecodeError, ValueError, KeyError, TypeError)


class SqliteFile:
    """A .db3 file, open; what is wrong with it is in `findings`.

    Parameters
    ----------
    path : pathlib.Path
        Name for messages.
    file : pathlib.Path
        What is opened.
    stack : contextlib.ExitStack
        Closes it.

    Raises
    ------
    RecordingError
        If it is no such file.
    """

    def __init__(self, path: Path, file: Path, stack: ExitStack) -> None:
        self.path = path
        self.findings: list[Finding] = []
        self.size = file.stat().st_size
        self._reader = Reader(file)
        try:
            self._reader.open()
        except _UNREADABLE as error:
            raise RecordingError(str(path), "", f"is no readable .db3 file: {_one_line(error)}") from error
        stack.callback(self._reader.close)
        self._connections = {connection.id: connection for connection in self._reader.connections}
        self.channels = {number: _channel(each) for number, each in self._connections.items()}

    def pieces(self, types: dict[int, int]) -> Iterator[Piece]:
        """Messages of the channels asked for, as far as they can be read.

        Parameters
        ----------
        types : dict
            Codes of `cdr.TYPES` by number of the channel.
        """
        wanted = [self._connections[number] for number in types]
        expected, found = sum(connection.msgcount for connection in wanted), 0
        messages = self._reader.messages(wanted)
        while together := self._next(messages):
            sound = [row for row in together if _is_message(row[1], row[2])]
            found += len(sound)
            if sound:
                yield _piece(sound, types, self.size * len(together) // max(expected, 1))
        self.findings.append(Finding(self.path, _NO_CHECKSUMS, Weight.NOTE))
        if found != expected:
            text = f"{found} messages could be read of the {expected} that it counts"
            self.findings.append(Finding(self.path, text))

    def _next(self, messages: Iterator[_Row]) -> list[_Row]:
        """The next rows, as far as they can be read."""
        rows: list[_Row] = []
        try:
            for row in islice(messages, _TOGETHER):
                rows.append(row)  # what came before an error is kept
        except _UNREADABLE as error:
            self.findings.append(Finding(self.path, f"breaks off: {_one_line(error)}"))
        return rows


def _is_message(time: object, raw: object) -> bool:
    """Whether a row holds what it should: SQLite lets a damaged one hold anything."""
    return isinstance(time, int) and isinstance(raw, bytes) and abs(time) < 2**63


def _piece(together: list[_Row], types: dict[int, int], stored: int) -> Piece:
    ends = np.cumsum([len(raw) for _, _, raw in together])
    messages = np.zeros(len(together), MESSAGE)
    messages["end"] = ends
    messages["begin"][1:] = ends[:-1]
    messages["log_time_ns"] = messages["publish_time_ns"] = [time for _, time, _ in together]
    messages["type"] = [types[connection.id] for connection, _, _ in together]
    data = np.frombuffer(b"".join(raw for _, _, raw in together), np.uint8)
    return Piece(int(messages["log_time_ns"].min()), data, messages, stored)


def _channel(connection: Any) -> Channel:
    encoding = connection.ext.serialization_format
    return Channel(connection.topic, connection.msgtype, encoding, connection.msgdef.data, "ros2msg")


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split()) or type(error).__name__
