"""Reports into an MCAP file: what the node would have published."""

from contextlib import suppress
from pathlib import Path
from types import TracebackType

from leg_wear_monitor.bags.findings import RecordingError
from leg_wear_monitor.bags.mcap.writer import McapWriter
from leg_wear_monitor.messages.forecast_times import ForecastTimes
from leg_wear_monitor.messages.outputs import ALARMS, DIAGNOSTICS, FORECAST, OUTPUTS, Messages, topic_of
from leg_wear_monitor.monitor.config.parameter_file import NODE
from leg_wear_monitor.monitor.reports import Reports
from leg_wear_monitor.monitor.wear_monitor import WearMonitor

_CHUNK_BYTES = 2**20


class Sink:
    """An MCAP file of the monitor's topics; all are there, used or not.

    Parameters
    ----------
    path : pathlib.Path
    monitor : WearMonitor
    node : str
        Full name of the node that would have published.

    Raises
    ------
    RecordingError
        If the disk does not take it.
    """

    def __init__(self, path: Path, monitor: WearMonitor, node: str = NODE) -> None:
        self._monitor = monitor
        self._messages = Messages(monitor.config, monitor.clearance_joints, node)
        self._writer = McapWriter(path, chunk_bytes=_CHUNK_BYTES)
        self._channels = {
            output: self._writer.channel(topic_of(output, node), output.type, output.qos)
            for output in OUTPUTS
        }
        self._start, self._has_begun = monitor.alarms, False
        self._forecasts = ForecastTimes()

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
        if stamp_ns > 0 and not self._has_begun:
            self._has_begun = True  # as the node begins: with all alarms as they stand
            self._writer.write(self._channels[ALARMS], stamp_ns, self._messages.alarms(self._start))
        for outgoing in self._messages.of(reports):
            self._writer.write_many(self._channels[outgoing.output], outgoing.stamp_ns, outgoing.messages)
        for cycle in self._forecasts.due(reports):
            raw = self._messages.forecast(cycle)
            self._writer.write(self._channels[FORECAST], cycle.stamp_ns, raw)
        if stamp_ns > 0:
            raw = self._messages.diagnostics(stamp_ns, self._monitor.status())
            self._writer.write(self._channels[DIAGNOSTICS], stamp_ns, raw)
