"""The ledger stores the modelled wear in an SQLite file that survives kills, full disks and a wrong leg.

An entry is on the disk when `keep` returns. If a write fails, `Ledger.fault` gives the reason, the monitor
continues, and the next entry includes all events since the last successful one. If the process is killed,
the wear since the last entry is lost: at most the time between two entries, which the next start reports.
"""

import sqlite3
from collections.abc import Mapping
from contextlib import closing
from pathlib import Path

import numpy as np

from leg_wear_monitor.errors import one_line
from leg_wear_monitor.estimate.signature import CommissionedTorque
from leg_wear_monitor.mechanism.arrays import Ints
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor.config.fitting import fitted
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.ledger.entry import (
    Audit,
    Commissioned,
    CorrectedClearance,
    Entry,
    Event,
    IdentifiedLeg,
    Measurement,
    Run,
    SimulatedReference,
    VerdictEvent,
    binding_of,
)
from leg_wear_monitor.monitor.ledger.file import (
    LedgerError,
    commissioned_torques,
    connect,
    copy_of,
    damage_refused,
    read,
    read_entry,
    transaction,
    write_entry,
    write_event,
    write_run,
)
from leg_wear_monitor.state import Verdict


class LedgerContent:
    """Content of a ledger on its leg, by earlier runs.

    Parameters
    ----------
    db : sqlite3.Connection

    Attributes
    ----------
    runs : tuple of Run
    entry : Entry or None
        The last entry; None in a new ledger.
    verdict : Verdict or None
        Since its last change.
    measurements : tuple of Measurement
        Manually measured clearances, including withdrawn ones.
    audits : tuple of Audit
    corrections : tuple of CorrectedClearance
    commissioned : Commissioned or None
        Errors of further encoders.
    commissioned_torques : list of CommissionedTorque
        Signatures of the drive torque, one for each cadence, the last one first.
    references : list of SimulatedReference
        Torque references that were simulated, the last one first; one may not be whole.
    parameters : IdentifiedLeg or None
        Masses, lengths and friction that were identified.
    """

    def __init__(self, db: sqlite3.Connection) -> None:
        self.runs, verdicts = read(db, Run), read(db, VerdictEvent)
        self.entry = read_entry(db, self.runs)
        self.verdict: Verdict | None = verdicts[-1].verdict if verdicts else None
        self.measurements = read(db, Measurement)
        self.audits = read(db, Audit)
        self.corrections = read(db, CorrectedClearance)
        self.commissioned = next(reversed(read(db, Commissioned)), None)
        self.commissioned_torques = commissioned_torques(read(db, CommissionedTorque))
        self.parameters = next(reversed(read(db, IdentifiedLeg)), None)
        self.references = [*reversed(read(db, SimulatedReference))]

    @property
    def counted_ns(self) -> Ints:
        """Begin and end (n, 2) [ns] of the time spans whose wear is modelled, in all epochs."""
        spans = {span[:2] for run in self.runs for span in run.spans}
        return np.array(sorted(spans), dtype=np.int64).reshape(-1, 2)


