"""Two runs with the same stamps: left out if they are the same time, counted if the clock began anew."""

import sqlite3
from contextlib import closing

import numpy as np
import pytest

from leg_wear_monitor import WearMonitor, open_ledger
from leg_wear_monitor.monitor.config.parameters import config_from


@pytest.fixture
def begin(leg, tmp_path):
    """Begin a run of a monitor on the ledger of this test."""
    config = config_from({"ledger.path": str(tmp_path / "wear.ledger"), "clearance_joints": ["G"]})
    return lambda: WearMonitor(leg, config, open_ledger(leg, config))


def test_a_run_by_a_clock_that_began_anew_is_counted_in_an_epoch_of_its_own(begin, gait, tmp_path) -> None:
    walk = gait(2.5)
    first = begin()
    assert not first.begin_run("one")
    first.update(walk)
    once = first.wear_of("G")
    first.close()
    second = begin()
    assert second.begin_run("two")
    assert second.counted(walk).mean() > 0.9
    second.begin_epoch(int(walk["stamp_ns"][0]), "clock")
    assert not second.counted(walk).any()
    second.update(walk)
    twice = second.wear_of("G")
    assert twice.depth.sum() > 1.9 * once.depth.sum()
    second.close()
    with closing(sqlite3.connect(tmp_path / "wear.ledger")) as db:
        spans = db.execute("SELECT run, epoch FROM span ORDER BY run").fetchall()
        runs = db.execute("SELECT epoch, boot_id FROM run ORDER BY id").fetchall()
        (audit,) = db.execute("SELECT who, what FROM audit").fetchall()
    assert spans == [(1, 0), (2, 1)]
    assert runs == [(0, "one"), (1, "two")]
    assert audit == ("clock", "new_epoch")
    third = begin()
    third.update(walk)  # a recording of either
    assert np.array_equal(third.wear_of("G").depth, twice.depth)
    third.close()


def test_a_clock_that_begins_anew_within_a_run_keeps_both_spans(begin, gait, tmp_path) -> None:
    monitor = begin()
    monitor.update(gait(1.0))
    monitor.begin_epoch(1, "clock")
    monitor.update(gait(1.0, begin_s=0.5))
    monitor.close()
    with closing(sqlite3.connect(tmp_path / "wear.ledger")) as db:
        spans = db.execute("SELECT epoch, end_ns > begin_ns FROM span ORDER BY part").fetchall()
    assert spans == [(0, 1), (1, 1)]
