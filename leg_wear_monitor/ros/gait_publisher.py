"""Node ``gait_publisher``: publishes the sensor readings of a synthetic leg."""

import itertools
import math
import queue
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, TypeAlias

import attrs
from builtin_interfaces.msg import Time
from geometry_msgs.msg import WrenchStamped
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions
from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState
from std_msgs.msg import Bool, Float64, Header

from leg_wear_monitor.configuration import described, quantity
from leg_wear_monitor.errors import LegWearError, system_asked
from leg_wear_monitor.files import json_text
from leg_wear_monitor.gait.config import CONTACT, FLOAT64, GaitConfig
from leg_wear_monitor.gait.leg import SyntheticLeg
from leg_wear_monitor.gait.sensors import Reading, readings, stamp_ns
from leg_wear_monitor.recordings.streams import streams_read
from leg_wear_monitor.ros.inputs import message_class
from leg_wear_monitor.ros.parameters import Parameters
from leg_wear_monitor.ros.running import WAKE_S, ClosingNode, repeated, run, spin, until_down
from leg_wear_monitor.twin import CRANK, LOAD, TORQUE
from leg_wear_monitor.twin.sample import (
    EMPTY,
    MISSING_JOINT,
    NOT_FINITE,
    UNDECODABLE,
    WRONG_LENGTH,
    ZERO_STAMP,
)

# Parameters of the gait publisher, for the synthetic leg and its messages.


@attrs.frozen(kw_only=True)
class TruthConfig:
    """True values of the leg."""

    path: str = described(
        "JSON file for the true clearances, written at the end; if empty, none is written", default=""
    )


@attrs.frozen(kw_only=True)
class PublisherConfig(GaitConfig):
    """All parameters of the gait publisher."""

    crank_joint: str = described("name of the crank in joint_states", default="crank")
    further_joints: tuple[str, ...] = described(
        "names of other joints in the message; they stand still", default=()
    )
    frame_id: str = described("frame of the torque", default="pelvis")
    wait_for_subscribers: int = quantity(
        "",
        "number of subscribers per topic that the node waits for before it starts",
        within=(0, 100),
        default=0,
    )
    truth: TruthConfig = described("true values of the leg", factory=TruthConfig)


# Conversion of the synthetic leg's readings to messages, with injected faults.


Message: TypeAlias = JointState | WrenchStamped | Float64 | Bool


