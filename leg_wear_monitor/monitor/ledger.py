"""Wear is months of work: the ledger keeps it in an SQLite file, over a kill, a full disk, a wrong leg.

An entry is one transaction (WAL, synchronous FULL). A write that fails is said in `Ledger.fault`, the monitor
goes on, and the next entry tries again with all that has happened since. What is not an entry yet is lost
with the process: at most the time between two entries, and the next start says how much that was.
"""

import os
import sqlite3
from pathlib import Path

from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor.binding import Binding, binding_of
from leg_wear_monitor.monitor.config import MonitorConfig
from leg_wear_monitor.monitor.fitting import fitted
from leg_wear_monitor.monitor.ledger_entry import Entry, Event
from leg_wear_monitor.monitor.ledger_file import MOVE, LedgerError, connect, create, transaction
from leg_wear_monitor.monitor.ledger_rows import (
    read_commissioned,
    read_entry,
    read_last_run,
    read_measurements,
    read_spans,
    write_entry,
    write_event,
)


class Ledger:
    """An open ledger, ours alone.

    Parameters
    ----------
    path : pathlib.Path or str
        Created if it is not there.
    binding : Binding
        What its wear must belong to.
    interval_s : float
        Longest time between two entries that is intended.

    Attributes
    ----------
    entry : Entry or None
        The last one of earlier runs; None in a new ledger.
    counted_ns : (n, 2) array of int
        Begin and end of the time whose wear is in it, of earlier runs.
    measurements : tuple of Measurement
        Clearances measured by hand, of earlier runs.
    commissioned : Commissioned or None
        Errors of further encoders, of earlier runs.
    cut_off_s : float or None
        If the last run was cut off: the longest time of walking whose wear was lost with it.
    kept_ns : int
        Stamp of the last entry on the disk, 0 before.
    fault : str
        Why the last write failed; empty if it did not.

    Raises
    ------
    LedgerError
        If it cannot be read, or must not be continued; it is left as it is.
    """

    def __init__(self, path: Path | str, binding: Binding, interval_s: float) -> None:
        self.path = Path(path)
        self.fault = ""
        self._binding = binding
        self._events: list[Event] = []
        self._interval_s = interval_s
        if not os.path.lexists(self.path):
            create(self.path, binding)
        self._db: sqlite3.Connection | None = connect(self.path, binding)
        self._place = _place(self.path)
        try:
            self.entry = read_entry(self._db)
            self.counted_ns = read_spans(self._db)
            self.measurements = read_measurements(self._db)
            self.commissioned = read_commissioned(self._db)
            last, closed, last_interval_s = read_last_run(self._db)
        except (sqlite3.Error, ValueError, TypeError) as error:
            self._db.close()
            raise LedgerError(f"{self.path}: is damaged: {error}; {MOVE}") from error
        self.cut_off_s = None if closed else last_interval_s
        self.kept_ns = self.entry.stamp_ns if self.entry else 0
        self._kept_moving_s = self.entry.totals.get("moving_s", 0.0) if self.entry else 0.0
        self._run = last + 1
        self._write(None, closed=False)

    @property
    def waiting(self) -> int:
        """Events that are not written yet."""
        return len(self._events)

    def note(self, event: Event) -> None:
        """Take an event down; it is written with the next entry."""
        self._events.append(event)

    def keep(self, entry: Entry, closed: bool = False) -> bool:
        """Write an entry and all events since the last; False, and `fault` says why, if that failed.

        Parameters
        ----------
        entry : Entry
        closed : bool
            Whether the run ends here in order.
        """
        moving_s = entry.totals.get("moving_s", 0.0)
        self._interval_s = max(self._interval_s, moving_s - self._kept_moving_s)
        return self._write(entry, closed)

    def record(self) -> None:
        """Write the events since the last entry, and leave that in force; for a run that monitors nothing.

        Raises
        ------
        LedgerError
            If they could not be written.
        """
        if not self._write(None, closed=self.cut_off_s is None):
            raise LedgerError(f"{self.path}: {self.fault}")

    def close(self) -> None:
        """Let go of the file; entries are written by `keep`."""
        if self._db is not None:
            self._db.close()
            self._db = None

    def _write(self, entry: Entry | None, closed: bool) -> bool:
        try:
            db = self._connection()
            with transaction(db):
                values = (self._run, int(closed), self._interval_s)
                db.execute("INSERT OR REPLACE INTO run VALUES (?, ?, ?)", values)
                if entry is not None:
                    write_entry(db, self._run, entry)
                for event in self._events:
                    write_event(db, event)
        except (sqlite3.Error, LedgerError) as error:
            self.fault = " ".join(str(error).split())
            self.close()
            return False
        self.fault = ""
        self._events.clear()
        if entry is not None:
            self.kept_ns = entry.stamp_ns
            self._kept_moving_s = entry.totals.get("moving_s", 0.0)
        return True

    def _connection(self) -> sqlite3.Connection:
        """The open file; it is opened again after a write has failed."""
        if _place(self.path) != self._place:
            self.close()
            raise LedgerError(f"{self.path}: was moved away or replaced while in use; put it back")
        if self._db is None:
            self._db = connect(self.path, self._binding)
        if read_last_run(self._db)[0] > self._run:
            raise LedgerError(f"{self.path}: was continued by another monitor meanwhile; end one of them")
        return self._db


def _place(path: Path) -> tuple[int, int] | None:
    """What tells a file from another one of the same name."""
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_dev, found.st_ino


def open_ledger(mechanism: Mechanism, config: MonitorConfig) -> Ledger | None:
    """The ledger that a configuration names, None if it names none.

    Raises
    ------
    ConfigError
        For parameters that do not fit the mechanism.
    LedgerError
        If it must not be continued.
    """
    if not config.ledger.path:
        return None
    binding = binding_of(fitted(mechanism, config), config)
    return Ledger(config.ledger.path, binding, config.ledger.checkpoint_s)
