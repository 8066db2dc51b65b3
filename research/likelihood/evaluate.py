"""What must hold: the trained likelihood, or today's diagnosis, on test legs in full coordinates.

`python evaluate.py LEGS WEIGHTS [--hours 10]` evaluates the likelihood. With `--today`, it evaluates today's
diagnosis on the same legs and drives, which takes minutes of processor time for each leg and drive.
"""

import argparse
import sys
import time
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import attrs
import numpy as np
from legs import LEG, NEW_M
from model import JOINTS, NONE, SOME, KnownLeg, Network, cause_of, hypotheses
from signals import RATE_HZ, Drive, Stored, changes_of

KNOWN, BLOCK = 40, 10  # gait cycles of a baseline, and neighbouring ones that are drawn together
ALL = {"lag_s": 0.01, "hz": 35.0, "load_friction": 0.2, "coulomb_nm": 1.0, "cogging": 0.03}
ALL |= {"quantum_nm": 0.1, "loss": 0.02}
DRIVES = {
    "clean": {}, "lag 10 ms": {"lag_s": 0.01}, "lag 20 ms": {"lag_s": 0.02}, "lag 30 ms": {"lag_s": 0.03},
    "low-pass 20 Hz": {"hz": 20.0}, "low-pass 35 Hz": {"hz": 35.0},
    "load friction 0.1": {"load_friction": 0.1}, "load friction 0.3": {"load_friction": 0.3},
    "Coulomb 1 N m": {"coulomb_nm": 1.0},
    "torque constant −10 %": {}, "cogging 3 %": {"cogging": 0.03}, "steps of 0.1 N m": {"quantum_nm": 0.1},
    "2 % lost": {"loss": 0.02}, "all": ALL,
}  # fmt: skip
LATER = {  # what is different after the change
    "torque constant −10 %": {"scale": 0.9},
    "all": {"scale": 0.9, "coulomb_nm": 0.5, "load_friction": 0.15},
}
FAULTS = {
    "sign": {"scale": -1.0}, "scale 1.3": {"scale": 1.3}, "scale 0.7": {"scale": 0.7},
    "in N mm": {"scale": 1000.0}, "stuck": {"is_stuck": True}, "dead zone 2 N m": {"dead_nm": 2.0},
    "hysteresis 1 N m": {"hysteresis_nm": 1.0},
    "noise × 4": {"noise_nm": 2.0}, "noise / 5": {"noise_nm": 0.1},
}  # fmt: skip
ON_GROUND = ("clean", "low-pass 35 Hz", "all")


def drives_of(name: str) -> tuple[Drive, Drive]:
    """A drive when the leg is new, and after the change."""
    return Drive(**DRIVES[name]), Drive(**DRIVES[name] | LATER.get(name, {}))


class Case(NamedTuple):
    """A change of a stored leg: its row of the table, its state, the single open joint, and its size."""

    row: str
    state: int
    opened: tuple[str, ...]
    size_m: float


def cases_of(stored: Stored, drive: str) -> Iterator[Case]:
    """All changes of a leg behind a drive."""
    where = f"ground {float(stored.truth['peak_n']):.0f} N: " if stored.truth["peak_n"] else ""
    for state, change in enumerate(changes_of(stored.truth)[1:], 1):
        cause, size_m = cause_of(change), float(stored.truth["clearance_m"][state].max())
        row = drive if cause in JOINTS else cause
        if row == "clean":
            row = f"clean, {1e3 * size_m:.2f} mm"
        yield Case(where + row, state, (cause,) if cause in JOINTS else (), size_m)


class Counts:
    """How often which answer was given, by row of the table, and errors of sizes."""

    def __init__(self) -> None:
        self.found: dict[str, list[str]] = defaultdict(list)
        self.errors: dict[str, list[float]] = defaultdict(list)

    def add(self, row: str, opened: tuple[str, ...], found: str, error_mm: float = 0.0) -> None:
        """Add an answer."""
        is_right = len(opened) == 1 and found == opened[0]
        self.found[row].append("right" if is_right else f"wrong {found}" if found in JOINTS else found)
        if is_right:
            self.errors[row].append(error_mm)

    def text(self) -> str:
        """A line for each row."""
        lines = []
        for row, found in sorted(self.found.items()):
            kinds = sorted(set(found), key=lambda kind: -found.count(kind))
            line = f"{row} | {len(found)} | " + ", ".join(f"{kind} {found.count(kind)}" for kind in kinds)
            if self.errors[row]:
                median, most = np.quantile(np.abs(self.errors[row]), [0.5, 0.9])
                line += f" | size within {median:.3f} mm, 90 % within {most:.3f} mm"
            lines.append(line)
        return "\n".join(lines)


