"""Reading of MCAP files: by their index, or by a sequential scan if the index is missing or damaged."""

import zlib
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import IO, Any

import attrs
import numpy as np
from mcap.records import Schema
from numpy.typing import NDArray

from leg_wear_monitor.bags import mcap_layout
from leg_wear_monitor.bags.budget import Budget
from leg_wear_monitor.bags.findings import DamageError, Finding, RecordingError, Severity
from leg_wear_monitor.bags.piece import Channel, Due, Piece
from leg_wear_monitor.messages.cdr import MESSAGE

# The scan of a file without a usable index, from the first to the last readable record. Its result is a
# layout as an index gives one.


_WINDOW = 2**20  # bytes scanned per step outside of chunks
_BYTES_PER_SEGMENT = 400  # memory of one segment [bytes]
_LAST_STANDARD_OPCODE, _FIRST_PRIVATE_OPCODE = 0x0F, 0x80  # opcodes between them are not MCAP
_MOST_DEFINITIONS = 4096  # schemas and channels read from one segment
# role of each channel: a scan reads definitions and times only
_ALL_IGNORED = np.full(2**16, mcap_layout.IGNORED, np.int64)


def by_scan(file: IO[bytes], size: int, budget: Budget) -> mcap_layout.Layout:
    """Layout of a file by its records; each chunk is decompressed to find its channels and log times.

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
    layout.channels = mcap_layout.channels_of(scan.definitions.values())
    layout.segments.sort(key=lambda segment: (segment.start_ns, segment.at))
    return layout


class _Scan:
    """State and results of a scan."""

    def __init__(self, file: IO[bytes], size: int, budget: Budget) -> None:
        self.file, self.size, self.at = file, size, len(mcap_layout.MAGIC)
        self.budget = budget
        self.layout = mcap_layout.Layout([], {})
        self.definitions: dict[tuple[type, int], Any] = {}  # chunks may repeat them
        self.definition_bytes = 0

    def run(self) -> None:
        """Read record by record until the data section ends or the records become unreadable."""
        try:
            while self._step():
                pass
        except DamageError as error:
            text = f"byte {self.at} {error}: it and the {self.size - self.at} bytes from there on are lost"
            self.layout.losses.append(text)

    def _step(self) -> bool:
        """Process a record, or the messages outside of chunks from here on; False at the end of the data."""
        self.file.seek(self.at)
        head = self.file.read(mcap_layout.RECORD_HEAD)
        if len(head) < mcap_layout.RECORD_HEAD:
            return self._ends_early()
        opcode, length = mcap_layout.HEAD.unpack(head)
        end = self.at + mcap_layout.RECORD_HEAD + length
        if opcode == mcap_layout.DATA_END and length == 4:
            self.layout.data_end = self.at
            self.layout.data_crc = int.from_bytes(self.file.read(4), "little")
            return False
        if not 0 < opcode <= _LAST_STANDARD_OPCODE and opcode < _FIRST_PRIVATE_OPCODE:
            raise DamageError("has no MCAP record")
        if opcode == mcap_layout.CHUNK:
            segment = mcap_layout.chunk_head(self.file, self.at, self.size)
            self._add_segment(segment)
            if segment.cut:
                return self._ends_early()
        elif end > self.size:
            return self._ends_early()
        elif opcode in (mcap_layout.SCHEMA, mcap_layout.CHANNEL, mcap_layout.MESSAGE_RECORD):
            try:
                self.budget.check(end - self.at)
                end = self._add_messages(end)
            except DamageError as error:
                self.layout.losses.append(f"record at byte {self.at} {error}: it is lost")
        self.at = end
        if len(self.layout.segments) * _BYTES_PER_SEGMENT > self.budget.part_limit:
            raise DamageError(f"is behind {len(self.layout.segments)} chunks, more than --memory-mb allows")
        return True

    def _add_messages(self, end: int) -> int:
        """Add the messages outside of chunks from here on as one segment; return the offset of its end."""
        window = min(max(end - self.at, _WINDOW), self.size - self.at)
        self._add_segment(mcap_layout.Segment(self.at, self.at, window, window))
        return self.at + self.layout.segments[-1].stored

    def _add_segment(self, segment: mcap_layout.Segment) -> None:
        """Add a segment with the log times that it contains, and its definitions."""
        try:
            data = content(self.file, segment, self.budget)
        except DamageError:
            self.layout.segments.append(segment)  # the reader reports the damage
            return
        counts, positions = np.zeros(1, mcap_layout.COUNTS), np.zeros(_MOST_DEFINITIONS, np.int64)
        mcap_layout.walk(np.frombuffer(data, np.uint8), _ALL_IGNORED, np.zeros(0, MESSAGE), positions, counts)
        self._add_definitions(data, positions[: int(counts["definitions"][0])].tolist())
        if counts["last_log_time_ns"][0] >= 0:
            segment = attrs.evolve(segment, start_ns=int(counts["first_log_time_ns"][0]))
        if segment.data_at == segment.at:  # not a chunk: it ends with the last whole record
            read = int(counts["read"][0])
            segment = attrs.evolve(segment, stored=read, size=read)
        self.layout.segments.append(segment)

    def _add_definitions(self, data: bytes, positions: list[int]) -> None:
        """Store schemas and channels while memory permits; of each number, the last one."""
        for record in mcap_layout.definitions(data, positions):
            self.definition_bytes += len(record.data) if isinstance(record, Schema) else len(record.topic)
            if self.definition_bytes <= self.budget.part_limit // 4:
                self.definitions[type(record), record.id] = record

    def _ends_early(self) -> bool:
        """Report that the file was cut off; False."""
        rest = self.size - self.at
        self.layout.losses.append(
            f"ends at byte {self.size} without its closing records, in a part of {rest} bytes: the recording "
            "was cut off, and what came after is lost"
        )
        return False


def content(file: IO[bytes], segment: mcap_layout.Segment, budget: Budget) -> bytes:
    """Records of a segment, without verification of its checksum; the readable part of a truncated one.

    Raises
    ------
    DamageError
        If the segment is damaged, or needs more memory than is left in the budget.
    """
    budget.check(segment.size + (segment.stored if segment.data_at != segment.at else 0))
    file.seek(segment.data_at)
    return mcap_layout.expand(file.read(segment.stored), segment.compression, segment.size, segment.cut)


# The reader of one MCAP file: its topics, and its messages in pieces in order of log time.


_NO_POSITIONS = np.zeros(0, np.int64)
_NO_MESSAGES = np.zeros(0, MESSAGE)


_BYTES_PER_MESSAGE = 400  # memory overhead of decoding one message into a sample [bytes]
_MOST_FINDINGS = 1000  # of a file, so that damage everywhere does not fill the memory


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
        self._read = 0
        self._check_magic()
        indexed = mcap_layout.by_index(file, self.size, budget)
        self.layout = indexed or by_scan(file, self.size, budget)
        for text in self.layout.losses:
            self._add_finding(text)
        if indexed is None and not self.layout.losses:
            self._add_finding("has no index, or a damaged one: read from start to end", Severity.NOTE)
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
        roles = np.zeros(2**16, np.int64)
        roles[list(self.channels)] = mcap_layout.IGNORED
        for number, code in types.items():
            roles[number] = code
        for segment in self.layout.segments:
            yield Due(segment.start_ns, partial(self._piece, segment, roles))
        self._report_missing(types, self._read)

    def _piece(self, segment: mcap_layout.Segment, roles: NDArray[np.int64]) -> Piece | None:
        """Messages of a segment; None if it is damaged."""
        try:
            data = np.frombuffer(self._verified_content(segment), np.uint8)
            messages = self._messages(segment, data, roles)
        except DamageError as error:
            self._add_finding(f"chunk at byte {segment.at} {error}: its messages are lost")
            return None
        self._read += len(messages)
        return Piece(segment.start_ns, data, messages, segment.stored)

    def _verified_content(self, segment: mcap_layout.Segment) -> bytes:
        """Records of a segment, whose checksum must agree with the data; 0 means that there is none."""
        data = content(self.file, segment, self.budget)
        is_checked = segment.crc and not segment.cut
        if is_checked and zlib.crc32(data) != segment.crc:
            raise DamageError("does not match its checksum")
        self.without_checksum += not is_checked
        return data

    def _messages(
        self, segment: mcap_layout.Segment, data: NDArray[np.uint8], roles: NDArray[np.int64]
    ) -> NDArray[np.void]:
        """Messages of requested channels in a segment: counted first, then read."""
        counts = np.zeros(1, mcap_layout.COUNTS)
        mcap_layout.walk(data, roles, _NO_MESSAGES, _NO_POSITIONS, counts)
        wanted = int(counts["wanted"][0])
        self.budget.check(segment.stored + len(data) + _BYTES_PER_MESSAGE * wanted)
        messages = np.zeros(wanted, MESSAGE)
        if len(messages):
            mcap_layout.walk(data, roles, messages, _NO_POSITIONS, counts)
        rest = len(data) - int(counts["read"][0])
        if rest and not segment.cut:
            self._add_finding(
                f"chunk at byte {segment.at} holds {rest} bytes that are not records: they are lost"
            )
        for name, what in (
            ("unknown_channel", "messages without a channel"),
            ("foreign", "records of an unknown kind"),
        ):
            if counts[name][0]:
                self._add_finding(f"chunk at byte {segment.at} holds {counts[name][0]} {what}: they are lost")
        return messages

    def _report_missing(self, types: dict[int, int], found: int) -> None:
        """Report, after the last piece, how many messages are missing and what could not be checked."""
        counts = self.layout.counts
        expected = sum(counts.get(number, 0) for number in types) if counts is not None else found
        if expected != found:
            self._add_finding(f"{found} messages could be read of the {expected} that it counts")
        if self.without_checksum and not self.layout.data_crc:
            self._add_finding(
                f"has no checksum for {self.without_checksum} of {len(self.layout.segments)} chunks: "
                "a damaged number in them would not be detected",
                Severity.NOTE,
            )

    def _check_magic(self) -> None:
        """Check that the file is an MCAP file."""
        self.file.seek(0)
        start = self.file.read(len(mcap_layout.MAGIC))
        if not self.size:
            raise RecordingError(str(self.path), "", "is empty, expected an MCAP file")
        if start != mcap_layout.MAGIC:
            raise RecordingError(
                str(self.path),
                "",
                f"begins with {start!r}, expected {mcap_layout.MAGIC!r}: is not an MCAP file",
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
            self._add_finding("does not match the checksum of its data: a part of it is damaged")

    def _add_finding(self, text: str, severity: Severity = Severity.LOSS) -> None:
        """Add a finding, up to a largest number."""
        if len(self.findings) < _MOST_FINDINGS:
            self.findings.append(Finding(self.path, text, severity))
        elif len(self.findings) == _MOST_FINDINGS:
            self.findings.append(Finding(self.path, "has more findings that are not listed"))
