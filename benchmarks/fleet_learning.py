"""Learning across legs: how often p10 to p90 of a wear coefficient contain the truth, and how wide they are.

    python benchmarks/fleet_learning.py [FLEETS]

Synthetic fleets: the levels of pair, lots and parts are drawn with the variances that the model expects, with
half and with double of them, and each leg of a lot gives one measured clearance before the next leg is built.
A row forecasts the 1st, 5th and 20th leg of a new lot, in a fleet without other lots or with four earlier
ones of 20 legs. Given a fleet's levels, the probability that p10 to p90 contain the next leg's factor is in
closed form; a cell has its mean over the fleets with its standard error, and the mean ratio of p90 to p10.
"""

import math
import sys
from statistics import NormalDist

import numpy as np

from leg_wear_monitor.fleet.learning import LOT_FRACTION, PAIR_FRACTION, PART_FRACTION, Part, learn
from leg_wear_monitor.monitor.forecast.wear_coefficients import CoefficientPrior

SIGMA, ERROR_M, Z90 = 0.7, 7.0e-6, NormalDist().inv_cdf(0.9)  # 5 µm of the new part, 5 µm of the measurement
LEGS, ASKED = 20, (1, 5, 20)
ROWS = [(0, 6e-5, 0.5), (0, 6e-5, 1.0), (0, 6e-5, 2.0), (4, 6e-5, 0.5), (4, 6e-5, 1.0), (4, 6e-5, 2.0),
        (0, 1.5e-5, 1.0)]  # fmt: skip


def measured(random, lot, leg, log_factor, growth_m):
    error = ERROR_M / (growth_m * math.exp(0.3 * random.standard_normal()))
    factor = math.exp(log_factor) + error * random.standard_normal()
    return Part(
        leg=f"{lot}-{leg:02d}", joint="A", pair="pair", lot=f"{lot}", nominal_per_pa=1e-15,
        prior=CoefficientPrior(sigma=SIGMA), factor=factor, precision=error**-2.0,
    )  # fmt: skip


def inside(prior, truth):
    """Probability of the true distribution between p10 and p90 of a prior."""
    low, high = (truth.cdf(prior.mean + side * Z90 * prior.sigma) for side in (-1.0, 1.0))
    return high - low


def one_fleet(random, earlier, growth_m, scale):
    """Coverage, sigma and parts set aside, for each leg that is asked."""
    fractions = PAIR_FRACTION, LOT_FRACTION, PART_FRACTION
    pair, between, within = (SIGMA * math.sqrt(scale * one) for one in fractions)
    centre, parts, found = pair * random.standard_normal(), [], []
    for lot in range(earlier + 1):
        level = centre + between * random.standard_normal()
        for leg in range(LEGS):
            if lot == earlier and leg + 1 in ASKED:
                learned = learn(parts).get("pair")
                prior = (
                    learned.lots.get(f"{lot}", learned.new_lot) if learned else CoefficientPrior(sigma=SIGMA)
                )
                # the first leg shows nothing of its lot before it is measured
                at = NormalDist(level, within) if leg else NormalDist(centre, math.hypot(between, within))
                at = at if parts else NormalDist(0.0, SIGMA * math.sqrt(scale))
                aside = sum(not each.counts for each in learned.measured) if learned else 0
                found.append((inside(prior, at), prior.sigma, aside))
            parts.append(measured(random, lot, leg, level + within * random.standard_normal(), growth_m))
    return found


def row(fleets, earlier, growth_m, scale):
    random = np.random.default_rng(20261122)
    coverage, sigma, aside = np.array([one_fleet(random, earlier, growth_m, scale) for _ in range(fleets)]).T
    error = coverage.std(axis=1, ddof=1) / math.sqrt(fleets)
    cells = [
        f"{100.0 * c:.0f} ± {100.0 * e:.0f} %, {math.exp(2.0 * Z90 * s):.1f}"
        for c, e, s in zip(coverage.mean(axis=1), error, sigma.mean(axis=1), strict=True)
    ]
    return [*cells, f"{int(aside[-1].sum())} of {fleets * ((earlier + 1) * LEGS - 1)}"]


def main():
    fleets = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    print(f"{fleets} fleets a row")
    print("| earlier lots | growth [µm] | true variances | 1st leg | 5th leg | 20th leg | set aside |")
    print("|---|---|---|---|---|---|---|")
    for earlier, growth_m, scale in ROWS:
        cells = row(fleets, earlier, growth_m, scale)
        print(f"| {earlier} | {1e6 * growth_m:.0f} | {scale:g} × | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