def time_message(stamp: int) -> Time:
    """A stamp [ns] as a message."""
    return Time(sec=stamp // 1_000_000_000, nanosec=stamp % 1_000_000_000)


def sensor_message(reading: Reading, start_ns: int, config: PublisherConfig) -> Message | bytes:
    """Message of a reading; raw bytes for a fault that makes it undecodable."""
    message = _whole(reading, start_ns, config)
    if reading.fault == UNDECODABLE:
        data: bytes = serialize_message(message)
        return data[: len(data) // 2]
    _break(message, reading.fault)
    return message


def _whole(reading: Reading, start_ns: int, config: PublisherConfig) -> Message:
    stamp = time_message(stamp_ns(reading, start_ns))
    if reading.kind == CRANK:
        return _joint_state(reading, stamp, config)
    if reading.kind == LOAD:
        return _foot_load(reading, stamp, config)
    if config.torque_sensor.source == FLOAT64:
        return Float64(data=reading.torque_nm)
    message = WrenchStamped(header=Header(stamp=stamp, frame_id=config.frame_id))
    message.wrench.torque.z = reading.torque_nm
    return message


def _foot_load(reading: Reading, stamp: Time, config: PublisherConfig) -> Message:
    along, up = reading.foot_force_n
    if config.foot_load_sensor.source == CONTACT:
        return Bool(data=up > 0.0)
    if config.foot_load_sensor.source == FLOAT64:
        return Float64(data=up)
    message = WrenchStamped(header=Header(stamp=stamp, frame_id=config.frame_id))
    message.wrench.force.x, message.wrench.force.y = along, up
    return message


def _joint_state(reading: Reading, stamp: Time, config: PublisherConfig) -> JointState:
    """Joint state with the crank last, so that no receiver can rely on its position in the list."""
    still = [0.0] * len(config.further_joints)
    with_effort = not math.isnan(reading.torque_nm)
    return JointState(
        header=Header(stamp=stamp),
        name=[*config.further_joints, config.crank_joint],
        position=[*still, reading.crank_angle_rad],
        velocity=[*still, reading.crank_velocity_radps],
        effort=[*still, reading.torque_nm] if with_effort else [],
    )


def _break(message: Message, fault: int) -> None:
    """Inject a fault into a message; a torque message can only lack its stamp or a finite value."""
    if isinstance(message, Bool):  # a Bool has no stamp and no number
        return
    if fault == ZERO_STAMP and not isinstance(message, Float64):
        message.header.stamp = Time()
    elif isinstance(message, JointState):
        _break_joint_state(message, fault)
    elif fault in (EMPTY, MISSING_JOINT, NOT_FINITE, WRONG_LENGTH):
        number = math.inf if fault == NOT_FINITE else math.nan
        if isinstance(message, Float64):
            message.data = number
        else:
            message.wrench.torque.z = message.wrench.force.x = number


def _break_joint_state(message: JointState, fault: int) -> None:
    if fault == EMPTY:
        message.name, message.position, message.velocity, message.effort = [], [], [], []
    elif fault == WRONG_LENGTH:
        message.position = [*message.position, 0.0]
    elif fault == MISSING_JOINT:
        message.name = [f"not_{name}" for name in message.name]
    elif fault == NOT_FINITE:
        message.position = [math.nan] * len(message.position)


# Node ``gait_publisher``: publishes the sensor readings of a synthetic leg.


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
        log = self.get_logger()
        log.info("preparing the leg; the first start compiles numerical kernels for a minute")
        with repeated(lambda passed_s: log.info(f"preparing the leg: {passed_s:.0f} s")):
            self._leg = SyntheticLeg(self.config)
        qos = QoSProfile(depth=200, reliability=ReliabilityPolicy.BEST_EFFORT)
        sources = {TORQUE: self.config.torque_sensor.source, LOAD: self.config.foot_load_sensor.source}
        self._by_kind: dict[int, Publisher] = {
            stream.kind: self._publisher(message_class(stream.type), stream.topic, qos)
            for stream in streams_read(sources)
        }
        self.published, self._start_ns = 0, 0

    def walk(self, wanted: Callable[[], bool] = lambda: True) -> None:
        """Publish in step with the clock until the walk ends or `wanted` returns false."""
        with until_down(self.context):
            self._walk_on(wanted)

    def _walk_on(self, wanted: Callable[[], bool]) -> None:
        while wanted() and not self._has_subscribers():
            time.sleep(0.02)
        self._start_ns, began = self.get_clock().now().nanoseconds, time.monotonic()
        self.get_logger().info("walking")
        for reading in itertools.chain.from_iterable(self._computed_ahead()):
            due = began + reading.arrival_s
            while (wait := due - time.monotonic()) > 0.0 and wanted():
                time.sleep(min(wait, WAKE_S))
            if not wanted():
                return
            if wait < -_LATE_S:
                self.get_logger().warning(
                    "the simulation is slower than the clock; lower the rates",
                    throttle_duration_sec=5.0,
                )
            message = sensor_message(reading, self._start_ns, self.config)
            self._by_kind[reading.kind].publish(message)
            self.published += 1

    def close(self) -> None:
        """Write the ground truth, if a file is configured."""
        if path := self.config.truth.path:
            truth = {"start_ns": self._start_ns, **self._leg.truth()}
            with system_asked(f"truth.path: {path}", "cannot be written"):
                Path(path).write_text(json_text(truth))

    def _publisher(self, kind: type, topic: str, qos: QoSProfile) -> Publisher:
        return self.create_publisher(
            kind, topic, qos, qos_overriding_options=QoSOverridingOptions.with_default_policies()
        )

    def _has_subscribers(self) -> bool:
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
                for block in self._walk():
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
