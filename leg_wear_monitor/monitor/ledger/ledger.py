"""The ledger keeps the counted wear in an SQLite file that survives kills, full disks and a wrong leg.

An entry is on the disk when `keep` returns. If a write fails, `Ledger.fault` gives the reason, the monitor
continues, and the next entry includes all events since the last successful one. If the process is killed,
the wear since the last entry is lost: at most the time between two entries, which the next start reports.
"""

import sqlite3
from collections.abc import Callable
from pathlib import Path

import attrs
import numpy as np

from leg_wear_monitor.mechanism.arrays import Ints
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor.config.fitting import fitted
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.ledger.binding import Binding, binding_of
from leg_wear_monitor.monitor.ledger.entry import Audit, Entry, Event, Measurement, VerdictEvent, Withdrawal
from leg_wear_monitor.monitor.ledger.file import LedgerError
from leg_wear_monitor.monitor.ledger.recovery import Recovered
from leg_wear_monitor.monitor.ledger.rows import (
    read_commissioned,
    read_commissioned_torques,
    read_corrections,
    read_identified_leg,
    read_last_reset,
    read_last_verdict,
    read_loads,
    read_measurements,
    read_simulated_references,
    read_spans,
)
from leg_wear_monitor.monitor.ledger.run import Run
from leg_wear_monitor.monitor.ledger.store import LedgerStore
from leg_wear_monitor.monitor.ledger.walked import together


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
    corrections : tuple of CorrectedClearance
        Counted clearances that were corrected by the drive torque in earlier runs.
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
        If the last run was interrupted: the longest time of walking whose wear was lost.
    kept_ns : int
        Stamp of the last entry on the disk, 0 before.
    loss : str
        Fault found at the opening, and the possible loss; empty if there is none.
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
        self._events: list[Event] = []
        self._store = LedgerStore(self.path, binding)
        found = self._store.found
        self.entry, self.last_run, self.loss = found.entry, found.run, found.loss
        self.epoch, self.boot_id = found.run.epoch, found.run.boot_id
        self.cut_off_s = found.lost_s
        self._interval_s = interval_s
        self.kept_ns = self.entry.stamp_ns if self.entry else 0
        self._kept_moving_s = self.entry.moving_s if self.entry else 0.0
        self.fault = ""
        self._number = found.run.number + 1
        try:
            self._begin(found)
            self._read()
        except BaseException:
            self._store.close()
            raise

    def _begin(self, found: Recovered) -> None:
        """Write the last entry of the log and the begin of this run into the tables."""
        newer = found.entry if found.is_newer else None
        reported_s = max(found.run.interval_s, found.lost_s or 0.0)
        run = attrs.evolve(found.run, interval_s=reported_s) if self.at_end else self._run(closed=False)
        if newer or not self.at_end:
            self._try(lambda: self._store.write(run, newer, entry_run=found.entry_run))
        if self.at_end:
            self._store.check_writable()

    def _read(self) -> None:
        spans = self._store.ask(read_spans)
        if self.entry:  # also if the tables could not be written
            own = self.entry.span_epochs or (0,) * len(self.entry.spans)
            spans += [(*span, epoch) for span, epoch in zip(self.entry.spans, own, strict=True)]
        self._spans = np.array(sorted(set(spans)), dtype=np.int64).reshape(-1, 3)
        self.measurements = self._store.ask(read_measurements)
        self.corrections = self._store.ask(read_corrections)
        self.commissioned = self._store.ask(read_commissioned)
        self.commissioned_torques = self._store.ask(read_commissioned_torques)
        self.parameters = self._store.ask(read_identified_leg)
        self.references = self._store.ask(read_simulated_references)
        others = self._store.ask(lambda db: read_loads(db, "run != ?", self._store.found.entry_run))
        self.loads = together((*others, *(self.entry.loads if self.entry else ())))

    @property
    def counted_ns(self) -> Ints:
        """Begin and end (n, 2) [ns] of the time spans counted in earlier runs, in all epochs."""
        return self._spans[:, :2]

    def counted_in(self, epoch: int) -> Ints:
        """Begin and end (n, 2) [ns] of the counted time spans in one epoch of the clock."""
        return self._spans[self._spans[:, 2] == epoch, :2]

    @property
    def waiting(self) -> int:
        """Number of events that are not written yet."""
        return len(self._events)

    def note(self, event: Event) -> None:
        """Queue an event; it is written with the next entry."""
        self._events.append(event)

    def withdraw(self, measurement: int, stamp_ns: int, who: str) -> Measurement:
        """Withdraw a measurement of an earlier run; the withdrawal is an event, the measurement stays.

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
            The withdrawn measurement.

        Raises
        ------
        LedgerError
            If no measurement has this `id`, or it is already withdrawn.
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

    @property
    def last_verdict(self) -> VerdictEvent | None:
        """The last stored change of the verdict; None without one.

        Raises
        ------
        LedgerError
            If the ledger cannot be read now.
        """
        return self._store.ask(read_last_verdict)

    def last_reset(self, joint: str) -> Audit | None:
        """The last stored `reset_wear` of a joint that was not undone, None if there is none.

        Its `joint` is None in rows of formats before 4, which do not contain the whole state of the joint.

        Raises
        ------
        LedgerError
            If the ledger cannot be read now.
        """
        return self._store.ask(lambda db: read_last_reset(db, joint))

    def keep(self, entry: Entry, closed: bool = False, *, whole: bool = True) -> bool:
        """Write an entry and all events since the last; False if that failed, with the reason in `fault`.

        Parameters
        ----------
        entry : Entry
        closed : bool
            Whether the run ends normally with this entry.
        whole : bool
            Whether the surfaces must be stored bit for bit. If False, their rise since the previous entry
            may be stored in the log, with an error of at most a 36th part of its largest value; an entry is
            still written whole every ten minutes of motion, or with events.
        """
        if self.at_end and not closed:
            return False
        self._interval_s = max(self._interval_s, entry.moving_s - self._kept_moving_s)
        run = self._run(closed)
        if closed or whole or self._events or self._store.is_due(entry):
            kept = self._try(lambda: self._store.write(run, entry, self._events))
        else:
            kept = self._try(lambda: self._store.append(run, entry))
        if kept:
            self._events.clear()
            self.kept_ns = entry.stamp_ns
            self._kept_moving_s = entry.moving_s
        return kept

    def record(self, entry: Entry | None = None) -> None:
        """Write the events since the last entry; for a run that monitors nothing.

        Parameters
        ----------
        entry : Entry, optional
            To replace the last one, which otherwise stays in force; its loads are of that one's run.

        Raises
        ------
        LedgerError
            If they could not be written.
        """
        self._interval_s = max(self._interval_s, self.cut_off_s or 0.0)  # until the loss is acknowledged
        run = self._run(closed=self.cut_off_s is None)
        entry = entry and attrs.evolve(entry, loads=())
        if not self._try(lambda: self._store.write(run, entry, self._events)):
            raise LedgerError(f"{self.path}: {self.fault}")
        self._events.clear()

    def abandon(self) -> None:
        """End a run that monitored nothing or is to be discarded, and close the file.

        Raises
        ------
        LedgerError
            If that could not be written.
        """
        try:
            if not self.at_end:
                self.record()
        finally:
            self.close()

    def close(self) -> None:
        """Close the file; entries are written by `keep`."""
        self._store.close()

    def _run(self, closed: bool) -> Run:
        return Run(self._number, closed, self._interval_s, self.epoch, self.boot_id)

    def _try(self, write: Callable[[], None]) -> bool:
        """Whether the write succeeded; if not, `fault` gives the reason."""
        try:
            write()
        except (sqlite3.Error, OSError, ValueError, LedgerError) as error:
            self.fault = " ".join(str(error).split())
            return False
        self.fault = ""
        return True


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
    binding = binding_of(fitted(mechanism, config), config)
    return Ledger(config.ledger.path, binding, config.ledger.checkpoint_s, at_end)
