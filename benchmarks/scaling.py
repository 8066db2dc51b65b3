"""How the clearance model's cost grows: with clearance joints, wear fed back, legs and cores, and with time.

    python benchmarks/scaling.py

The default leg at 60 rpm. Contestants take turns on one core; medians are printed, by the processor's time.
Batches use one core and two, and the wall clock. Memory is the resident set over a long run (Linux).
About five minutes.
"""

import argparse
import os
from collections.abc import Sequence
from pathlib import Path
from statistics import median

import one_core  # before numpy

# isort: split
from watch import Watch

from leg_wear_monitor import load_mechanism
from leg_wear_monitor.dynamics.batch import Leg, simulate_batch
from leg_wear_monitor.dynamics.clearance.stepper import ClearanceRun
from leg_wear_monitor.dynamics.run import new_run_statistics
from leg_wear_monitor.dynamics.simulation import prepare

LEG = load_mechanism("bionic_leg")
JOINTS = tuple(LEG.joints)
FIVE = ("A", "B", "G", "I", "J")
SETS = (("G",), ("A", "B"), FIVE)
TURN = 5.0  # cycles


def take_turns(runs: Sequence[ClearanceRun], repeats: int) -> tuple[list[float], list[float]]:
    """Seconds of a cycle, medians, and trial steps in a cycle of each run."""
    statistics_of_all = [new_run_statistics(len(JOINTS)) for _ in runs]
    spent: list[list[float]] = [[] for _ in runs]
    for run in runs:
        run.advance(1.0, new_run_statistics(len(JOINTS)))
    for turn in range(repeats):
        for run, statistics, seconds in zip(runs, statistics_of_all, spent, strict=True):
            watch = Watch()
            run.advance(1.0 + (turn + 1) * TURN, statistics)
            seconds.append(watch.processor / TURN)
    trials = [float(statistics.steps[0]) / (repeats * TURN) for statistics in statistics_of_all]
    return [median(seconds) for seconds in spent], trials


def clearance_joints(repeats: int) -> None:
    """Print the cost with one to all clearance joints."""
    sets = [JOINTS[: n + 1] for n in range(len(JOINTS))]
    runs = [ClearanceRun(prepare(LEG, clearances=clearance_joints)) for clearance_joints in sets]
    seconds, trials = take_turns(runs, repeats)
    print(
        "Clearance joints: real-time factor, trial steps a cycle, cost of one, cost of a cycle over that of A"
    )
    print(f"  {'':22}{'factor':>8} {'trials':>8} {'us/trial':>9} {'cost':>7}")
    for clearance_joints, spent, tried in zip(sets, seconds, trials, strict=True):
        row = f"{1.0 / spent:8.1f} {tried:8.0f} {1.0e6 * spent / tried:9.2f} {spent / seconds[0]:7.1f}"
        print(f"  {','.join(clearance_joints):22}{row}")


def wear_fed_back(repeats: int) -> None:
    """Print the cost of wear that opens the clearances as it goes."""
    runs = [
        ClearanceRun(prepare(LEG, clearances=clearance_joints, wear=wear))
        for clearance_joints in SETS
        for wear in (False, True)
    ]
    seconds, trials = take_turns(runs, repeats)
    print(
        "\nWear, counted always, fed back into the clearances: real-time factor without and with, and more of"
    )
    print(f"  {'':22}{'without':>8} {'with':>8} {'time':>9} {'trials':>9}")
    for i, clearance_joints in enumerate(SETS):
        (without, fed), (few, many) = seconds[2 * i : 2 * i + 2], trials[2 * i : 2 * i + 2]
        more = f"{100.0 * (fed / without - 1.0):+7.1f} % {100.0 * (many / few - 1.0):+7.1f} %"
        print(f"  {','.join(clearance_joints):22}{1.0 / without:8.1f} {1.0 / fed:8.1f} {more}")


def batches(sizes: Sequence[int], cores: int, repeats: int) -> None:
    """Print the speed of batches of legs that differ in their start, their preparation included."""
    print(
        "\nBatches of two cycles a leg: cycles a second of wall clock (over the smallest batch on one core)"
    )
    heads = (f"{count} core{'s' if count > 1 else ''}" for count in range(1, cores + 1))
    print(f"  {'legs':>22}" + "".join(f"{head:>20}" for head in heads))
    factors: dict[tuple[int, int], list[float]] = {}
    for size in sizes:
        for _ in range(1 if size > 100 else repeats):
            for count in range(1, cores + 1):
                factors.setdefault((size, count), []).append(batch_factor(size, count))
        medians = [median(factors[size, count]) for count in range(1, cores + 1)]
        one = median(factors[sizes[0], 1])
        print(f"  {size:22d}" + "".join(f"{m:11.1f} ({m / one:6.2f})" for m in medians), flush=True)


def batch_factor(size: int, cores: int) -> float:
    """Cycles a second of a batch on so many cores; warm, so that nothing is compiled."""
    legs = [Leg(mechanism=LEG, clearances=FIVE, perturb_m=1.0e-4, seed=i) for i in range(size)]
    one_core.use_cores(cores)
    watch = Watch()
    simulate_batch(legs, cycles=1.0, skip_cycles=1.0, workers=cores)
    spent, _ = watch.read()
    one_core.use_cores(1)
    return 2.0 * size / spent


def memory(cycles: int) -> None:
    """Print the resident set over a long run with five clearance joints and wear fed back."""
    run, statistics = ClearanceRun(prepare(LEG, clearances=FIVE, wear=True)), new_run_statistics(len(JOINTS))
    print(f"\nMemory over {cycles} cycles with five clearance joints, wear fed back")
    print(f"  {'cycle':>8} {'resident MB':>12} {'factor':>8}")
    sizes, watch = [], Watch()
    for tenth in range(1, 11):
        done = tenth * cycles / 10.0
        run.advance(done, statistics)
        sizes.append(resident_bytes())
        factor = done / watch.processor
        print(f"  {done:8.0f} {1.0e-6 * sizes[-1]:12.2f} {factor:8.1f}", flush=True)
    print(f"  from the first tenth to the last: {1.0e-3 * (sizes[-1] - sizes[0]):+.0f} kB")


def resident_bytes() -> int:
    """Memory of this process that is in use."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE")


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--repeats", type=int, default=7, help="turns of each contestant")
    parser.add_argument("--cycles", type=int, default=10_000, help="cycles of the memory run")
    parser.add_argument("--legs", type=int, nargs="+", default=[1, 10, 100, 1000], help="sizes of batches")
    options = parser.parse_args()
    clearance_joints(options.repeats)
    wear_fed_back(options.repeats)
    batches(options.legs, min(2, len(one_core.CORES) or 1), options.repeats)
    memory(options.cycles)


if __name__ == "__main__":
    main()
