"""The crank tracker: samples in order of arrival become steps for the leg in order of their stamps."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from leg_wear_monitor.twin.sample import Samples
from leg_wear_monitor.twin.settings import TrackerSettings
from leg_wear_monitor.twin.steps import Steps, room_for_steps
from leg_wear_monitor.twin.tracker.state import (
    ARRIVALS,
    HEAD,
    QUEUE,
    TAIL,
    WAITING,
    TrackerState,
    tracker_model,
    tracker_state,
)
from leg_wear_monitor.twin.tracker.tracking import track

_CHUNK = 256  # samples taken in at once
_STEPS_A_SAMPLE = 7  # at most

_MEASURED = ("crank_angle_rad", "crank_velocity_radps", "torque_nm")
_ARRIVAL = ("arrival_stamp", "arrival_kind", "arrival")
_QUEUE = ("queue_stamp", "queue_kind", "queue")


class TrackerSnapshot(NamedTuple):
    """A tracker's state, of what waits only what is there."""

    fixed: tuple[np.ndarray, ...]
    waiting: tuple[np.ndarray, ...]
    queued: tuple[np.ndarray, ...]


class CrankTracker:
    """Follows the crank through noisy, late, repeated and missing samples.

    Parameters
    ----------
    settings : TrackerSettings
    """

    def __init__(self, settings: TrackerSettings) -> None:
        self._model = tracker_model(settings)
        self.state: TrackerState = tracker_state()
        self._work = np.zeros((3, 3))
        self._steps = room_for_steps(_STEPS_A_SAMPLE * (QUEUE + ARRIVALS + _CHUNK))

    def update(self, samples: Samples) -> Iterator[tuple[Steps, int]]:
        """Take in a block (n,) of samples, in order of arrival.

        Yields
        ------
        steps : Steps
            Valid until the next is asked for.
        n : int
            Number of steps.
        """
        for start in range(0, len(samples), _CHUNK):
            block = samples[start : start + _CHUNK]
            stamp, kind, fault = (np.array(block[name], np.int64) for name in ("stamp_ns", "kind", "fault"))
            angle, velocity, torque = (np.array(block[name]) for name in _MEASURED)
            yield (
                self._steps,
                int(
                    track(
                        self._model,
                        self.state,
                        stamp,
                        kind,
                        fault,
                        angle,
                        velocity,
                        torque,
                        self._work,
                        self._steps,
                    )
                ),
            )

    def snapshot(self) -> TrackerSnapshot:
        """A copy of the whole state."""
        state, clock = self.state, self.state.clock
        queued = slice(int(clock[HEAD]), int(clock[TAIL]))
        return TrackerSnapshot(
            tuple(np.array(part) for part in state[: -len(_ARRIVAL + _QUEUE)]),
            tuple(getattr(state, name)[: clock[WAITING]].copy() for name in _ARRIVAL),
            tuple(getattr(state, name)[queued].copy() for name in _QUEUE),
        )

    def restore(self, snapshot: TrackerSnapshot) -> None:
        """Go back to a snapshot of a tracker of the same settings."""
        for part, saved in zip(self.state, snapshot.fixed, strict=False):
            part[:] = saved
        clock = self.state.clock
        for name, saved in zip(_ARRIVAL, snapshot.waiting, strict=True):
            getattr(self.state, name)[: clock[WAITING]] = saved
        for name, saved in zip(_QUEUE, snapshot.queued, strict=True):
            getattr(self.state, name)[clock[HEAD] : clock[TAIL]] = saved
