"""What must hold: the trained likelihood, and today's diagnosis, on test legs in full coordinates.

`python evaluate.py LEGS WEIGHTS [--hours 10] [--out FILE]` evaluates the likelihood; with `--today`, today's
diagnosis on the same legs and drives, which takes a minute of processor time for each leg and drive.
"""

import argparse
import json
import sys
import time
from collections import defaultdict
from pathlib import Path

import numpy as np
from legs import LEG
from model import JOINTS, NONE, KnownLeg, Network, hypotheses
from signals import Drive, Stored, changes_of

KNOWN = 40  # gait cycles of a baseline; the others of a new leg are its healthy ones
ALL = {
    "lag_s": 0.01, "hz": 35.0, "load_friction": 0.2, "coulomb_nm": 1.0, "cogging": 0.03, "waves": 72.3,
    "quantum_nm": 0.1, "loss": 0.02,
}  # fmt: skip
DRIVES = {  # when new, and after the change
    "clean": ({}, {}),
    "lag 10 ms": ({"lag_s": 0.01}, {}),
    "lag 20 ms": ({"lag_s": 0.02}, {}),
    "lag 30 ms": ({"lag_s": 0.03}, {}),
    "low-pass 20 Hz": ({"hz": 20.0}, {}),
    "low-pass 35 Hz": ({"hz": 35.0}, {}),
    "load friction 0.1": ({"load_friction": 0.1}, {}),
    "load friction 0.3": ({"load_friction": 0.3}, {}),
    "Coulomb 1 N m": ({"coulomb_nm": 1.0}, {}),
    "torque constant −10 %": ({}, {"scale": 0.9}),
    "cogging 3 %": ({"cogging": 0.03}, {}),
    "steps of 0.1 N m": ({"quantum_nm": 0.1}, {}),
    "2 % lost": ({"loss": 0.02}, {}),
    "all": (ALL, {"scale": 0.9, "coulomb_nm": 0.5, "load_friction": 0.15}),
}
FAULTS = {
    "sign": {"scale": -1.0},
    "scale 1.3": {"scale": 1.3},
    "scale 0.7": {"scale": 0.7},
    "in N mm": {"scale": 1000.0},
    "stuck": {"is_stuck": True},
    "dead zone 2 N m": {"dead_nm": 2.0},
    "hysteresis 1 N m": {"hysteresis_nm": 1.0},
    "noise × 4": {"noise_nm": 2.0},
    "noise / 5": {"noise_nm": 0.1},
}
BLOCK = 10  # neighbouring gait cycles that are drawn together


def opened_of(stored: Stored, state: int) -> tuple[str, ...]:
    """Joints that are open in a state."""
    opening = changes_of(stored.truth)[state]
    return tuple(joint for joint, one in zip(JOINTS, opening, strict=False) if one > 0.05)


def is_other(stored: Stored, state: int) -> bool:
    """Whether a mass, the friction or the load is different, and not a clearance."""
    return bool(np.abs(changes_of(stored.truth)[state, 5:]).max() > 0.01)


class Counts:
    """How often which answer was given, by row of the table."""

    def __init__(self) -> None:
        self.found: dict[str, list[str]] = defaultdict(list)
        self.errors_mm: dict[str, list[float]] = defaultdict(list)

    def add(self, row: str, right: bool | None, found: str) -> None:
        """Add an answer: right, wrong, or neither."""
        self.found[row].append({True: "right", False: f"wrong: {found}", None: found}[right])

    def text(self) -> str:
        """A line for each row."""
        lines = []
        for row, found in self.found.items():
            kinds = sorted(set(found), key=lambda kind: -found.count(kind))
            line = f"{row} | n = {len(found)} | " + ", ".join(f"{kind} {found.count(kind)}" for kind in kinds)
            if row in self.errors_mm:
                errors = np.abs(self.errors_mm[row])
                line += (
                    f" | size off by {np.median(errors):.3f}, 90 % within {np.quantile(errors, 0.9):.3f} mm"
                )
            lines.append(line)
        return "\n".join(lines)


