"""Print section 5 of validation_clearance.md: loads, no friction, much friction, other clearances.

Nine cases, some runs of twenty cycles in each model: half an hour on one core. With numbers as arguments,
only these cases.
"""

import argparse
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor

import attrs
import numpy as np
from full_against_clearance import (
    APART,
    FIGURES,
    SKIPPED,
    WORKERS,
    Case,
    Comparison,
    cell,
    compare,
    row,
    summary,
    table,
)

from leg_wear_monitor import Mechanism, SimulationResult, load_mechanism, simulate
from leg_wear_monitor.mechanism.spec import Load

LEG = load_mechanism("bionic_leg")
RPM = 60.0
PHASES = 64  # of a gait cycle
STANCE = 0.25  # phase in the middle of the ground's push
DIGITS = (2, 2, 0, 3, 4)  # of FIGURES


def pushed(force_n: float) -> Mechanism:
    """The leg with a constant force up at its toe."""
    return attrs.evolve(LEG, loads={"ground": Load(body="foot", point="toe", force=((0.0, force_n),))})


def walking(force_n: float) -> Mechanism:
    """The leg with a push of half a sine at its toe, up and a fifth of it forward, for half of the cycle."""
    phase = np.arange(PHASES) / PHASES
    push = force_n * np.clip(np.cos(2.0 * np.pi * (phase - STANCE)), 0.0, None)
    force = tuple((0.2 * float(up), float(up)) for up in push)
    load = Load(body="foot", point="toe", phase=tuple(phase.tolist()), force=force)
    return attrs.evolve(LEG, loads={"ground": load})


def rubbing(coefficient: float) -> Mechanism:
    """The leg with another friction coefficient in its joints."""
    return attrs.evolve(
        LEG,
        clearances={
            name: attrs.evolve(one, friction=attrs.evolve(one.friction, coefficient=coefficient))
            for name, one in LEG.clearances.items()
        },
    )


CASES = {
    "100 N": Case(pushed(100.0), "ABGIJ", RPM),
    "290 N": Case(pushed(290.0), "ABGIJ", RPM),
    "290 N in stance": Case(walking(290.0), "ABGIJ", RPM),
    "290 N in stance, A and B": Case(walking(290.0), "AB", RPM),
    "no friction": Case(rubbing(0.0), "ABGIJ", RPM),
    "no friction, I and J": Case(rubbing(0.0), "IJ", RPM),
    "0.04 mm": Case(LEG, "ABGIJ", RPM, 4.0e-5),
    "0.04 mm, friction 0.3": Case(rubbing(0.3), "ABGIJ", RPM, 4.0e-5),
    "0.5 mm, A and I": Case(LEG, "AI", RPM, 5.0e-4),
}


def results(case: Case, model: str, runs: int, cycles: int) -> list[SimulationResult]:
    """Runs whose clearances are APART."""

    def run(i: int) -> SimulationResult:
        return simulate(
            case.mechanism,
            clearances=tuple(case.clearance_joints),
            clearance_m=case.clearance_m + i * APART,
            speed_rpm=case.rpm,
            cycles=cycles,
            skip_cycles=SKIPPED,
            model=model,
        )

    with ThreadPoolExecutor(WORKERS) as pool:
        return list(pool.map(run, range(runs)))


def losses(result: SimulationResult) -> tuple[float, float]:
    """Losses [J/cycle], and what does not add up over them."""
    lost = result.energy_j.friction_loss + result.energy_j.contact_loss
    return lost / result.cycles, abs(result.energy_j.residual) / lost


def compare_all(names: Iterable[str], runs: int, cycles: int) -> list[Comparison]:
    """Tables of the cases; every comparison."""
    comparisons, balances = [], {}
    table("case", "joint", *FIGURES.values())
    for name in names:
        full, other = (results(CASES[name], model, runs, cycles) for model in ("full", "clearance"))
        balances[name] = [np.array([losses(one) for one in each]).T for each in (full, other)]
        for joint in CASES[name].clearance_joints:
            figures = [
                compare(
                    *(np.array([getattr(one.joints[joint], key) for one in each]) for each in (full, other))
                )
                for key in FIGURES
            ]
            row(name, joint, *map(cell, figures, DIGITS))
            comparisons += figures
    print("\n### Energy\n")
    table("case", "losses, full [J/cycle]", "clearance", "residual over losses, largest, full", "clearance")
    for name, (full, other) in balances.items():
        lost = compare(full[0], other[0])
        row(name, f"{lost.value:.4f}", f"{100.0 * lost.fraction:+.1f} % ({abs(lost.errors):.1f})",
            f"{full[1].max():.1e}", f"{other[1].max():.1e}")  # fmt: skip
    return comparisons


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("only", type=int, nargs="*", help="numbers of the cases, from 0")
    parser.add_argument("--runs", type=int, default=8, help="independent runs of each case")
    parser.add_argument("--cycles", type=int, default=20, help="counted cycles of each run")
    options = parser.parse_args()
    chosen = [list(CASES)[i] for i in options.only] or list(CASES)
    summary(compare_all(chosen, options.runs, options.cycles))
