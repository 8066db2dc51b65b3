"""Coverage of growth's interval of 80 %: legs in full coordinates that differ from the leg on paper.

Each leg has its own masses and joints, and a crank with a ripple. Its truth is the mean growth of many gait
cycles in full coordinates. The monitor's twin is the leg on paper, in clearance coordinates, and has noisy
crank angles only, or the drive torque as well (`--torque`). The benchmark also prints the factor in
`growth.py` for the growth from impacts: it comes from the first sixteen legs with `--quick`, so other
legs show the coverage.
`python benchmarks/growth_coverage.py --first 16 --keep DIRECTORY` takes about half an hour of one core, and
some more minutes for other windows. With `--quick` the truth is a twin of the leg as built instead: not
independent, but in a third of the time.
"""

import argparse
import itertools
import pickle
from collections.abc import Iterator
from pathlib import Path
from statistics import NormalDist
from typing import NamedTuple

import attrs
import numpy as np

from leg_wear_monitor import load_mechanism
from leg_wear_monitor import twin as kinds
from leg_wear_monitor.dynamics.full_run import FullRun
from leg_wear_monitor.dynamics.run import TORQUE, new_run_statistics, quintic
from leg_wear_monitor.dynamics.simulation import prepare
from leg_wear_monitor.gait.config import PaceConfig
from leg_wear_monitor.gait.leg import Pace
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor.forecast.growth import GrowthWindow, ModelError, growth_rate, model_error
from leg_wear_monitor.twin.digital_twin import DigitalTwin
from leg_wear_monitor.twin.sample import gait_samples

MASS_SIGMA, POINT_SIGMA_M, MOST_RIPPLE = 0.05, 1.0e-4, 0.03
RATE_HZ, NOISE_RAD, NOISE_NM = 200, 1.0e-3, 0.5  # a gait cycle takes a second
TOLERANCE_M = 1.0e-8
SETTLING = 3  # gait cycles until a leg that starts from its ideal motion walks as it will
WIDTH = NormalDist().inv_cdf(0.9)  # standard deviations from the middle of a normal distribution to p90


HEAD = """
| joint | median error, mean error [%] | model: found, stated [%] | coverage [%]: before | cycles only | now \
| truth's scatter counted | error over sigma: before, now |
|---|---|---|---|---|---|---|---|"""


class Leg(NamedTuple):
    """A leg as built, and the ripple of its crank."""

    mechanism: Mechanism
    ripple: float


class Cycle(NamedTuple):
    """Growth (k,) of the mean clearances [m] in a gait cycle, and mean drive torque in each step [N m]."""

    growth_m: np.ndarray
    torque_nm: np.ndarray


def heavier(paper: Mechanism, factors: dict[str, float]) -> Mechanism:
    """A mechanism with other masses, and inertias with them."""
    bodies = dict(paper.bodies)
    for name, factor in factors.items():
        body = bodies[name]
        bodies[name] = attrs.evolve(body, mass=factor * body.mass, inertia=factor * body.inertia)
    return attrs.evolve(paper, bodies=bodies)


def built(paper: Mechanism, seed: int) -> Leg:
    """A leg with masses and joints that differ from the leg on paper."""
    random, bodies, factors = np.random.default_rng(seed), {}, {}
    for name, body in paper.bodies.items():
        factors[name] = 1.0 + MASS_SIGMA * random.standard_normal()
        points = {
            at: (x + POINT_SIGMA_M * random.standard_normal(), y + POINT_SIGMA_M * random.standard_normal())
            for at, (x, y) in body.points.items()
        }
        bodies[name] = attrs.evolve(body, points=points)
    return Leg(heavier(attrs.evolve(paper, bodies=bodies), factors), MOST_RIPPLE * random.random())


