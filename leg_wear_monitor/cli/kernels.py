"""Kernels compiled ahead of their first use: by ``cache --fill``, before the tests, in a container."""

import itertools
from collections.abc import Callable
from contextlib import AbstractContextManager, suppress
from importlib.util import find_spec

import numpy as np

import leg_wear_monitor as lw
from leg_wear_monitor.files import share_directory
from leg_wear_monitor.gait.config import GaitConfig
from leg_wear_monitor.gait.leg import SyntheticLeg
from leg_wear_monitor.gait.sensors import readings
from leg_wear_monitor.recordings.cdr import Decoder
from leg_wear_monitor.recordings.streams import STREAMS
from leg_wear_monitor.twin.reference import CrankProfile, LegParameters
from leg_wear_monitor.twin.references import TorqueReferenceRun
from leg_wear_monitor.workers import results


def _simulation() -> None:
    """Motion in clearance and in full coordinates, and the synthetic leg."""
    for model in ("clearance", "full"):
        lw.simulate("bionic_leg", clearances=("G",), cycles=0.01, skip_cycles=0.0, model=model)
    config = GaitConfig()
    list(itertools.islice(readings(SyntheticLeg(config), config), 3))


def _monitor() -> None:
    """Run the kernels of the monitor, and of the reference that it simulates while the leg walks."""
    leg = lw.load_mechanism()
    lw.WearMonitor(leg).warm_up()
    parameters, depth = LegParameters.none(leg), np.zeros((len(leg.clearance_joints), 2, 1))
    run = TorqueReferenceRun(leg, cycles=1, far_cycles=1)
    run.begin_expected(np.zeros(len(depth)), depth, CrankProfile.steady(1.0), parameters)
    run.finish()


def _reading() -> None:
    """Run the kernels that read messages, and recordings if their libraries are installed."""
    decoder = Decoder(lw.MonitorConfig())
    for stream in STREAMS:
        decoder.one(b"", stream.code)
    with suppress(ModuleNotFoundError):
        from leg_wear_monitor.recordings.reader import Recording

        path = share_directory() / "bags" / "healthy.mcap"
        with Recording([path], lw.load_config(path.with_suffix(".yaml"))) as recording:
            next(recording.blocks())


_CALLS: dict[str, Callable[[], None]] = {call.__name__: call for call in (_simulation, _monitor, _reading)}


def compile_all(progress: AbstractContextManager[Callable[[float], None]]) -> None:
    """Compile all kernels for simulation, monitor, synthetic leg and replay; with joblib in two processes.

    Parameters
    ----------
    progress : context manager
        Gives a function that takes the fraction done.
    """
    with progress as show:
        for done, _ in enumerate(results(_CALLS, 2 if find_spec("joblib") else 1), start=1):
            show(done / len(_CALLS))
