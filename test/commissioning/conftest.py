"""Robots: the walk of the healthy sample recording, seen through other encoders and torque sensors."""

from collections.abc import Callable
from pathlib import Path

import attrs
import numpy as np
import pytest
from dynamic_messages import DYNAMIC_JOINT_STATE, dynamic_joint_state

from leg_wear_monitor import Mechanism, MonitorConfig
from leg_wear_monitor.estimate.torque_model import TorqueModel, torque_model
from leg_wear_monitor.files import share_directory
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.monitor.config.inputs import EFFORT, FLOAT64, INTERFACE, WRENCH
from leg_wear_monitor.recordings import encode
from leg_wear_monitor.recordings.mcap_file import McapWriter
from leg_wear_monitor.recordings.reader import Recording

START_NS = 1_700_000_000 * 10**9
FLOAT64_TYPE = "std_msgs/msg/Float64"


@attrs.frozen(eq=False)
class Walk:
    """What a leg did: times [s], crank angles [rad] and drive torques on the crank [N m]."""

    time_s: Floats
    angle_rad: Floats
    torque_nm: Floats


MakeWalk = Callable[..., Walk]


@attrs.frozen(kw_only=True)
class Robot:
    """How a robot's sensors show a walk."""

    sign: int = 1
    gear_ratio: float = 1.0
    offset_rad: float = 0.0
    source: str = WRENCH
    axis: str = "z"
    torque_sign: int = 1
    scale: float = 1.0
    angle_noise_rad: float = 1.0e-3
    torque_noise_nm: float = 0.1
    is_wrapped: bool = False
    lag_s: float = 0.0
    seed: int = 0


Record = Callable[[Path, Robot, Walk], Path]


@pytest.fixture(scope="session")
def walked() -> Walk:
    """The healthy sample recording: full coordinates, five joints with clearance, 60 rpm."""
    with Recording([share_directory() / "bags" / "healthy.mcap"], MonitorConfig()) as recording:
        samples = np.concatenate([block.samples for block in recording.blocks()])
    crank, torque = (samples[np.isfinite(samples[name])] for name in ("crank_angle_rad", "torque_nm"))
    first = crank["stamp_ns"][0]
    times, at = ((each["stamp_ns"] - first) * 1.0e-9 for each in (crank, torque))
    # smoothed, since each robot has noise of its own
    angle = np.polynomial.Polynomial.fit(times, np.unwrap(crank["crank_angle_rad"]), 3)(at)
    return Walk(at, angle, torque["torque_nm"].copy())


@pytest.fixture(scope="session")
def model(leg: Mechanism) -> TorqueModel:
    """Torques of the default leg."""
    return torque_model(leg)


@pytest.fixture(scope="session")
def ideal_walk(model: TorqueModel) -> MakeWalk:
    """Make a walk without clearances: at some speeds [rpm], one after the other, each for some time."""

    def make(*speeds_rpm: float, seconds: float = 15.0, friction_nm: float = 0.0) -> Walk:
        times = np.arange(0.0, seconds * len(speeds_rpm), 0.005)
        which = np.minimum((times / seconds).astype(int), len(speeds_rpm) - 1)
        wanted = np.array(speeds_rpm)[which] * TURN / 60.0
        speed = np.convolve(wanted, np.full(100, 0.01), mode="same")
        speed[:50], speed[-50:] = wanted[0], wanted[-1]
        speed *= 1.0 + 0.02 * np.sin(3.0 * times)
        angle = np.cumsum(speed) * 0.005
        torque = model.torque(angle, speed, np.gradient(speed, times))[0]
        return Walk(times, angle, torque + friction_nm * np.sign(speed))

    return make


def columns_of(robot: Robot, walk: Walk) -> tuple[Floats, Floats]:
    """Positions of the robot's crank joint, and values of its torque sensor."""
    rng = np.random.default_rng(robot.seed)
    position = robot.sign * robot.gear_ratio * (walk.angle_rad - robot.offset_rad)
    position = position + robot.angle_noise_rad * rng.standard_normal(len(position))
    if robot.is_wrapped:
        position = position % TURN
    torque = np.interp(walk.time_s - robot.lag_s, walk.time_s, walk.torque_nm)
    torque = torque + robot.torque_noise_nm * rng.standard_normal(len(torque))
    return position, robot.torque_sign * torque / robot.scale


@pytest.fixture(scope="session")
def record() -> Record:
    """Record a robot's walk with a hip that swings, a wheel that turns, and a wrench that is only noise."""

    def write(path: Path, robot: Robot, walk: Walk) -> Path:
        rng = np.random.default_rng([robot.seed, 1])
        position, torque = columns_of(robot, walk)
        stamps = START_NS + np.round(1.0e9 * walk.time_s).astype(np.int64)
        n, noise = len(stamps), rng.standard_normal((3, len(stamps)))
        wheel = 7.0 * walk.time_s + 0.1 * np.cumsum(noise[0]) * 0.07
        joints = np.stack([0.4 * np.sin(walk.angle_rad), position, wheel], axis=1)
        efforts = np.stack([noise[1], torque if robot.source == EFFORT else noise[2], noise[0]], axis=1)
        wrench = 0.2 * rng.standard_normal((n, 3))
        if robot.source == WRENCH:
            wrench[:, "xyz".index(robot.axis)] = torque
        with McapWriter(path) as writer:
            rows = encode.joint_states(stamps, ["hip", "crank", "wheel"], position=joints, effort=efforts)
            writer.write_many(writer.channel("/joint_states", encode.JOINT_STATE), stamps, rows)
            rows = encode.wrenches(stamps, torque=wrench)
            writer.write_many(writer.channel("/drive_torque", encode.WRENCH_STAMPED), stamps, rows)
            if robot.source == FLOAT64:
                raw = np.ascontiguousarray(torque, "<f8").view(np.uint8).reshape(n, 8)
                head = np.broadcast_to(np.array([0, 1, 0, 0], np.uint8), (n, 4))
                channel = writer.channel("/motor/torque", FLOAT64_TYPE)
                writer.write_many(channel, stamps, np.concatenate([head, raw], axis=1))
            if robot.source == INTERFACE:
                warm = np.full(n, 40.0) + 0.01 * walk.time_s
                crank = {"position": position, "motor_current": torque, "temperature": warm}
                states = {"crank": crank, "hip": {"motor_current": noise[1]}}
                channel = writer.channel("/dynamic_joint_states", DYNAMIC_JOINT_STATE)
                for k, stamp in enumerate(stamps.tolist()):
                    now = {
                        joint: {name: each[k] for name, each in one.items()} for joint, one in states.items()
                    }
                    writer.write(channel, stamp, dynamic_joint_state(stamp, now))
        return path

    return write
