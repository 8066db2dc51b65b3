"""Ten robots with random signs, gears, offsets, torque sources and noise: what commissioning finds of each.

The legs walk in full coordinates with 0.3 mm in five joints, at several cadences, some with a foot load or
with friction in the drive; the robots differ in what their encoders and torque sensors make of it.
"""

import argparse
import math
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from leg_wear_monitor.bags.mcap.writer import McapWriter
from leg_wear_monitor.commissioning.commission import commission
from leg_wear_monitor.commissioning.result import Commissioning
from leg_wear_monitor.gait.config import GaitConfig, LoadConfig, PaceConfig
from leg_wear_monitor.gait.leg import SyntheticLeg
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.messages import encode

RATE_HZ, START_NS = 200, 1_700_000_000 * 10**9
TURN = 2.0 * math.pi

# how the legs walk: pace, load, time [s]
WALKS: dict[str, tuple[PaceConfig, LoadConfig, int]] = {
    "steady60": (PaceConfig(ripple=0.02), LoadConfig(), 60),
    "two": (
        PaceConfig(times_s=(0.0, 20.0), speeds_rpm=(45.0, 75.0), ripple=0.02),
        LoadConfig(friction_nm=0.8),
        40,
    ),
    "back60": (PaceConfig(speeds_rpm=(-60.0,), ripple=0.03), LoadConfig(friction_nm=1.0), 40),
    "load90": (
        PaceConfig(speeds_rpm=(90.0,), ripple=0.05),
        LoadConfig(friction_nm=1.5, toe_force_n=100.0),
        30,
    ),
    "slow30": (PaceConfig(speeds_rpm=(30.0,), ripple=0.02), LoadConfig(friction_nm=0.5), 60),
}


def walked(name: str, cache: Path | None) -> Floats:
    """Times, crank angles, speeds, impulses of the torque and torques (n, 5) of a walk."""
    path = cache / f"{name}.npy" if cache else None
    if path is not None and path.exists():
        return np.asarray(np.load(path))
    pace, load, seconds = WALKS[name]
    leg, rng, rows = SyntheticLeg(GaitConfig(pace=pace, load=load)), np.random.default_rng(1), []
    for i in range(1, seconds * RATE_HZ):
        t = i / RATE_HZ + min(2.0e-3, max(-2.0e-3, 1.0e-4 * rng.standard_normal()))
        now = leg.advance(t)
        rows.append((t, now.crank.angle, now.crank.speed, now.torque_impulse, now.torque_nm))
    if path is not None:
        np.save(path, np.array(rows))
    return np.array(rows)


def robot(seed: int) -> dict[str, Any]:
    """A robot of random signs, gear, offset, source and noise."""
    rng = np.random.default_rng(seed)
    gear = float(rng.choice([1.0, 1.0, 0.5, 6.25, 9.0, 27.5, 50.0, 100.0]))
    return {
        "sign": int(rng.choice([1, -1])),
        "gear_ratio": gear,
        "offset_rad": float(rng.uniform(-3.0, 3.0)),
        "starts_at_zero": gear != 1.0 and bool(rng.integers(2)),
        "is_wrapped": gear == 1.0 and bool(rng.integers(2)),
        "source": str(rng.choice(["wrench", "effort", "float64"])),
        "axis": str(rng.choice(list("xyz"))),
        "torque_sign": int(rng.choice([1, -1])),
        "scale": float(rng.choice([1.0, 0.8, 4.448, 1.0e-3])),
        "is_of_motor": gear != 1.0 and bool(rng.integers(2)),
        "sampling": str(rng.choice(["average", "instant"])),
        "angle_noise_rad": float(rng.choice([1.0e-4, 1.0e-3, 3.0e-3])),
        "torque_noise_nm": float(rng.choice([0.05, 0.3, 1.0])),
        "walk": list(WALKS)[seed % len(WALKS)],
    }


