"""Writes reports to an MCAP file, as the messages that a live node would have published."""

from contextlib import suppress
from pathlib import Path
from types import TracebackType

from leg_wear_monitor.bags.findings import RecordingError
from leg_wear_monitor.bags.mcap.writer import McapWriter
from leg_wear_monitor.messages.forecast_times import ForecastTimes
from leg_wear_monitor.messages.leg_drawing import LegDrawing
from leg_wear_monitor.messages.leg_markers import LegMarkers
from leg_wear_monitor.messages.output import topic_of
from leg_wear_monitor.messages.outputs import ALARMS, DIAGNOSTICS, FORECAST, VERDICT, Messages
from leg_wear_monitor.monitor.config.parameter_file import NODE
from leg_wear_monitor.monitor.reports import Reports
from leg_wear_monitor.monitor.wear_monitor import WearMonitor

_CHUNK_BYTES = 2**20


class Sink:
    """An MCAP file with all topics of the monitor, including those without messages.

    Parameters
    ----------
    path : pathlib.Path
    monitor : WearMonitor
    node : str
        Full name of the publishing node.

    Raises
    ------
    RecordingError
        If writing to the disk fails.
    """

    def __init__(self, path: Path, monitor: WearMonitor, node: str = NODE) -> None:
        self._monitor = monitor
        self._messages = Messages(monitor.config, monitor.clearance_joints, node)
        self._writer = McapWriter(path, chunk_bytes=_CHUNK_BYTES)
        self._channels = {
            output: self._writer.channel(topic_of(output, node), output.type, output.qos)
            for output in self._messages.outputs
        }
        self._start, self._has_begun = (monitor.alarms, monitor.verdict), False
        self._forecasts = ForecastTimes()
        self._markers = (
            LegMarkers(monitor, LegDrawing(monitor.mechanism)) if monitor.config.publish_markers else None
        )

    def __enter__(self) -> "Sink":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is None:
            self._writer.close()
            return
        with suppress(RecordingError):  # report the original error, not one from closing the file
            self._writer.close()

    def take(self, reports: Reports, stamp_ns: int) -> None:
        """Write reports and the status of the monitor after them.

        Parameters
        ----------
        reports : Reports
        stamp_ns : int
            Stamp of the status [ns]; 0 if no time is known yet.
        """
        if stamp_ns > 0 and not self._has_begun:
            self._has_begun = True  # like the node, begin with the state of all alarms and the verdict
            alarms, verdict = self._start
            self._writer.write(self._channels[ALARMS], stamp_ns, self._messages.alarms(alarms))
            self._writer.write(self._channels[VERDICT], stamp_ns, self._messages.verdict(verdict))
        for outgoing in self._messages.of(reports):
            self._writer.write_many(self._channels[outgoing.output], outgoing.stamp_ns, outgoing.messages)
        for outgoing in self._markers.of(reports) if self._markers else ():
            self._writer.write_many(self._channels[outgoing.output], outgoing.stamp_ns, outgoing.messages)
        for cycle in self._forecasts.due(reports):
            raw = self._messages.forecast(cycle)
            self._writer.write(self._channels[FORECAST], cycle.stamp_ns, raw)
        if stamp_ns > 0:
            raw = self._messages.diagnostics(stamp_ns, self._monitor.status())
            self._writer.write(self._channels[DIAGNOSTICS], stamp_ns, raw)
