"""What the number of intervals in a gait cycle costs, and what it changes in statistics of chaotic motion.

    python benchmarks/intervals.py [--starts 4] [--full] [CASE ...]

The default leg with five clearance joints. Every number of intervals moves the same legs in turns: each start
moves the journals by 1e-9 m, two gait cycles do not count, forty do. A column is the difference from the
finest number, its mean over the joints weighted by their scatter, the standard error by the scatter of single
gait cycles, and the largest difference of a joint in its own standard errors. `--full` adds one start in full
coordinates, which take ten times as long. Half an hour of a core.
"""

import argparse
import time
from collections.abc import Callable, Sequence
from typing import NamedTuple

import attrs
import numpy as np
import one_core  # noqa: F401 - before numpy's threads start

from leg_wear_monitor import load_mechanism
from leg_wear_monitor.dynamics.clearance.model import coupling_of
from leg_wear_monitor.dynamics.clearance.stepper import ClearanceRun
from leg_wear_monitor.dynamics.full_run import FullRun
from leg_wear_monitor.dynamics.run import ARCHARD, FORCE, FORCE_SQUARED, Setup, new_run_statistics
from leg_wear_monitor.dynamics.simulation import prepare
from leg_wear_monitor.dynamics.statistics import energy_balance
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.mechanism.spec import Mechanism, PhaseLoad

LEG, FIVE = load_mechanism("bionic_leg"), ("A", "B", "G", "I", "J")
COUNTS = (4096, 2048, 1024)
CYCLES, SETTLING = 40, 2
PUSH = [300.0 * max(0.0, np.sin(TURN * i / 16)) for i in range(16)]
STANCE = PhaseLoad(
    body="foot",
    point="toe",
    phase=tuple(i / 16 for i in range(16)),
    force=tuple((0.2 * up, up) for up in PUSH),
)
STIFFNESS, DAMPING_RATIO = 1000.0, 0.05  # of the compliant drive
NAMES = ("mean force", "force squared", "peak", "impacts", "Archard")
Run = ClearanceRun | FullRun


class Case(NamedTuple):
    """A leg, all its radial clearances [mm], its cadence [rpm], and whether its drive is compliant."""

    leg: Mechanism
    clearance: float
    rpm: float
    compliant: bool = False


CASES = {
    f"{clearance} mm, {rpm} rpm": Case(LEG, clearance, rpm)
    for clearance, rpm in ((0.1, 60), (0.3, 60), (0.8, 60), (2.0, 60), (0.3, 30), (0.3, 90), (0.8, 90))
}
CASES["ground 300 N"] = Case(attrs.evolve(LEG, loads={"ground": STANCE}), 0.3, 60)
CASES["compliant"] = Case(LEG, 0.3, 60, compliant=True)


def setup_of(case: Case) -> Setup:
    return prepare(case.leg, clearances=FIVE, clearance_m=1e-3 * case.clearance, speed_rpm=case.rpm)


def run_of(case: Case, count: int, start: int) -> ClearanceRun:
    """A leg whose journals are moved by a start."""
    run = ClearanceRun(setup_of(case), count)
    model = run.stepper.model
    if case.compliant:
        law = coupling_of(model.tables, len(FIVE), False, model.interval, STIFFNESS, DAMPING_RATIO)
        run.stepper.model = model._replace(coupling=law)
    run.stepper.state.e[:] = 1e-9 * start * np.sign(np.sin(1.0 + np.arange(2 * len(FIVE))))
    return run


class Cycles(NamedTuple):
    """Values (CYCLES, NAMES, k) of gait cycles, energy residual over losses, processor's seconds a cycle."""

    values: np.ndarray
    residual: float
    seconds: float


def cycles_of(run: Run, setup: Setup) -> Cycles:
    period, joint = TURN / setup.speed, setup.contacts.joint
    run.advance(SETTLING * period, new_run_statistics(len(LEG.joints)))
    rows, whole, begin = [], np.zeros(2), time.process_time()
    for cycle in range(CYCLES):
        statistics, stored = new_run_statistics(len(LEG.joints)), run.stored_energy
        run.advance((SETTLING + cycle + 1) * period, statistics)
        energy = energy_balance(statistics, stored, run.stored_energy)
        whole += energy.residual, energy.friction_loss + energy.contact_loss
        rates = statistics.integral[joint].T[[FORCE, FORCE_SQUARED, ARCHARD]]
        rows.append([*rates[:2], statistics.peak[joint], statistics.impacts[joint], rates[2]])
    spent = (time.process_time() - begin) / CYCLES
    return Cycles(np.array(rows, dtype=float), float(whole[0] / whole[1]), spent)


def print_row(kind: str, runs: Sequence[Cycles], reference: np.ndarray) -> None:
    """Cost, energy, and differences from the reference (n, NAMES, k)."""
    values, mean = np.concatenate([one.values for one in runs]), reference.mean(axis=0)
    errors = [all_of.std(axis=0, ddof=1) / np.sqrt(len(all_of)) for all_of in (values, reference)]
    off, sigma = values.mean(axis=0) / mean - 1.0, np.hypot(*errors) / mean
    weight = 1.0 / sigma**2
    total = weight.sum(axis=1)
    worst = (np.abs(off) / sigma).max(axis=1)
    cells = zip((weight * off).sum(axis=1) / total, 1.0 / np.sqrt(total), worst, strict=True)
    residual = 1e3 * np.array([one.residual for one in runs])
    scatter = residual.std(ddof=1) / np.sqrt(len(residual)) if len(residual) > 1 else np.nan
    print(
        f"  {kind:5} {1e3 * np.median([one.seconds for one in runs]):8.2f} "
        f"{residual.mean():8.2f} ± {scatter:4.2f} "
        + "".join(f"{100 * m:+8.2f} ± {100 * s:4.2f} % ({z:3.1f})" for m, s, z in cells),
        flush=True,
    )


def compare(name: str, starts: int, full: bool) -> None:
    case = CASES[name]
    setup = setup_of(case)
    kinds: dict[str, Callable[[int], Run]] = {
        str(count): lambda start, count=count: run_of(case, count, start) for count in COUNTS
    }
    if full and not case.compliant:
        kinds["full"] = lambda _: FullRun(setup_of(case), tolerance_m=1e-9)
    found: dict[str, list[Cycles]] = {kind: [] for kind in kinds}
    for start in range(starts):
        for kind, make in kinds.items():
            if kind != "full" or start == 0:
                found[kind].append(cycles_of(make(start), setup))
    heads = "".join(f"{head:>24}" for head in NAMES)
    print(f"\n{name}, {starts} starts\n  {'':5} {'ms/cycle':>8} {'residual [1e-3]':>16}{heads}")
    for kind, runs in found.items():
        print_row(kind, runs, np.concatenate([one.values for one in found[str(COUNTS[0])]]))


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("cases", nargs="*", metavar="CASE", help=", ".join(CASES))
    parser.add_argument("--starts", type=int, default=4)
    parser.add_argument("--full", action="store_true")
    options = parser.parse_args()
    for name in options.cases or CASES:
        compare(name, options.starts, options.full)


if __name__ == "__main__":
    main()
