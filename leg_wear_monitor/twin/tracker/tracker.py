"""The crank tracker: converts samples in order of arrival to steps for the leg in order of stamps."""

from collections.abc import Iterator
from typing import NamedTuple

from leg_wear_monitor.record import Record, Records, new_records, record_of
from leg_wear_monitor.twin.sample import GAIT_SAMPLE, Samples
from leg_wear_monitor.twin.settings import TrackerSettings
from leg_wear_monitor.twin.steps import Steps, room_for_steps
from leg_wear_monitor.twin.tracker.crank_motion import IS_STARTING
from leg_wear_monitor.twin.tracker.state import (
    ARRIVALS,
    QUEUE,
    QUEUED,
    TRACKER_STATE,
    tracker_model,
)
from leg_wear_monitor.twin.tracker.tracking import track

_CHUNK = 256  # samples per call of the kernel
_STEPS_A_SAMPLE = 7  # largest number of steps per sample


class TrackerSnapshot(NamedTuple):
    """State of a tracker; the queues contain the waiting samples only."""

    state: Records
    arrivals: Records
    queue: Records


class CrankTracker:
    """Tracks the crank's motion from noisy, late, repeated and missing samples.

    Parameters
    ----------
    settings : TrackerSettings

    Attributes
    ----------
    records : Records
        The `TRACKER_STATE`, (1,), without the queues.
    state : Record
        The same record, by names.
    steps : Steps
        Steps of the last block of samples, with room for more.
    """

    def __init__(self, settings: TrackerSettings) -> None:
        self._model = tracker_model(settings)
        self.records, self._block = new_records(1, TRACKER_STATE), new_records(_CHUNK, GAIT_SAMPLE)
        self._arrivals, self._queue = new_records(ARRIVALS, GAIT_SAMPLE), new_records(QUEUE, QUEUED)
        self.state: Record = record_of(self.records)
        self.state.clock.tracking = IS_STARTING
        self.steps = room_for_steps(_STEPS_A_SAMPLE * (QUEUE + ARRIVALS + _CHUNK))

    def update(self, samples: Samples) -> Iterator[tuple[Steps, int]]:
        """Process a block (n,) of samples, in order of arrival.

        Yields
        ------
        steps : Steps
            Valid until the next iteration.
        n : int
            Number of steps.
        """
        for start in range(0, len(samples), _CHUNK):
            block = samples[start : start + _CHUNK]
            own = self._block[: len(block)]
            own[:] = block  # compiled code gets this layout only, and does not change the caller's array
            n = track(self._model, self.records, self._arrivals, self._queue, own, self.steps)
            yield self.steps, int(n)

    @property
    def due_stamp_ns(self) -> int:
        """Stamp that the samples of all kinds must reach for the next spline node; 0 while none is followed.

        The node is the first crank sample after its interval, so it may be reached a period later.
        """
        (model,), clock = self._model, self.state.clock
        if not clock.followed:
            return 0
        waits = model["node_interval_ns"] + model["lag_ns"] + model["reorder_window_ns"]
        return int(clock.last_node_ns + waits)

    def snapshot(self) -> TrackerSnapshot:
        """A copy of the whole state."""
        clock = self.state.clock
        return TrackerSnapshot(
            self.records.copy(),
            self._arrivals[: clock.waiting].copy(),
            self._queue[clock.head : clock.tail].copy(),
        )

    def restore(self, snapshot: TrackerSnapshot) -> None:
        """Restore a snapshot of a tracker of the same settings."""
        self.records[:] = snapshot.state
        clock = self.state.clock
        self._arrivals[: clock.waiting] = snapshot.arrivals
        self._queue[clock.head : clock.tail] = snapshot.queue
