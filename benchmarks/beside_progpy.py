"""A joint's forecast beside NASA's progpy (its Monte Carlo predictor), on the same growth of clearance.

progpy is no dependency: `python -m venv X && X/bin/pip install progpy`, then
`python benchmarks/beside_progpy.py X/bin/python`. Truth is a large ensemble, integrated finely.
"""

import argparse
import json
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

FRESH, LIMIT, SIGMA, FRESH_SIGMA, LOAD_SIGMA = 3.0e-4, 6.0e-4, 0.7, 5.0e-6, 0.1
RATE, POWER = (
    1.5e-11,
    0.23,
)  # growth when new [m a cycle], and the power of the clearance it goes by


def growth(clearance):
    """Nominal growth [m] a cycle, as simulated lives of joint A have it."""
    return RATE * (clearance / FRESH) ** POWER


def progpy_side(samples: int, step: float) -> None:
    """Quantiles by progpy as JSON on stdout; runs in progpy's own environment."""
    from progpy import PrognosticsModel
    from progpy.predictors import MonteCarlo
    from progpy.uncertain_data import UnweightedSamples

    class Joint(PrognosticsModel):
        inputs: list[str] = []  # noqa: RUF012
        states = ["clearance", "factor"]  # noqa: RUF012
        outputs = ["measured"]  # noqa: RUF012
        events = ["limit"]  # noqa: RUF012
        is_vectorized = True

        def initialize(self, u=None, z=None):
            return self.StateContainer({"clearance": FRESH, "factor": 1.0})

        def dx(self, x, u):
            rate = x["factor"] * growth(x["clearance"])
            return self.StateContainer({"clearance": rate, "factor": 0.0 * rate})

        def output(self, x):
            return self.OutputContainer({"measured": x["clearance"]})

        def event_state(self, x):
            return {"limit": (LIMIT - x["clearance"]) / (LIMIT - FRESH)}

        def threshold_met(self, x):
            return {"limit": x["clearance"] >= LIMIT}

    random = np.random.default_rng(1)
    factors = np.exp(np.hypot(SIGMA, LOAD_SIGMA) * random.standard_normal(samples))
    fresh = FRESH + FRESH_SIGMA * random.standard_normal(samples)
    model = Joint(process_noise=0, measurement_noise=0)
    state = UnweightedSamples(
        [
            model.StateContainer({"clearance": c, "factor": f})
            for c, f in zip(fresh.tolist(), factors.tolist(), strict=True)
        ]
    )
    began = time.perf_counter()
    found = MonteCarlo(model).predict(state, dt=step, horizon=1e9, save_freq=1e9)
    ends = [sample["limit"] for sample in found.time_of_event]
    ends = np.array([np.nan if end is None else end for end in ends])
    took = time.perf_counter() - began
    quantiles = np.nanquantile(ends, (0.1, 0.5, 0.9)).tolist()
    off = np.abs(ends / life_of(fresh, factors) - 1.0)
    result = {
        "quantiles": quantiles,
        "s": took,
        "off": float(np.nanmedian(off)),
        "lost": int(np.isnan(ends).sum()),
    }
    print(json.dumps(result))


def life_of(fresh, factor):
    """Cycles to the limit in closed form."""
    left = 1.0 - POWER
    return FRESH / (RATE * left) * ((LIMIT / FRESH) ** left - (fresh / FRESH) ** left) / factor


def truth() -> np.ndarray:
    """Quantiles of a million members; the law's life is known in closed form."""
    random = np.random.default_rng(2)
    factor = np.exp(np.hypot(SIGMA, LOAD_SIGMA) * random.standard_normal(10**6))
    fresh = FRESH + FRESH_SIGMA * random.standard_normal(10**6)
    return np.quantile(life_of(fresh, factor), (0.1, 0.5, 0.9))


def ours() -> tuple[np.ndarray, float]:
    from leg_wear_monitor.monitor.config.sections import Forecasting
    from leg_wear_monitor.monitor.forecast.forecast import GrowthLaw, JointCondition, forecast
    from leg_wear_monitor.monitor.forecast.wear_coefficients import estimate_coefficient

    law = GrowthLaw(np.array([[POWER]]), np.array([FRESH]), np.array([1.0]), np.zeros(1))
    now = JointCondition(
        joint="A", fresh_m=FRESH, wear_m=0.0, limit_m=LIMIT, growth_m=RATE, growth_error_m=0.0
    )
    settings = Forecasting(wear_coefficient_sigma=SIGMA, load_sigma=LOAD_SIGMA, clearance_sigma_m=FRESH_SIGMA)
    began = time.perf_counter()
    life = forecast(
        [now], [estimate_coefficient(settings, FRESH)], settings, law, cycle_s=1.0, valid=True
    ).leg.cycles
    return np.array([life.p10, life.p50, life.p90]), time.perf_counter() - began


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("python", type=Path, help="the one that has progpy")
    parser.add_argument("--side", nargs=2, metavar=("SAMPLES", "STEP"), help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.side:
        progpy_side(int(options.side[0]), float(options.side[1]))
        return
    true = truth()
    print(f"truth: p10 {true[0]:.4g}, p50 {true[1]:.4g}, p90 {true[2]:.4g} cycles")
    ours()  # once to warm up
    found, took = ours()
    print(f"ours, 1021 members: off by {np.round(100 * (found / true - 1), 2)} %, {took:.4f} s")
    for samples, step in ((100, 1e6), (1000, 1e6), (100, 1e5)):
        line = [str(options.python), __file__, str(options.python), "--side", str(samples), str(step)]
        done = subprocess.run(line, capture_output=True, text=True, check=False)
        if done.returncode:
            sys.exit(done.stderr)
        result = json.loads(done.stdout.splitlines()[-1])
        off = np.round(100 * (np.array(result["quantiles"]) / true - 1), 2)
        print(
            f"progpy, {samples} samples, steps of {step:g} cycles: off by {off} %, {result['s']:.2f} s; "
            f"each member by {100 * result['off']:.2g} % (median), {result['lost']} without an end"
        )


if __name__ == "__main__":
    main()
