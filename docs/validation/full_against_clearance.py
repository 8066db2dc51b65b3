"""Print the tables of validation_clearance.md on means: clearance against full coordinates.

Twenty-seven cases, ten independent runs of twenty cycles in each model: a quarter of an hour on two cores.
"""

import argparse
import math
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from itertools import product
from typing import NamedTuple

import numpy as np

from leg_wear_monitor import Mechanism, SimulationResult, load_mechanism, simulate
from leg_wear_monitor.mechanism.person import with_ground_reaction

LEGS = ("bionic_leg", "jansen_leg")
SPEEDS_RPM = (30.0, 60.0, 90.0)
SETS = ("AB", "G", "IJ", "ABGIJ")
LOADS_N = (0.0, 300.0, 600.0)
SKIPPED = 2.0  # cycles of each run before counting begins
WORKERS = 2
APART = 1.0e-9  # m: what the clearances of two runs differ by, enough to make them two samples of the chaos
FRACTION, ERRORS = 0.02, 3.0  # what is wanted: within 2 %, or within three standard errors
FIGURES = {
    "mean_force_n": "mean force [N]",
    "rms_force_n": "RMS force [N]",
    "p99_force_n": "99 % below [N]",
    "contact_fraction": "in contact",
    "archard_integral_j_per_cycle": "Archard [J/cycle]",
}
ZONE = "90 % of the wear, from and to [deg]"


class Samples(NamedTuple):
    """Of n runs: ``joints`` (n, k, 5) `FIGURES`, ``zone`` (n, k, 2) of wear [deg], ``torque`` (n,) RMS [N m],
    and ``loss`` (n,) of energy in contacts and friction [J/cycle], and ``residual`` (n,) of
    the balance over it.
    """

    joints: np.ndarray
    zone: np.ndarray
    torque: np.ndarray
    loss: np.ndarray
    residual: np.ndarray


class Comparison(NamedTuple):
    """A figure in full coordinates, and the other model's difference as a fraction and in standard errors."""

    value: float
    fraction: float
    errors: float

    @property
    def beyond(self) -> bool:
        return abs(self.fraction) > FRACTION and abs(self.errors) > ERRORS


class Case(NamedTuple):
    """A leg with some clearance joints at a speed."""

    mechanism: Mechanism
    clearance_joints: str
    rpm: float
    clearance_m: float = 3.0e-4

    def simulated(self, runs: int, cycles: int, model: str = "full") -> Samples:
        """Runs whose clearances are APART."""

        def run(i: int) -> SimulationResult:
            return simulate(
                self.mechanism,
                clearances=tuple(self.clearance_joints),
                clearance_m=self.clearance_m + i * APART,
                speed_rpm=self.rpm,
                cycles=cycles,
                skip_cycles=SKIPPED,
                model=model,
            )

        with ThreadPoolExecutor(WORKERS) as pool:
            return self._samples(list(pool.map(run, range(runs))))

    def _samples(self, results: list[SimulationResult]) -> Samples:
        joints = [
            [[getattr(result.joints[name], key) for key in FIGURES] for name in self.clearance_joints]
            for result in results
        ]
        zones = [[result.joints[name].wear_zone_deg for name in self.clearance_joints] for result in results]
        energy = [r.energy_j for r in results if r.energy_j]
        loss = np.array([each.friction_loss + each.contact_loss for each in energy])
        return Samples(
            np.array(joints),
            np.array(zones),
            np.array([r.drive_torque_nm.rms for r in results]),
            loss / results[0].cycles,
            np.array([each.residual for each in energy]) / loss,
        )


def row(*cells: str) -> None:
    print(f"| {' | '.join(cells)} |", flush=True)


def table(*columns: str) -> None:
    """Head of a Markdown table."""
    row(*columns)
    row(*("---" for _ in columns))


def compare(full: np.ndarray, other: np.ndarray, whole: float | None = None) -> Comparison:
    """Samples (n,) of both models; the difference as a fraction of the value, or of ``whole``."""
    difference = other.mean() - full.mean()
    error = math.hypot(*(one.std(ddof=1) / math.sqrt(len(one)) for one in (full, other)))
    errors = difference / error if error else math.copysign(math.inf, difference) if difference else 0.0
    return Comparison(full.mean(), difference / (whole or full.mean()), errors)


def compare_ends(full: np.ndarray, other: np.ndarray) -> list[Comparison]:
    """Ends (n, 2) of wear zones [deg], each on the turn on which it is nearest to the first run's."""
    near = [full[0] + (ends - full[0] + 180.0) % 360.0 - 180.0 for ends in (full, other)]
    return [compare(near[0][:, i], near[1][:, i], 360.0) for i in range(2)]


def in_errors(one: Comparison) -> str:
    return f"{min(abs(one.errors), 99.0):.1f}"


def cell(one: Comparison, digits: int) -> str:
    text = f"{one.value:.{digits}f} {100.0 * one.fraction:+.1f} % ({in_errors(one)})"
    return f"**{text}**" if one.beyond else text


def zone_cell(ends: list[Comparison]) -> str:
    zone = " to ".join(f"{end.value:.0f}" for end in ends)
    text = f"{zone}; {', '.join(f'{360.0 * end.fraction:+.1f} ({in_errors(end)})' for end in ends)}"
    return f"**{text}**" if any(end.beyond for end in ends) else text


