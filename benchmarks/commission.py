"""Commissioning of ten robots with random signs, gears, offsets, drives, torque sources and noise.

The legs walk in full coordinates with 0.2 to 0.4 mm in five joints, at several cadences, some with a foot
load. Their torque passes a drive, with friction that grows with the load, constant friction, a low-pass and a
lag. The robots have different encoders and torque sensors. The table has one row per robot, each cell *made /
found*. The last lines count how often the truth is within 1.28 standard deviations: 80 % if the standard
deviations are right.
`python benchmarks/commission.py [--first 121] [--cache DIRECTORY]` takes ten minutes, two without the walks.
"""

import argparse
import math
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from leg_wear_monitor.commissioning.commission import commission
from leg_wear_monitor.commissioning.proposal import CommissioningResult
from leg_wear_monitor.gait.config import GaitConfig, LoadConfig, PaceConfig
from leg_wear_monitor.gait.leg import SyntheticLeg
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.recordings import encode
from leg_wear_monitor.recordings.mcap_file import McapWriter

START_NS = 1_700_000_000 * 10**9
TURN = 2.0 * math.pi
JOINTS, CLEARANCE_M, WALK_S = 5, 3.0e-4, 60
STEP_S = 5.0e-4  # of a kept walk, and of the drive's filter
WITHIN = 1.28  # standard deviations that hold 80 % of a normal distribution


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
        "ground_n": 100.0 if rng.random() < 0.2 else 0.0,
        "clearances_m": tuple((CLEARANCE_M * rng.uniform(0.7, 1.3, JOINTS)).tolist()),
        "rate_hz": int(rng.choice([100, 200, 200, 500])),
    }


def walked(seed: int, cache: Path | None) -> Floats:
    """Times, crank angles, impulses of the torque and torques (n, 4) of a walk, without the drive."""
    path = cache / f"{seed}.npy" if cache else None
    if path is not None and path.exists():
        return np.asarray(np.load(path))
    walk, rows = walk_of(seed), []
    speeds = walk["speeds_rpm"]
    times = tuple(WALK_S / len(speeds) * i for i in range(len(speeds)))
    pace = PaceConfig(times_s=times, speeds_rpm=speeds, ripple=walk["ripple"])
    load = LoadConfig(ground_n=walk["ground_n"])
    leg = SyntheticLeg(GaitConfig(pace=pace, load=load, clearances_m=walk["clearances_m"]))
    for i in range(1, round(WALK_S / STEP_S)):
        now = leg.advance(STEP_S * i)
        rows.append((STEP_S * i, now.crank.angle, now.torque_impulse, now.torque_nm))
    if path is not None:
        np.save(path, np.array(rows))
    return np.array(rows)


def drive_of(seed: int) -> dict[str, float]:
    """A drive: three of four have friction of the load, four of five a low-pass."""
    rng = np.random.default_rng([seed, 4])
    bandwidth = math.exp(rng.uniform(math.log(15.0), math.log(120.0)))
    return {
        "lag_s": float(rng.uniform(0.0, 0.02)),
        "bandwidth_hz": bandwidth if rng.random() < 0.8 else math.inf,
        "load_friction": float(rng.uniform(0.0, 0.3)) if rng.random() < 0.75 else 0.0,
    }


def received(walk: Floats, truth: dict[str, Any]) -> tuple[Floats, Floats]:
    """Means over each step, and instants (n,), of a walk's torque behind the drive."""
    mean, instant = np.diff(walk[:, 2], prepend=0.0) / STEP_S, walk[:, 3]
    way, late = np.sign(truth["speeds_rpm"][0]), round(truth["lag_s"] / STEP_S)
    part = 1.0 - math.exp(-STEP_S * TURN * truth["bandwidth_hz"])

    def behind(torque: Floats) -> Floats:
        rubbing = torque + way * (truth["load_friction"] * np.abs(torque) + truth["friction_nm"])
        if math.isfinite(truth["bandwidth_hz"]):
            value = rubbing[0]
            for i, now in enumerate(rubbing.tolist()):
                value += part * (now - value)
                rubbing[i] = value
        return np.concatenate([np.full(late, rubbing[0]), rubbing[: len(rubbing) - late]])

    # A low-pass averages over impacts; single instants meet some impacts and miss others.
    return behind(mean), behind(instant if math.isinf(truth["bandwidth_hz"]) else mean)


def sampled(walk: Floats, truth: dict[str, Any], seed: int) -> tuple[Floats, Floats, Floats]:
    """Times, crank angles and torques (n,) of the sensors, their stamps off by 0.1 ms."""
    rng = np.random.default_rng([seed, 3])
    mean, instant = received(walk, truth)
    every = round(1.0 / truth["rate_hz"] / STEP_S)
    at = np.arange(every, len(walk), every)
    times = walk[at, 0] + np.clip(1.0e-4 * rng.standard_normal(len(at)), -5.0e-4, 5.0e-4)
    impulse = np.interp(times, walk[:, 0], np.cumsum(mean) * STEP_S)
    means = np.diff(impulse, prepend=impulse[0]) / np.diff(times, prepend=times[0] - 1.0)
    torque = means if truth["sampling"] == "average" else instant[at]
    return times[1:], np.interp(times, walk[:, 0], walk[:, 1])[1:], torque[1:]


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
    times, angle, torque = sampled(walk, truth, seed)
    if truth["starts_at_zero"]:
        truth["offset_rad"] = float((angle[0] + math.pi) % TURN - math.pi)
        angle = angle - angle[0] + truth["offset_rad"]
    position = truth["sign"] * truth["gear_ratio"] * (angle - truth["offset_rad"])
    position = position + truth["angle_noise_rad"] * rng.standard_normal(len(angle))
    position = position % TURN if truth["is_wrapped"] else position
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


