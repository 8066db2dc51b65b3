"""The ledger keeps the counted wear in an SQLite file that survives kills, full disks and a wrong leg.

An entry is on the disk when `keep` returns. If a write fails, `Ledger.fault` gives the reason, the monitor
continues, and the next entry includes all events since the last successful one. If the process is killed,
the wear since the last entry is lost: at most the time between two entries, which the next start reports.
"""

import os
import sqlite3
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing, contextmanager
from pathlib import Path
from typing import TypeVar

import attrs

from leg_wear_monitor.mechanism.arrays import Ints
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor.config.fitting import fitted
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.ledger import rows
from leg_wear_monitor.monitor.ledger.entry import (
    AlarmEvent,
    Audit,
    Binding,
    ClearancePoint,
    CorrectedClearance,
    Entry,
    Event,
    ForecastPoint,
    Measurement,
    Recount,
    Run,
    WalkedLoad,
    binding_of,
    coefficient_spans,
)
from leg_wear_monitor.monitor.ledger.file import REMEDY, LedgerError, connect, copy_of, create, transaction
from leg_wear_monitor.state import Evidence, Verdict

WHOLE_S = 60.0
"""Longest time in motion between two entries that are written with whole surfaces."""

INTERRUPTED = "an earlier run was interrupted, the wear of its last seconds is lost"

_Answer = TypeVar("_Answer")