class Trained:
    """The trained likelihood on a stored leg with a drive."""

    def __init__(self, network: Network, stored: Stored, drive: Drive, known: int = KNOWN) -> None:
        self._rng = np.random.default_rng(11)
        baseline = stored.signatures(0, drive, self._rng)[:known].mean(axis=0)
        self.leg, self._stored = KnownLeg(network, baseline, known, stored.context), stored

    def judge(self, counts: Counts, case: Case, drive: Drive, n: int, suffix: str = "") -> None:
        """Count the answer for the last n gait cycles of a case."""
        cycles = self._stored.signatures(case.state, drive, self._rng)[-n:]
        answer = self.leg.posterior(cycles.mean(axis=0), n)
        found = answer.found
        first = max(JOINTS, key=lambda joint: answer.probability[joint])
        if found == SOME and len(case.opened) == 1:
            found = f"{'right' if first == case.opened[0] else 'wrong'} first"
        size_m = NEW_M * np.exp(answer.log_opening)
        counts.add(case.row + suffix, case.opened, found, 1e3 * (size_m - case.size_m))
        if len(case.opened) == 1 and n == 10:
            where = "ground" if self._stored.truth["peak_n"] else "in the air"
            counts.add(f"one joint, {where}, any drive", case.opened, found, 1e3 * (size_m - case.size_m))
            counts.add(f"first of the joints, {where}", case.opened, first, 1e3 * (size_m - case.size_m))


def trained(network: Network, legs: list[Stored], counts: Counts) -> None:
    """All rows of the trained likelihood."""
    for stored in legs:
        is_loaded = bool(stored.truth["peak_n"])
        for name in ON_GROUND if is_loaded else DRIVES:
            before, after = drives_of(name)
            engine = Trained(network, stored, before)
            if is_loaded:
                counts.add(f"load {stored.truth['peak_n']:.0f} N: {engine.leg.peak_n:.0f} N", (), "-")
            for case in cases_of(stored, name):
                for n in (3, 5, 10) if name == "clean" else (10,):
                    engine.judge(counts, case, after, n, f", {n} cycles")
        if is_loaded:
            continue
        engine, short = (Trained(network, stored, Drive(), known) for known in (KNOWN, 10))
        rng = np.random.default_rng(15)
        for case in cases_of(stored, ""):
            if len(case.opened) != 1:
                continue
            short.judge(counts, case, Drive(), 10, "baseline of 10 cycles")
            worn = stored.signatures(case.state, Drive(), rng)
            half = np.vstack([stored.signatures(0, Drive(), rng)[: len(worn)], worn])
            for row, base, then in (
                ("repaired", worn, half[: len(worn)]),
                ("inside the baseline", half, worn),
            ):
                leg = KnownLeg(network, base.mean(axis=0), len(base), stored.context)
                counts.add(row, (), leg.posterior(then[-10:].mean(axis=0), 10).found)
        for name, fault in FAULTS.items():
            engine.judge(counts, Case(f"fault: {name}", 0, (), 0.0), Drive(**fault), 10)


