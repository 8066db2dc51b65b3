"""How often a forecast's p10 to p90 contains the true end of life, on legs with hidden coefficients.

    python benchmarks/life_coverage.py LIVES --simulate 300    adds lives to the file LIVES for 300 s
    python benchmarks/life_coverage.py LIVES                   compares them with forecasts, some minutes

Wear coefficients, loads and clearances of the legs are hidden. A simulated life takes about twenty seconds;
a joint that reaches its limit is held there, as if its part were replaced. The first life is the nominal one.

The truth is simulated lives, and 200 legs by a law that is fitted to those lives. Each leg is monitored for
the first fifth of its own life (until its first joint ends), or for a fifth of a joint's own life. The
forecast is then made without a measured clearance, with one of the joint (for the leg: of the joint that most
likely ends first), and with all joints measured once.
"""

import argparse
import json
import time
from pathlib import Path

import attrs
import numpy as np

from leg_wear_monitor import load_mechanism
from leg_wear_monitor.life.life import LifeRun, LifeSettings
from leg_wear_monitor.mechanism.materials import USUAL_SPREAD
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor.config.settings import Forecasting
from leg_wear_monitor.monitor.forecast.forecast import (
    Forecast,
    JointCondition,
    JointForecast,
    LegForecast,
    forecast,
)
from leg_wear_monitor.monitor.forecast.wear_coefficients import (
    ClearanceAtWear,
    estimate_coefficient,
    when_new,
)

LIMIT_M = 6.0e-4
FRESH_M, MEASURED_M, GROWTH_NOISE = 3.0e-4, 5.0e-6, 0.03
STEPS = 100  # of a joint's way to its limit, in the truth by a law
SETTINGS = Forecasting()
MOST_JUMPS = 400  # of a life


@attrs.frozen
class HiddenLife:
    """A leg's true life: factors and clearances when new (k,); clearance and growth (p, k) over cycles."""

    factor: np.ndarray
    fresh_m: np.ndarray
    cycles: np.ndarray
    clearance_m: np.ndarray
    growth_m: np.ndarray

    def ends(self) -> np.ndarray:
        """Cycles (k,) at which each joint reaches its limit."""
        return np.array([np.interp(LIMIT_M, seen, self.cycles) for seen in self.clearance_m.T])


def hidden_life(leg: Mechanism, number: int) -> HiddenLife:
    """Life of a leg; the first is the nominal one, which the twin has."""
    k, seed = len(leg.clearance_joints), number - 1
    clearances, factor = dict(leg.clearances), np.ones(k)
    if number:
        factor *= np.exp(USUAL_SPREAD * np.random.default_rng(1000 + seed).standard_normal(k))
        off = SETTINGS.new_clearance_sigma * FRESH_M * np.random.default_rng(5000 + seed).standard_normal(k)
        for joint, more in zip(leg.clearance_joints, off.tolist(), strict=True):
            was = clearances[joint]
            clearances[joint] = attrs.evolve(was, radial_clearance=was.radial_clearance + more)
    own = attrs.evolve(leg, clearances=clearances)
    run = LifeRun(own, LifeSettings(seed=500 + 17 * seed), wear_factor=factor)
    held = np.zeros(len(leg.clearance_joints), bool)
    while not held.all() and len(run.points) < MOST_JUMPS:
        run.jump()
        ended = (run.fresh_m + run.points[-1].opened_m >= LIMIT_M) & ~held
        for k in np.flatnonzero(ended):
            run.hold(int(k))
        held |= ended
    life = run.life
    return HiddenLife(factor, run.fresh_m, life.cycles, life.clearance_m, life.growth_m_per_cycle)


def read(path: Path) -> list[HiddenLife]:
    lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    return [HiddenLife(*(np.array(each) for each in json.loads(line))) for line in lines]


@attrs.frozen
class Case:
    """A leg now: the monitor's data, the true clearances, and the remaining cycles to the joints' ends."""

    now: list[JointCondition]
    clearance_m: np.ndarray
    remain: np.ndarray


def terms(clearance: np.ndarray) -> np.ndarray:
    """Terms for a linear model of the true ln growth: clearances and their squares."""
    x = clearance / FRESH_M - 1.0
    return np.concatenate([np.ones((len(x), 1)), x, x**2], axis=1)