class Ledger:
    """An open ledger, locked for this process.

    Parameters
    ----------
    path : pathlib.Path or str
        Created if it does not exist.
    binding : Binding
        Leg that its wear must belong to.
    interval_s : float
        Intended longest time between two entries.
    at_end : bool
        Whether the run is written only at its end, completely or not at all, as for a recording.

    Attributes
    ----------
    entry : Entry or None
        Last entry of earlier runs; None in a new ledger.
    measurements : tuple of Measurement
        Manually measured clearances of earlier runs, including withdrawn ones.
    corrections : tuple of CorrectedClearance and CoefficientSpan
        Counted clearances that were corrected by the drive torque in earlier runs; with `open_ledger`, also
        wear that was counted with other wear coefficients than those of the leg now.
    states : tuple of JointWear
        Parts as they were before each change of their wear in earlier runs, then as in `entry`.
    commissioned : Commissioned or None
        Errors of further encoders from earlier runs.
    commissioned_torques : list of CommissionedTorque
        Signatures of the drive torque from earlier runs, one for each cadence, the last one first.
    references : list of SimulatedReference
        Torque references that were simulated in earlier runs, the last one first; one may not be whole.
    parameters : IdentifiedLeg or None
        Masses, lengths and friction that were identified in earlier runs.
    loads : tuple of WalkedLoad
        Foot loads of earlier runs.
    last_run : Run
        The previous run.
    epoch, boot_id : int, str
        Of this run's clock and computer, stored with each entry; until set, those of the previous run.
    cut_off_s : float or None
        If a run was interrupted and that is not acknowledged: the longest time of walking whose wear was
        lost.
    counted_ns : (n, 2) array
        Begin and end [ns] of the time spans counted in earlier runs, in all epochs.
    kept_ns : int
        Stamp of the last entry on the disk, 0 before.
    loss : str
        What was lost before the opening; empty if nothing was.
    fault : str
        Reason of the last failed write; empty if it succeeded.

    Raises
    ------
    LedgerError
        If it cannot be read, or must not be continued; it is left unchanged.
    """

    def __init__(self, path: Path | str, binding: Binding, interval_s: float, at_end: bool = False) -> None:
        self.path = Path(path)
        self.at_end = at_end
        self._binding = binding
        self._events: list[Event] = []
        if not os.path.lexists(self.path):
            create(self.path, binding)
        self._db: sqlite3.Connection | None = connect(self.path, binding)
        self._place = _place(self.path)
        self._interval_s = interval_s
        self.fault = ""
        self._whole_s: float | None = None  # time in motion at the last whole surfaces of this run
        try:
            with _damage_refused(self.path):
                self._read(self._db)
            self._begin()
        except BaseException:
            self.close()
            raise

    def _read(self, db: sqlite3.Connection) -> None:
        self.last_run = rows.read_last_run(db)
        self._written_run, self._number = self.last_run.number, self.last_run.number + 1
        self.epoch, self.boot_id = self.last_run.epoch, self.last_run.boot_id
        self.cut_off_s = None if self.last_run.closed else self.last_run.interval_s
        self.loss = "" if self.last_run.closed else INTERRUPTED
        self.entry = rows.read_entry(db)
        self.kept_ns = self.entry.stamp_ns if self.entry else 0
        self._kept_moving_s = self.entry.moving_s if self.entry else 0.0
        self.counted_ns = rows.read_spans(db)
        self.measurements = rows.read_measurements(db)
        self.corrections: tuple[Recount, ...] = rows.read_rows(db, CorrectedClearance)
        self.states = (*rows.read_former_states(db), *(self.entry.joints if self.entry else ()))
        self.commissioned = rows.read_commissioned(db)
        self.commissioned_torques = rows.read_commissioned_torques(db)
        self.parameters = rows.read_identified_leg(db)
        self.references = rows.read_simulated_references(db)
        self.loads = rows.read_loads(db)

    def _begin(self) -> None:
        """Write the begin of this run; for one that is written at its end, check that it can be written."""
        if not self.at_end:
            self._write(self._run(closed=False))
            return
        db = self._connection()
        try:
            db.execute("BEGIN EXCLUSIVE")
            db.execute("UPDATE run SET closed = closed")
            db.execute("ROLLBACK")
        except sqlite3.Error as error:
            raise LedgerError(f"{self.path}: cannot be written: {error}") from error

    @property
    def waiting(self) -> int:
        """Number of events that are not written yet."""
        return len(self._events)

    def note(self, event: Event) -> None:
        """Queue an event; it is written with the next entry."""
        self._events.append(event)

    @property
    def last_verdict(self) -> Verdict | None:
        """The verdict since its last stored change; None without one.

        Raises
        ------
        LedgerError
            If the ledger cannot be read now.
        """
        return self._ask(lambda db: next(rows.read_verdicts(db), None))

    def last_evidence(self, name: str) -> Mapping[str, Evidence]:
        """Evidence by its name, of the last stored verdict that has some of a name; empty if none has.

        Raises
        ------
        LedgerError
            If the ledger cannot be read now.
        """
        stored = self._ask(lambda db: tuple(rows.read_verdicts(db)))
        found = ({each.name: each for each in verdict.evidence} for verdict in stored)
        return next((evidence for evidence in found if name in evidence), {})

    @property
    def alarm_history(self) -> tuple[AlarmEvent, ...]:
        """All stored changes of alarms.

        Raises
        ------
        LedgerError
            If the ledger cannot be read now.
        """
        return self._ask(rows.read_alarm_history)

    def last_reset(self, joint: str) -> Audit | None:
        """The last stored `reset_wear` of a joint that was not undone, None if there is none.

        Raises
        ------
        LedgerError
            If the ledger cannot be read now.
        """
        return self._ask(lambda db: rows.read_last_reset(db, joint))

    def acknowledge_loss(self) -> bool:
        """Tell the interruption of an earlier run no more, from the next entry on; whether there was one."""
        was, self.cut_off_s = self.cut_off_s, None
        return was is not None

    def keep(self, entry: Entry, closed: bool = False, *, whole: bool = True) -> bool:
        """Write an entry and all events since the last; False if that failed, with the reason in `fault`.

        Parameters
        ----------
        entry : Entry
        closed : bool
            Whether the run ends normally with this entry.
        whole : bool
            Whether the surfaces must be stored bit for bit. If False, their means are; the surfaces are once
            in a minute of motion, and after a kill the wear since lies around them as that before.
        """
        if self.at_end and not closed:
            return False
        self._interval_s = max(self._interval_s, entry.moving_s - self._kept_moving_s)
        is_due = self._whole_s is None or not 0.0 <= entry.moving_s - self._whole_s < WHOLE_S
        kept = self._write(self._run(closed), entry, closed or whole or is_due)
        if kept:
            self.kept_ns = entry.stamp_ns
            self._kept_moving_s = entry.moving_s
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
        if self._db is not None:
            self._db.close()
            self._db = None

    def _run(self, closed: bool) -> Run:
        """The row of this run: not closed while the loss of an earlier one is not acknowledged."""
        closed, interval_s = closed and self.cut_off_s is None, max(self._interval_s, self.cut_off_s or 0.0)
        return Run(self._number, closed, interval_s, self.epoch, self.boot_id)

    def _write(self, run: Run, entry: Entry | None = None, whole: bool = True) -> bool:
        """Write a run, an entry and the events in one transaction; False if that failed, see `fault`."""
        try:
            with transaction(db := self._connection()):
                rows.write_run(db, run)
                if entry is not None:
                    rows.write_entry(db, run.number, entry, whole)
                for event in self._events:
                    rows.write_event(db, event)
        except (sqlite3.Error, OSError, ValueError, LedgerError) as error:
            self.close()  # the next write begins with a fresh connection
            self.fault = " ".join(str(error).split())
            return False
        self._events.clear()
        self._written_run, self.fault = run.number, ""
        if entry is not None and whole:
            self._whole_s = entry.moving_s
        return True

    def _ask(self, ask: Callable[[sqlite3.Connection], _Answer]) -> _Answer:
        """Result of a query."""
        try:
            return ask(self._connection())
        except (sqlite3.Error, ValueError, TypeError) as error:
            raise LedgerError(f"{self.path}: cannot be read: {error}") from error

    def _connection(self) -> sqlite3.Connection:
        """The open connection; it is opened again after a failed write."""
        if _place(self.path) != self._place:
            raise LedgerError(f"{self.path}: was moved away or replaced while in use; put it back")
        if self._db is None:
            self._db = connect(self.path, self._binding)
        if rows.read_last_run(self._db).number > self._written_run:
            raise LedgerError(f"{self.path}: was continued by another monitor meanwhile; end one of them")
        return self._db


