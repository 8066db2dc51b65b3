"""A monitor with a ledger on a steady gait, to be killed: says ``saved N`` when N blocks are kept."""

import itertools
import sys
from collections.abc import Iterator
from typing import Any

import attrs
import numpy as np

import leg_wear_monitor as lw

START_NS, RATE_HZ, BLOCK, TOGETHER = 1_700_000_000 * 10**9, 200, 20, 5


def walk(begin_s: float, end_s: float) -> Iterator[Any]:
    """Blocks of samples of a steady gait at 60 rpm."""
    for first in range(round(begin_s * RATE_HZ), round(end_s * RATE_HZ), BLOCK):
        n = np.arange(first, first + BLOCK)
        angle = 2.0 * np.pi * n / RATE_HZ % (2.0 * np.pi)
        yield lw.gait_samples(START_NS + n * (10**9 // RATE_HZ), crank_angle_rad=angle)


def opened(parameters: str) -> lw.WearMonitor:
    """A monitor on the ledger that the parameters name."""
    config = lw.load_config(parameters)
    config = attrs.evolve(config, ledger=attrs.evolve(config.ledger, checkpoint_s=600.0))
    leg = lw.load_mechanism(config.mechanism)
    return lw.WearMonitor(leg, config, lw.open_ledger(leg, config))


def main(parameters: str, blocks: int) -> None:
    monitor = opened(parameters)
    print("started", flush=True)
    for number, block in enumerate(itertools.islice(walk(0.0, 10_000.0), blocks), 1):
        monitor.update(block)
        if number % TOGETHER == 0:
            monitor.save()
            print("saved", number, flush=True)
    sys.stdin.read()


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]))