def truth_by_law(lives: list[HiddenLife], legs: int, random: np.random.Generator) -> list[HiddenLife]:
    """Lives by a law fitted to hidden ones, each off it by a constant as those are."""
    joints = len(lives[0].factor)
    law, off = np.zeros((2 * joints + 1, joints)), np.zeros(joints)
    for k in range(joints):
        rows = [(terms(v.clearance_m), v.growth_m[:, k] / v.factor[k], v.growth_m[:, k] > 0.0) for v in lives]
        x = np.concatenate([x[grows] for x, _, grows in rows])
        y = np.log(np.concatenate([g[grows] for _, g, grows in rows]))
        law[:, k] = np.linalg.lstsq(x, y, rcond=None)[0]
        off[k] = np.std([(np.log(g[grows]) - x[grows] @ law[:, k]).mean() for x, g, grows in rows])
    print(f"truth by a law: lives are off it by {np.round(off, 3)}")
    return [lived(law, off, joints, random) for _ in range(legs)]


def lived(law: np.ndarray, off: np.ndarray, joints: int, random: np.random.Generator) -> HiddenLife:
    factor = np.exp(USUAL_SPREAD * random.standard_normal(joints))
    fresh = FRESH_M + SETTINGS.new_clearance_sigma * FRESH_M * random.standard_normal(joints)
    own = factor * np.exp(off * random.standard_normal(joints))
    clearance, cycles, growth = [fresh], [0.0], []
    while True:
        going = clearance[-1] < LIMIT_M
        growth.append(np.where(going, own * np.exp(terms(clearance[-1][None])[0] @ law), 0.0))
        if not going.any():
            break
        jump = (LIMIT_M - FRESH_M) / STEPS / growth[-1].max()
        cycles.append(cycles[-1] + jump)
        clearance.append(np.where(going, clearance[-1] + jump * growth[-1], clearance[-1]))
    return HiddenLife(factor, fresh, np.array(cycles), np.array(clearance), np.array(growth))


def counted(twin: HiddenLife, k: int, now: float) -> tuple[float, float]:
    """Growth and wear of the twin; it is not stopped at the limit, but continues at its last rate there.

    A point of a life has eight cycles, the monitor averages 2000: growth is that over many points about now.
    """
    grows = twin.growth_m[:, k] > 0.0
    cycles, seen = twin.cycles[grows], twin.clearance_m[grows, k]
    late = len(cycles) // 2
    last = (seen[-1] - seen[late]) / (cycles[-1] - cycles[late])

    def wear(when: float) -> float:
        return float(np.interp(when, cycles, seen) - FRESH_M + max(0.0, when - cycles[-1]) * last)

    return (wear(1.8 * now) - wear(0.2 * now)) / (1.6 * now), wear(now)


def case_of(life: HiddenLife, now: float, twin: HiddenLife, joints: str, random: np.random.Generator) -> Case:
    """The monitor's data of a leg after so many cycles; from then on it wears under a different load."""
    later = float(np.exp(SETTINGS.load_sigma * random.standard_normal()))
    state = []
    for k, joint in enumerate(joints):
        growth, wear = counted(twin, k, now)
        seen = growth * (1.0 + GROWTH_NOISE * random.standard_normal())
        state.append(
            JointCondition(
                joint=joint, fresh_m=FRESH_M, wear_m=wear, limit_m=LIMIT_M, growth_m=seen,
                growth_error_m=GROWTH_NOISE * growth,
            )
        )  # fmt: skip
    clearance = np.array([np.interp(now, life.cycles, each) for each in life.clearance_m.T])
    return Case(state, clearance, (life.ends() - now) / later)


def forecast_of(case: Case, measured: dict[int, ClearanceAtWear]) -> Forecast:
    coefficient_estimates = [
        estimate_coefficient(when_new(SETTINGS, FRESH_M), [measured[k]] if k in measured else [])
        for k in range(len(case.now))
    ]
    return forecast(case.now, coefficient_estimates, SETTINGS, cycle_s=1.0, valid=True)


