"""Recordings of short walks of the default leg."""

from pathlib import Path

import numpy as np
from raw_messages import Message, crank_and_torque, write_messages

import leg_wear_monitor as lw

RATE_HZ, BEGIN_S = 200, 1_700_000_000


def torque_of_a_cycle(leg: lw.Mechanism) -> tuple[np.ndarray, np.ndarray]:
    """Crank angle [rad] in rising order, and drive torque of ideal joints [N m]."""
    ideal = lw.simulate(leg, clearances=[], cycles=1, trace=360).trace
    order = np.argsort(ideal.crank_angle_rad)
    return ideal.crank_angle_rad[order], ideal.drive_torque_nm[order]


def walk_messages(
    cycle: tuple[np.ndarray, np.ndarray], begin_s: float = 0.0, seconds: float = 4.0, seed: int = 0
) -> list[Message]:
    """Messages of a steady gait at 60 rpm that begins some seconds after `BEGIN_S`."""
    n = round(seconds * RATE_HZ)
    times = begin_s + np.arange(n) / RATE_HZ
    angle = 2.0 * np.pi * times + np.random.default_rng(seed).normal(0.0, 2.0e-4, n)
    torque = np.interp(angle % (2.0 * np.pi), *cycle, period=2.0 * np.pi)
    stamps = BEGIN_S * 10**9 + np.round(times * 1.0e9).astype(np.int64)
    return crank_and_torque(stamps, angle, torque)


def write_walk(
    cycle: tuple[np.ndarray, np.ndarray],
    path: Path,
    begin_s: float = 0.0,
    seconds: float = 4.0,
    seed: int = 0,
) -> Path:
    """Write such a walk as a recording."""
    return write_messages(path, walk_messages(cycle, begin_s, seconds, seed), chunk_bytes=20_000)
