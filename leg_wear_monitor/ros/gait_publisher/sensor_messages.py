"""Conversion of the synthetic leg's readings to messages, with injected faults."""

import math
from typing import TypeAlias

from builtin_interfaces.msg import Time
from geometry_msgs.msg import WrenchStamped
from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState
from std_msgs.msg import Bool, Float64, Header

from leg_wear_monitor.gait.config import CONTACT, FLOAT64
from leg_wear_monitor.gait.sensors import Reading, stamp_ns
from leg_wear_monitor.ros.gait_publisher.config import PublisherConfig
from leg_wear_monitor.twin.kinds import CRANK, LOAD
from leg_wear_monitor.twin.sample import (
    EMPTY,
    MISSING_JOINT,
    NOT_FINITE,
    UNDECODABLE,
    WRONG_LENGTH,
    ZERO_STAMP,
)

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
    further = [*config.further_joints, *config.joint_encoders.names]
    still = [0.0] * len(config.further_joints)
    unmeasured = [*still, *(math.nan,) * len(config.joint_encoders.names)]
    with_effort = not math.isnan(reading.torque_nm)
    return JointState(
        header=Header(stamp=stamp),
        name=[*further, config.crank_joint],
        position=[*still, *reading.encoder_rad, reading.crank_angle_rad],
        velocity=[*unmeasured, reading.crank_velocity_radps],
        effort=[*unmeasured, reading.torque_nm] if with_effort else [],
    )


def _break(message: Message, fault: int) -> None:
    """Inject a fault into a message; a torque message can only lack its stamp or a finite value."""
    if isinstance(message, Bool):  # it has neither a stamp nor a number
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