def open_ledger(mechanism: Mechanism, config: MonitorConfig, at_end: bool = False) -> Ledger | None:
    """Open the ledger that a configuration names; None if it names none.

    Parameters
    ----------
    mechanism : Mechanism
    config : MonitorConfig
    at_end : bool
        Whether the run is written only at its end, completely or not at all, as for a recording.

    Raises
    ------
    ConfigError
        For parameters that do not fit the mechanism.
    LedgerError
        If the ledger must not be continued.
    """
    if not config.ledger.path:
        return None
    leg = fitted(mechanism, config)
    ledger = Ledger(config.ledger.path, binding_of(leg, config), config.ledger.checkpoint_s, at_end)
    now_per_pa = {joint: sum(leg.clearances[joint].wear_coefficient) for joint in leg.clearance_joints}
    ledger.corrections += coefficient_spans(ledger.states, now_per_pa)
    return ledger


@attrs.frozen(kw_only=True, eq=False)
class LedgerContent:
    """What a ledger has of its leg.

    Attributes
    ----------
    entry : Entry or None
        The last entry; None in a new ledger.
    verdict : Verdict or None
        Since its last change.
    clearances : tuple of ClearancePoint
        In the order in which they were written.
    forecasts : dict of str to ForecastPoint
        The last forecast of each joint.
    measurements : tuple of Measurement
    loads : tuple of WalkedLoad
        Foot loads of all runs.
    counted_ns : (n, 2) array
        Begin and end [ns] of the time spans whose wear is in the ledger.
    """

    entry: Entry | None
    verdict: Verdict | None
    clearances: tuple[ClearancePoint, ...]
    forecasts: dict[str, ForecastPoint]
    measurements: tuple[Measurement, ...]
    loads: tuple[WalkedLoad, ...]
    counted_ns: Ints

    @property
    def cycles(self) -> int:
        """Gait cycles over the leg's whole life."""
        return int(self.entry.totals.get("cycles", 0.0)) if self.entry else 0


def read_ledger(path: Path, binding: Binding) -> LedgerContent:
    """Read a ledger of a leg for who only looks: from a copy, because a running monitor locks its ledger.

    Raises
    ------
    LedgerError
        If it cannot be read, is damaged or of another leg; also if the monitor wrote while it was copied.
    """
    with copy_of(path) as copy:
        if not copy.is_file():
            raise LedgerError(f"{path}: cannot be read: there is no such file")
        with closing(connect(copy, binding)) as db, _damage_refused(path):
            last = "id IN (SELECT max(id) FROM forecast GROUP BY joint)"
            return LedgerContent(
                entry=rows.read_entry(db),
                verdict=next(rows.read_verdicts(db), None),
                clearances=rows.read_rows(db, ClearancePoint),
                forecasts={point.joint: point for point in rows.read_rows(db, ForecastPoint, last)},
                measurements=rows.read_measurements(db),
                loads=rows.read_loads(db),
                counted_ns=rows.read_spans(db),
            )


@contextmanager
def _damage_refused(path: Path) -> Iterator[None]:
    """Refuse rows that cannot be what was written, in one line."""
    try:
        yield
    except (sqlite3.Error, ValueError, TypeError) as error:
        raise LedgerError(f"{path}: is damaged: {error}; {REMEDY}") from error


def _place(path: Path) -> tuple[int, int] | None:
    """Identity of a file (device and inode), None if there is none."""
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_dev, found.st_ino