def evaluated(case: Case, random: np.random.Generator) -> np.ndarray:
    """p10, p50 and p90 over truth: (without, one, all) x (joints and the leg) x 3."""
    noise = MEASURED_M * random.standard_normal(len(case.now))
    observations = {
        k: ClearanceAtWear(float(case.clearance_m[k] + noise[k]), MEASURED_M, each.wear_m)
        for k, each in enumerate(case.now)
    }
    without = forecast_of(case, {})
    singly = [forecast_of(case, {k: observation}) for k, observation in observations.items()]
    first = [each.joint for each in case.now].index(str(without.leg.first))
    one = Forecast(joints=tuple(f.joints[k] for k, f in enumerate(singly)), leg=singly[first].leg)
    truth = np.append(case.remain, case.remain.min())
    rows: list[list[JointForecast | LegForecast]] = [
        [*f.joints, f.leg] for f in (without, one, forecast_of(case, observations))
    ]
    bands = np.array([[attrs.astuple(each.cycles) for each in row] for row in rows])
    return np.asarray(bands / truth[:, None])


def row(name: str, ratio: np.ndarray) -> None:
    """A line of a table; (legs, 3 ways, 3 quantiles) over truth."""
    within = 100.0 * ((ratio[..., 0] <= 1.0) & (ratio[..., 2] >= 1.0)).mean(axis=0)
    with np.errstate(all="ignore"):  # a joint that is held to be at its limit already remains for 0
        width, error = np.log(ratio[..., 2] / ratio[..., 0]), 100.0 * np.log(ratio[..., 1])
        narrower = np.nanmedian(width[:, :1] / width, axis=0)
    bias, off = np.nanmedian(error, axis=0), np.nanmedian(np.abs(error), axis=0)
    cells = "".join(
        f"{within[w]:10.1f}{narrower[w]:6.1f}{off[w]:6.1f}{'(' + format(bias[w], '+.1f') + ')':>8}"
        for w in range(3)
    )
    print(f"{name:>6}{cells}")


def tables(name: str, lives: list[HiddenLife], twin: HiddenLife, again: int) -> None:
    joints, random = "ABGIJ", np.random.default_rng(7)
    head = f"{'':>6}" + "".join(f"{way:>20}{'':10}" for way in ("none", "one", "all measured"))
    print(f"\n{name}: {len(lives)} lives, {again} loads and noises each")
    print(
        f"p10 to p90 holds the end [%], narrower by, p50 off [%], its bias; a fifth of the leg's life\n{head}"
    )
    cases = [case_of(v, 0.2 * v.ends().min(), twin, joints, random) for v in lives for _ in range(again)]
    ratio = np.array([evaluated(case, random) for case in cases])
    for k, joint in enumerate([*joints, "leg"]):
        row(joint, ratio[:, :, k])
    print("a fifth of the joint's own life")
    for k, joint in enumerate(joints):
        cases = [case_of(v, 0.2 * v.ends()[k], twin, joints, random) for v in lives for _ in range(again)]
        row(joint, np.array([evaluated(case, random)[:, k] for case in cases]))


def simulate(leg: Mechanism, path: Path, seconds: float) -> None:
    """Add lives to a file, a line each, until the time is up."""
    until, number = time.monotonic() + seconds, len(read(path))
    while time.monotonic() < until:
        life = hidden_life(leg, number)
        with path.open("a", encoding="utf-8") as file:
            file.write(json.dumps([column.tolist() for column in attrs.astuple(life)]) + "\n")
        print(f"{number}: {len(life.cycles) - 1} jumps, ends {life.ends()}", flush=True)
        number += 1


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("lives", type=Path, help="file of simulated lives, one per line")
    parser.add_argument("--simulate", type=float, metavar="SECONDS", help="add lives to the file, and end")
    parser.add_argument("--legs", type=int, default=200)
    options = parser.parse_args()
    leg = load_mechanism("bionic_leg")
    if options.simulate:
        simulate(leg, options.lives, options.simulate)
        return
    twin, *hidden = read(options.lives)
    tables("simulated", hidden, twin, -(-options.legs // len(hidden)))
    tables("by a law", truth_by_law(hidden, options.legs, np.random.default_rng(8)), twin, 1)


if __name__ == "__main__":
    main()