def errors(truth: dict[str, Any], result: CommissioningResult) -> dict[str, float]:
    """Error of each quantity that the recording determines, in standard deviations."""
    found = {item.name: item for item in result.items}

    def away(name: str, true: float, turn: float = math.inf) -> float:
        item = found.get(name)
        if item is None or item.sigma is None or isinstance(item.value, str):
            return math.nan
        off = float(item.value) - true
        return (off if math.isinf(turn) else (off + 0.5 * turn) % turn - 0.5 * turn) / item.sigma

    scale, turns = found["drive_torque.scale"], float(found["drive_torque.gear_ratio"].value)
    measured = float(scale.remark.split()[-1])
    sizes = {
        "offset": away("crank.offset_rad", truth["offset_rad"], TURN),
        "scale": (measured - truth["factor"]) / (float(scale.sigma or 0.0) * turns),
        "friction": away("friction", truth["friction_nm"]),
        "load friction": away("load friction", truth["load_friction"]),
    }
    return {name: value for name, value in sizes.items() if math.isfinite(value)}


def row(seed: int, truth: dict[str, Any], result: CommissioningResult, seconds: float) -> str:
    """A row of the table: each value as it was made, and as it was found."""
    found = {item.name: item for item in result.items}

    def value(name: str) -> Any:
        return found[name].value

    def pair(name: str, true: float, digits: int, factor: float = 1.0) -> str:
        item = found.get(name)
        if item is None or isinstance(item.value, str) or item.sigma is None:
            return (
                f"{factor * true:.{digits}f} / {item.value if item and isinstance(item.value, str) else '-'}"
            )
        now, sigma = factor * float(item.value), factor * item.sigma
        return f"{factor * true:.{digits}f} / {now:.{digits}f} ± {sigma:.{digits}f}"

    offset = found["crank.offset_rad"]
    apart = (float(offset.value) - truth["offset_rad"] + math.pi) % TURN - math.pi
    factor = float(value("drive_torque.scale")) * float(value("drive_torque.gear_ratio"))
    names = [text.split(":")[0].replace("drive_torque.", "") for text in result.not_told]
    cells = (
        f"{seed}",
        " and ".join(f"{speed:.0f}" for speed in truth["speeds_rpm"]),
        f"{truth['rate_hz']}, {truth['sampling']}",
        f"{truth['ground_n']:.0f}",
        f"{truth['sign']}, {truth['torque_sign']} / {value('crank.sign')}, {value('drive_torque.sign')}",
        f"{truth['gear_ratio']:g} / {value('crank.gear_ratio'):.6g}",
        f"{truth['source']} / {value('drive_torque.source')}",
        f"{apart:+.3f} ± {offset.sigma:.3f}",
        f"{truth['factor']:.4g} / {factor:.4g}",
        pair("friction", truth["friction_nm"], 2),
        pair("load friction", truth["load_friction"], 3),
        f"{found['crank.sign'].mismatch:.3f}",
        "; ".join([*names, *(text.split(" ± ")[0] for text in result.findings)]) or "-",
        f"{seconds:.1f}",
    )
    return f"| {' | '.join(map(str, cells))} |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=int, default=121, help="seed of the first robot")
    parser.add_argument("--number", type=int, default=10, help="number of robots")
    parser.add_argument("--cache", type=Path, help="directory of walks, each of which takes half a minute")
    arguments = parser.parse_args()
    print(
        "| seed | rpm | Hz, sampling | foot load, N | signs | gear ratio | source | offset, rad | "
        "scale × gear | friction, N m | load friction | mismatch | "
        "not enough to tell; does not fit | CPU s |"
    )
    print("|" + "---|" * 14)
    away: dict[str, list[float]] = {}
    for seed in range(arguments.first, arguments.first + arguments.number):
        truth = robot(seed) | walk_of(seed) | drive_of(seed)
        with tempfile.TemporaryDirectory() as directory:
            path = Path(directory) / "robot.mcap"
            record(path, truth, walked(seed, arguments.cache), seed)
            began = time.process_time()
            result = commission(path)
            print(row(seed, truth, result, time.process_time() - began), flush=True)
            for name, value in (errors(truth, result) if result.config else {}).items():
                away.setdefault(name, []).append(value)
    print()
    for name, values in away.items():
        inside = sum(abs(value) <= WITHIN for value in values)
        each = ", ".join(f"{value:+.2f}" for value in values)
        print(f"{name}: {inside} of {len(values)} within {WITHIN} sigma ({each})")


if __name__ == "__main__":
    main()