def known_leg(network: Network, stored: Stored, drive: Drive, rng, known: int = KNOWN, tried=None):
    """A leg with its baseline, and its other healthy signatures."""
    new = stored.signatures(0, drive, rng)
    return KnownLeg(network, new[:known].mean(axis=0), known, stored.context, tried), new[known:]


def judged(
    counts: Counts, row: str, leg: KnownLeg, cycles: np.ndarray, opened: tuple[str, ...], sizes_m
) -> None:
    """Count the answer for the mean of some cycles of a leg with open joints."""
    answer = leg.posterior(cycles.mean(axis=0), len(cycles))
    if len(opened) == 1:
        counts.add(row, answer.found == opened[0] if answer.found in JOINTS else None, answer.found)
        if answer.found == opened[0]:
            true_m = sizes_m[JOINTS.index(opened[0])]
            counts.errors_mm[row].append(1e3 * (3.0e-4 * np.exp(answer.log_opening) - true_m))
    else:
        counts.add(row, False if answer.found in JOINTS else None, answer.found)


def changed_legs(network: Network, legs: list[Stored], counts: Counts) -> None:
    """Opened joints behind all drives, and on the ground; several joints, masses, repairs and faults."""
    rng = np.random.default_rng(11)
    for stored in legs:
        ground_n = float(stored.truth["peak_n"])
        number = len(stored.truth["clearance_m"])
        for name, (before, after) in DRIVES.items():
            if ground_n and name not in ("clean", "low-pass 35 Hz", "all"):
                continue
            drive, later = Drive(**before), Drive(**{**before, **after})
            leg, _ = known_leg(network, stored, drive, rng)
            if ground_n:
                counts.errors_mm["load, relative"].append(leg.peak_n / ground_n - 1.0)
                counts.add("load, relative", None, "-")
            for state in range(1, number):
                opened, sizes_m = opened_of(stored, state), stored.truth["clearance_m"][state]
                cycles = stored.signatures(state, later, rng)
                where = f"ground {ground_n:.0f} N, {name}" if ground_n else name
                if is_other(stored, state):
                    what = "friction" if abs(stored.truth["state_friction"][state] - 1.0) > 0.01 else "mass"
                    judged(
                        counts,
                        f"{what} changed{', ground' if ground_n else ''}",
                        leg,
                        cycles[:10],
                        (),
                        sizes_m,
                    )
                elif len(opened) > 1:
                    judged(
                        counts, f"several{', ground' if ground_n else ''}", leg, cycles[:10], opened, sizes_m
                    )
                else:
                    for n in (3, 5, 10) if name == "clean" else (10,):
                        size = f"{1e3 * max(sizes_m):.2f} mm, " if name == "clean" and not ground_n else ""
                        judged(counts, f"{where}, {size}{n} cycles", leg, cycles[:n], opened, sizes_m)
        if ground_n:
            continue
        leg, _ = known_leg(network, stored, Drive(), rng)
        short, _ = known_leg(network, stored, Drive(), rng, 10)
        for state in range(1, number):
            opened, sizes_m = opened_of(stored, state), stored.truth["clearance_m"][state]
            if len(opened) == 1:
                cycles = stored.signatures(state, Drive(), rng)
                judged(counts, "baseline of 10 cycles, 10 cycles", short, cycles[:10], opened, sizes_m)
                worn = KnownLeg(network, cycles.mean(axis=0), len(cycles), stored.context)
                judged(counts, "repaired", worn, stored.signatures(0, Drive(), rng)[:10], (), sizes_m)
                half = np.vstack([stored.signatures(0, Drive(), rng)[:20], cycles])
                mixed = KnownLeg(network, half.mean(axis=0), len(half), stored.context)
                judged(counts, "opened inside the baseline", mixed, cycles[:10], (), sizes_m)
        for name, fault in FAULTS.items():
            cycles = stored.signatures(0, Drive(**fault), rng)[KNOWN:]
            judged(counts, f"fault: {name}", leg, cycles[:10], (), stored.truth["clearance_m"][0])


