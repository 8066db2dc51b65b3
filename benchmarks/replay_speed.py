"""A replay end to end: 1 kHz each of joint states and torque, five clearance joints; where its time goes.

The leg has clearances, and the same gait cycles of it are repeated: the diagnosis finds that the leg is as
modelled.
"""

import argparse
import os
import tempfile
import time
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy, as the command line does

# isort: split

import attrs
import numpy as np

import leg_wear_monitor as lw
from leg_wear_monitor.gait.config import EncoderConfig, GaitConfig, PaceConfig, TorqueSensorConfig
from leg_wear_monitor.gait.leg import SyntheticLeg
from leg_wear_monitor.gait.sensors import readings
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.recordings import encode
from leg_wear_monitor.recordings.mcap_file import McapWriter
from leg_wear_monitor.recordings.reader import Recording
from leg_wear_monitor.twin import TORQUE

NAMES = ["hip", "knee", "ankle", "crank", "toe", "pelvis", "spare"]
RATE_HZ = 1000
CHUNK_BYTES = 768 * 1024
WALK_S = 12  # that are repeated: whole gait cycles at a multiple of 5 rpm


def torques(rpm: float) -> np.ndarray:
    """Drive torque of a leg with clearances over some gait cycles, the first sample at crank angle 0."""
    config = GaitConfig(
        duration_s=WALK_S + 0.5 / RATE_HZ,
        pace=PaceConfig(speeds_rpm=(rpm,)),
        encoder=EncoderConfig(rate_hz=10.0),
        torque_sensor=TorqueSensorConfig(rate_hz=float(RATE_HZ)),
    )
    found = [one.torque_nm for one in readings(SyntheticLeg(config), config) if one.kind == TORQUE]
    return np.roll(found, 1)  # the first reading comes a sample after the start


def write_walk(path: Path, seconds: int, rpm: float) -> None:
    """A steady gait with an encoder's noise."""
    rng, torque_nm, speed = np.random.default_rng(1), torques(rpm), TURN * rpm / 60.0
    with McapWriter(path, chunk_bytes=CHUNK_BYTES) as writer:
        joints = writer.channel("/joint_states", encode.JOINT_STATE)
        torque = writer.channel("/drive_torque", encode.WRENCH_STAMPED)
        for second in range(seconds):
            since = second + np.arange(RATE_HZ) / RATE_HZ
            stamps = 1_700_000_000 * 10**9 + np.round(since * 1e9).astype(np.int64)
            position = rng.normal(0.0, 1.0e-4, (RATE_HZ, len(NAMES)))
            position[:, NAMES.index("crank")] += speed * since
            wrench = np.zeros((RATE_HZ, 3))
            wrench[:, 2] = np.take(torque_nm, second * RATE_HZ + np.arange(RATE_HZ), mode="wrap")
            velocity = np.full((RATE_HZ, len(NAMES)), speed)
            rows = encode.joint_states(stamps, NAMES, position=position, velocity=velocity, effort=velocity)
            writer.write_many(joints, stamps, rows)
            writer.write_many(torque, stamps, encode.wrenches(stamps, torque=wrench, frame_id="pelvis"))


class Watch:
    """Seconds since it was made, by the wall clock and by processor time."""

    def __init__(self) -> None:
        self._wall, self._processor = time.perf_counter(), time.process_time()

    def read(self) -> tuple[float, float]:
        """Seconds by the wall clock and by processor time."""
        return time.perf_counter() - self._wall, time.process_time() - self._processor


def reading(path: Path) -> Watch:
    """Read the samples, and do nothing with them."""
    watch = Watch()
    with Recording([path], lw.MonitorConfig()) as recording:
        for _ in recording.blocks():
            pass
    return watch


def replaying(path: Path, config: lw.MonitorConfig, out: Path | None = None) -> Watch:
    """Put them through the monitor, and write its reports if there is a place for them."""
    watches: list[Watch] = []

    def ready(monitor: lw.WearMonitor) -> None:
        monitor.warm_up()
        watches.append(Watch())

    result = lw.replay(path, config, out=out, ready=ready)
    if len(result.history) < result.duration_s * config.cadence.commanded_rpm / 60.0 - 3.0:
        raise SystemExit(f"only {len(result.history)} gait cycles were followed")
    return watches[0]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=int, default=60, help="length of the recording")
    parser.add_argument("--rpm", type=float, default=60.0, help="at others than 60 a reference is simulated")
    args = parser.parse_args()
    seconds, with_it = args.seconds, lw.MonitorConfig()
    with_it = attrs.evolve(with_it, cadence=attrs.evolve(with_it.cadence, commanded_rpm=args.rpm))
    without = attrs.evolve(with_it, diagnosis=attrs.evolve(with_it.diagnosis, enabled=False))
    with tempfile.TemporaryDirectory() as directory:
        path = Path(directory) / "walk.mcap"
        write_walk(path, seconds, args.rpm)
        reading(path)
        replaying(path, without)
        spent = {
            "reading": reading(path).read(),
            "monitoring, no diagnosis": replaying(path, without).read(),
            "monitoring": replaying(path, with_it).read(),
            "all, with reports as MCAP": replaying(path, with_it, Path(directory)).read(),
        }
    print(f"{seconds} s of motion, 2 x {RATE_HZ} Hz, by the wall clock (by the processor's time)")
    for name, (wall, processor) in spent.items():
        each = f"{1e3 * wall / seconds:7.2f} ({1e3 * processor / seconds:6.2f}) ms a second of motion"
        print(f"  {name:28} {each}, {seconds / wall:7.1f} ({seconds / processor:6.1f}) times real time")


if __name__ == "__main__":
    main()
