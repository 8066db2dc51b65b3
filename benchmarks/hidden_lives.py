"""Legs whose wear coefficients and clearances when new are hidden, simulated until every joint has ended.

A joint that reaches its limit is held there, as if its part were replaced. The first leg is the nominal one.
`python benchmarks/hidden_lives.py FILE --seconds 300` adds lives to a file, a line each, until that time is
up; each takes about twenty seconds of a core.
"""

import argparse
import json
import time
from pathlib import Path

import attrs
import numpy as np

from leg_wear_monitor import load_mechanism
from leg_wear_monitor.life.life import LifeRun, LifeSettings
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor.config.sections import Forecasting

LIMIT_M = 6.0e-4
MOST_JUMPS = 400


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
    settings, k, seed = Forecasting(wear_coefficient_sigma=0.7), len(leg.clearance_joints), number - 1
    clearances, factor = dict(leg.clearances), np.ones(k)
    if number:
        factor *= np.exp(
            settings.wear_coefficient_sigma * np.random.default_rng(1000 + seed).standard_normal(k)
        )
        off = settings.clearance_sigma_m * np.random.default_rng(5000 + seed).standard_normal(k)
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


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("file", type=Path)
    parser.add_argument("--seconds", type=float, default=300.0)
    options = parser.parse_args()
    leg, until = load_mechanism("bionic_leg"), time.monotonic() + options.seconds
    number = len(read(options.file))
    while time.monotonic() < until:
        life = hidden_life(leg, number)
        with options.file.open("a", encoding="utf-8") as file:
            file.write(json.dumps([column.tolist() for column in attrs.astuple(life)]) + "\n")
        print(f"{number}: {len(life.cycles) - 1} jumps, ends {life.ends()}", flush=True)
        number += 1


if __name__ == "__main__":
    main()
