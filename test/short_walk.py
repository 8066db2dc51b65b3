"""Recordings of short walks of the default leg."""

from pathlib import Path

import numpy as np

import leg_wear_monitor as lw
from leg_wear_monitor.bags.mcap_writer import McapWriter
from leg_wear_monitor.messages import encode

RATE_HZ, BEGIN_S = 200, 1_700_000_000


def torque_of_a_cycle(leg: lw.Mechanism) -> tuple[np.ndarray, np.ndarray]:
    """Crank angle [rad] in rising order, and drive torque of ideal joints [N m]."""
    ideal = lw.simulate(leg, clearances=[], cycles=1, trace=360).trace
    order = np.argsort(ideal.crank_angle_rad)
    return ideal.crank_angle_rad[order], ideal.drive_torque_nm[order]


def write_walk(
    cycle: tuple[np.ndarray, np.ndarray],
    path: Path,
    begin_s: float = 0.0,
    seconds: float = 4.0,
    seed: int = 0,
) -> Path:
    """Write a recording of a steady gait at 60 rpm that begins some seconds after `BEGIN_S`."""
    n = round(seconds * RATE_HZ)
    times = begin_s + np.arange(n) / RATE_HZ
    angle = 2.0 * np.pi * times + np.random.default_rng(seed).normal(0.0, 2.0e-4, n)
    torque = np.interp(angle % (2.0 * np.pi), *cycle, period=2.0 * np.pi)
    stamps = BEGIN_S * 10**9 + np.round(times * 1.0e9).astype(np.int64)
    still = np.zeros(n)
    joints = encode.joint_states(stamps, ["crank"], position=angle[:, None])
    wrenches = encode.wrenches(stamps, torque=np.stack([still, still, torque], axis=1), frame_id="pelvis")
    path.parent.mkdir(parents=True, exist_ok=True)
    with McapWriter(path, chunk_bytes=20_000) as writer:
        crank = writer.channel("/joint_states", encode.JOINT_STATE)
        drive = writer.channel("/drive_torque", encode.WRENCH_STAMPED)
        for stamp, joint, wrench in zip(stamps.tolist(), joints, wrenches, strict=True):
            writer.write(crank, stamp + 100_000, bytes(joint))
            writer.write(drive, stamp + 100_001, bytes(wrench))
    return path
