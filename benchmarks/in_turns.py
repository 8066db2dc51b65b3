"""Two versions of the clearance model in turns, some gait cycles each, hundreds of times.

    python benchmarks/in_turns.py BEFORE NOW --joints A,B,G,I,J

BEFORE and NOW are directories of two checkouts. Each version has a process of its own on one core, and they
take turns within milliseconds, since neighbours can make a machine twice as slow for minutes. Where a process
lies in memory makes it some percent slower or faster than the next one of the same version, so there are
several pairs of processes; the range of their ratios says what a difference means.
"""

import argparse
import os
import subprocess
import sys
from pathlib import Path

import one_core  # noqa: F401, before numpy

# isort: split
import numpy as np
from watch import Watch

WARM = 5  # turns that do not count


def walk(joints: str, cycles: float, wear: bool, peak_n: float, stiffness: float) -> None:
    """Advance by some gait cycles for each line of the standard input; print milliseconds of a gait cycle."""
    import attrs

    from leg_wear_monitor import load_mechanism
    from leg_wear_monitor.dynamics.clearance.stepper import ClearanceStepper
    from leg_wear_monitor.dynamics.run import new_run_statistics, steady_drive
    from leg_wear_monitor.dynamics.simulation import prepare
    from leg_wear_monitor.life.result import Duty
    from leg_wear_monitor.twin.reference import LegParameters, drive_coupling

    leg = load_mechanism("bionic_leg")
    if peak_n:
        (leg,) = Duty.parse(f"{peak_n}:1").mechanisms(leg)
    setup = prepare(leg, clearances=joints.split(","), wear=wear)
    stepper, statistics = ClearanceStepper(setup), new_run_statistics(len(leg.joints))
    if stiffness:
        parameters = attrs.evolve(LegParameters.none(leg), compliance=1.0 / stiffness)
        stepper.model = stepper.model._replace(coupling=drive_coupling(setup, stepper.model, parameters))
    polynomial, done = steady_drive(0.0, setup.speed), 0.0
    for _ in sys.stdin:
        done += cycles
        watch = Watch()
        stepper.advance(polynomial, done, statistics)
        print(1e3 * watch.processor / cycles, flush=True)


def take_turns(homes: list[Path], options: list[str], turns: int) -> np.ndarray:
    """Milliseconds of a gait cycle (turns, versions)."""
    walks = [
        subprocess.Popen(
            [sys.executable, __file__, "--walk", *options],
            env=os.environ | {"PYTHONPATH": str(home)},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        for home in homes
    ]
    spent = np.zeros((turns + WARM, len(walks)))
    for turn, row in enumerate(spent):
        order = list(enumerate(walks))
        for i, one in order if turn % 2 else reversed(order):
            if one.stdin is None or one.stdout is None:
                raise SystemExit("a version has no pipes")
            one.stdin.write("\n")
            one.stdin.flush()
            row[i] = float(one.stdout.readline())
    for one in walks:
        one.kill()
    return spent[WARM:]


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("homes", nargs="*", type=Path, help="directories of two or more checkouts")
    parser.add_argument("--joints", default="A,B,G,I,J", help="clearance joints")
    parser.add_argument("--cycles", type=float, default=2.0, help="gait cycles in a turn")
    parser.add_argument("--turns", type=int, default=60, help="of each pair of processes")
    parser.add_argument("--pairs", type=int, default=7, help="of processes, one after another")
    parser.add_argument("--wear", action="store_true", help="wear opens the clearances")
    parser.add_argument("--peak-n", type=float, default=0.0, help="of the ground's force in stance [N]")
    parser.add_argument("--stiffness", type=float, default=0.0, help="of the drive [N m/rad]; 0: rigid")
    parser.add_argument("--walk", action="store_true", help=argparse.SUPPRESS)
    args = parser.parse_args()
    if args.walk:
        walk(args.joints, args.cycles, args.wear, args.peak_n, args.stiffness)
        return
    if len(args.homes) < 2:
        parser.error("expected the directories of at least two checkouts")
    numbers = {"--cycles": args.cycles, "--peak-n": args.peak_n, "--stiffness": args.stiffness}
    options = [f"{name}={value}" for name, value in numbers.items()]
    options += ["--joints", args.joints, *(["--wear"] if args.wear else [])]
    homes = [home.resolve() for home in args.homes]
    spent = np.array([take_turns(homes, options, args.turns) for _ in range(args.pairs)])
    ratios = np.median(spent / spent[:, :, :1], axis=1)  # (pairs, versions)
    for i, home in enumerate(homes):
        own, ratio = spent[:, :, i], ratios[:, i]
        print(
            f"{home.name:20} {np.median(own):7.2f} ms a gait cycle, at best {own.min():.2f}; "
            f"of the first {np.median(ratio):.3f} ({ratio.min():.3f} to {ratio.max():.3f})"
        )


if __name__ == "__main__":
    main()
