"""How well a worn joint is named with other sensors, laws of contact, loads and lengths.

Leg d of `diagnosis.py` in full coordinates, with each joint at 0.36 mm and at 1 mm. A row of the first table
is a sensor, one of the second a leg that has something the mechanism file does not know of.
`python benchmarks/diagnosis_conditions.py --keep DIRECTORY` takes about an hour of one core, and some minutes
again.
"""

import argparse
import functools
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import attrs
import numpy as np
from diagnosis import (
    BODIES,
    HEALTHY,
    LEGS,
    MONTH,
    NEW,
    STARTS,
    best_of,
    detected,
    explained,
    kept,
    largest_sum,
    measured,
    profile_of,
    referred,
    rightly,
    rounds_of,
    truth,
    walked,
)

from leg_wear_monitor import load_mechanism
from leg_wear_monitor.estimate.change_detector import ChangeDetector
from leg_wear_monitor.estimate.explanations import Explainer
from leg_wear_monitor.estimate.identification import misfit
from leg_wear_monitor.estimate.signature import TorqueSensor
from leg_wear_monitor.mechanism.position import TURN, build_linkage, one_cycle, point_motion
from leg_wear_monitor.mechanism.spec import Mechanism, PhaseLoad
from leg_wear_monitor.twin.load import torque_size
from leg_wear_monitor.twin.reference import LegParameters

SIZES, CYCLES = (3.6e-4, 1.0e-3), 40
RATES, NOISES_NM, INSTANTS = (50.0, 100.0, 200.0, 500.0, 1000.0), (0.05, 0.5, 2.0), (200.0, 1000.0)
LOAD_N, LOAD_PHASES = 30.0, 72

HEAD = """misfit | largest sum when healthy | 0.36 mm: cycles to detection | named in 5 cycles | in 10 \
| 1 mm: cycles to detection | named in 5 cycles | in 10 |
|---|---|---|---|---|---|---|---|---|"""


class Condition(NamedTuple):
    """Something that a leg has and the mechanism file does not."""

    name: str
    leg: Mechanism
    loads: tuple[float, ...] = ()


def loaded(leg: Mechanism) -> Mechanism:
    """A leg with a ground force while its toe is below its mean height; another shape than the monitor's."""
    body, point = leg.toe
    linkage = build_linkage(leg)
    position, _, _ = point_motion(one_cycle(linkage, LOAD_PHASES, TURN), linkage, body, point)
    depth = np.maximum(0.0, position[:, 1].mean() - position[:, 1])
    push = LOAD_N * np.sqrt(depth / depth.max())
    phase = tuple((np.arange(LOAD_PHASES) / LOAD_PHASES).tolist())
    ground = PhaseLoad(body=body, point=point, phase=phase, force=tuple((0.0, float(f)) for f in push))
    return attrs.evolve(leg, loads={**leg.loads, "ground": ground})


def with_contact(leg: Mechanism, normal_law: str, restitution: float, friction: dict) -> Mechanism:
    """A leg whose joints have other laws."""
    clearances = {
        joint: attrs.evolve(
            one,
            normal_law=normal_law,
            restitution=restitution,
            friction=attrs.evolve(one.friction, **friction),
        )
        for joint, one in leg.clearances.items()
    }
    return attrs.evolve(leg, clearances=clearances)


def conditions(paper: Mechanism) -> Iterator[Condition]:
    """Legs with one thing each that the mechanism file does not have."""
    leg = truth(paper, "d")
    yield Condition("none", leg)
    yield Condition("Flores, restitution 0.9", with_contact(leg, "flores", 0.9, {}))
    yield Condition("Hunt-Crossley, restitution 0.7", with_contact(leg, "hunt-crossley", 0.7, {}))
    yield Condition(
        "friction 0.1 for 0.05", with_contact(leg, "lankarani-nikravesh", 0.9, {"coefficient": 0.1})
    )
    random = np.random.default_rng(4)
    steps = tuple(np.maximum(0.0, 1.0 + 0.3 * random.standard_normal(500)).tolist())
    yield Condition(f"foot load {LOAD_N:g} N ± 30 % from step to step", loaded(leg), steps)
    for percent in (2.0, 5.0):
        # the lengths of leg d in units of 0.2 %
        lengths = [1.0 + (LEGS["d"].lengths[body] - 1.0) * percent / 0.2 for body in BODIES]
        masses = [LEGS["d"].masses[body] for body in BODIES]
        yield Condition(
            f"lengths within {percent:g} %", LegParameters(np.array(masses), np.array(lengths)).applied(paper)
        )


