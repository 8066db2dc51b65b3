"""Storage of a ledger: whole entries in the tables, entries between them as records in the log."""

import os
import sqlite3
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TypeVar

from leg_wear_monitor.monitor.ledger.binding import Binding
from leg_wear_monitor.monitor.ledger.entry import Entry, Event
from leg_wear_monitor.monitor.ledger.file import MOVE, LedgerError, connect, create, transaction
from leg_wear_monitor.monitor.ledger.log import EntryLog
from leg_wear_monitor.monitor.ledger.recovery import WHOLE_S, check_absent, migrated, recover
from leg_wear_monitor.monitor.ledger.rows import read_last_run, write_entry, write_event, write_run
from leg_wear_monitor.monitor.ledger.run import Run
from leg_wear_monitor.monitor.ledger.seal import Head, write_head
from leg_wear_monitor.monitor.ledger.step import encode

_Answer = TypeVar("_Answer")


class LedgerStore:
    """The tables and the log on the disk, locked for this process.

    Parameters
    ----------
    path : pathlib.Path
        Created if it does not exist.
    binding : Binding
        Leg that the wear must belong to.

    Attributes
    ----------
    found : Recovered
        Content when the ledger was opened.

    Raises
    ------
    LedgerError
        If the ledger cannot be read, or must not be continued; it is left unchanged.
    """

    def __init__(self, path: Path, binding: Binding) -> None:
        self.path = path
        self._binding = binding
        if not os.path.lexists(path):
            check_absent(path)
            create(path, binding)
        self._db: sqlite3.Connection | None = connect(path, binding)
        self._place = _place(path)
        try:
            self.found = migrated(self._db, recover(self._db, path))
        except (sqlite3.Error, ValueError, TypeError, LedgerError) as error:
            self._db.close()
            text = str(error) if isinstance(error, LedgerError) else f"{path}: is damaged: {error}; {MOVE}"
            raise LedgerError(text) from error
        self._number, self._digest = self.found.head.number, self.found.digest
        self._log = EntryLog(path)
        self._run = self.found.run.number
        self._whole: Entry | None = None  # last entry in the tables
        self._last: Entry | None = None  # last entry, as it will be decoded
        self._spans = 0  # number of its spans that belong to this run

    def is_due(self, entry: Entry) -> bool:
        """Whether an entry has to be written whole; otherwise a record is sufficient."""
        if self._whole is None or self._last is None or not self._log.is_open:
            return True
        return not 0.0 <= entry.moving_s - self._whole.moving_s < WHOLE_S

    def write(
        self, run: Run, entry: Entry | None, events: Sequence[Event] = (), entry_run: int | None = None
    ) -> None:
        """Write an entry whole, and events, in one transaction.

        Parameters
        ----------
        run : Run
            State of the present run to be written.
        entry : Entry or None
            With None, the previous entry stays in force.
        events : sequence of Event
        entry_run : int, optional
            Run of the entry's spans; the present one if not given.

        Raises
        ------
        sqlite3.Error, OSError, LedgerError
            If nothing was written; a later call tries again.
        """
        try:
            db = self._connection()
            with transaction(db):
                write_run(db, run)
                if entry is not None:
                    write_entry(db, run.number if entry_run is None else entry_run, self._number + 1, entry)
                for event in events:
                    write_event(db, event)
                head = write_head(db, self._number + 1, self._digest)
        except BaseException:
            self.close()
            raise
        self._number, self._digest, self._run = head.number, head.digest, run.number
        if entry is not None:
            self._whole = self._last = entry
            self._spans = len(entry.spans) if entry_run is None else 0
        self._renew_log(head, run.closed)

    def _renew_log(self, head: Head, closed: bool) -> None:
        """Delete the log, or begin a new one; if that fails, the next entry is written whole again."""
        try:
            if closed:
                self._log.remove()
            else:
                self._log.begin(head, self.path.stat().st_mode)
        except OSError:
            self._log.close()

    def append(self, run: Run, entry: Entry) -> None:
        """Write an entry as a record in the log; only if it does not have to be whole.

        Raises
        ------
        sqlite3.Error, OSError, LedgerError, ValueError
            If the record was not written; the next entry has to be whole.
        """
        if self._last is None:
            raise LedgerError(f"{self.path}: has no entry yet")
        try:
            self._check_place()
            content, read = encode(entry, run, self._last, self._spans)
            self._digest = self._log.append(content)
        except BaseException:
            self.close()
            raise
        self._last, self._spans = read, len(read.spans)

    def check_writable(self) -> None:
        """Raise LedgerError if later writes would fail."""
        db = self._connection()
        try:
            db.execute("BEGIN EXCLUSIVE")
            db.execute("UPDATE run SET closed = closed")
            db.execute("ROLLBACK")
        except sqlite3.Error as error:
            raise LedgerError(f"{self.path}: cannot be written: {error}") from error

    def ask(self, ask: Callable[[sqlite3.Connection], _Answer]) -> _Answer:
        """Result of a query to the tables.

        Raises
        ------
        LedgerError
            If the tables cannot be read now.
        """
        try:
            return ask(self._connection())
        except (sqlite3.Error, ValueError) as error:
            raise LedgerError(f"{self.path}: cannot be read: {error}") from error

    def close(self) -> None:
        """Close the files."""
        self._log.close()
        if self._db is not None:
            self._db.close()
            self._db = None

    def _check_place(self) -> None:
        if _place(self.path) != self._place:
            self.close()
            raise LedgerError(f"{self.path}: was moved away or replaced while in use; put it back")

    def _connection(self) -> sqlite3.Connection:
        """The open connection; it is opened again after a failed write."""
        self._check_place()
        if self._db is None:
            self._db = connect(self.path, self._binding)
        if read_last_run(self._db).number > self._run:
            raise LedgerError(f"{self.path}: was continued by another monitor meanwhile; end one of them")
        return self._db


def _place(path: Path) -> tuple[int, int] | None:
    """Identity of a file (device and inode), None if there is none."""
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_dev, found.st_ino
