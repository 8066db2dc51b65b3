"""A replay end to end: 1 kHz each of joint states and torque, five clearance joints; where its time goes."""

import argparse
import tempfile
from pathlib import Path

import numpy as np
from watch import Watch

import leg_wear_monitor as lw
from leg_wear_monitor.bags.mcap.writer import McapWriter
from leg_wear_monitor.bags.reader import Recording
from leg_wear_monitor.messages import encode

NAMES = ["hip", "knee", "ankle", "crank", "toe", "pelvis", "spare"]
RATE_HZ = 1000
CHUNK_BYTES = 768 * 1024


def write_walk(path: Path, seconds: int) -> None:
    """A steady gait with an encoder's noise, and the ideal leg's torque."""
    rng = np.random.default_rng(1)
    ideal = lw.simulate(lw.load_mechanism("bionic_leg"), clearances=[], cycles=1, trace=720).trace
    order = np.argsort(ideal.crank_angle_rad)
    angles, torques = ideal.crank_angle_rad[order], ideal.drive_torque_nm[order]
    with McapWriter(path, chunk_bytes=CHUNK_BYTES) as writer:
        joints = writer.channel("/joint_states", encode.JOINT_STATE)
        torque = writer.channel("/drive_torque", encode.WRENCH_STAMPED)
        for second in range(seconds):
            since = second + np.arange(RATE_HZ) / RATE_HZ
            stamps = 1_700_000_000 * 10**9 + np.round(since * 1e9).astype(np.int64)
            position = rng.normal(0.0, 1.0e-4, (RATE_HZ, len(NAMES)))
            position[:, NAMES.index("crank")] += 2.0 * np.pi * since
            wrench = np.zeros((RATE_HZ, 3))
            wrench[:, 2] = np.interp(2.0 * np.pi * (since % 1.0), angles, torques, period=2.0 * np.pi)
            velocity = np.full((RATE_HZ, len(NAMES)), 2.0 * np.pi)
            rows = encode.joint_states(stamps, NAMES, position=position, velocity=velocity, effort=velocity)
            writer.write_many(joints, stamps, rows)
            writer.write_many(torque, stamps, encode.wrenches(stamps, torque=wrench, frame_id="pelvis"))


def reading(path: Path) -> Watch:
    """Read the samples, and do nothing with them."""
    watch = Watch()
    with Recording([path], lw.MonitorConfig()) as recording:
        for _ in recording.blocks():
            pass
    return watch


def replaying(path: Path, out: Path | None) -> Watch:
    """Put them through the monitor, and write its reports if there is a place for them."""
    watches: list[Watch] = []

    def ready(monitor: lw.WearMonitor) -> None:
        monitor.warm_up()
        watches.append(Watch())

    result = lw.replay(path, lw.MonitorConfig(), out=out, ready=ready)
    if len(result.history) < result.duration_s - 3.0:
        raise SystemExit(f"only {len(result.history)} gait cycles were followed")
    return watches[0]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=int, default=60, help="length of the recording")
    seconds = parser.parse_args().seconds
    with tempfile.TemporaryDirectory() as directory:
        path = Path(directory) / "walk.mcap"
        write_walk(path, seconds)
        reading(path)
        replaying(path, None)
        spent = {
            "reading": reading(path).read(),
            "reading and monitoring": replaying(path, None).read(),
            "all, with reports as MCAP": replaying(path, Path(directory)).read(),
        }
    print(f"{seconds} s of motion, 2 x {RATE_HZ} Hz, by the wall clock (by the processor's time)")
    for name, (wall, processor) in spent.items():
        each = f"{1e3 * wall / seconds:7.2f} ({1e3 * processor / seconds:6.2f}) ms a second of motion"
        print(f"  {name:28} {each}, {seconds / wall:7.1f} ({seconds / processor:6.1f}) times real time")


if __name__ == "__main__":
    main()
