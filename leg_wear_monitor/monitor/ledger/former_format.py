"""Checks of ledgers up to format 3: only their entry and their encoders' errors have checksums."""

import sqlite3

import attrs
import numpy as np

from leg_wear_monitor.monitor.alarms.alarm import Alarm, Level
from leg_wear_monitor.monitor.ledger.entry import Commissioned, Entry, JointWear


def verify_former(db: sqlite3.Connection, found: int) -> None:
    """Verify the existing checksums before a file is migrated.

    Raises
    ------
    ValueError
        If the content differs from what was written.
    """
    row = db.execute("SELECT run, stamp_ns, digest FROM entry").fetchone()
    if row is not None and _entry(db, *row[:2]).digest() != row[2]:
        raise ValueError("its checksum is not that of its content")
    if found < 3:
        return
    for stamp_ns, text, errors, digest in db.execute(
        "SELECT stamp_ns, encoders, errors, digest FROM commissioning"
    ):
        names, values = tuple(text.split("\n")), np.frombuffer(errors, "<f8")
        m, p = len(names), 1 + 2 * len(names)
        held = Commissioned(stamp_ns, names, values[:m], values[m : m + p], values[m + p :])
        if held.digest() != digest:
            raise ValueError("the checksum of its encoders' errors is not that of its content")


def _entry(db: sqlite3.Connection, run: int, stamp_ns: int) -> Entry:
    spans = db.execute("SELECT begin_ns, end_ns FROM span WHERE run = ? ORDER BY part", (run,))
    joints = db.execute("SELECT name, depth, cycles, moving_s, replaced_ns FROM joint ORDER BY name")
    alarms = db.execute("SELECT kind, subject, level, present, acknowledged, raised_ns FROM alarm")
    return Entry(
        stamp_ns=stamp_ns,
        joints=tuple(
            JointWear(name, np.frombuffer(depth, "<f8").reshape(2, -1), *rest)
            for name, depth, *rest in joints
        ),
        totals=dict(db.execute("SELECT name, value FROM total")),
        alarms=tuple(
            Alarm(
                kind=kind, subject=subject, level=Level(level), present=Level(present),
                acknowledged=bool(acknowledged), raised_ns=raised_ns,
            )
            for kind, subject, level, present, acknowledged, raised_ns in alarms
        ),
        spans=tuple(spans.fetchall()),
    )  # fmt: skip


def sampling_to_joints(entry: Entry) -> Entry:
    """Move variances by sampled replays, which were totals up to format 8, to the joints that they are of."""
    totals, joints = dict(entry.totals), []
    for joint in entry.joints:
        variance_m2 = totals.pop(f"sampling_variance_{joint.name}_m2", joint.sampling_m2)
        joints.append(attrs.evolve(joint, sampling_m2=variance_m2))
    return attrs.evolve(entry, joints=tuple(joints), totals=totals)
