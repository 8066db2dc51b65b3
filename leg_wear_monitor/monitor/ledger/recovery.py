"""Recovery of the last entry from the tables and the log, with the possible loss."""

import sqlite3
from pathlib import Path

import attrs

from leg_wear_monitor.monitor.ledger.entry import Entry
from leg_wear_monitor.monitor.ledger.file import MOVE, LedgerError, beside, transaction
from leg_wear_monitor.monitor.ledger.former_format import sampling_to_joints
from leg_wear_monitor.monitor.ledger.log import ENDING, LogContent, read_log
from leg_wear_monitor.monitor.ledger.rows import read_entry, read_last_run, write_entry, write_run
from leg_wear_monitor.monitor.ledger.run import Run
from leg_wear_monitor.monitor.ledger.schema import FORMAT, migrate
from leg_wear_monitor.monitor.ledger.seal import Head, read_head, write_head
from leg_wear_monitor.monitor.ledger.step import decode

WHOLE_S = 600.0
"""Longest time in motion between two entries that are written whole, into the tables."""


@attrs.frozen
class Recovered:
    """The last entry of a ledger.

    Attributes
    ----------
    head : Head
        Head of the tables.
    digest : bytes
        Checksum of the last record, or of the head; the next record follows it.
    run : Run
        The last run.
    entry_run : int
        Number of the run of the entry's spans.
    entry : Entry or None
    is_newer : bool
        Whether the entry is newer than the tables.
    lost_s : float or None
        Longest time in motion whose wear is lost; None if the last run ended in order.
    loss : str
        Fault of the log; empty if there is none.
    """

    head: Head
    digest: bytes
    run: Run
    entry_run: int = 0
    entry: Entry | None = None
    is_newer: bool = False
    lost_s: float | None = None
    loss: str = ""


def recover(db: sqlite3.Connection, path: Path) -> Recovered:
    """Find the last entry of a ledger whose tables were checked.

    Raises
    ------
    LedgerError
        If its log is newer than its tables.
    """
    head, run = read_head(db), read_last_run(db)
    entry_run, entry = read_entry(db) or (0, None)
    recovered = Recovered(head, head.digest, run, entry_run, entry)
    log = beside(path, ENDING)
    try:
        content = read_log(path)
        fault = _misfit(content, recovered)
        if content and content.number > head.number:
            raise LedgerError(
                f"{path}: is older than {log.name} beside it; put back the ledger that belongs to that, or "
                f"move {log.name} away to go on from this one without the wear since"
            )
    except (OSError, ValueError) as error:
        content, fault = None, f"cannot be read: {error}"
    if run.closed:
        return recovered
    if content is None or fault:
        lost_s = WHOLE_S + 2.0 * run.interval_s
        return attrs.evolve(
            recovered, lost_s=lost_s, loss=_loss_text(log.name, fault or "is missing", lost_s)
        )
    if content.digest == head.previous:
        return attrs.evolve(recovered, lost_s=run.interval_s)
    return _applied(recovered, content, log.name)


def migrated(db: sqlite3.Connection, found: Recovered) -> Recovered:
    """Migrate tables that may have a log to the present format, together with the last entry of the log.

    The new head follows the log's last record: a log that is still there counts as contained in the tables.
    """
    (number,) = db.execute("PRAGMA user_version").fetchone()
    if number >= FORMAT:
        return found
    found = attrs.evolve(found, entry=sampling_to_joints(found.entry) if found.entry else None)
    with transaction(db):
        migrate(db, number)
        write_run(db, found.run)
        if found.is_newer and found.entry:
            write_entry(db, found.entry_run, found.head.number + 1, found.entry)
        head = write_head(db, found.head.number + 1, found.digest)
    return attrs.evolve(found, head=head, digest=head.digest, is_newer=False)


def check_absent(path: Path) -> None:
    """Refuse to create a ledger if only the log of a former one exists."""
    log = beside(path, ENDING)
    if log.exists():
        raise LedgerError(
            f"{path}: is missing, but {log.name} beside it is there; put the ledger back, or move {log.name} "
            "away, too, to begin with new parts"
        )


def _misfit(content: LogContent | None, recovered: Recovered) -> str:
    """Reason why a log does not belong to the tables; empty if it does."""
    if content is None:
        return ""
    follows = (content.number, content.head) == (recovered.head.number, recovered.head.digest)
    # a kill between the commit of the tables and the new log leaves the log that led to these tables
    is_before = content.number < recovered.head.number and content.digest == recovered.head.previous
    return "" if follows or is_before else "is of another time"


def _applied(recovered: Recovered, content: LogContent, name: str) -> Recovered:
    """Apply the records of a log up to the last valid one."""
    run, entry = recovered.run, recovered.entry
    for record in content.records:
        if entry is None:
            raise LedgerError(f"{name}: follows a ledger that has no entry; {MOVE}")
        run, entry = decode(record, entry)
    lost_s, loss = run.interval_s, ""
    if content.left or content.missing:
        most_s = max(0.0, WHOLE_S - _moved_s(recovered.entry, entry)) + 2.0 * run.interval_s
        lost_s = min(most_s, (content.missing + 1) * run.interval_s) if content.is_torn else most_s
        loss = _loss_text(name, "is not whole", lost_s)
    return attrs.evolve(
        recovered,
        digest=content.digest,
        run=run,
        entry_run=run.number if content.records else recovered.entry_run,
        entry=entry,
        is_newer=bool(content.records),
        lost_s=lost_s,
        loss=loss,
    )


def _moved_s(first: Entry | None, last: Entry | None) -> float:
    return last.moving_s - first.moving_s if first and last else 0.0


def _loss_text(name: str, fault: str, lost_s: float) -> str:
    return f"{name} {fault}: the wear of at most {lost_s:.3g} s of walking is lost"
