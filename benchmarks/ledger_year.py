"""A year of ledger: bytes written, and size of the file at its end.

    python benchmarks/ledger_year.py [DAYS] [DIRECTORY]

Eight hours of walking a day, an entry each 5 s, a run a day, through the ledger's own code with its fsyncs.
The surfaces' rises come from the default leg's twin at 60 rpm with encoder noise, one minute of it over and
over. All whole surfaces and all history are written; of the stretches of a minute between them, the
entries of one in `EACH` are written in truth and count as often. Bytes are those handed to the system
(``/proc/self/io``: wchar), and beside them the pages that it has to bring to the disk (write_bytes).
"""

import sys
import tempfile
import time
from pathlib import Path

import attrs
import numpy as np

import leg_wear_monitor as lw
from leg_wear_monitor.monitor.accounting import next_point_s
from leg_wear_monitor.monitor.config.fitting import fitted
from leg_wear_monitor.monitor.ledger.entry import ClearancePoint, Entry, ForecastPoint, JointWear, binding_of
from leg_wear_monitor.monitor.ledger.ledger import WHOLE_S, Ledger
from leg_wear_monitor.twin.sample import gait_samples

CHECKPOINT_S, DAY_S = 5.0, 8 * 3600.0
EACH = 97
RATE_HZ = 200
GB = 1.0e9


def rises(leg, config):
    """What surfaces (joints, 2, N) rise in each of twelve times 5 s [m]."""
    monitor = lw.WearMonitor(leg, config)
    random, depths = np.random.default_rng(1), []
    for part in range(13):
        n = np.arange(part * 5 * RATE_HZ, (part + 1) * 5 * RATE_HZ)
        angle = 2.0 * np.pi * n / RATE_HZ + 1.0e-3 * random.standard_normal(len(n))
        stamps = 10**18 + n * (10**9 // RATE_HZ)
        monitor.update(gait_samples(stamps, crank_angle_rad=angle % (2.0 * np.pi)))
        depths.append(monitor.wear_depth_m)
    return np.diff(depths, axis=0), monitor.clearance_joints


def written():
    """Bytes handed to the system, and bytes of pages that have to go to the disk."""
    values = dict(line.split(": ") for line in Path("/proc/self/io").read_text().splitlines())
    return np.array([int(values["wchar"]), int(values["write_bytes"])])


class Walk:
    """Entry after entry."""

    def __init__(self, rise, clearance_joints):
        self.rise, self.clearance_joints = rise, clearance_joints
        self.depth = np.zeros(rise.shape[1:])
        self.count, self.begin_ns, self.point_due_s = 0, 10**18, 0.0

    def entry(self):
        """The next one, 5 s on."""
        self.depth = self.depth + self.rise[self.count % len(self.rise)]
        self.count += 1
        moving_s, stamp_ns = CHECKPOINT_S * self.count, self.begin_ns + self.count * 5 * 10**9
        return Entry(
            stamp_ns=stamp_ns,
            joints=tuple(
                JointWear(name, depth, round(moving_s), moving_s, 0)
                for name, depth in zip(self.clearance_joints, self.depth, strict=True)
            ),
            totals={"cycles": moving_s, "moving_s": moving_s, "standing_s": 0.0, "bridged_s": 0.1},
            spans=((self.begin_ns, stamp_ns, 0),),
        )

    def points(self, entry):
        """What the history takes now and then."""
        for joint in self.clearance_joints:
            yield ClearancePoint(entry.stamp_ns, round(entry.moving_s), joint, 3.1e-4, 3.2e-4)
            yield ForecastPoint(entry.stamp_ns, round(entry.moving_s), joint, 1e8, 2e8, 3e8)


def keep(ledger, entry, **how):
    """Write an entry; a year without a fault is what is asked for."""
    if not ledger.keep(entry, **how):
        raise OSError(ledger.fault)


def a_day(walk, path, binding, stretch, costs):
    """One run of a day: a stretch between whole surfaces after the other."""
    before = written()
    ledger = Ledger(path, binding, CHECKPOINT_S)
    costs["opened and closed"] += written() - before
    for _ in range(round(DAY_S / WHOLE_S)):
        is_written = stretch[0] % EACH == 0
        stretch[0] += 1
        for _ in range(round(WHOLE_S / CHECKPOINT_S) - 1):
            entry = walk.entry()
            if is_written:
                before = written()
                keep(ledger, entry, whole=False)
                costs["entries"] += written() - before
                costs["entries written"] += 1
        entry = walk.entry()
        before = written()
        if entry.moving_s >= walk.point_due_s:
            walk.point_due_s = next_point_s(entry.moving_s)
            for point in walk.points(entry):
                ledger.note(point)
        keep(ledger, entry, whole=False)
        costs["whole"] += written() - before
    before = written()
    keep(ledger, entry, closed=True)
    ledger.close()
    costs["opened and closed"] += written() - before


def main(days, directory):
    config, leg = lw.MonitorConfig(), lw.load_mechanism("bionic_leg")
    config = attrs.evolve(config, ledger=attrs.evolve(config.ledger, checkpoint_s=CHECKPOINT_S))
    binding = binding_of(fitted(leg, config), config)
    walk = Walk(*rises(leg, config))
    costs = {name: np.zeros(2) for name in ("entries", "whole", "opened and closed", "entries written")}
    stretch, began = [0], time.perf_counter()
    with tempfile.TemporaryDirectory(dir=directory) as place:
        path = Path(place) / "wear.ledger"
        for day in range(days):
            walk.begin_ns = 10**18 + day * 86400 * 10**9
            a_day(walk, path, binding, stretch, costs)
        size = path.stat().st_size
        began_open = time.perf_counter()
        Ledger(path, binding, CHECKPOINT_S).close()
        opened_s = time.perf_counter() - began_open
    number = round(days * DAY_S / CHECKPOINT_S)
    an_entry = costs["entries"] / costs["entries written"]
    entries = (number - round(days * DAY_S / WHOLE_S)) * an_entry
    total = entries + costs["whole"] + costs["opened and closed"]
    print(f"{days} days, {number} entries, {costs['entries written'][0]:.0f} entries written in truth")
    print(f"{'':24}{'handed on':>14}{'pages':>14}")
    print(f"{'an entry':24}{an_entry[0]:12.0f} B{an_entry[1]:12.0f} B")
    a_whole = costs["whole"] / round(days * DAY_S / WHOLE_S)
    print(f"{'with whole surfaces':24}{a_whole[0]:12.0f} B{a_whole[1]:12.0f} B")
    for name, cost in (("entries", entries), ("whole surfaces", costs["whole"]), ("all", total)):
        print(f"{name:24}{cost[0] / GB:11.2f} GB{cost[1] / GB:11.2f} GB")
    print(f"size at the end {size / 1e6:.1f} MB, opened and checked in {opened_s:.1f} s")
    print(f"took {time.perf_counter() - began:.0f} s")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 365, sys.argv[2] if len(sys.argv) > 2 else None)