def walk(leg: Leg) -> Iterator[Cycle]:
    """Gait cycles of a leg in full coordinates, without end."""
    setup, pace = prepare(leg.mechanism), Pace(PaceConfig(ripple=leg.ripple))
    run = FullRun(attrs.evolve(setup, speed=pace.at(0.0).speed), tolerance_m=TOLERANCE_M)
    statistics, before = new_run_statistics(len(leg.mechanism.joints)), 0.0
    opened, impulse = np.zeros(len(setup.clearance_joints)), np.zeros(RATE_HZ + 1)
    for i in itertools.count():
        t = (i + 1) / RATE_HZ
        run.polynomial[:] = quintic(before, pace.at(before), t - before, pace.at(t))
        run.advance(t, statistics)
        before = t
        impulse[i % RATE_HZ + 1] = statistics.drive_integral[TORQUE]
        if (i + 1) % RATE_HZ == 0:
            now = setup.surfaces.depth.sum(axis=1).mean(axis=1)
            yield Cycle(now - opened, RATE_HZ * np.diff(impulse))
            opened, impulse[0] = now, impulse[-1]


def counted(
    paper: Mechanism,
    ripple: float,
    seed: int,
    cycles: int,
    torque: np.ndarray | None = None,
    noise_rad: float = NOISE_RAD,
) -> np.ndarray:
    """Growth (cycles, k) [m] in each gait cycle, as the monitor's twin counts it from noisy samples."""
    random, pace, twin = np.random.default_rng(seed), Pace(PaceConfig(ripple=ripple)), DigitalTwin(paper)
    growth, i = [], 0
    while len(growth) < cycles + SETTLING:
        steps = np.arange(i, i + RATE_HZ) + 1
        angle = np.array([pace.at(step / RATE_HZ).angle for step in steps])
        angle += noise_rad * random.standard_normal(RATE_HZ)
        stamps = 10**9 + steps * (10**9 // RATE_HZ)
        samples = gait_samples(stamps, kinds.CRANK, crank_angle_rad=angle)
        if torque is not None:
            noisy = torque[i : i + RATE_HZ] + NOISE_NM * random.standard_normal(RATE_HZ)
            measured = gait_samples(stamps, kinds.TORQUE, torque_nm=noisy)
            samples = np.stack([samples, measured], axis=1).ravel()
        growth += [cycle.growth_mean_m for cycle in twin.update(samples).cycles]
        i += RATE_HZ
    return np.array(growth[SETTLING : SETTLING + cycles])


def kept(file: Path, cycles: int, leg: Leg) -> list[Cycle]:
    """A number of gait cycles of a leg: from a file if it has them, otherwise walked and stored there."""
    if file.exists():
        walked = pickle.loads(file.read_bytes())
        if len(walked) >= cycles + SETTLING:
            return walked[: cycles + SETTLING]
    walked = list(itertools.islice(walk(leg), cycles + SETTLING))
    file.write_bytes(pickle.dumps([tuple(cycle) for cycle in walked]))
    return walked


def rates(growth: np.ndarray, model: ModelError) -> np.ndarray:
    """Growth, sampling part and whole uncertainty (3, k) [m] that the monitor reports of a window."""
    found = [growth_rate(GrowthWindow(column, np.ones(len(column)))) for column in growth.T]
    errors = [rate.error_m(model.relative(k, rate.per_cycle_m)) for k, rate in enumerate(found)]
    return np.array([[r.per_cycle_m for r in found], [r.sampling_m for r in found], errors])


def former(growth: np.ndarray) -> np.ndarray:
    """Standard error (k,) [m] of five batches, which was reported before."""
    size = len(growth) // 5
    return growth[len(growth) % 5 :].reshape(5, size, -1).mean(axis=1).std(axis=0, ddof=1) / np.sqrt(5)


def inside(off: np.ndarray, sigma: np.ndarray) -> str:
    """Coverage [%] of the interval from p10 to p90."""
    return f"{100.0 * np.mean(np.abs(off) <= WIDTH * sigma):.0f}"


def table(
    joints: tuple[str, ...], truth: np.ndarray, own: np.ndarray, windows: list[np.ndarray], model: ModelError
):
    """Print coverages; truth and its own standard error (legs, k), windows (cycles, k) of the legs."""
    said = np.array([rates(window, model) for window in windows])
    before = np.array([former(window) for window in windows])
    off, sampling, whole = said[:, 0] - truth, said[:, 1], said[:, 2]
    print(HEAD)
    for k, joint in [*enumerate(joints), (slice(None), "all")]:
        relative = off[:, k] / truth[:, k]
        scatter = (np.square(before[:, k]) + np.square(own[:, k])) / np.square(truth[:, k])
        is_off = np.sqrt(max(0.0, np.mean(np.square(relative) - scatter)))
        stated = np.sqrt(
            np.mean((np.square(whole[:, k]) - np.square(sampling[:, k])) / np.square(truth[:, k]))
        )
        ratios = [np.sqrt(np.mean(np.square(off[:, k] / s[:, k]))) for s in (before, whole)]
        cells = [
            joint,
            f"{100.0 * np.median(np.abs(relative)):.1f}, {100.0 * relative.mean():+.1f}",
            f"{100.0 * is_off:.1f}, {100.0 * stated:.1f}",
            *(inside(off[:, k], s[:, k]) for s in (before, sampling, whole, np.hypot(whole, own))),
            ", ".join(f"{ratio:.2f}" for ratio in ratios),
        ]
        print(f"| {' | '.join(cells)} |")


def print_impacts(truth: np.ndarray, own: np.ndarray, windows: list[np.ndarray], model: ModelError) -> None:
    """Print how much variance the ideal motion's sensitivities lack, by the fraction that impacts make."""
    mean, scatter = np.array([w.mean(axis=0) for w in windows]), np.array([former(w) for w in windows])
    square = np.square(mean / truth - 1.0) - (np.square(scatter) + np.square(own)) / np.square(truth)
    missing = square.mean(axis=0) / MASS_SIGMA**2 - np.square(model.sensitivity)
    impacts = np.minimum(np.abs(1.0 - model.ideal_m / mean.mean(axis=0)), 1.0)
    factor = impacts @ missing / (impacts @ impacts)
    print(f"impacts {impacts.round(2)}, missing squared sensitivity {missing.round(2)}: {factor:.2f} of them")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--keep", type=Path, default=Path("build/growth_coverage"))
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--legs", type=int, default=100)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--cycles", type=int, default=60)
    parser.add_argument("--window", type=int, default=30)
    parser.add_argument("--torque", action="store_true")
    options = parser.parse_args()
    if options.torque and options.cycles < options.window + SETTLING:
        parser.error(f"--cycles: {options.cycles} walk no torque for a window of {options.window}")
    paper = load_mechanism("bionic_leg")
    options.keep.mkdir(parents=True, exist_ok=True)
    model, truth, own, windows = model_error(paper, paper.drive.speed), [], [], []
    for seed in range(options.first, options.first + options.legs):
        leg = built(paper, seed)
        torque = None
        if options.quick:
            growth = counted(leg.mechanism, leg.ripple, seed, options.cycles, noise_rad=0.0)
        else:
            cycles = kept(options.keep / f"leg {seed}.pkl", options.cycles, leg)
            growth = np.array([cycle[0] for cycle in cycles[SETTLING:]])
            torque = np.concatenate([cycle[1] for cycle in cycles]) if options.torque else None
        truth.append(growth.mean(axis=0))
        own.append(growth.std(axis=0, ddof=1) / np.sqrt(len(growth)))
        windows.append(counted(paper, leg.ripple, seed, options.window, torque))
    table(paper.clearance_joints, np.array(truth), np.array(own), windows, model)
    print_impacts(np.array(truth), np.array(own), windows, model)


if __name__ == "__main__":
    main()