class Ledger(LedgerContent):
    """An open ledger, locked for this process.

    Parameters
    ----------
    path : pathlib.Path or str
        Created if it does not exist.
    binding : mapping of str to str
        Of `binding_of` the leg that its wear must belong to.
    interval_s : float
        Intended longest time between two entries.
    at_end : bool
        True if the run is written only at its end, completely or not at all, as for a recording.

    Attributes
    ----------
    audits, verdict
        With the changes of this run.
    last_run : Run
        The previous run.
    epoch, boot_id : int, str
        Epoch of this run's clock and boot id of its computer, stored with each entry; until set, the previous
        run's.
    cut_off_s : float or None
        If a run was interrupted and that is not acknowledged: the longest time of walking whose wear was
        lost.
    kept_ns : int
        Stamp of the last entry on the disk, 0 before.
    fault : str
        Reason of the last failed write; empty if it succeeded.

    Raises
    ------
    LedgerError
        If it cannot be read, or must not be continued.
    """

    def __init__(
        self, path: Path | str, binding: Mapping[str, str], interval_s: float, at_end: bool = False
    ) -> None:
        self.path, self.at_end, self.fault = Path(path), at_end, ""
        self._events: list[Event] = []
        self._db = connect(self.path, binding)
        self._place = _place(self.path)
        self._interval_s = interval_s
        self._spans: tuple[tuple[int, int, int], ...] = ()  # of this run
        try:
            with damage_refused(self.path):
                super().__init__(self._db)
            self.last_run = self.runs[-1] if self.runs else Run()
            self.epoch, self.boot_id = self.last_run.epoch, self.last_run.boot_id
            self.cut_off_s = None if self.last_run.closed else self.last_run.interval_s
            self.kept_ns = self.entry.stamp_ns if self.entry else 0
            self._kept_moving_s = self.entry.moving_s if self.entry else 0.0
            if not at_end and not self._write(self._run(closed=False)):
                raise LedgerError(f"{self.path}: cannot be written: {self.fault}")
        except BaseException:
            self.close()
            raise

    @property
    def waiting(self) -> int:
        """Number of events that are not written yet."""
        return len(self._events)

    def note(self, event: Event) -> None:
        """Queue an event; it is written with the next entry."""
        self._events.append(event)
        if isinstance(event, Audit):
            self.audits += (event,)
        elif isinstance(event, VerdictEvent):
            self.verdict = event.verdict

    def acknowledge_loss(self) -> bool:
        """Tell the interruption of an earlier run no more, from the next entry on; whether there was one."""
        was, self.cut_off_s = self.cut_off_s, None
        return was is not None

    def keep(self, entry: Entry, closed: bool = False) -> bool:
        """Write an entry and all events since the last; False if that failed, with the reason in `fault`.

        Parameters
        ----------
        entry : Entry
        closed : bool
            True if the run ends normally with this entry.
        """
        if self.at_end and not closed:
            return False
        self._interval_s = max(self._interval_s, entry.moving_s - self._kept_moving_s)
        self._spans = entry.spans
        kept = self._write(self._run(closed), entry)
        if kept:
            self.kept_ns, self._kept_moving_s = entry.stamp_ns, entry.moving_s
        return kept

    def abandon(self) -> None:
        """End a run that monitored nothing or is to be discarded, and close the file.

        Raises
        ------
        LedgerError
            If that could not be written.
        """
        try:
            if not self.at_end and not self._write(self._run(closed=True)):
                raise LedgerError(f"{self.path}: {self.fault}")
        finally:
            self.close()

    def close(self) -> None:
        """Close the file; entries are written by `keep`."""
        self._db.close()

    def _run(self, closed: bool) -> Run:
        """The row of this run: not closed while the loss of an earlier one is not acknowledged."""
        return Run(
            number=self.last_run.number + 1,
            closed=closed and self.cut_off_s is None,
            interval_s=max(self._interval_s, self.cut_off_s or 0.0),
            epoch=self.epoch,
            boot_id=self.boot_id,
            spans=self._spans,
        )

    def _write(self, run: Run, entry: Entry | None = None) -> bool:
        """Write a run, an entry and the events in one transaction; False if that failed, see `fault`."""
        try:
            if _place(self.path) != self._place:
                raise LedgerError("was moved away or replaced while in use; put it back")
            with transaction(self._db):
                write_run(self._db, run)
                if entry is not None:
                    write_entry(self._db, run.number, entry)
                for event in self._events:
                    write_event(self._db, event)
        except (sqlite3.Error, LedgerError) as error:
            self.fault = one_line(error)
            return False
        self._events.clear()
        self.fault = ""
        return True


def open_ledger(mechanism: Mechanism, config: MonitorConfig, at_end: bool = False) -> Ledger | None:
    """Open the ledger that a configuration names; None if it names none.

    Parameters
    ----------
    mechanism : Mechanism
    config : MonitorConfig
    at_end : bool
        True if the run is written only at its end, completely or not at all, as for a recording.

    Raises
    ------
    ConfigError
        For parameters that do not fit the mechanism.
    LedgerError
        If the ledger must not be continued.
    """
    if not config.ledger.path:
        return None
    binding = binding_of(fitted(mechanism, config), config)
    return Ledger(config.ledger.path, binding, config.ledger.checkpoint_s, at_end)


def read_ledger(path: Path, binding: Mapping[str, str]) -> LedgerContent:
    """Read a ledger of a leg for who only looks: from a copy, because a running monitor locks its ledger.

    Raises
    ------
    LedgerError
        If it cannot be read, is damaged or belongs to a different leg; also if the monitor wrote while it was
        copied.
    """
    with copy_of(path) as copy:
        if not copy.is_file():
            raise LedgerError(f"{path}: cannot be read: the file does not exist")
        with closing(connect(copy, binding)) as db, damage_refused(path):
            return LedgerContent(db)


def _place(path: Path) -> tuple[int, int] | None:
    """Identity of a file (device and inode), None if there is none."""
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_dev, found.st_ino
