"""How often the diagnosis raises a change of a leg that is all right.

Leg d of `diagnosis.py` walks in full coordinates with the clearances when new. Each of several commissionings
takes 60 consecutive gait cycles; the others, in blocks drawn at random, make up months of walking. A row is
something that changed after the commissioning and is no wear. What never occurred in the walk cannot occur in
the months, so the table also has how fast the sums' maxima become rare.
`python benchmarks/diagnosis_false_alarms.py --keep DIRECTORY` takes ten minutes of one core.
"""

import argparse
import functools
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from diagnosis import COMMISSIONING, LEGS, MONTH, NEW, kept, measured, profile_of, truth, walked
from diagnosis_conditions import known_reference
from numba import njit

from leg_wear_monitor import load_mechanism
from leg_wear_monitor.estimate.change_detector import ChangeDetector, DetectorState
from leg_wear_monitor.estimate.leg_model import explainer_of
from leg_wear_monitor.estimate.signature import CommissionedTorque, TorqueSensor
from leg_wear_monitor.mechanism.position import TURN, build_linkage
from leg_wear_monitor.monitor.diagnosis.references import LegModels
from leg_wear_monitor.twin.load import load_signature, torque_size

NOISE_NM, BLOCK, STRETCH = 0.5, 10, 1000  # N m; gait cycles
FAR = 1.0e6  # a sum from which no gait cycle leads below zero


def changed(walk: np.ndarray, size_nm: float, lever: np.ndarray) -> Iterator[tuple[str, np.ndarray]]:
    """Name and walk of each row; the impulse of the torque is that of a leg with something else."""
    time, angle, impulse = walk[:, 0], walk[:, 1], walk[:, 2]
    torque = np.diff(impulse, prepend=0.0)
    step = np.diff(time, prepend=0.0)
    push = np.interp(angle % TURN, np.linspace(0.0, TURN, len(lever)), lever)
    of_step = {
        "nothing": torque,
        "friction 10 % of the torque's RMS": torque + 0.1 * size_nm * step,
        "scale 2 %": 1.02 * torque,
        "foot load 5 N": torque + 5.0 * push * step,
        "foot load 20 N": torque + 20.0 * push * step,
    }
    for name, column in of_step.items():
        other = walk.copy()
        other[:, 2] = np.cumsum(column)
        yield name, other
    late = walk.copy()
    late[:, 1] += 0.01
    yield "crank offset 10 mrad", late


def ratios(detector: ChangeDetector, cycles: np.ndarray) -> np.ndarray:
    """What each gait cycle adds to each test (n, tests)."""
    tests = len(detector.fresh().sums)
    far = DetectorState(np.full(tests, FAR), np.zeros(tests, np.int64))
    return np.array([detector.with_cycle(far, cycle, 0).sums - FAR for cycle in cycles])


@njit
def maxima(found, blocks, threshold):
    """Number of alarms, after each of which the tests start again, and the largest sum in each stretch."""
    sums, alarms, n, most = np.zeros(found.shape[1]), 0, 0, np.zeros(len(blocks) * BLOCK // STRETCH)
    for first in blocks:
        for i in range(first, first + BLOCK):
            largest = 0.0
            for j in range(found.shape[1]):
                sums[j] = max(0.0, sums[j] + found[i, j])
                largest = max(largest, sums[j])
            if n // STRETCH < len(most):
                most[n // STRETCH] = max(most[n // STRETCH], largest)
            n += 1
            if largest > threshold:
                alarms += 1
                sums[:] = 0.0
    return alarms, most


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--keep", type=Path, default=Path("build/diagnosis_conditions"))
    parser.add_argument("--cycles", type=int, default=1000)
    parser.add_argument("--commissionings", type=int, default=10)
    parser.add_argument("--months", type=int, default=10, help="of each commissioning")
    options = parser.parse_args()
    options.keep.mkdir(parents=True, exist_ok=True)
    paper = load_mechanism("bionic_leg")
    leg, size = truth(paper, "d"), torque_size(build_linkage(paper), TURN)
    make = functools.partial(walked, leg, NEW, options.cycles, LEGS["d"].ripple)
    walk = kept(options.keep / f"healthy {options.cycles}.pkl", make)
    plain, lever = TorqueSensor(0.005, 1.0, size), load_signature(build_linkage(paper))
    reference = known_reference(walk, profile_of(walk), plain, NOISE_NM, options.keep / "none", paper)
    legs = {
        name: measured(one, plain, NOISE_NM, np.random.default_rng(3))
        for name, one in changed(walk, size, lever)
    }
    healthy, random = legs["nothing"], np.random.default_rng(7)
    firsts = np.linspace(0, len(healthy) - COMMISSIONING, options.commissionings).astype(int)
    found = {name: [] for name in legs}
    for first in firsts:
        inside = np.arange(len(healthy))
        inside = (inside >= first) & (inside < first + COMMISSIONING)
        known = CommissionedTorque(0, NEW, healthy[inside])
        explainer = explainer_of(paper, reference, LegModels(paper).channel(reference, plain, known), known)
        detector = ChangeDetector(explainer, NEW, MONTH)
        for name, cycles in legs.items():
            of_cycles = ratios(detector, cycles[~inside])
            blocks = random.integers(0, len(of_cycles) - BLOCK, options.months * int(MONTH) // BLOCK)
            found[name].append(maxima(of_cycles, blocks, detector.threshold))
    print(f"threshold {detector.threshold:.1f}, {len(firsts)} commissionings of {options.months} months each")
    print(
        "| changed since commissioning | findings a month: all, worst commissioning | largest sum | "
        "median of 1000 cycles' maxima | a maximum is ten times as rare with each |\n|---|---|---|---|---|"
    )
    for name, results in found.items():
        alarms = np.array([alarms for alarms, _ in results]) / options.months
        most = np.concatenate([most for _, most in results])
        tail = np.quantile(most, [0.9, 0.99, 0.999])
        print(
            f"| {name} | {alarms.mean():.3g}, {alarms.max():.3g} | {most.max():.1f} | {np.median(most):.1f} "
            f"| {0.5 * (tail[2] - tail[0]):.1f} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
