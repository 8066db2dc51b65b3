"""How many seconds of the leg's motion a second of wall clock gives, beside what one would use instead.

    pip install .[bench]
    python benchmarks/real_time.py

One core, one thread, everything in one run; contestants take turns, and medians over the turns are printed,
by the wall clock and by the processor's time: where they differ, others used the core too.
With one (G), two (A, B) and five (A, B, G, I, J) clearance joints at 60 rpm:

- the clearance model and full coordinates, with their defaults;
- Exudyn with ideal joints, and with stiff springs for them (`exudyn_leg.py` says how it is set up);
- SciPy's solve_ivp on the compiled right-hand side of the full coordinates (`scipy_leg.py`).

Mean forces come first, and how loosely the others may integrate to keep them (`mean_forces.py`). Exudyn
halves its step by itself where its iterations do not converge, so its accuracy hangs on the tolerance of its
discontinuous iterations more than on the step it is given.

Last, where the clearance model's time goes, and the floor: five contact laws and one 10 x 10 product.
About eight minutes. Exudyn prints a line or two of its own.
"""

import argparse
import platform
from collections.abc import Callable, Sequence
from importlib.metadata import version
from statistics import median

import one_core  # before numpy

# isort: split
import clearance_cost
from exudyn_leg import ExudynLeg, Scheme
from mean_forces import (
    Forces,
    exudyn_forces,
    own_forces,
    print_forces,
    print_heading,
    scipy_forces,
    sweep_exudyn,
    sweep_scipy,
)
from scipy_leg import ScipyLeg, impact_speeds
from watch import Watch

from leg_wear_monitor import load_mechanism
from leg_wear_monitor.dynamics.clearance.stepper import ClearanceRun
from leg_wear_monitor.dynamics.full_run import FullRun
from leg_wear_monitor.dynamics.run import RunStatistics, Setup, new_run_statistics
from leg_wear_monitor.dynamics.simulation import prepare

LEG = load_mechanism("bionic_leg")
FIVE = ("A", "B", "G", "I", "J")
SETS = (("G",), ("A", "B"), FIVE)

Factors = tuple[float, float]
Contestant = Callable[[], Factors]


def compare_own(setup: Setup, cycles: int) -> tuple[Forces, FullRun, RunStatistics]:
    """Forces of the package's two models; the reference, and the run and the tally it comes from."""
    full, clearance, watch = FullRun(setup), ClearanceRun(setup), Watch()
    reference, statistics = own_forces(full, setup, 3 * cycles)
    factor = 3 * cycles / watch.processor
    print_heading(
        "Mean contact forces of five clearance joints, off full coordinates by", setup.clearance_joints
    )
    print_forces("full coordinates", factor, 3 * cycles, reference, reference)
    print(f"  {'  their standard error':57} " + "".join(f"{e:9.2f}{'':9}" for e in reference.error))
    watch = Watch()
    forces, _ = own_forces(clearance, setup, 10 * cycles)
    print_forces("clearance model", 10 * cycles / watch.processor, 10 * cycles, forces, reference)
    return reference, full, statistics


def check_others(
    clearance_joints: Sequence[str], schemes: Sequence[Scheme], method: str, tolerance: float, cycles: int
) -> None:
    """Forces of the others with fewer clearance joints, as they were found best with five."""
    setup = prepare(LEG, clearances=clearance_joints)
    full = FullRun(setup)
    reference, statistics = own_forces(full, setup, 3 * cycles)
    print_heading(f"The same settings with clearance in {','.join(clearance_joints)}", clearance_joints)
    for scheme in schemes:
        forces, factor = exudyn_forces(setup, scheme, cycles)
        print_forces(f"Exudyn, {scheme.name}", factor, cycles, forces, reference)
    leg = ScipyLeg(setup, full, impact_speeds(setup, statistics))
    forces, factor, _ = scipy_forces(leg, method, tolerance, cycles)
    print_forces(f"SciPy, {method}", factor, cycles, forces, reference)


def own_contestant(run: ClearanceRun | FullRun, cycles: float, statistics: RunStatistics) -> Contestant:
    """A model of the package, after its first cycle."""

    def turn() -> Factors:
        watch = Watch()
        run.advance(run.time + cycles, statistics)
        return factors(cycles, watch.read())

    run.advance(1.0, statistics)
    return turn


def factors(seconds: float, spent: tuple[float, float]) -> Factors:
    """Real-time factors of so much motion by the wall clock and by the processor's time."""
    return seconds / spent[0], seconds / spent[1]


def contestants(
    setup: Setup, schemes: Sequence[Scheme], method: str, tolerance: float
) -> dict[str, Contestant]:
    """Those who take turns: each call moves the leg on and returns the real-time factors."""

    def exudyn(scheme: Scheme) -> Contestant:
        return lambda: factors(2.0, ExudynLeg(setup, scheme.penalty).solve(scheme, 2.0))

    statistics, full = new_run_statistics(len(LEG.joints)), FullRun(setup)
    entries = {
        "clearance model": own_contestant(ClearanceRun(setup), 10.0, new_run_statistics(len(LEG.joints))),
        "full coordinates": own_contestant(full, 3.0, statistics),
    }
    entries["full coordinates"]()
    entries |= {f"Exudyn, {scheme.name}": exudyn(scheme) for scheme in schemes}
    leg = ScipyLeg(setup, full, impact_speeds(setup, statistics))
    return entries | {f"SciPy, {method}": lambda: factors(1.0, leg.advance(method, tolerance, 1.0)[0])}


