"""Reports into an MCAP file: what the node would have published."""

from contextlib import suppress
from pathlib import Path
from types import TracebackType

from leg_wear_monitor.monitor.reports import CycleReport, Reports
from leg_wear_monitor.monitor.wear_monitor import WearMonitor
from leg_wear_monitor.recording.findings import RecordingError
from leg_wear_monitor.recording.outputs import DIAGNOSTICS, FORECAST, OUTPUTS, Messages, topic_of
from leg_wear_monitor.recording.writer import McapWriter

NODE = "/leg_wear_monitor"
_FORECAST_NS = 60 * 10**9
_CHUNK_BYTES = 2**20


class Sink:
    """An MCAP file of the monitor's topics; all are there, used or not.

    Parameters
    ----------
    path : pathlib.Path
    monitor : WearMonitor

    Raises
    ------
    RecordingError
        If the disk does not take it.
    """

    def __init__(self, path: Path, monitor: WearMonitor) -> None:
        self._monitor = monitor
        self._messages = Messages(monitor.config, monitor.loose)
        self._writer = McapWriter(path, chunk_bytes=_CHUNK_BYTES)
        self._channels = {
            output: self._writer.channel(topic_of(output, NODE), output.type, output.qos)
            for output in OUTPUTS
        }
        self._forecast_ns: int | None = None

    def __enter__(self) -> "Sink":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is None:
            self._writer.close()
            return
        with suppress(RecordingError):  # the error on its way is the one to tell
            self._writer.close()

    def take(self, reports: Reports, stamp_ns: int) -> None:
        """Write what was reported, and how the monitor then stood.

        Parameters
        ----------
        reports : Reports
        stamp_ns : int
            Of the status; 0 before there is any time.
        """
        for outgoing in self._messages.of(reports):
            self._writer.write_many(self._channels[outgoing.output], outgoing.stamp_ns, outgoing.messages)
        for cycle in reports.cycles:
            self._forecast(cycle)
        if stamp_ns > 0:
            raw = self._messages.diagnostics(stamp_ns, self._monitor.status())
            self._writer.write(self._channels[DIAGNOSTICS], stamp_ns, raw)

    def _forecast(self, cycle: CycleReport) -> None:
        """Write a forecast with the first gait cycle of each minute."""
        if self._forecast_ns is not None and 0 <= cycle.stamp_ns - self._forecast_ns < _FORECAST_NS:
            return
        self._forecast_ns = cycle.stamp_ns
        self._writer.write(self._channels[FORECAST], cycle.stamp_ns, self._messages.forecast(cycle))
