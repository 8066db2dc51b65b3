"""Reader of one MCAP file: its topics, and its messages in pieces ordered by log time."""

import zlib
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import IO

import attrs
import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.bags.budget import Budget
from leg_wear_monitor.bags.findings import DamageError, Finding, RecordingError, Severity
from leg_wear_monitor.bags.mcap import records
from leg_wear_monitor.bags.mcap.compression import check
from leg_wear_monitor.bags.mcap.layout import MAGIC, Channel, Segment, by_index, chunk_head
from leg_wear_monitor.bags.mcap.records import COUNTS
from leg_wear_monitor.bags.mcap.salvage import by_scan, content
from leg_wear_monitor.messages.cdr import MESSAGE

_NO_POSITIONS = np.zeros(0, np.int64)
_NO_MESSAGES = np.zeros(0, MESSAGE)


_OF_A_MESSAGE = 400  # memory overhead of decoding one message into a sample [bytes]
_MOST_FINDINGS = 1000


@attrs.frozen(eq=False)
class Piece:
    """Messages that are read in one step.

    Attributes
    ----------
    start_ns : int
        Lower bound of the log times in this piece and all later pieces of the file [ns].
    data : (bytes,) array of uint8
    messages : (n,) array of MESSAGE
    stored : int
        Bytes that the piece occupies in the file.
    """

    start_ns: int
    data: NDArray[np.uint8]
    messages: NDArray[np.void]
    stored: int


@attrs.frozen(eq=False)
class Due:
    """A piece that is not loaded yet; a merge of many files thus holds few pieces in memory.

    Attributes
    ----------
    start_ns : int
        `Piece.start_ns` of the piece [ns].
    load : callable
        Returns the piece, or None if it is damaged. Call it before requesting the next piece.
    """

    start_ns: int
    load: Callable[[], Piece | None]


class McapFile:
    """An open MCAP file; its faults are listed in `findings`.

    Parameters
    ----------
    path : pathlib.Path
        Name of the file in findings and errors.
    file : binary file
        Seekable.
    budget : Budget

    Raises
    ------
    RecordingError
        If the file is empty or is not an MCAP file.
    """

    def __init__(self, path: Path, file: IO[bytes], budget: Budget) -> None:
        self.path, self.file, self.budget = path, file, budget
        self.size = file.seek(0, 2)
        self.findings: list[Finding] = []
        self.without_checksum = 0
        self._found = 0
        self._check_magic()
        indexed = by_index(file, self.size, budget)
        self.layout = indexed or by_scan(file, self.size, budget)
        self.is_indexed = indexed is not None
        for text in self.layout.losses:
            self._find(text)
        if not (self.is_indexed or self.layout.losses):
            self._find("has no index, or a damaged one: read from start to end", Severity.NOTE)
        self._check_data()

    @property
    def channels(self) -> dict[int, Channel]:
        """Channels of the file by channel number."""
        return self.layout.channels

    def pieces(self, types: dict[int, int]) -> Iterator[Due]:
        """Pieces of the requested channels, for lazy loading; damaged parts are skipped and become findings.

        Parameters
        ----------
        types : dict
            Stream code by channel number.
        """
        roles = np.zeros(2**16, np.uint8)
        roles[list(self.channels)] = records.IGNORED
        for number, code in types.items():
            roles[number] = code
        for segment in self.layout.segments:
            yield Due(segment.start_ns, partial(self._piece, segment, roles))
        self._account(types, self._found)

    def _piece(self, segment: Segment, roles: NDArray[np.uint8]) -> Piece | None:
        """Messages of a segment; None if it is damaged."""
        try:
            data = np.frombuffer(self._load(segment), np.uint8)
            messages = self._messages(segment, data, roles)
        except DamageError as error:
            self._find(f"chunk at byte {segment.at} {error}: its messages are lost")
            return None
        self._found += len(messages)
        return Piece(segment.start_ns, data, messages, segment.stored)

    def _load(self, segment: Segment) -> bytes:
        """Records of a segment, after verification of its checksum (if there is one)."""
        if segment.data_at == segment.at:
            self.without_checksum += 1
            return content(self.file, segment, self.budget)
        head = chunk_head(self.file, segment.at, self.size)
        if (head.data_at, head.stored, head.size, head.compression) != (
            segment.data_at,
            segment.stored,
            segment.size,
            segment.compression,
        ):
            raise DamageError("differs from the index")
        data = content(self.file, segment, self.budget)
        if not segment.cut:
            check(data, head.crc)
        self.without_checksum += not head.crc or segment.cut
        return data

    def _messages(
        self, segment: Segment, data: NDArray[np.uint8], roles: NDArray[np.uint8]
    ) -> NDArray[np.void]:
        counts = np.zeros(1, COUNTS)
        records.walk(data, roles, _NO_MESSAGES, _NO_POSITIONS, counts)
        wanted = int(counts["wanted"][0])
        self.budget.check(segment.stored + len(data) + _OF_A_MESSAGE * wanted)
        messages = np.zeros(wanted, MESSAGE)
        if len(messages):
            records.walk(data, roles, messages, _NO_POSITIONS, counts)
        rest = len(data) - int(counts["read"][0])
        if rest and not segment.cut:
            self._find(f"chunk at byte {segment.at} holds {rest} bytes that are not records: they are lost")
        for name, what in (
            ("unknown_channel", "messages without a channel"),
            ("foreign", "records of an unknown kind"),
        ):
            if counts[name][0]:
                self._find(f"chunk at byte {segment.at} holds {counts[name][0]} {what}: they are lost")
        return messages

    def _account(self, types: dict[int, int], found: int) -> None:
        """Report, after the last piece, how many messages are missing and what could not be checked."""
        counts = self.layout.counts
        expected = sum(counts.get(number, 0) for number in types) if counts is not None else found
        if expected != found:
            self._find(f"{found} messages could be read of the {expected} that it counts")
        if self.without_checksum and not self.layout.data_crc:
            self._find(
                f"has no checksum for {self.without_checksum} of {len(self.layout.segments)} chunks: "
                "a damaged number in them would not be detected",
                Severity.NOTE,
            )

    def _check_magic(self) -> None:
        self.file.seek(0)
        start = self.file.read(len(MAGIC))
        if not self.size:
            raise RecordingError(str(self.path), "", "is empty, expected an MCAP file")
        if start != MAGIC:
            raise RecordingError(
                str(self.path), "", f"begins with {start!r}, expected {MAGIC!r}: is not an MCAP file"
            )

    def _check_data(self) -> None:
        """Verify the checksum of the data section, if the file has one."""
        if not self.layout.data_crc:
            return
        self.file.seek(0)
        crc, left = 0, self.layout.data_end
        while left and (part := self.file.read(min(left, 2**20))):
            crc, left = zlib.crc32(part, crc), left - len(part)
        if crc != self.layout.data_crc:
            self._find("does not match the checksum of its data: a part of it is damaged")

    def _find(self, text: str, severity: Severity = Severity.LOSS) -> None:
        if len(self.findings) < _MOST_FINDINGS:
            self.findings.append(Finding(self.path, text, severity))
        elif len(self.findings) == _MOST_FINDINGS:
            self.findings.append(Finding(self.path, "has more findings that are not listed"))
