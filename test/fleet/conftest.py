"""Recordings of short walks, and fleets of them."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import leg_wear_monitor as lw
from leg_wear_monitor.bags.mcap.writer import McapWriter
from leg_wear_monitor.fleet.description.loader import load_fleet
from leg_wear_monitor.fleet.update import FleetUpdate, update_fleet
from leg_wear_monitor.messages import encode

RATE_HZ, BEGIN_S = 200, 1_700_000_000


@pytest.fixture(scope="session")
def walk(leg: lw.Mechanism) -> Callable[..., Path]:
    """Write a recording of a steady gait that begins some seconds after the others' origin."""
    ideal = lw.simulate(leg, clearances=[], cycles=1, trace=360).trace
    order = np.argsort(ideal.crank_angle_rad)

    def write(path: Path, begin_s: float = 0.0, seconds: float = 4.0, seed: int = 0) -> Path:
        n = round(seconds * RATE_HZ)
        times = begin_s + np.arange(n) / RATE_HZ
        angle = 2.0 * np.pi * times + np.random.default_rng(seed).normal(0.0, 2.0e-4, n)
        torque = np.interp(
            angle % (2.0 * np.pi),
            ideal.crank_angle_rad[order],
            ideal.drive_torque_nm[order],
            period=2.0 * np.pi,
        )
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

    return write


@pytest.fixture(scope="session")
def describe() -> Callable[..., Path]:
    """Write a fleet.yaml; a leg's recordings are in a directory of its name."""

    def write(home: Path, *legs: str, **more: Any) -> Path:
        entries = [f'  - {{id: {leg}, recordings: "{leg}/*"}}\n' for leg in legs]
        head = "".join(f"{key}: {value}\n" for key, value in more.items())
        path = home / "fleet.yaml"
        path.write_text(f"{head}legs:\n{''.join(entries)}")
        return path

    return write


@pytest.fixture(scope="session")
def update() -> Callable[..., FleetUpdate]:
    """Update a fleet."""
    pytest.importorskip("pyarrow")

    def run(path: Path, out: Path, **options: Any) -> FleetUpdate:
        return update_fleet(load_fleet(path), out, **options)

    return run