def race(schemes: Sequence[Scheme], method: str, tolerance: float, repeats: int) -> None:
    """Let them take turns with every set of clearance joints, and print the medians."""
    medians: list[dict[str, Factors]] = []
    for clearance_joints in SETS:
        entries = contestants(prepare(LEG, clearances=clearance_joints), schemes, method, tolerance)
        turns: dict[str, list[Factors]] = {name: [] for name in entries}
        for _ in range(repeats):
            for name, turn in entries.items():
                turns[name].append(turn())
        medians.append(
            {name: (median(wall for wall, _ in of), median(p for _, p in of)) for name, of in turns.items()}
        )
    for by, clock in enumerate(("wall clock", "processor's time")):
        print(f"\nReal-time factor by the {clock}, medians of {repeats} turns (over the clearance model's)")
        print(
            f"  {'clearance joints':42}"
            + "".join(f"{','.join(clearance_joints):>20}" for clearance_joints in SETS)
        )
        for name in medians[0]:
            cells = (
                f"{m[name][by]:10.2f} (1/{m['clearance model'][by] / m[name][by]:5.1f})" for m in medians
            )
            print(f"  {name:42}" + "".join(f"{cell:>20}" for cell in cells))


def where_time_goes(repeats: int) -> None:
    """Print the cost of the clearance model's steps and intervals, of its parts, and the floor."""
    setup = prepare(LEG, clearances=FIVE)
    rows, trial, interval = clearance_cost.regression(setup, repeats)
    print("\nThe clearance model with five clearance joints, over the number of its intervals in a cycle")
    print(f"  {'intervals':>10} {'trials':>8} {'taken':>8} {'ms/cycle':>10} {'factor':>8}")
    for row in rows:
        cost = f"{1e3 * row.seconds:10.3f} {1.0 / row.seconds:8.1f}"
        print(f"  {row.intervals:10d} {row.trials:8.0f} {row.taken:8.0f} {cost}")
    print(f"  by regression: {1e9 * trial:.0f} ns a trial step, {1e9 * interval:.0f} ns an interval")
    print_parts(clearance_cost.parts(setup), rows[1])
    least, now = clearance_cost.floor(setup), rows[1]
    bound = 2.0 * now.trials * least
    print(f"\nThe floor: five contact laws and one 10 x 10 product take {1e9 * least:.0f} ns")
    print(f"  {now.trials:.0f} trials a cycle, two evaluations each: {1.0 / bound:.0f} times real time")
    print(f"  the whole model takes {now.seconds / bound:.1f} times as long")


def print_parts(parts: Sequence[clearance_cost.Part], now: clearance_cost.Fineness) -> None:
    """Print what each part costs alone, and in a cycle."""
    print("\nIts parts alone, all five joints in contact")
    print(f"  {'':34}{'ns':>8} {'times':>6} {'':9}{'ms/cycle':>9} {'fraction':>7}")
    counts, explained = {"trial": now.trials, "taken": now.taken, "interval": now.intervals, "": 0.0}, 0.0
    for part in parts:
        spent = part.seconds * part.times * counts[part.per]
        explained += spent
        cost = f"{1e3 * spent:9.3f} {100.0 * spent / now.seconds:5.0f} %" if part.per else ""
        print(f"  {part.name:34}{1e9 * part.seconds:8.0f} {part.times:6.1f} {part.per:9}{cost}")
    rest = now.seconds - explained
    print(f"  {'all else':34}{'':25}{1e3 * rest:9.3f} {100.0 * rest / now.seconds:5.0f} %")


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--repeats", type=int, default=7, help="turns of each contestant")
    parser.add_argument("--cycles", type=int, default=20, help="cycles for the mean forces of the others")
    options = parser.parse_args()
    names = ("numpy", "numba", "scipy", "exudyn")
    print(f"Python {platform.python_version()}, " + ", ".join(f"{name} {version(name)}" for name in names))
    print(f"{platform.system()} {platform.machine()}, one of {len(one_core.CORES) or '?'} cores")
    setup = prepare(LEG, clearances=FIVE)
    reference, full, statistics = compare_own(setup, options.cycles)
    schemes = sweep_exudyn(setup, reference, options.cycles)
    leg = ScipyLeg(setup, full, impact_speeds(setup, statistics))
    method, tolerance = sweep_scipy(leg, setup, reference, options.cycles)
    for clearance_joints in SETS[:2]:
        check_others(clearance_joints, schemes, method, tolerance, options.cycles)
    race(schemes, method, tolerance, options.repeats)
    where_time_goes(options.repeats)


if __name__ == "__main__":
    main()
