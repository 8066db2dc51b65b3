"""A monitor with a ledger on an endless steady gait, to be killed: says on stdout how far it is.

Lines are ``begin NS`` before a block is handed on and ``end NS`` after; NS is the block's last stamp.
"""

import sys

import numpy as np

import leg_wear_monitor as lw
from leg_wear_monitor.monitor.config.parameters import config_from
from leg_wear_monitor.twin.sample import gait_samples

START_NS, RATE_HZ, BLOCK = 1_700_000_000_000_000_000, 200, 20


def walk(path: str, checkpoint_s: float, begin_s: float, end_s: float) -> None:
    config = config_from({"ledger.path": path, "ledger.checkpoint_s": checkpoint_s})
    leg = lw.load_mechanism("bionic_leg")
    print("opening", flush=True)
    ledger = lw.open_ledger(leg, config)
    monitor = lw.WearMonitor(leg, config, ledger)
    monitor.warm_up()
    cut_off = "none" if ledger.cut_off_s is None else f"{ledger.cut_off_s:.9f}"
    print("started", ledger.kept_ns, cut_off, flush=True)
    for first in range(round(begin_s * RATE_HZ), round(end_s * RATE_HZ), BLOCK):
        n = np.arange(first, first + BLOCK)
        stamps = START_NS + n * (10**9 // RATE_HZ)
        print("begin", int(stamps[-1]), flush=True)
        monitor.update(gait_samples(stamps, crank_angle_rad=2.0 * np.pi * n / RATE_HZ % (2.0 * np.pi)))
        print("end", int(stamps[-1]), flush=True)
    monitor.close()
    print("closed", flush=True)


if __name__ == "__main__":
    walk(sys.argv[1], *map(float, sys.argv[2:]))
