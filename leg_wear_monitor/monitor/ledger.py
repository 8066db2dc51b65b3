"""Wear is months of work: the ledger keeps it in an SQLite file, over a kill, a full disk, a wrong leg.

An entry is one transaction. A write that fails is said in `Ledger.fault`, the monitor goes on, and the next
entry tries again with all that has happened since. What is not an entry yet is lost with the process: at most
the time between two entries, and the next start says how much that was.
"""

import os
import sqlite3
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import attrs

from leg_wear_monitor.mechanism.arrays import Ints
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor.binding import Binding, binding_of
from leg_wear_monitor.monitor.config import MonitorConfig
from leg_wear_monitor.monitor.fitting import fitted
from leg_wear_monitor.monitor.ledger_entry import Audit, Entry, Event, Measurement, Withdrawal
from leg_wear_monitor.monitor.ledger_file import MOVE, LedgerError, connect, create, transaction
from leg_wear_monitor.monitor.ledger_rows import (
    Run,
    read_commissioned,
    read_entry,
    read_last_reset,
    read_last_run,
    read_measurements,
    read_spans,
    write_entry,
    write_event,
    write_run,
)
from leg_wear_monitor.monitor.ledger_seal import read_head, write_head

_Answer = TypeVar("_Answer")


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
        Begin and end of the time whose wear is in it, of earlier runs, by whatever epoch of the clock.
    measurements : tuple of Measurement
        Clearances measured by hand, of earlier runs, withdrawn ones with them.
    commissioned : Commissioned or None
        Errors of further encoders, of earlier runs.
    last_run : Run
        The run before this one.
    epoch, boot_id : int, str
        Of this run's clock and computer, as each entry keeps them; as in the run before until they are set.
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
            self._read(self._db)
        except (sqlite3.Error, ValueError, TypeError) as error:
            self._db.close()
            raise LedgerError(f"{self.path}: is damaged: {error}; {MOVE}") from error
        last = self.last_run
        self.epoch, self.boot_id = last.epoch, last.boot_id
        self.cut_off_s = None if last.closed else last.interval_s
        self.kept_ns = self.entry.stamp_ns if self.entry else 0
        self._kept_moving_s = self.entry.moving_s if self.entry else 0.0
        self._run = last.number + 1
        self._write(None, closed=False)

    def _read(self, db: sqlite3.Connection) -> None:
        found = read_entry(db)
        self.entry = found[1] if found else None
        self.counted_ns = read_spans(db)
        self.measurements = read_measurements(db)
        self.commissioned = read_commissioned(db)
        self.last_run = read_last_run(db)

    @property
    def waiting(self) -> int:
        """Events that are not written yet."""
        return len(self._events)

    def note(self, event: Event) -> None:
        """Take an event down; it is written with the next entry."""
        self._events.append(event)

    def withdraw(self, measurement: int, stamp_ns: int, who: str) -> Measurement:
        """Withdraw a measurement of an earlier run: it is kept, and does not count; written as events are.

        Parameters
        ----------
        measurement : int
            Its `id`.
        stamp_ns : int
            Not 0.
        who : str

        Returns
        -------
        Measurement
            As it is now.

        Raises
        ------
        LedgerError
            If there is none of that `id`, or it is withdrawn already.
        """
        found = {each.id: each for each in self.measurements}
        if measurement not in found:
            known = ", ".join(map(str, found)) or "none"
            raise LedgerError(f"{self.path}: has no measurement {measurement}, it has {known}")
        if found[measurement].is_withdrawn:
            raise LedgerError(f"{self.path}: measurement {measurement} is withdrawn already")
        now = attrs.evolve(found[measurement], withdrawn_ns=stamp_ns, withdrawn_by=who)
        self.measurements = tuple(now if each.id == measurement else each for each in self.measurements)
        self.note(Withdrawal(stamp_ns, who, measurement))
        return now

    def counted_in(self, epoch: int) -> Ints:
        """Begin and end (n, 2) [ns] of the time that is counted by the clock of an epoch.

        Raises
        ------
        LedgerError
            If it cannot be read now.
        """
        return self._asked(lambda db: read_spans(db, epoch))

    def last_reset(self, joint: str) -> Audit | None:
        """The last `reset_wear` of a joint that is kept and was not undone, None if there is none.

        Its `joint` is None in a row of a format before 4, which does not hold all of it.

        Raises
        ------
        LedgerError
            If it cannot be read now.
        """
        return self._asked(lambda db: read_last_reset(db, joint))

    def keep(self, entry: Entry, closed: bool = False) -> bool:
        """Write an entry and all events since the last; False, and `fault` says why, if that failed.

        Parameters
        ----------
        entry : Entry
        closed : bool
            Whether the run ends here in order.
        """
        self._interval_s = max(self._interval_s, entry.moving_s - self._kept_moving_s)
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

    def _asked(self, ask: Callable[[sqlite3.Connection], _Answer]) -> _Answer:
        try:
            return ask(self._connection())
        except (sqlite3.Error, ValueError) as error:
            raise LedgerError(f"{self.path}: cannot be read: {error}") from error

    def _write(self, entry: Entry | None, closed: bool) -> bool:
        try:
            db = self._connection()
            with transaction(db):
                head = read_head(db)
                write_run(db, Run(self._run, closed, self._interval_s, self.epoch, self.boot_id))
                if entry is not None:
                    write_entry(db, self._run, head.number + 1, entry)
                for event in self._events:
                    write_event(db, event)
                write_head(db, head.number + 1, head.digest)
        except (sqlite3.Error, LedgerError) as error:
            self.fault = " ".join(str(error).split())
            self.close()
            return False
        self.fault = ""
        self._events.clear()
        if entry is not None:
            self.kept_ns = entry.stamp_ns
            self._kept_moving_s = entry.moving_s
        return True

    def _connection(self) -> sqlite3.Connection:
        """The open file; it is opened again after a write has failed."""
        if _place(self.path) != self._place:
            self.close()
            raise LedgerError(f"{self.path}: was moved away or replaced while in use; put it back")
        if self._db is None:
            self._db = connect(self.path, self._binding)
        if read_last_run(self._db).number > self._run:
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
