"""Topic ``~/markers`` of the node; `messages.leg_markers` draws them."""

import time
from collections.abc import Callable
from functools import cached_property

from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node

from leg_wear_monitor.messages.leg_drawing import LegDrawing
from leg_wear_monitor.messages.leg_markers import MARKERS, SILENT_NS, LegMarkers
from leg_wear_monitor.messages.output import Outgoing
from leg_wear_monitor.monitor.reports import Reports
from leg_wear_monitor.monitor.wear_monitor import WearMonitor
from leg_wear_monitor.ros.outputs.outlets import Outlets


class MarkerTopic:
    """``~/markers``, while its parameter is on and somebody subscribes or the node is recorded.

    Parameters
    ----------
    node : rclpy.node.Node
    outlets : Outlets
    monitor : WearMonitor
    is_current : callable
        Returns whether there are current data; otherwise the leg is published in grey, once a second.
    """

    def __init__(
        self, node: Node, outlets: Outlets, monitor: WearMonitor, is_current: Callable[[], bool]
    ) -> None:
        self._node, self._outlets, self._monitor, self._is_current = node, outlets, monitor, is_current
        self._markers: LegMarkers | None = None
        if self._is_wanted:
            self._markers = LegMarkers(monitor, self._drawing)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        node.create_timer(SILENT_NS * 1.0e-9, self._show_silence, clock=steady)

    def publish(self, reports: Reports) -> None:
        """Publish the markers of reports."""
        for outgoing in self._drawn.of(reports) if self._is_wanted else ():
            self._send(outgoing)

    def operated(self) -> None:
        """Show alarms and verdict that an operator has changed."""
        if self._markers:
            self._markers.set_state(self._monitor.alarms, self._monitor.verdict)

    @cached_property
    def _drawing(self) -> LegDrawing:
        return LegDrawing(self._monitor.mechanism)

    @property
    def _drawn(self) -> LegMarkers:
        self._markers = self._markers or LegMarkers(self._monitor, self._drawing)
        return self._markers

    @property
    def _is_wanted(self) -> bool:
        """Whether markers are needed; if not, what they show is not kept up to date."""
        wanted = self._monitor.config.publish_markers and self._outlets.wanted(MARKERS)
        if not wanted:
            self._markers = None
        return wanted

    def _show_silence(self) -> None:
        if not self._is_current() and self._is_wanted:
            self._send(self._drawn.no_data(self._node.get_clock().now().nanoseconds))

    def _send(self, outgoing: Outgoing) -> None:
        self._outlets.send_many(outgoing.output, time.time_ns(), outgoing.messages)