def record(path: Path, truth: dict[str, Any], walk: Floats, seed: int) -> None:
    """The robot's recording: its crank among other joints, its torque among others."""
    rng = np.random.default_rng([seed, 1])
    times, angle, _, impulse, instant = walk.T
    if truth["starts_at_zero"]:
        truth["offset_rad"] = float((angle[0] + math.pi) % TURN - math.pi)
        angle = angle - angle[0] + truth["offset_rad"]
    position = truth["sign"] * truth["gear_ratio"] * (angle - truth["offset_rad"])
    position = position + truth["angle_noise_rad"] * rng.standard_normal(len(angle))
    position = position % TURN if truth["is_wrapped"] else position
    mean = np.diff(impulse, prepend=0.0) / np.diff(times, prepend=0.0)
    torque = (mean if truth["sampling"] == "average" else instant).copy()
    torque += truth["torque_noise_nm"] * rng.standard_normal(len(torque))
    truth["factor"] = truth["scale"] * (truth["gear_ratio"] if truth["is_of_motor"] else 1.0)
    torque *= truth["torque_sign"] / truth["factor"]
    stamps, n = START_NS + np.round(1.0e9 * times).astype(np.int64), len(times)
    noise = rng.standard_normal((3, n))
    wheel = 7.0 * times + 0.007 * np.cumsum(noise[0])
    joints = np.stack([0.4 * np.sin(angle), position, wheel], axis=1)
    efforts = np.stack([noise[1], torque if truth["source"] == "effort" else noise[2], noise[0]], axis=1)
    wrench = 0.2 * rng.standard_normal((n, 3))
    if truth["source"] == "wrench":
        wrench[:, "xyz".index(truth["axis"])] = torque
    with McapWriter(path) as writer:
        rows = encode.joint_states(stamps, ["hip", "crank", "wheel"], position=joints, effort=efforts)
        writer.write_many(writer.channel("/joint_states", encode.JOINT_STATE), stamps, rows)
        rows = encode.wrenches(stamps, torque=wrench)
        writer.write_many(writer.channel("/drive_torque", encode.WRENCH_STAMPED), stamps, rows)
        if truth["source"] == "float64":
            raw = np.ascontiguousarray(torque, "<f8").view(np.uint8).reshape(n, 8)
            head = np.broadcast_to(np.array([0, 1, 0, 0], np.uint8), (n, 4))
            channel = writer.channel("/motor/torque", "std_msgs/msg/Float64")
            writer.write_many(channel, stamps, np.concatenate([head, raw], axis=1))


def row(seed: int, truth: dict[str, Any], result: Commissioning, seconds: float) -> str:
    """A row of the table: each value as it was made, and as it was found."""
    found = {item.name: item for item in result.items}

    def value(name: str) -> Any:
        return found[name].value

    apart = (float(value("crank.offset_rad")) - truth["offset_rad"] + math.pi) % TURN - math.pi
    factor = float(value("drive_torque.scale")) * float(value("drive_torque.gear_ratio"))
    rival = min(
        (found[name].other_mismatch or math.inf)
        for name in ("crank.sign", "drive_torque.sign", "crank_joint", "drive_torque.source")
    )
    told = [text.split(":")[0].replace("drive_torque.", "") for text in result.not_told]
    cells = (
        f"{seed}",
        truth["walk"],
        f"{truth['sign']} / {value('crank.sign')}",
        f"{truth['gear_ratio']:g} / {value('crank.gear_ratio'):.6g}",
        f"{truth['offset_rad']:.3f} / {value('crank.offset_rad'):.3f} ({apart:+.3f})",
        f"{truth['source']} / {value('drive_torque.source')}",
        f"{truth['torque_sign']} / {value('drive_torque.sign')}",
        f"{truth['factor']:.4g} / {factor:.4g}",
        f"{truth['sampling']} / {found['drive_torque.sampling'].value}",
        f"{found['crank.sign'].mismatch:.3f}",
        f"{rival:.3f}",
        "; ".join([*told, *(text.split(" ± ")[0] for text in result.findings)]) or "-",
        f"{seconds:.1f}",
    )
    return f"| {' | '.join(cells)} |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=10, help="number of robots")
    parser.add_argument("--cache", type=Path, help="directory of walks, which take minutes to make")
    arguments = parser.parse_args()
    print(
        "| robot | walk | sign | gear ratio | offset, rad | source | torque sign | scale × gear | sampling | "
        "mismatch | of the runner-up | not enough to tell; does not fit | CPU s |"
    )
    print("|" + "---|" * 13)
    for seed in range(arguments.seeds):
        truth = robot(seed)
        with tempfile.TemporaryDirectory() as directory:
            path = Path(directory) / "robot.mcap"
            record(path, truth, walked(truth["walk"], arguments.cache), seed)
            began = time.process_time()
            result, _ = commission([path])
            print(row(seed, truth, result, time.process_time() - began), flush=True)


if __name__ == "__main__":
    main()
