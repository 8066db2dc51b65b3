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
from leg_wear_monitor.commissioning.result.commissioning_result import CommissioningResult
from leg_wear_monitor.gait.config import GaitConfig, LoadConfig, PaceConfig
from leg_wear_monitor.gait.leg import SyntheticLeg
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.messages import encode

START_NS = 1_700_000_000 * 10**9
TURN = 2.0 * math.pi
JOINTS, CLEARANCE_M, WALK_S = 5, 3.0e-4, 60


def walk_of(seed: int) -> dict[str, Any]:
    """How a leg walks: two of three follow the instructions, at two cadences and with the foot in the air."""
    rng = np.random.default_rng([seed, 2])
    slow, factor = float(rng.uniform(30.0, 50.0)), float(rng.uniform(1.6, 2.2))
    way = float(rng.choice([1.0, 1.0, 1.0, -1.0]))
    if rng.random() < 2.0 / 3.0:
        speeds: tuple[float, ...] = (way * slow, way * slow * factor)
    else:
        speeds = (way * float(rng.uniform(35.0, 90.0)),)
    return {
        "speeds_rpm": speeds,
        "ripple": float(rng.uniform(0.0, 0.05)),
        "friction_nm": float(rng.uniform(0.0, 1.5)),
        "toe_force_n": 100.0 if rng.random() < 0.2 else 0.0,
        "clearances_m": tuple((CLEARANCE_M * rng.uniform(0.7, 1.3, JOINTS)).tolist()),
        "rate_hz": int(rng.choice([100, 200, 200, 500])),
    }


def walked(seed: int, cache: Path | None) -> Floats:
    """Times, crank angles, impulses of the torque and torques (n, 4) of a walk."""
    path = cache / f"{seed}.npy" if cache else None
    if path is not None and path.exists():
        return np.asarray(np.load(path))
    walk, rng, rows = walk_of(seed), np.random.default_rng([seed, 3]), []
    speeds = walk["speeds_rpm"]
    times = tuple(WALK_S / len(speeds) * i for i in range(len(speeds)))
    pace = PaceConfig(times_s=times, speeds_rpm=speeds, ripple=walk["ripple"])
    load = LoadConfig(friction_nm=walk["friction_nm"], toe_force_n=walk["toe_force_n"])
    leg = SyntheticLeg(GaitConfig(pace=pace, load=load, clearances_m=walk["clearances_m"]))
    for i in range(1, WALK_S * walk["rate_hz"]):
        jitter = 1.0e-4 * float(rng.standard_normal())
        t = i / walk["rate_hz"] + min(5.0e-4, max(-5.0e-4, jitter))
        now = leg.advance(t)
        rows.append((t, now.crank.angle, now.torque_impulse, now.torque_nm))
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
    }


def record(path: Path, truth: dict[str, Any], walk: Floats, seed: int) -> None:
    """The robot's recording: its crank among other joints, its torque among others."""
    rng = np.random.default_rng([seed, 1])
    times, angle, impulse, instant = walk.T
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


def row(seed: int, truth: dict[str, Any], result: CommissioningResult, seconds: float) -> str:
    """A row of the table: each value as it was made, and as it was found."""
    found = {item.name: item for item in result.items}

    def value(name: str) -> Any:
        return found[name].value

    offset, lag = found["crank.offset_rad"], found["lag"]
    apart = (float(offset.value) - truth["offset_rad"] + math.pi) % TURN - math.pi
    factor = float(value("drive_torque.scale")) * float(value("drive_torque.gear_ratio"))
    rival = min(
        (found[name].other_mismatch or math.inf)
        for name in ("crank.sign", "drive_torque.sign", "crank_joint", "drive_torque.source")
    )
    told = [text.split(":")[0].replace("drive_torque.", "") for text in result.not_told]
    cells = (
        f"{seed}",
        " and ".join(f"{speed:.0f}" for speed in truth["speeds_rpm"]),
        f"{truth['rate_hz']}",
        f"{truth['sign']} / {value('crank.sign')}",
        f"{truth['gear_ratio']:g} / {value('crank.gear_ratio'):.6g}",
        f"{truth['offset_rad']:.3f} / {offset.value:.3f} ({apart:+.3f} ± {offset.sigma:.3f})",
        f"{truth['source']} / {value('drive_torque.source')}",
        f"{truth['torque_sign']} / {value('drive_torque.sign')}",
        f"{truth['factor']:.4g} / {factor:.4g}",
        f"{truth['sampling']} / {found['drive_torque.sampling'].value}",
        "-" if lag.sigma is None else f"0 / {1.0e3 * float(lag.value):.1f} ± {1.0e3 * lag.sigma:.1f}",
        f"{found['crank.sign'].mismatch:.3f}",
        f"{rival:.3f}",
        "; ".join([*told, *(text.split(" ± ")[0] for text in result.findings)]) or "-",
        f"{seconds:.1f}",
    )
    return f"| {' | '.join(cells)} |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=int, default=0, help="seed of the first robot")
    parser.add_argument("--number", type=int, default=10, help="number of robots")
    parser.add_argument("--cache", type=Path, help="directory of walks, each of which takes half a minute")
    arguments = parser.parse_args()
    print(
        "| seed | rpm | Hz | sign | gear ratio | offset, rad | source | torque sign | scale × gear | "
        "sampling | lag, ms | mismatch | of the runner-up | not enough to tell; does not fit | CPU s |"
    )
    print("|" + "---|" * 15)
    for seed in range(arguments.first, arguments.first + arguments.number):
        truth = robot(seed) | walk_of(seed)
        with tempfile.TemporaryDirectory() as directory:
            path = Path(directory) / "robot.mcap"
            record(path, truth, walked(seed, arguments.cache), seed)
            began = time.process_time()
            result = commission(path)
            print(row(seed, truth, result, time.process_time() - began), flush=True)


if __name__ == "__main__":
    main()