def walks_of(one: Condition, keep: Path) -> dict[tuple[str, float], np.ndarray]:
    """Walks by joint and size; the joint of the healthy leg is an empty string."""
    walks = {}
    for joint, size, cycles in [("", 0.0, HEALTHY)] + [
        (j, s, CYCLES) for j in one.leg.clearance_joints for s in SIZES
    ]:
        clearance = np.where(np.array(one.leg.clearance_joints) == joint, size, NEW)
        make = functools.partial(walked, one.leg, clearance, cycles + 2, LEGS["d"].ripple, one.loads)
        walks[joint, size] = kept(keep / f"{one.name} {joint} {1e3 * size:.2f}.pkl", make)
    return walks


def cells(
    explainer: Explainer, walks, sensor: TorqueSensor, noise_nm: float, healthy, random
) -> Iterator[str]:
    """What a row says of detection and names."""
    detector = ChangeDetector(explainer, NEW, MONTH)
    yield f"{largest_sum(detector, healthy):.1f}"
    for size in SIZES:
        found, right = [], np.zeros((2, 2), int)
        for (joint, opening), walk in walks.items():
            if opening != size:
                continue
            cycles = measured(walk, sensor, noise_nm, random)
            found += [detected(detector, cycles[i : i + 30]) for i in range(0, len(cycles) - 29, STARTS)]
            right += [rightly(explainer, cycles, n, [joint]) for n in (5, 10)]
        missed, late = found.count(None), [30 if delay is None else delay for delay in found]
        worst = f"{max(late)}" + (f" ({missed} of {len(found)} not in 30)" if missed else "")
        yield f"{np.median(late):g}, {worst}"
        yield from (f"{hits} of {windows}" for hits, windows in right)


def sensors(cycle_s: float, size_nm: float) -> Iterator[tuple[str, TorqueSensor, float]]:
    """Name, sensor and noise of each row."""
    for rate in RATES:
        yield f"averages, {rate:g} Hz, 0.5 N m", TorqueSensor(1.0 / rate, cycle_s, size_nm), 0.5
    for noise in NOISES_NM:
        if noise != 0.5:
            yield f"averages, 200 Hz, {noise:g} N m", TorqueSensor(0.005, cycle_s, size_nm), noise
    for rate in INSTANTS:
        yield f"instants, {rate:g} Hz, 0.5 N m", TorqueSensor(1.0 / rate, cycle_s, size_nm, True), 0.5


def print_row(name: str, row: Sequence[str]) -> None:
    """Print a row of a table."""
    print(f"| {name} | {' | '.join(row)} |", flush=True)


def known_reference(walk, profile, sensor: TorqueSensor, noise_nm: float, keep: Path, paper: Mechanism):
    """The reference that the monitor would have of a leg: that of its file, or with identified bodies."""

    def file(what: str) -> Path:
        return keep.with_name(f"{keep.name} {what}.pkl")

    reference = kept(file("of file"), lambda: referred(paper, profile, LegParameters.none(paper)))
    draws = functools.partial(np.random.default_rng, 5)
    return best_of(rounds_of(paper, reference, walk, sensor, noise_nm, draws, file), keep.name).reference


def known(walk, sensor: TorqueSensor, noise_nm: float, random, reference, paper: Mechanism):
    """Misfit, explainer and healthy signatures of a leg."""
    explainer, commissioned, healthy = explained(paper, reference, walk, sensor, noise_nm, random)
    return f"{misfit(explainer.model, explainer.nuisances, commissioned):.2f}", explainer, healthy


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--keep", type=Path, default=Path("build/diagnosis_conditions"))
    parser.add_argument("--only", choices=("sensors", "legs"))
    options = parser.parse_args()
    options.keep.mkdir(parents=True, exist_ok=True)
    paper = load_mechanism("bionic_leg")
    size, legs = torque_size(build_linkage(paper), TURN), list(conditions(paper))
    plain = TorqueSensor(0.005, 1.0, size)
    if options.only != "legs":
        walks = walks_of(legs[0], options.keep)
        healthy = walks["", 0.0]
        reference = known_reference(
            healthy, profile_of(healthy), plain, 0.5, options.keep / legs[0].name, paper
        )
        print("| sensor |", HEAD)
        for name, sensor, noise_nm in sensors(1.0, size):
            random = np.random.default_rng(5)
            found = known(healthy, sensor, noise_nm, random, reference, paper)
            print_row(name, [found[0], *cells(found[1], walks, sensor, noise_nm, found[2], random)])
    if options.only != "sensors":
        print("| what the file does not have |", HEAD)
        for one in legs:
            walks, random = walks_of(one, options.keep), np.random.default_rng(5)
            healthy = walks["", 0.0]
            reference = known_reference(
                healthy, profile_of(healthy), plain, 0.5, options.keep / one.name, paper
            )
            found = known(healthy, plain, 0.5, random, reference, paper)
            print_row(one.name, [found[0], *cells(found[1], walks, plain, 0.5, found[2], random)])


if __name__ == "__main__":
    main()