def healthy_hours(network: Network, legs: list[Stored], hours: float) -> dict[str, int]:
    """Diagnoses of healthy legs: gait cycles drawn in blocks, judged over the last 5, 10 and 20 of them."""
    rng, found = np.random.default_rng(12), defaultdict(int)
    pairs = [(stored, name) for stored in legs for name in (ON_GROUND if stored.truth["peak_n"] else DRIVES)]
    each = round(3600 * hours / len(pairs))
    for stored, name in pairs:
        before, after = drives_of(name)
        leg, healthy = Trained(network, stored, before).leg, stored.signatures(0, after, rng)[KNOWN:]
        begins, last = rng.integers(len(healthy) - BLOCK, size=each // BLOCK + 3), NONE
        order = (begins[:, None] + np.arange(BLOCK)).ravel()
        total = np.vstack([np.zeros(160), np.cumsum(healthy[order], axis=0)])
        for at in range(20, each, 5):
            answers = [leg.posterior((total[at] - total[at - n]) / n, n).found for n in (5, 10, 20)]
            new = next((one for one in answers if one != NONE), NONE)
            found[new] += new not in (NONE, last)
            last = new
    return {"cycles": each * len(pairs), **{key: number for key, number in found.items() if number}}


def calibration(network: Network, legs: list[Stored]) -> str:
    """Ranks of the true size in its posterior (ten bins), coverage, and the square of the true change."""
    rng, tried, ranks, squares = np.random.default_rng(13), hypotheses(), [], []
    for stored in legs:
        change = changes_of(stored.truth)
        true = tried._replace(change=change, cause=np.arange(len(change)))
        for name in ON_GROUND if stored.truth["peak_n"] else DRIVES:
            drive, _ = drives_of(name)
            leg = Trained(network, stored, drive).leg
            exact = KnownLeg(network, leg.baseline, KNOWN, stored.context, true)
            for case in cases_of(stored, name):
                present = stored.signatures(case.state, drive, rng)[-10:].mean(axis=0)
                squares.append(exact.squares(present, 10)[case.state] / network.basis.shape[1])
                if len(case.opened) == 1:
                    own = tried.cause == tried.names.index(case.opened[0])
                    k, weight = JOINTS.index(case.opened[0]), leg.weights(leg.squares(present, 10), 10)[own]
                    part = np.cumsum(weight) / max(weight.sum(), 1e-300)
                    ranks.append(float(np.interp(change[case.state, k], tried.change[own, k], part)))
    bins, off = np.histogram(ranks, 10, (0.0, 1.0))[0], np.abs(np.array(ranks) - 0.5)
    inside = ", ".join(f"{part:g}: {np.mean(off <= 0.5 * part):.2f}" for part in (0.5, 0.8, 0.95))
    return f"ranks {bins.tolist()}, coverage {inside}, mean square of the truth {np.mean(squares):.2f}"


def today(legs: list[Stored], names: list[str], longest: int, counts: Counts) -> None:
    """Today's diagnosis: commissioned on the new leg, then each change."""
    sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))
    from diagnosis import observed

    from leg_wear_monitor import MonitorConfig, gait_samples
    from leg_wear_monitor.estimate.cause import Cause
    from leg_wear_monitor.monitor.config.inputs import Load
    from leg_wear_monitor.monitor.diagnosis.observer import TorqueObserver
    from leg_wear_monitor.twin import CRANK, TORQUE

    rng = np.random.default_rng(14)

    def stream(stored: Stored, state: int, drive: Drive, cycles: int, first: int) -> np.ndarray:
        torque = stored.torque(state)
        torque_s, _, torque_nm, _ = stored.samples(np.resize(torque, (cycles, torque.shape[1])), drive, rng)
        crank_s = np.arange(0.0, cycles, 1.0 / RATE_HZ)
        angle = stored.angles(crank_s) + 1e-3 * rng.standard_normal(len(crank_s))
        stamps = (np.round(1e9 * (first + times)).astype(np.int64) for times in (crank_s, torque_s))
        both = [
            gait_samples(next(stamps), CRANK, crank_angle_rad=angle),
            gait_samples(next(stamps), TORQUE, torque_nm=torque_nm),
        ]
        samples = np.concatenate(both)
        return np.asarray(samples[np.argsort(samples["stamp_ns"], kind="stable")])

    for stored in legs:
        is_loaded = bool(stored.truth["peak_n"])
        config = MonitorConfig(load=Load(model="ground")) if is_loaded else MonitorConfig()
        for name in names:
            before, after = drives_of(name)
            began, cycle = time.process_time(), 0
            one = TorqueObserver(LEG, config, stored.size_nm, np.full(5, NEW_M))
            one.warm_up()
            for seen in observed(one, LEG, stream(stored, 0, before, longest, 0), 0):
                cycle += 1
                if one.state.commissioned is not None and not seen.reason:
                    break
            seconds, load_n = time.process_time() - began, seen.load.peak_n if seen.load else 0.0
            print(f"{name}: {cycle} cycles, {seconds:.0f} s, load {load_n:.0f} N, {seen.reason or 'sure'}")
            then = attrs.evolve(one.state)
            for case in cases_of(stored, name):
                one.go_on_from(then)
                for seen in observed(one, LEG, stream(stored, case.state, after, 11, cycle), cycle):
                    if any(change.is_sure for change in seen.changes):
                        break
                change = seen.changes[-1] if seen.changes else None
                found = change.cause.value if change else NONE
                if change and change.cause is Cause.CLEARANCE:
                    found = change.subject if change.is_sure else f"{change.subject}?"
                counts.add(
                    case.row, case.opened, found, 1e3 * (change.value - case.size_m) if change else 0.0
                )
            print(counts.text(), flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("legs", type=Path)
    parser.add_argument("weights", type=Path)
    parser.add_argument("--hours", type=float, default=10.0)
    parser.add_argument("--today", action="store_true")
    parser.add_argument("--longest", type=int, default=480, help="gait cycles to today's first diagnosis")
    parser.add_argument("--drive", nargs="+", default=["clean", "all"], choices=sorted(DRIVES))
    parser.add_argument("--only", type=int, nargs="+", help="numbers of legs")
    options = parser.parse_args()
    paths = sorted(options.legs.glob("[0-9]????.npz"))
    legs = [Stored.read(path) for path in paths if not options.only or int(path.stem) in options.only]
    counts = Counts()
    if options.today:
        today(legs, options.drive, options.longest, counts)
        return
    network, began = Network(options.weights), time.process_time()
    trained(network, legs, counts)
    print(counts.text(), calibration(network, legs), sep="\n", flush=True)
    print(healthy_hours(network, legs, options.hours), f"{time.process_time() - began:.0f} s")


if __name__ == "__main__":
    main()
