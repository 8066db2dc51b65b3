"""Content of a ledger for who only looks: from a copy, because a running monitor locks its ledger."""

import sqlite3
from pathlib import Path
from typing import TypeVar

import attrs

from leg_wear_monitor.monitor.ledger.binding import Binding
from leg_wear_monitor.monitor.ledger.copy import copy_of
from leg_wear_monitor.monitor.ledger.entry import (
    ClearancePoint,
    Entry,
    ForecastPoint,
    Measurement,
    VerdictEvent,
)
from leg_wear_monitor.monitor.ledger.file import MOVE, LedgerError, connect
from leg_wear_monitor.monitor.ledger.recovery import migrated, recover
from leg_wear_monitor.monitor.ledger.rows import read_last_verdict, read_loads, read_measurements
from leg_wear_monitor.monitor.ledger.walked import WalkedLoad, together

_Row = TypeVar("_Row", ClearancePoint, ForecastPoint)


@attrs.frozen(kw_only=True, eq=False)
class LedgerContent:
    """What a ledger has of its leg.

    Attributes
    ----------
    entry : Entry or None
        The last entry; None in a new ledger.
    verdict : VerdictEvent or None
        The last change of the verdict.
    clearances : tuple of ClearancePoint
        In the order in which they were written.
    forecasts : dict of str to ForecastPoint
        The last forecast of each joint.
    measurements : tuple of Measurement
    loads : tuple of WalkedLoad
        Foot loads of all runs.
    """

    entry: Entry | None
    verdict: VerdictEvent | None
    clearances: tuple[ClearancePoint, ...]
    forecasts: dict[str, ForecastPoint]
    measurements: tuple[Measurement, ...]
    loads: tuple[WalkedLoad, ...]


def read_ledger(path: Path, binding: Binding) -> LedgerContent:
    """Read a ledger of a leg, which a monitor may be writing; the ledger and its files are left as they are.

    Raises
    ------
    LedgerError
        If it cannot be read, is damaged or of another leg; also if the monitor wrote while it was copied.
    """
    with copy_of(path) as copy:
        if not copy.is_file():
            raise LedgerError(f"{path}: cannot be read: there is no such file")
        db = connect(copy, binding)
        try:
            return _content(db, copy)
        except (sqlite3.Error, ValueError, TypeError) as error:
            raise LedgerError(f"{path}: is damaged: {error}; {MOVE}") from error
        finally:
            db.close()


def _content(db: sqlite3.Connection, copy: Path) -> LedgerContent:
    found = migrated(db, recover(db, copy))
    forecasts = _rows(db, ForecastPoint, "forecast WHERE id IN (SELECT max(id) FROM forecast GROUP BY joint)")
    return LedgerContent(
        entry=found.entry,
        verdict=read_last_verdict(db),
        clearances=_rows(db, ClearancePoint, "history ORDER BY id"),
        forecasts={point.joint: point for point in forecasts},
        measurements=read_measurements(db),
        loads=together(
            (
                *read_loads(db, "run != ?", found.entry_run),
                *(found.entry.loads if found.entry else ()),
            )
        ),
    )


def _rows(db: sqlite3.Connection, kind: type[_Row], where: str) -> tuple[_Row, ...]:
    """Rows of a table whose columns are the fields of a class."""
    names = [field.name for field in attrs.fields(kind)]
    rows = db.execute(f"SELECT {', '.join(names)} FROM {where}")
    return tuple(kind(**dict(zip(names, row, strict=True))) for row in rows)
