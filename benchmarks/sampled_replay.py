"""Sampled replay against a whole one: hours of a leg whose cadence and load change, an hour at a time.

Each hour is a recording of 200 Hz that continues the ledger of the hour before, once whole and once sampled.
The recording has the crank of the schedule and the torque of an ideal leg under the schedule's load: both
replays see the same, and the wear is that of the monitor's own leg.
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy, as the command line does

# isort: split

import argparse
import tempfile
import time
from pathlib import Path

import attrs
import numpy as np

import leg_wear_monitor as lw
from leg_wear_monitor.mechanism.position import TURN, build_linkage, one_cycle
from leg_wear_monitor.twin.load import load_signature

RATE_HZ = 200.0
CADENCES_RPM, LOADS_N = (52.0, 56.0, 60.0, 64.0, 68.0), (0.0, 15.0, 30.0)
SPELL_S = (120.0, 600.0)  # of one cadence and load
RAMP_S = 4.0
POINTS = 1024


def schedule(hours: float, seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times [s], and the crank speed [rad/s] and load [N] at each."""
    rng, times = np.random.default_rng(seed), np.arange(round(3600.0 * hours * RATE_HZ)) / RATE_HZ
    knots, speeds, loads, now = [], [], [], 0.0
    while now < times[-1]:
        until = now + rng.uniform(*SPELL_S)
        speed, load = TURN / 60.0 * rng.choice(CADENCES_RPM), rng.choice(LOADS_N)
        knots += [now + RAMP_S, until]
        speeds += [speed, speed]
        loads += [load, load]
        now = until
    wander = 0.01 * np.interp(times, np.arange(0.0, times[-1] + 20.0, 10.0), _normals(rng, times[-1]))
    return times, np.interp(times, knots, speeds) * (1.0 + wander), np.interp(times, knots, loads)


def _normals(rng: np.random.Generator, last_s: float) -> np.ndarray:
    return rng.normal(size=len(np.arange(0.0, last_s + 20.0, 10.0)))


def table(hours: float, seed: int) -> dict[str, np.ndarray]:
    """The recording."""
    times, speed, load = schedule(hours, seed)
    angle = np.cumsum(speed) / RATE_HZ
    linkage = build_linkage(lw.load_mechanism("bionic_leg"))
    nominal = [one_cycle(linkage, POINTS, factor * TURN).drive_torque for factor in (0.5, 1.0)]
    by_square = (nominal[1] - nominal[0]) / 0.75  # by the squared speed, over that of 60 rpm
    at_rest = nominal[1] - by_square
    signature = load_signature(linkage)
    phase = np.arange(POINTS + 1) / POINTS * TURN
    turned = angle % TURN

    def along(values: np.ndarray) -> np.ndarray:
        return np.interp(turned, phase, np.append(values, values[0]))

    lever = np.interp(turned, np.linspace(0.0, TURN, len(signature)), signature)
    torque = along(at_rest) + (speed / TURN) ** 2 * along(by_square) + load * lever
    noise = np.random.default_rng(seed + 1).normal(0.0, 0.02, len(times))
    return {"time": 1.0 + times, "crank_angle": angle, "drive_torque": torque + noise}


def hour_of(whole: dict[str, np.ndarray], hour: int, hour_s: float) -> dict[str, np.ndarray]:
    inside = (whole["time"] >= 1.0 + hour * hour_s) & (whole["time"] < 1.0 + (hour + 1) * hour_s)
    return {name: values[inside] for name, values in whole.items()}


def replayed(
    recording: dict[str, np.ndarray], config: lw.MonitorConfig, ledger: Path, sample: float | None
) -> tuple[dict[str, float], dict[str, float], float, float]:
    """Clearances and their standard errors [m] at the end, the processor's time [s], fraction followed."""
    begun = [0.0]

    def ready(monitor: lw.WearMonitor) -> None:
        monitor.warm_up()
        begun[0] = time.process_time()

    result = lw.replay(recording, config, ledger=ledger, sample=sample, ready=ready)
    spent, found = time.process_time() - begun[0], result.summary()
    sampling = result.monitor.sampling
    followed = sampling.followed_cycles / len(result.history) if sampling else 1.0
    last = {name: joint.counted_m for name, joint in found.clearances.items()}
    return last, {name: joint.sampling_sigma_m for name, joint in found.joints.items()}, spent, followed


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--hours", type=int, default=24)
    parser.add_argument("--minutes", type=float, default=60.0, help="length of an hour, for a quick trial")
    parser.add_argument("--sample", type=float, default=0.1)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--diagnosis", action="store_true", help="with the diagnosis by torque")
    args = parser.parse_args()
    config = lw.MonitorConfig()
    if not args.diagnosis:
        config = attrs.evolve(config, diagnosis=attrs.evolve(config.diagnosis, enabled=False))
    hour_s = 60.0 * args.minutes
    recording = table(args.hours * args.minutes / 60.0, args.seed)
    held, rows, times = [], [], np.zeros(2)
    with tempfile.TemporaryDirectory() as directory:
        ledgers = Path(directory) / "whole.ledger", Path(directory) / "sampled.ledger"
        before: dict[str, tuple[float, float, float]] = {}
        for hour in range(args.hours):
            part = hour_of(recording, hour, hour_s)
            whole, _, whole_s, _ = replayed(part, config, ledgers[0], None)
            sampled, sigma, sampled_s, followed = replayed(part, config, ledgers[1], args.sample)
            times += (whole_s, sampled_s)
            new = lw.load_mechanism("bionic_leg").clearances
            for joint in whole:
                fresh = new[joint].radial_clearance
                was = before.get(joint, (fresh, fresh, 0.0))
                grown, estimate = whole[joint] - was[0], sampled[joint] - was[1]
                error = float(np.sqrt(max(sigma[joint] ** 2 - was[2] ** 2, 0.0)))
                held.append(abs(estimate - grown) <= 1.96 * error)
                rows.append((estimate / grown - 1.0, error / grown, (estimate - grown) / error))
                before[joint] = whole[joint], sampled[joint], sigma[joint]
            shown = "  ".join(
                f"{joint} {1e2 * off:+6.2f} ± {1e2 * by:5.2f} %"
                for joint, (off, by, _) in zip(whole, rows[-len(whole) :], strict=True)
            )
            print(f"hour {hour + 1:3}: {shown}; {1e2 * followed:.1f} % followed", flush=True)
    motion_s = args.hours * hour_s
    print(f"{args.hours} hours of {args.minutes:g} min at 200 Hz, sampled {args.sample:g}")
    print(f"  within 1.96 standard errors: {sum(held)} of {len(held)} joint-hours")
    print(f"  RMS of error over standard error: {np.sqrt(np.mean([row[2] ** 2 for row in rows])):.2f}")
    for name, spent in zip(("whole", "sampled"), times, strict=True):
        print(f"  {name:8} {1e3 * spent / motion_s:7.2f} ms a second, {motion_s / spent:7.1f} × real time")
    print(f"  ratio {times[0] / times[1]:.2f}, by the processor's time")


if __name__ == "__main__":
    main()
