"""Cycle jumps beside every single cycle, ten million cycles to the limit, and coefficients that differ.

`python benchmarks/life.py` simulates 20 000 cycles of accelerated wear one by one (about seven minutes of a
core), and the same by jumps of several lengths.
"""

import argparse
import time

import numpy as np

from leg_wear_monitor import load_mechanism
from leg_wear_monitor.dynamics.clearance_run import ClearanceStepper
from leg_wear_monitor.dynamics.drive import steady_drive
from leg_wear_monitor.dynamics.life import LifeRun, LifeSettings, simulate_life
from leg_wear_monitor.dynamics.life_result import Life
from leg_wear_monitor.dynamics.run import DONE
from leg_wear_monitor.dynamics.simulation import prepare
from leg_wear_monitor.dynamics.tally import new_tally
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor.belief import believe
from leg_wear_monitor.monitor.forecast import JointNow, LifeShape, forecast_joint
from leg_wear_monitor.monitor.forecast_config import Forecasting
from leg_wear_monitor.wear.cycle_jump import JumpControl

HASTE = 500.0
LENGTHS = (1.0e-5, 1.5e-5, 3.0e-5, 6.0e-5, 1.0e-4)
LIMIT_M = 6.0e-4


def every_cycle(leg: Mechanism, cycles: int) -> tuple[np.ndarray, float]:
    """Depth (k, 2, N) after so many cycles, and the processor's time."""
    setup = prepare(leg, wear=True)
    setup.contacts.wear_coefficient[:] *= HASTE
    stepper, tally = ClearanceStepper(setup), new_tally(len(leg.joints))
    stepper.init(0.3, setup.speed)
    began = time.process_time()
    for cycle in range(1, cycles + 1):
        status, _ = stepper.advance(steady_drive(0.3, setup.speed), float(cycle), tally)
        if status != DONE:
            raise SystemExit(f"stopped in cycle {cycle}")
    return setup.surfaces.depth, time.process_time() - began


def lived(leg: Mechanism, settings: LifeSettings, factor: object, limit_m: float, cycles: float) -> Life:
    run = LifeRun(leg, settings, wear_factor=factor)  # type: ignore[arg-type]
    return simulate_life(run, limit_m=limit_m, horizon_cycles=cycles)


def against_every_cycle(leg: Mechanism, cycles: int) -> None:
    truth, spent = every_cycle(leg, cycles)
    opened = truth.mean(axis=2).sum(axis=1)
    print(f"{cycles} cycles one by one, coefficients x {HASTE:g}: {spent:.0f} s; opened by, um:")
    print("  " + " ".join(f"{j} {1e6 * o:.1f}" for j, o in zip(leg.loose, opened, strict=True)))
    print("jump um  jumps  s     faster | wear off, % | profile off, RMS % of deepest | worst sector, deg")
    for length in LENGTHS:
        settings = LifeSettings(jump=JumpControl(opens_m=length))
        began = time.process_time()
        life = lived(leg, settings, HASTE, 1.0, float(cycles))
        took = time.process_time() - began
        depth = life.depth[-1]
        wear = 100.0 * (depth.mean(axis=2).sum(axis=1) / opened - 1.0)
        rms = np.sqrt(np.square(depth[:, 0] - truth[:, 0]).mean(axis=1)) / truth[:, 0].max(axis=1)
        turn = 0.5 * (depth[:, 0].argmax(axis=1) - truth[:, 0].argmax(axis=1))
        cells = " | ".join(" ".join(f"{x:5.1f}" for x in row) for row in (wear, 100.0 * rms, turn))
        print(f"{1e6 * length:7.0f} {len(life.cycles) - 1:6d} {took:5.1f} {spent / took:8.0f}x | {cells}")


def ten_million(leg: Mechanism) -> Life:
    """Time to the limit, and that of an ensemble which shares the life."""
    began = time.process_time()
    life = lived(leg, LifeSettings(), 1.0, LIMIT_M, 1.0e12)
    took = time.process_time() - began
    # the same life with coefficients scaled such that it lasts ten million cycles
    k = int(life.clearance_m[-1].argmax())
    cycles = life.cycles_to(k, LIMIT_M)
    print(f"\nto the limit: {cycles:.3g} cycles in {took:.1f} s, {len(life.cycles) - 1} jumps")
    began = time.process_time()
    shape = LifeShape(life.clearance_m[:, k], life.cycles)
    settings = Forecasting()
    growth = float(life.growth_m_per_cycle[:3, k].mean())
    now = JointNow(
        fresh_m=3e-4,
        wear_m=0.0,
        limit_m=LIMIT_M,
        growth_m=growth,
        growth_error_m=0.0,
        cycle_s=1.0,
        valid=True,
    )
    told = forecast_joint(now, believe(settings, 3e-4), settings, shape)
    print(f"an ensemble of 1024 on top: {time.process_time() - began:.4f} s, {told.cycles}")
    return life


def coefficients_that_differ(leg: Mechanism, nominal: Life, lives: int) -> None:
    print(
        "\nwear at the end by the nominal life, each joint's time scaled by its factor, over wear simulated"
    )
    for seed in range(1, lives + 1):
        factor = np.exp(0.7 * np.random.default_rng(seed).standard_normal(len(leg.loose)))
        life = lived(leg, LifeSettings(seed=seed), factor, LIMIT_M, 1.0e12)
        end = life.cycles[-1]
        cells = []
        for k, joint in enumerate(leg.loose):
            at, last = factor[k] * end, nominal.cycles[-1]
            wear = np.interp(at, nominal.cycles, nominal.clearance_m[:, k]) - nominal.clearance_m[0, k]
            wear += max(0.0, at - last) * nominal.growth_m_per_cycle[-1, k]
            true = life.clearance_m[-1, k] - life.clearance_m[0, k]
            cells.append(f"{joint} x{factor[k]:.2f}: {wear / true:.2f} (of {1e6 * true:.0f} um)")
        print("  " + "   ".join(cells))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cycles", type=int, default=20_000, help="one by one; 0 to leave that out")
    parser.add_argument("--lives", type=int, default=3, help="with coefficients that differ")
    options = parser.parse_args()
    leg = load_mechanism("bionic_leg")
    if options.cycles:
        against_every_cycle(leg, options.cycles)
    coefficients_that_differ(leg, ten_million(leg), options.lives)


if __name__ == "__main__":
    main()
