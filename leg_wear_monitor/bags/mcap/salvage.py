"""Sequential scan of a file whose index is missing or damaged, up to the last readable record."""

from typing import IO, Any

import attrs
import numpy as np
from mcap.records import Schema

from leg_wear_monitor.bags.budget import Budget
from leg_wear_monitor.bags.findings import DamageError
from leg_wear_monitor.bags.mcap import records
from leg_wear_monitor.bags.mcap.compression import expand, expand_part
from leg_wear_monitor.bags.mcap.layout import (
    HEAD,
    MAGIC,
    Layout,
    Segment,
    channels_of,
    chunk_head,
    definitions,
)
from leg_wear_monitor.bags.mcap.records import COUNTS, RECORD_HEAD
from leg_wear_monitor.messages.cdr import MESSAGE

_WINDOW = 2**20  # bytes scanned per step outside of chunks
_OF_A_SEGMENT = 400  # memory of one segment [bytes]
_LAST_OPCODE, _PRIVATE = 0x0F, 0x80
_MOST_DEFINITIONS = 4096
_ALL_IGNORED = np.full(2**16, records.IGNORED, np.uint8)


def by_scan(file: IO[bytes], size: int, budget: Budget) -> Layout:
    """Layout from the records; each chunk is decompressed to find its channels and actual log times.

    Parameters
    ----------
    file : seekable binary file
    size : int
        Size of the file [bytes].
    budget : Budget
    """
    scan = _Scan(file, size, budget)
    scan.run()
    layout = scan.layout
    layout.channels = channels_of(scan.definitions.values())
    layout.segments.sort(key=lambda segment: (segment.start_ns, segment.at))
    return layout


class _Scan:
    """State and results of a scan."""

    def __init__(self, file: IO[bytes], size: int, budget: Budget) -> None:
        self.file, self.size, self.at = file, size, len(MAGIC)
        self.budget = budget
        self.layout = Layout([], {})
        self.definitions: dict[tuple[type, int], Any] = {}  # chunks may repeat them
        self.defined = 0  # bytes

    def run(self) -> None:
        """Read record by record until the data section ends or the records become unreadable."""
        while True:
            self.file.seek(self.at)
            head = self.file.read(RECORD_HEAD)
            if len(head) < RECORD_HEAD:
                self._ends_early(len(head))
                return
            opcode, length = HEAD.unpack(head)
            if opcode == records.DATA_END and length == 4:
                self.layout.data_end = self.at
                self.layout.data_crc = int.from_bytes(self.file.read(4), "little")
                return
            if not 0 < opcode <= _LAST_OPCODE and opcode < _PRIVATE:
                self._lost("has no MCAP record")
                return
            if not self._step(opcode, length):
                return

    def _step(self, opcode: int, length: int) -> bool:
        """Process one record, or several messages outside of chunks; False ends the scan."""
        end = self.at + RECORD_HEAD + length
        if opcode == records.CHUNK:
            try:
                segment = chunk_head(self.file, self.at, self.size)
            except DamageError as error:
                self._lost(str(error))
                return False
            self._take(segment)
            if segment.cut:
                self._ends_early(self.size - self.at)
                return False
        elif end > self.size:
            self._ends_early(self.size - self.at)
            return False
        elif opcode in (records.SCHEMA, records.CHANNEL, records.MESSAGE_RECORD):
            try:
                self.budget.check(end - self.at)
                end = self._outside(end)
            except DamageError as error:
                self.layout.losses.append(f"record at byte {self.at} {error}: it is lost")
        self.at = end
        if len(self.layout.segments) * _OF_A_SEGMENT > self.budget.at_once:
            self._lost(f"is behind {len(self.layout.segments)} chunks, more than --memory-mb allows")
            return False
        return True

    def _outside(self, end: int) -> int:
        """Process the messages outside of chunks at this offset; return the offset of their end."""
        window = min(max(end - self.at, _WINDOW), self.size - self.at)
        self._take(Segment(self.at, self.at, window, window))
        return self.at + self.layout.segments[-1].stored

    def _take(self, segment: Segment) -> None:
        """Add a segment with its actual log times, and the definitions it contains."""
        try:
            data = content(self.file, segment, self.budget)
        except DamageError:
            self.layout.segments.append(segment)  # the reader reports the damage
            return
        counts, positions = np.zeros(1, COUNTS), np.zeros(_MOST_DEFINITIONS, np.int64)
        records.walk(np.frombuffer(data, np.uint8), _ALL_IGNORED, np.zeros(0, MESSAGE), positions, counts)
        self._define(data, positions[: int(counts["definitions"][0])].tolist())
        if counts["last_log_time_ns"][0] >= 0:
            first, last = int(counts["first_log_time_ns"][0]), int(counts["last_log_time_ns"][0])
            segment = attrs.evolve(segment, start_ns=first, end_ns=last)
        if segment.data_at == segment.at:
            read = int(counts["read"][0])
            segment = attrs.evolve(segment, stored=read, size=read)
        self.layout.segments.append(segment)

    def _define(self, data: bytes, positions: list[int]) -> None:
        """Store schemas and channels, the last of each number, while memory permits."""
        for record in definitions(data, positions):
            self.defined += len(record.data) if isinstance(record, Schema) else len(record.topic)
            if self.defined <= self.budget.at_once // 4:
                self.definitions[type(record), record.id] = record

    def _ends_early(self, rest: int) -> None:
        self.layout.losses.append(
            f"ends at byte {self.size} without its closing records, in a part of {rest} bytes: the recording "
            "was cut off, and what came after is lost"
        )

    def _lost(self, why: str) -> None:
        self.layout.losses.append(
            f"byte {self.at} {why}: it and the {self.size - self.at} bytes from there on are lost"
        )


def content(file: IO[bytes], segment: Segment, budget: Budget) -> bytes:
    """Records of a segment, without verification of its checksum; the readable part of a truncated one.

    Raises
    ------
    DamageError
        If the segment is damaged, or needs more memory than is left in the budget.
    """
    budget.check(segment.size + (segment.stored if segment.data_at != segment.at else 0))
    file.seek(segment.data_at)
    data = file.read(segment.stored)
    if segment.cut:
        return expand_part(data, segment.compression, segment.size)
    return expand(data, segment.compression, segment.size)
