"""Whether forecasts hold what they promise: 200 legs whose coefficients, load and clearances are hidden.

Truth is a law of growth over all clearances, fitted to simulated lives with coefficients that differ, so that
joints act upon each other as they do in the leg; the monitor knows the nominal life only. Each leg is
monitored for the first fifth of a joint's life, once without and once with one measured clearance.
`python benchmarks/coverage.py` (about a minute).
"""

import argparse

import numpy as np

from leg_wear_monitor import load_mechanism
from leg_wear_monitor.dynamics.life import LifeRun, LifeSettings, simulate_life
from leg_wear_monitor.dynamics.life_result import Life
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor.belief import Look, believe
from leg_wear_monitor.monitor.forecast import JointNow, LifeShape, forecast_joint
from leg_wear_monitor.monitor.forecast_config import Forecasting

LIMIT_M, FRESH_M, MEASURED_M = 6.0e-4, 3.0e-4, 5.0e-6
STEPS = 1500


def lives_of(leg: Mechanism, count: int) -> tuple[Life, np.ndarray, np.ndarray]:
    """The nominal life, and the coefficients (joints + 1, joints) of ln growth over 1 and (c / c_0 - 1)."""
    rows, growth = [], []
    nominal = None
    for seed in range(count):
        spread = 0.0 if seed == 0 else 0.7
        factor = np.exp(spread * np.random.default_rng(seed).standard_normal(len(leg.loose)))
        run = LifeRun(leg, LifeSettings(seed=seed), wear_factor=factor)
        life = simulate_life(run, limit_m=LIMIT_M, horizon_cycles=1e12)
        nominal = nominal or life
        rows.append(np.column_stack([np.ones(len(life.cycles)), life.clearance_m / FRESH_M - 1.0]))
        growth.append(np.log(life.growth_m_per_cycle / factor))
    x, y = np.concatenate(rows), np.concatenate(growth)
    law = np.linalg.lstsq(x, y, rcond=None)[0]
    return nominal, law, (y - x @ law).std(axis=0)


def grown(law: np.ndarray, factor: np.ndarray, fresh: np.ndarray, end: float, later: float, then: float):
    """Clearances (STEPS, joints) over cycles; from ``then`` on, wear is ``later`` times as fast."""
    cycles, clearance = np.linspace(0.0, end, STEPS), np.empty((STEPS, len(fresh)))
    clearance[0] = fresh
    for i in range(1, STEPS):
        ratio = np.minimum(clearance[i - 1], LIMIT_M) / FRESH_M - 1.0
        rate = factor * np.exp(law[0] + ratio @ law[1:])
        clearance[i] = clearance[i - 1] + (later if cycles[i] > then else 1.0) * rate * (end / (STEPS - 1))
    return cycles, clearance


def life_of(law, factor, fresh, k, later, then):
    """Cycles at which joint k reaches its limit, and the path there."""
    end = 2.5 * (LIMIT_M - fresh[k]) / (factor[k] * np.exp(law[0, k]))
    cycles, clearance = grown(law, factor, fresh, end, later, then)
    return float(np.interp(LIMIT_M, clearance[:, k], cycles)), cycles, clearance


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--legs", type=int, default=200)
    parser.add_argument("--lives", type=int, default=7)
    options = parser.parse_args()
    leg, settings = load_mechanism("bionic_leg"), Forecasting()
    nominal, law, left = lives_of(leg, options.lives)
    print(f"law of growth from {options.lives} lives; left over in ln growth: {np.round(left, 3)}")
    joints, random = len(leg.loose), np.random.default_rng(7)
    _, twin_cycles, twin = life_of(law, np.ones(joints), np.full(joints, FRESH_M), 0, 1.0, np.inf)
    print("joint  p10-p90 holds    after a measurement    narrower (median)   median error of p50")
    for k, joint in enumerate(leg.loose):
        shape = LifeShape(nominal.clearance_m[:, k], nominal.cycles)
        held, ratio, off = [[], []], [], []
        for _ in range(options.legs):
            factor = np.exp(settings.wear_coefficient_sigma * random.standard_normal(joints))
            fresh = FRESH_M + settings.clearance_sigma_m * random.standard_normal(joints)
            later = float(np.exp(settings.load_sigma * random.standard_normal()))
            now, *_ = life_of(law, factor, fresh, k, 1.0, np.inf)
            now *= 0.2
            end, cycles, clearance = life_of(law, factor, fresh, k, later, now)
            # what the monitor has: the twin with nominal coefficients, after as many cycles
            growth = float(np.exp(law[0, k])) if now > twin_cycles[-1] else None
            seen = float(np.interp(now, twin_cycles, twin[:, k]))
            i = min(int(np.searchsorted(twin_cycles, now)), STEPS - 2)
            growth = (twin[i + 1, k] - twin[i, k]) / (twin_cycles[1] - twin_cycles[0])
            if now > twin_cycles[-1]:
                seen += (now - twin_cycles[-1]) * growth
            noisy = growth * (1.0 + 0.03 * random.standard_normal())
            state = JointNow(
                fresh_m=FRESH_M, wear_m=seen - FRESH_M, limit_m=LIMIT_M, growth_m=noisy,
                growth_error_m=0.03 * growth, cycle_s=1.0, valid=True,
            )  # fmt: skip
            true = float(np.interp(now, cycles, clearance[:, k]))
            look = Look(true + MEASURED_M * random.standard_normal(), MEASURED_M, state.wear_m)
            widths = []
            for which, looks in enumerate(((), (look,))):
                told = forecast_joint(state, believe(settings, FRESH_M, looks), settings, shape).cycles
                held[which].append(told.p10 <= end - now <= told.p90)
                widths.append(np.log(max(told.p90, 1.0) / max(told.p10, 1.0)))
            ratio.append(widths[0] / widths[1])
            off.append(told.p50 / (end - now) - 1.0)
        print(
            f"{joint:>5} {100 * np.mean(held[0]):10.1f} % {100 * np.mean(held[1]):18.1f} % "
            f"{np.median(ratio):18.1f} {100 * np.median(np.abs(off)):18.1f} %"
        )


if __name__ == "__main__":
    main()