def healthy_hours(network: Network, legs: list[Stored], hours: float) -> dict[str, int | float]:
    """Diagnoses of healthy legs: gait cycles drawn in blocks, judged over the last 5, 10 and 20 of them."""
    rng, found = np.random.default_rng(12), defaultdict(int)
    each = round(3600 * hours / (len(legs) * len(DRIVES)))
    for stored in legs:
        for before, after in DRIVES.values():
            leg, _ = known_leg(network, stored, Drive(**before), rng)
            healthy = stored.signatures(0, Drive(**{**before, **after}), rng)
            begins, last = rng.integers(len(healthy) - BLOCK, size=each // BLOCK + 3), NONE
            order = np.concatenate([np.arange(begin, begin + BLOCK) for begin in begins])
            total = np.vstack([np.zeros(160), np.cumsum(healthy[order], axis=0)])
            for at in range(20, each, 5):
                answers = [leg.posterior((total[at] - total[at - n]) / n, n).found for n in (5, 10, 20)]
                new = next((one for one in answers if one != NONE), NONE)
                found[new] += new not in (NONE, last)
                last = new
    return {"cycles": each * len(legs) * len(DRIVES), **{key: n for key, n in found.items() if n}}


def calibration(network: Network, legs: list[Stored]) -> dict[str, object]:
    """Ranks of the true size in its posterior (ten bins), coverage, and squares of the true hypothesis."""
    rng, tried, ranks, squares = np.random.default_rng(13), hypotheses(), [], []
    for stored in legs:
        change = changes_of(stored.truth)
        for before, _ in DRIVES.values():
            drive = Drive(**before)
            leg, _ = known_leg(network, stored, drive, rng)
            true = tried._replace(change=change, cause=np.arange(len(change)))
            exact, _ = known_leg(network, stored, drive, rng, tried=true)
            for state in range(1, len(change)):
                present = stored.signatures(state, drive, rng)[:10].mean(axis=0)
                squares.append(
                    exact.squares(present, 10, slice(state, state + 1))[0] / network.basis.shape[1]
                )
                opened = opened_of(stored, state)
                if len(opened) != 1:
                    continue
                own = tried.cause == tried.names.index(opened[0])
                k = JOINTS.index(opened[0])
                log_weight = -0.5 * (leg.squares(present, 10) + leg._of_cycles(10)[2])[own]
                weight = np.exp(log_weight - log_weight.max())
                whole = np.cumsum(weight) / weight.sum()
                ranks.append(float(np.interp(change[state, k], tried.change[own, k], whole)))
    bins = np.histogram(ranks, 10, (0.0, 1.0))[0].tolist()
    inside = {
        f"{part:g}": float(np.mean(np.abs(np.array(ranks) - 0.5) <= 0.5 * part)) for part in (0.5, 0.8, 0.95)
    }
    return {"rank bins": bins, "coverage": inside, "mean square of the truth": float(np.mean(squares))}


def today(legs: list[Stored], names: list[str], counts: Counts) -> None:
    """Today's diagnosis: commissioned on the new leg, then each change."""
    sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))
    from diagnosis import LONGEST, observed

    from leg_wear_monitor import MonitorConfig, gait_samples
    from leg_wear_monitor.estimate.cause import Cause
    from leg_wear_monitor.monitor.config.inputs import Load
    from leg_wear_monitor.monitor.diagnosis.observer import TorqueObserver
    from leg_wear_monitor.twin import CRANK, TORQUE

    rng, new_m = np.random.default_rng(14), np.full(5, 3.0e-4)

    def stream(stored: Stored, state: int, drive: Drive, cycles: int, first: int) -> np.ndarray:
        torque = stored.torque(state)
        torque = np.tile(torque, (1 + cycles // len(torque), 1))[:cycles]
        times, _, value, _ = stored.samples(torque, drive, rng)
        crank_s = np.arange(0.0, cycles, 0.005)
        angle = stored.profile.angles(stored.profile.speed * crank_s) + 1e-3 * rng.standard_normal(
            len(crank_s)
        )
        both = [
            gait_samples(np.round(1e9 * (first + crank_s)).astype(np.int64), CRANK, crank_angle_rad=angle),
            gait_samples(np.round(1e9 * (first + times)).astype(np.int64), TORQUE, torque_nm=value),
        ]
        block = np.concatenate(both)
        return np.asarray(block[np.argsort(block["stamp_ns"], kind="stable")])

    for stored in legs:
        ground_n = float(stored.truth["peak_n"])
        config = MonitorConfig(load=Load(model="ground")) if ground_n else MonitorConfig()
        for name in names:
            before, after = DRIVES[name]
            began, cycle = time.process_time(), 0
            one = TorqueObserver(LEG, config, stored.size_nm, new_m)
            one.warm_up()
            samples = stream(stored, 0, Drive(**before), LONGEST, 0)
            for seen in observed(one, LEG, samples, 0):
                cycle += 1
                if seen.reason == "" and seen.state.value != "waiting":
                    break
            seconds, said = time.process_time() - began, seen.reason or "sure"
            print(
                f"leg {ground_n:.0f} N, {name}: {cycle} cycles, {seconds:.0f} s of processor, {said}",
                flush=True,
            )
            if seen.load and ground_n:
                counts.errors_mm["load, relative"].append(seen.load.peak_n / ground_n - 1.0)
                counts.add("load, relative", None, "-")
            then = one.snapshot()
            for state in range(1, len(stored.truth["clearance_m"])):
                one.restore(then)
                opened, sizes_m = opened_of(stored, state), stored.truth["clearance_m"][state]
                samples = stream(stored, state, Drive(**{**before, **after}), 11, cycle)
                for seen in observed(one, LEG, samples, cycle):
                    if any(change.is_sure for change in seen.changes):
                        break
                change = seen.changes[-1] if seen.changes else None
                found = (
                    NONE
                    if change is None
                    else change.subject
                    if change.cause is Cause.CLEARANCE
                    else change.cause.value
                )
                row = (
                    "several"
                    if len(opened) > 1
                    else "mass or friction"
                    if not opened
                    else f"{name}, one joint"
                )
                row = f"ground, {row}" if ground_n else row
                counts.add(
                    row,
                    (found == opened[0] if len(opened) == 1 else False) if found in JOINTS else None,
                    found,
                )
                if len(opened) == 1 and found == opened[0]:
                    counts.errors_mm[row].append(1e3 * (change.value - sizes_m[JOINTS.index(found)]))
            print(counts.text(), flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("legs", type=Path)
    parser.add_argument("weights", type=Path)
    parser.add_argument("--hours", type=float, default=10.0)
    parser.add_argument("--today", action="store_true")
    parser.add_argument("--drive", action="append", choices=sorted(DRIVES))
    parser.add_argument("--only", type=int, nargs="+", help="numbers of legs")
    options = parser.parse_args()
    paths = sorted(options.legs.glob("[0-9]????.npz"))
    legs = [Stored.read(path) for path in paths if options.only is None or int(path.stem) in options.only]
    counts = Counts()
    if options.today:
        today(legs, options.drive or ["clean", "all"], counts)
        return
    network = Network(options.weights)
    began = time.process_time()
    changed_legs(network, legs, counts)
    print(counts.text(), flush=True)
    print(json.dumps(calibration(network, legs)))
    print(json.dumps(healthy_hours(network, legs, options.hours)))
    print(f"{time.process_time() - began:.0f} s")


if __name__ == "__main__":
    main()
