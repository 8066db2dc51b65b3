"""Cycle jumps compared with every single cycle, and ten million cycles to the limit.

`python benchmarks/life.py` simulates 20 000 cycles of accelerated wear one by one (seven to ten minutes of a
core), and the same by jumps of several lengths, from several starts each.
"""

import argparse
import time

import numpy as np

from leg_wear_monitor import load_mechanism
from leg_wear_monitor.dynamics.clearance.stepper import ClearanceStepper
from leg_wear_monitor.dynamics.run import DONE, new_run_statistics, steady_drive
from leg_wear_monitor.dynamics.simulation import prepare
from leg_wear_monitor.life.life import LifeRun, LifeSettings, simulate_life
from leg_wear_monitor.life.result import Life
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor.config.settings import Forecasting
from leg_wear_monitor.monitor.forecast.forecast import JointCondition, forecast
from leg_wear_monitor.monitor.forecast.wear_coefficients import estimate_coefficient, when_new

HASTE = 500.0
LENGTHS = (1.0e-5, 1.5e-5, 3.0e-5, 6.0e-5, 1.0e-4)
SEEDS = (0, 10, 20)
LIMIT_M = 6.0e-4
FAR_M = 2.0e-3  # a limit that no joint reaches


def every_cycle(leg: Mechanism, cycles: int) -> tuple[np.ndarray, float]:
    """Depth (k, 2, N) after so many cycles, and the processor's time."""
    setup = prepare(leg, wear=True)
    setup.contacts.wear_coefficient[:] *= HASTE
    stepper, statistics = ClearanceStepper(setup), new_run_statistics(len(leg.joints))
    stepper.init(0.3, setup.speed)
    began = time.process_time()
    for cycle in range(1, cycles + 1):
        status, _ = stepper.advance(steady_drive(0.3, setup.speed), float(cycle), statistics)
        if status != DONE:
            raise SystemExit(f"stopped in cycle {cycle}")
    return setup.surfaces.depth, time.process_time() - began


def lived(leg: Mechanism, settings: LifeSettings, factor: object, limit_m: float, cycles: float) -> Life:
    run = LifeRun(leg, settings, wear_factor=factor)
    return simulate_life(run, limit_m=limit_m, horizon_cycles=cycles)


def against_every_cycle(leg: Mechanism, cycles: int) -> None:
    truth, spent = every_cycle(leg, cycles)
    opened = truth.mean(axis=2).sum(axis=1)
    print(f"{cycles} cycles one by one, coefficients x {HASTE:g}: {spent:.0f} s; opened by, um:")
    print("  " + " ".join(f"{j} {1e6 * o:.1f}" for j, o in zip(leg.clearance_joints, opened, strict=True)))
    print(
        f"jump um  jumps  s     faster | wear off, mean of {len(SEEDS)} starts, %; and of the worst of them:"
    )
    print("                              wear off, % | profile off, RMS % of deepest | worst sector, deg")
    for length in LENGTHS:
        began = time.process_time()
        lives = [
            lived(leg, LifeSettings(max_wear_per_jump_m=length, seed=seed), HASTE, FAR_M, float(cycles))
            for seed in SEEDS
        ]
        took = (time.process_time() - began) / len(SEEDS)
        depth = np.array([life.depth[-1] for life in lives])
        wear = 100.0 * (depth.mean(axis=3).sum(axis=2) / opened - 1.0)
        rms = np.sqrt(np.square(depth[:, :, 0] - truth[:, 0]).mean(axis=2)) / truth[:, 0].max(axis=1)
        turn = 0.5 * (depth[:, :, 0].argmax(axis=2) - truth[:, 0].argmax(axis=1))
        worst = [np.abs(x).max(axis=0) for x in (wear, 100.0 * rms, turn)]
        cells = " | ".join(" ".join(f"{x:5.1f}" for x in row) for row in (wear.mean(axis=0), *worst))
        jumps = np.mean([len(life.cycles) - 1 for life in lives])
        print(f"{1e6 * length:7.0f} {jumps:6.0f} {took:5.1f} {spent / took:8.0f}x | {cells}", flush=True)


def ten_million(leg: Mechanism) -> None:
    """Processor time of a life to the limit, and of a forecast."""
    began = time.process_time()
    life = lived(leg, LifeSettings(), 1.0, LIMIT_M, 1.0e12)
    took = time.process_time() - began
    k = int(life.clearance_m[-1].argmax())
    cycles = life.cycles_to(k, LIMIT_M)
    print(f"\nto the limit: {cycles:.3g} cycles in {took:.1f} s, {len(life.cycles) - 1} jumps")
    settings, growth = Forecasting(), life.growth_m_per_cycle[:3].mean(axis=0)
    now = [
        JointCondition(
            joint=joint, fresh_m=3e-4, wear_m=0.0, limit_m=LIMIT_M, growth_m=float(growth[k]),
            growth_error_m=0.0,
        )
        for k, joint in enumerate(leg.clearance_joints)
    ]  # fmt: skip
    coefficient_estimates = [estimate_coefficient(when_new(settings, 3e-4)) for _ in now]
    for _ in range(2):  # the first makes the draws
        began = time.process_time()
        found = forecast(now, coefficient_estimates, settings, cycle_s=1.0, valid=True)
    print(f"a forecast of all joints and the leg: {time.process_time() - began:.4f} s")
    print(f"A {found.joints[0].cycles}, leg {found.leg.cycles}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cycles", type=int, default=20_000, help="one by one; 0 to leave that out")
    options = parser.parse_args()
    leg = load_mechanism("bionic_leg")
    if options.cycles:
        against_every_cycle(leg, options.cycles)
    ten_million(leg)


if __name__ == "__main__":
    main()
