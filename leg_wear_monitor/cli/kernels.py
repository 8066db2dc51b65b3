"""Kernels compiled ahead of their first use: by ``cache --fill``, before the tests, in a container."""

import itertools
import multiprocessing
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import AbstractContextManager, suppress

import leg_wear_monitor as lw
from leg_wear_monitor.files import share_directory
from leg_wear_monitor.gait.config import GaitConfig
from leg_wear_monitor.gait.leg import SyntheticLeg
from leg_wear_monitor.gait.sensors import readings
from leg_wear_monitor.messages.cdr import Decoder
from leg_wear_monitor.messages.streams import STREAMS

SETS = ("clearance", "full", "gait", "monitor")
"""Sets of kernels that are then there, as commands name them."""


def _simulation() -> None:
    """Motion in clearance and in full coordinates, and the synthetic leg."""
    for model in ("clearance", "full"):
        lw.simulate("bionic_leg", clearances=("G",), cycles=0.01, skip_cycles=0.0, model=model)
    config = GaitConfig()
    list(itertools.islice(readings(SyntheticLeg(config), config), 3))


def _monitor() -> None:
    """What the monitor runs beside the leg."""
    lw.WearMonitor(lw.load_mechanism()).warm_up()


def _reading() -> None:
    """What reads messages, and recordings where their libraries are installed."""
    decoder = Decoder(lw.MonitorConfig())
    for stream in STREAMS:
        decoder.one(b"", stream.code)
    with suppress(ModuleNotFoundError):
        from leg_wear_monitor.bags.reader import Recording

        path = share_directory() / "bags" / "healthy.mcap"
        with Recording([path], lw.load_config(path.with_suffix(".yaml"))) as recording:
            next(recording.blocks())


_JOBS: tuple[Callable[[], None], ...] = (_simulation, _monitor, _reading)


def compile_all(progress: AbstractContextManager[Callable[[float], None]]) -> None:
    """Compile what simulations, monitor, synthetic leg and replays need, in two processes.

    Parameters
    ----------
    progress : context manager
        Gives a function that takes the fraction done.
    """
    # a process that starts anew would import from the current directory; forked, before there is a thread
    with ProcessPoolExecutor(2, multiprocessing.get_context("fork")) as pool:
        jobs = [pool.submit(job) for job in _JOBS]
        with progress as show:
            for number, job in enumerate(as_completed(jobs), 1):
                job.result()
                show(number / len(jobs))