def sets_of(name: str, runs: int, cycles: int) -> Iterator[Comparison]:
    """Tables of one leg; yields every comparison."""
    mechanism, torques = load_mechanism(name), {}
    print(f"\n### {mechanism.name}\n")
    table("clearance_joints", "rpm", "joint", *FIGURES.values(), ZONE)
    for clearance_joints, rpm in product(SETS, SPEEDS_RPM):
        case = Case(mechanism, clearance_joints, rpm)
        full, other = case.simulated(runs, cycles), case.simulated(runs, cycles, "clearance")
        torques[clearance_joints, rpm] = compare(full.torque, other.torque)
        for k, joint in enumerate(clearance_joints):
            figures = [compare(full.joints[:, k, i], other.joints[:, k, i]) for i in range(len(FIGURES))]
            ends = compare_ends(full.zone[:, k], other.zone[:, k])
            cells = map(cell, figures, (2, 2, 0, 3, 4))
            row(", ".join(clearance_joints), f"{rpm:.0f}", joint, *cells, zone_cell(ends))
            yield from [*figures, *ends]
    print(f"\nRMS of the drive torque [N m], {mechanism.name}:\n")
    table("clearance_joints", *(f"{rpm:.0f} rpm" for rpm in SPEEDS_RPM))
    for clearance_joints in SETS:
        row(", ".join(clearance_joints), *(cell(torques[clearance_joints, rpm], 3) for rpm in SPEEDS_RPM))
    yield from torques.values()


def ground_tables(runs: int, cycles: int) -> Iterator[Comparison]:
    """Tables of the leg with a stance of several sizes; yields every comparison."""
    leg = load_mechanism("bionic_leg")
    energy = []
    print(f"\n### On the ground: {leg.name}, 60 rpm\n")
    table("vertical peak [N]", "joint", *FIGURES.values(), ZONE)
    for load_n in LOADS_N:
        case = Case(with_ground_reaction(leg, load_n), SETS[-1], 60.0)
        full, other = (case.simulated(runs, cycles, model) for model in ("full", "clearance"))
        for k, joint in enumerate(case.clearance_joints):
            figures = [compare(full.joints[:, k, i], other.joints[:, k, i]) for i in range(len(FIGURES))]
            ends = compare_ends(full.zone[:, k], other.zone[:, k])
            row(f"{load_n:.0f}", joint, *map(cell, figures, (2, 2, 0, 3, 4)), zone_cell(ends))
            yield from [*figures, *ends]
        energy.append((load_n, full, other))
    print("\nDrive and energy:\n")
    table("vertical peak [N]", "RMS torque [N m]", "loss [J/cycle]", "residual, full", "residual, clearance")
    for load_n, full, other in energy:
        torque, loss = compare(full.torque, other.torque), compare(full.loss, other.loss)
        worst = (f"{np.abs(one.residual).max():.0e}" for one in (full, other))
        row(f"{load_n:.0f}", cell(torque, 3), cell(loss, 3), *worst)
        yield from [torque, loss]


def summary(comparisons: list[Comparison]) -> None:
    fraction, errors = (
        np.abs([one.fraction for one in comparisons]),
        np.abs([one.errors for one in comparisons]),
    )
    beyond = sum(one.beyond for one in comparisons)
    print("\n### All comparisons\n")
    table("comparisons", "beyond 2 %", "beyond 3 standard errors", "beyond both", "median difference",
          "median in standard errors")  # fmt: skip
    row(str(len(comparisons)), str((fraction > FRACTION).sum()), str((errors > ERRORS).sum()), str(beyond),
        f"{100.0 * np.median(fraction):.2f} %", f"{np.median(errors):.2f}")  # fmt: skip


def by_clearance(runs: int, cycles: int) -> None:
    """The case that differs most, as its clearance shrinks."""
    print("\n### By clearance: jansen_leg, clearance in I and J, 30 rpm\n")
    table("clearance [mm]", "joint", *FIGURES.values())
    for clearance_m in (1.0e-4, 2.0e-4, 2.9e-4, 3.0e-4, 3.1e-4, 4.0e-4):
        case = Case(load_mechanism("jansen_leg"), "IJ", 30.0, clearance_m)
        full, other = case.simulated(runs, cycles), case.simulated(runs, cycles, "clearance")
        for k, joint in enumerate("IJ"):
            figures = [compare(full.joints[:, k, i], other.joints[:, k, i]) for i in range(len(FIGURES))]
            row(f"{1e3 * clearance_m:g}", joint, *map(cell, figures, (2, 2, 0, 3, 4)))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=10, help="independent runs of each case")
    parser.add_argument("--cycles", type=int, default=20, help="counted cycles of each run")
    parser.add_argument("--ground", action="store_true", help="only the leg on the ground")
    options = parser.parse_args()
    ground = list(ground_tables(options.runs, options.cycles))
    if options.ground:
        summary(ground)
        raise SystemExit
    summary([one for name in LEGS for one in sets_of(name, options.runs, options.cycles)])
    by_clearance(options.runs, options.cycles)
