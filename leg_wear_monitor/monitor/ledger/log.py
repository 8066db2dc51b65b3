"""The log beside a ledger's file: records of the entries since the one in the tables.

The log begins with the number and checksum of the file's head. Each record has a checksum over its content
and the previous checksum. These checksums detect an incompletely written record, a log restored from another
time, and a log of another file.
"""

import hashlib
import os
import struct
from pathlib import Path

import attrs

from leg_wear_monitor.monitor.ledger.file import MODE, LedgerError, beside, sync_directory
from leg_wear_monitor.monitor.ledger.seal import Head

ENDING = "-log"

_HEADER = struct.Struct("<8sq32s")  # magic bytes, number and checksum of the head
_MAGIC = b"LWMLOG1\n"
_COUNT = struct.Struct("<Q")  # number of records, updated after each one, to detect missing ones
_BEGIN = _HEADER.size + _COUNT.size
_RECORD = struct.Struct("<I32s")  # bytes of the content, checksum
_MOST = 2**28  # bytes that a log may have: a new log begins every ten minutes


@attrs.frozen
class LogContent:
    """Content of a log.

    Attributes
    ----------
    number, head : int, bytes
        Number and checksum of the head that the log follows.
    records : tuple of bytes
        Contents of the records before the first one with a wrong checksum.
    digest : bytes
        Checksum of the last of these records, or of the head.
    missing : int
        Number of further records, by the log's count.
    left : int
        Bytes after the valid records, 0 in an intact log.
    is_torn : bool
        Whether these bytes are the begin of one record, as after a power cut.
    """

    number: int
    head: bytes
    records: tuple[bytes, ...]
    digest: bytes
    missing: int
    left: int
    is_torn: bool


class EntryLog:
    """A log open for writing."""

    def __init__(self, ledger: Path) -> None:
        self.path = beside(ledger, ENDING)
        self._handle: int | None = None
        self._size = 0
        self._digest = b""
        self._count = 0

    @property
    def is_open(self) -> bool:
        """Whether records can be appended."""
        return self._handle is not None

    def begin(self, head: Head, mode: int) -> None:
        """Begin a new log after a head, with the permissions of a mode; raises OSError."""
        self.close()
        new = beside(self.path, ".new")
        new.unlink(missing_ok=True)
        handle = os.open(new, os.O_CREAT | os.O_EXCL | os.O_WRONLY, MODE)
        try:
            os.fchmod(handle, mode & 0o666)
            _write(handle, _HEADER.pack(_MAGIC, head.number, head.digest) + _COUNT.pack(0))
            os.fdatasync(handle)
            new.rename(self.path)
            sync_directory(self.path)
        except BaseException:
            os.close(handle)
            raise
        self._handle, self._size, self._digest, self._count = handle, _BEGIN, head.digest, 0

    def append(self, content: bytes) -> bytes:
        """Write a record to the disk and return its checksum.

        Raises
        ------
        OSError
            If the write fails; the log is then unchanged and closed.
        LedgerError
            If the log was moved away.
        """
        if self._handle is None:
            raise LedgerError(f"{self.path}: is not open")
        digest = _checksum(self._digest, content)
        record = _RECORD.pack(len(content), digest) + content
        try:
            if not os.path.samestat(os.fstat(self._handle), self.path.stat()):
                raise LedgerError(f"{self.path}: was replaced while in use")
            _write(self._handle, record)
            os.pwrite(self._handle, _COUNT.pack(self._count + 1), _HEADER.size)
            os.fdatasync(self._handle)
        except (OSError, LedgerError):
            handle, self._handle = self._handle, None
            try:
                os.ftruncate(handle, self._size)
            finally:
                os.close(handle)
            raise
        self._size += len(record)
        self._count += 1
        self._digest = digest
        return digest

    def remove(self) -> None:
        """Close and delete the log, whose content is now in the tables; raises OSError."""
        self.close()
        self.path.unlink(missing_ok=True)
        sync_directory(self.path)

    def close(self) -> None:
        """Close the file."""
        if self._handle is not None:
            os.close(self._handle)
            self._handle = None


def read_log(ledger: Path) -> LogContent | None:
    """Read the log beside a ledger; None if there is none.

    Raises
    ------
    ValueError
        If the file is not a log.
    OSError
        If the file cannot be read.
    """
    path = beside(ledger, ENDING)
    if not os.path.lexists(path):
        return None
    if not path.is_file() or path.stat().st_size > _MOST:
        raise ValueError("is not a log")
    data = path.read_bytes()
    if len(data) < _BEGIN or not data.startswith(_MAGIC):
        raise ValueError("does not begin as a log does")
    _, number, head = _HEADER.unpack_from(data)
    (count,) = _COUNT.unpack_from(data, _HEADER.size)
    at, digest, records = _BEGIN, head, []
    while at + _RECORD.size <= len(data):
        size, checksum = _RECORD.unpack_from(data, at)
        content = data[at + _RECORD.size : at + _RECORD.size + size]
        if len(content) < size or _checksum(digest, content) != checksum:
            break
        records.append(content)
        digest = checksum
        at += _RECORD.size + size
    missing = max(0, count - len(records))
    return LogContent(number, head, tuple(records), digest, missing, len(data) - at, _is_torn(data[at:]))


def _is_torn(rest: bytes) -> bool:
    """Whether the bytes are the begin of one record."""
    return len(rest) < _RECORD.size or len(rest) < _RECORD.size + _RECORD.unpack_from(rest)[0]


def _checksum(before: bytes, content: bytes) -> bytes:
    return hashlib.sha256(before + struct.pack("<I", len(content)) + content).digest()


def _write(handle: int, data: bytes) -> None:
    left = memoryview(data)
    while left:
        left = left[os.write(handle, left) :]
