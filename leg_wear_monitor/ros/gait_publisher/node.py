"""Node ``gait_publisher``: publishes the sensor readings of a synthetic leg."""

import itertools
import queue
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions

from leg_wear_monitor.errors import ConfigError, LegWearError
from leg_wear_monitor.gait.leg import SyntheticLeg
from leg_wear_monitor.gait.sensors import Reading, readings
from leg_wear_monitor.json_text import json_text
from leg_wear_monitor.messages.streams import streams_read
from leg_wear_monitor.ros.gait_publisher.config import PublisherConfig
from leg_wear_monitor.ros.gait_publisher.sensor_messages import sensor_message
from leg_wear_monitor.ros.inputs.message_class import message_class
from leg_wear_monitor.ros.parameters.parameters import Parameters
from leg_wear_monitor.ros.running import WAKE_S, ClosingNode, run, spin, until_down
from leg_wear_monitor.ros.waiting import repeated

_BLOCK_S = 0.05  # walking time per computed block
_AHEAD = 20  # blocks
_LATE_S = 0.2


class GaitPublisher(ClosingNode):
    """The synthetic leg as a node.

    Attributes
    ----------
    config : PublisherConfig
    """

    def __init__(self, **options: Any) -> None:
        super().__init__("gait_publisher", **options)
        self.config = Parameters(self, PublisherConfig).config
        if self.config.precompute and not self.config.duration_s:
            raise ConfigError(self.get_fully_qualified_name(), "precompute", "needs a duration_s above 0 s")
        log = self.get_logger()
        log.info("preparing the leg; the first start compiles numerical kernels for a minute")
        with repeated(lambda passed_s: log.info(f"preparing the leg: {passed_s:.0f} s")):
            self._leg = SyntheticLeg(self.config)
            self._blocks = self._walk()
            if self.config.precompute:
                self._blocks = iter(list(self._blocks))
        qos = QoSProfile(depth=200, reliability=self._reliability())
        self._by_kind: dict[int, Publisher] = {
            stream.kind: self._publisher(message_class(stream.type), stream.topic, qos)
            for stream in streams_read(self.config.torque_sensor.source, self.config.foot_load_sensor.source)
        }
        self.published, self._start_ns = 0, 0

    def walk(self, wanted: Callable[[], bool] = lambda: True) -> None:
        """Publish in step with the clock until the walk ends or `wanted` returns false."""
        with until_down(self.context):
            self._walk_on(wanted)

    def _walk_on(self, wanted: Callable[[], bool]) -> None:
        blocks = self._blocks if self.config.precompute else self._computed_ahead()
        while wanted() and not self._heard():
            time.sleep(0.02)
        self._start_ns, began = self.get_clock().now().nanoseconds, time.monotonic()
        self.get_logger().info("walking")
        for reading in itertools.chain.from_iterable(blocks):
            due = began + reading.arrival_s / self.config.time_scale
            while (wait := due - time.monotonic()) > 0.0 and wanted():
                time.sleep(min(wait, WAKE_S))
            if not wanted():
                return
            if wait < -_LATE_S:
                self.get_logger().warning(
                    "the simulation is slower than the clock; lower rates or time_scale, or set precompute",
                    throttle_duration_sec=5.0,
                )
            message = sensor_message(reading, self._start_ns, self.config)
            self._by_kind[reading.kind].publish(message)
            self.published += 1

    def close(self) -> None:
        """Write the ground truth, if a file is configured."""
        path = self.config.truth.path
        if not path:
            return
        try:
            truth = {"start_ns": self._start_ns, **self._leg.truth()}
            Path(path).write_text(json_text(truth))
        except OSError as error:
            raise LegWearError(f"truth.path: {path}: cannot be written: {error.strerror}") from error

    def _publisher(self, kind: type, topic: str, qos: QoSProfile) -> Publisher:
        return self.create_publisher(
            kind, topic, qos, qos_overriding_options=QoSOverridingOptions.with_default_policies()
        )

    def _reliability(self) -> ReliabilityPolicy:
        return ReliabilityPolicy.RELIABLE if self.config.reliable else ReliabilityPolicy.BEST_EFFORT

    def _heard(self) -> bool:
        wanted = self.config.wait_for_subscribers
        return all(one.get_subscription_count() >= wanted for one in self._by_kind.values())

    def _walk(self) -> Iterator[list[Reading]]:
        """Readings in blocks of equal duration."""
        for _, block in itertools.groupby(
            readings(self._leg, self.config), lambda reading: int(reading.arrival_s / _BLOCK_S)
        ):
            yield list(block)

    def _computed_ahead(self) -> Iterator[list[Reading]]:
        """The walk, computed in a separate thread; its kernels release the GIL."""
        ready: queue.Queue[list[Reading] | LegWearError | None] = queue.Queue(_AHEAD)

        def compute() -> None:
            try:
                for block in self._blocks:
                    ready.put(block)
                ready.put(None)
            except LegWearError as error:
                ready.put(error)

        threading.Thread(target=compute, daemon=True).start()
        while (block := ready.get()) is not None:
            if isinstance(block, LegWearError):
                raise block
            yield block


def _serve(node: GaitPublisher, wanted: Callable[[], bool]) -> None:
    """Walk, while a thread answers parameter requests."""
    walking = threading.Event()
    walking.set()
    server = threading.Thread(target=spin, args=(node, walking.is_set))
    server.start()
    try:
        node.walk(wanted)
    finally:
        walking.clear()
        server.join()


def main(argv: Sequence[str] | None = None) -> int:
    """Entry point of ``ros2 run leg_wear_monitor gait_publisher``; returns the exit code."""
    return run(GaitPublisher, _serve, argv)
