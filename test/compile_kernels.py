"""Compile the kernels before the tests: in two processes, each kernel once, and unseen by coverage.

Two workers that begin with an empty cache compile the same kernels at the same time, and a compilation
that coverage traces takes almost half as long again.
"""

from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor

import leg_wear_monitor as lw
from leg_wear_monitor.bags.reader import Recording
from leg_wear_monitor.files import share_directory


def simulation() -> None:
    """Motion in clearance and in full coordinates."""
    for model in ("clearance", "full"):
        lw.simulate("bionic_leg", clearances=("G",), cycles=0.01, skip_cycles=0.0, model=model)


def monitor() -> None:
    """What the monitor runs beside the leg."""
    lw.WearMonitor(lw.load_mechanism()).warm_up()


def reading() -> None:
    """What reads a recording."""
    healthy = share_directory() / "bags" / "healthy"
    with Recording([healthy.with_suffix(".mcap")], lw.load_config(healthy.with_suffix(".yaml"))) as recording:
        next(recording.blocks())


def main() -> None:
    jobs: tuple[Callable[[], None], ...] = (simulation, monitor, reading)
    with ProcessPoolExecutor(2) as pool:
        for done in [pool.submit(job) for job in jobs]:
            done.result()


if __name__ == "__main__":
    main()
