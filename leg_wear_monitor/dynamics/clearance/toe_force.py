"""A force on the toe, at each point of the leg's tables (physics.md section 9).

The tables are linear in the force, point by point.
"""

from typing import NamedTuple

import attrs
import numpy as np

from leg_wear_monitor.contact.arrays import ContactArrays
from leg_wear_monitor.dynamics.clearance.tables import COARSER, ClearanceTables, build_tables
from leg_wear_monitor.mechanism.arrays import Floats, Ints, Singles
from leg_wear_monitor.mechanism.position import Linkage, build_linkage
from leg_wear_monitor.mechanism.spec import ConstantLoad

_TRIAL_N = 100.0


class LoadedTable(NamedTuple):
    """A table that the force changes: its rows (n, w), columns (c,), parts (3, n, c): bare, per x, per y."""

    rows: Floats | Singles
    columns: Ints
    parts: Floats


class LoadedTables(NamedTuple):
    """Those of `ClearanceTables`."""

    motion: LoadedTable
    reaction: LoadedTable
    stored: LoadedTable
    by_e: LoadedTable


def loaded_tables(linkage: Linkage, contacts: ContactArrays, tables: ClearanceTables) -> LoadedTables:
    """What a force on the toe changes.

    Parameters
    ----------
    linkage : Linkage
        One without a toe has nothing to push.
    contacts : ContactArrays
    tables : ClearanceTables
        Of this linkage; `put_force` changes them.
    """
    mechanism = linkage.mechanism
    others = []
    for push in ((_TRIAL_N, 0.0), (0.0, _TRIAL_N)):
        if mechanism.toe is None:
            break
        trial = ConstantLoad(body=mechanism.toe[0], point=mechanism.toe[1], force=push)
        pushed = attrs.evolve(mechanism, loads={**mechanism.loads, "trial of a toe force": trial})
        others.append(build_tables(build_linkage(pushed), contacts))
    return LoadedTables(*(_loaded(name, tables, others) for name in LoadedTables._fields))


def put_force(loaded: LoadedTables, force: Floats) -> None:
    """Set the tables to a force (N, 2) [N] along the axes of the mechanism, at their points of a turn."""
    fine = np.concatenate([force, force[:1]])
    for table, step in zip(loaded, (1, 1, 1, COARSER), strict=True):
        fx, fy = fine[::step].T[:, :, None]
        table.rows[:, table.columns] = table.parts[0] + fx * table.parts[1] + fy * table.parts[2]


def _loaded(name: str, tables: ClearanceTables, others: list[ClearanceTables]) -> LoadedTable:
    table = getattr(tables, name)
    rows = table.reshape(len(table), -1)  # a view
    if not others:
        return LoadedTable(rows, np.zeros(0, np.int64), np.zeros((3, len(rows), 0)))
    slopes = [(getattr(other, name).reshape(rows.shape).astype(float) - rows) / _TRIAL_N for other in others]
    columns = np.flatnonzero(np.any(slopes, axis=(0, 1)))
    parts = np.stack([rows.astype(float), *slopes])[:, :, columns]
    return LoadedTable(rows, columns.astype(np.int64), np.ascontiguousarray(parts))
