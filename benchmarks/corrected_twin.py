"""Impact forces and growth after a joint has broken out: the corrected twin against full coordinates.

The leg walks with other masses and lengths than the mechanism file, commissions the diagnosis, and then the
clearance of one joint opens to 1 mm. The monitor has crank angles and the drive torque only. What it reports
of the minute that follows is compared with the leg itself, with the correction of the counted clearance and
without. `python benchmarks/corrected_twin.py` takes about ten minutes of one core.
"""

import argparse
import copy
import functools
from pathlib import Path
from typing import NamedTuple

import attrs
import numpy as np
from diagnosis import BODIES, LEGS, NEW, kept, truth

from leg_wear_monitor import MonitorConfig, WearMonitor, load_mechanism, twin
from leg_wear_monitor.dynamics.full_run import FullRun
from leg_wear_monitor.dynamics.run import FORCE, TORQUE, new_run_statistics, percentile, quintic
from leg_wear_monitor.dynamics.simulation import prepare
from leg_wear_monitor.gait.config import PaceConfig
from leg_wear_monitor.gait.leg import Pace
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.twin.sample import gait_samples

SAMPLES, NOISE_RAD, NOISE_NM = 200, 1.0e-3, 0.5  # of a gait cycle, which takes a second
PERIOD_NS = 5_010_500  # between samples: they drift through the gait cycle
RIPPLE = 0.01  # of the crank's speed: the reference that comes with the package holds up to 1.5 %
BREAK, AFTER = 1560, 62  # gait cycles
BROKEN_M = 1.0e-3
COMPARED = slice(20, 60)  # gait cycles since the joint broke out: the rest of the minute
FIGURES = ("mean force [N]", "p99 force [N]", "peak force [N]", "growth [pm]")


class Walk(NamedTuple):
    """Crank angles [rad] and mean drive torques [N m] of samples, and FIGURES (cycles, 4, k)."""

    angle: np.ndarray
    torque: np.ndarray
    figures: np.ndarray


class Walker:
    """A leg in full coordinates that walks on, a gait cycle at a time."""

    def __init__(self, leg: Mechanism) -> None:
        self.setup, self.pace = prepare(leg, wear=True), Pace(PaceConfig(ripple=RIPPLE))
        self.setup.contacts.clearance[:] = NEW
        start = attrs.evolve(self.setup, speed=self.pace.at(0.0).speed)
        self.run, self.cycle = FullRun(start, tolerance_m=1e-9), 0
        self.joints = [list(leg.joints).index(joint) for joint in leg.clearance_joints]

    def walk(self, cycles: int) -> Walk:
        """Some more times SAMPLES samples, about a gait cycle each."""
        run, angles, torques, figures = self.run, [], [], []
        for _ in range(cycles):
            statistics, impulse = new_run_statistics(len(self.setup.linkage.mechanism.joints)), 0.0
            opened = self.setup.surfaces.depth.sum(axis=1).mean(axis=1)
            for i in range(SAMPLES):
                before, t = run.time, 1.0e-9 * PERIOD_NS * (self.cycle * SAMPLES + i + 1)
                run.polynomial[:] = quintic(before, self.pace.at(before), t - before, self.pace.at(t))
                run.advance(t, statistics)
                angles.append(self.pace.at(t).angle)
                torques.append((statistics.drive_integral[TORQUE] - impulse) / (1.0e-9 * PERIOD_NS))
                impulse = float(statistics.drive_integral[TORQUE])
            grown = self.setup.surfaces.depth.sum(axis=1).mean(axis=1) - opened
            tails = [percentile(statistics.force_time[joint], 0.99) for joint in self.joints]
            means = statistics.integral[self.joints, FORCE] / statistics.time[0]
            figures.append([means, tails, statistics.peak[self.joints], 1e12 * grown])
            self.cycle += 1
        return Walk(np.array(angles), np.array(torques), np.array(figures))


def walks(leg: Mechanism) -> tuple[Walk, list[Walk]]:
    """A healthy leg until its bodies are identified, and what follows where each of its joints breaks out."""
    walker, parts = Walker(leg), []
    healthy = walker.walk(BREAK)
    for k in range(len(leg.clearance_joints)):
        one = copy.deepcopy(walker)
        one.setup.contacts.clearance[k] = BROKEN_M
        parts.append(one.walk(AFTER))
    return healthy, parts


def samples_of(walk: Walk, first: int, random: np.random.Generator) -> np.ndarray:
    """Samples of a crank encoder and a torque sensor, from the end of some gait cycles on."""
    count = len(walk.angle)
    stamps = 10**9 + (first * SAMPLES + np.arange(count) + 1) * PERIOD_NS
    angle = walk.angle + NOISE_RAD * random.standard_normal(count)
    torque = walk.torque + NOISE_NM * random.standard_normal(count)
    crank = gait_samples(stamps, twin.CRANK, crank_angle_rad=angle)
    return np.stack([crank, gait_samples(stamps, twin.TORQUE, torque_nm=torque)], axis=1).ravel()


def reported(monitor: WearMonitor, samples: np.ndarray) -> dict[int, np.ndarray]:
    """Figures (4, k) that the monitor reports, by gait cycle."""
    found = {}
    for block in np.array_split(samples, len(samples) // 400):
        for report in monitor.update(block).cycles:
            rows = [
                [one.mean_force_n, one.p99_force_n, one.peak_force_n, one.clearance_m]
                for one in report.joints
            ]
            found[round(report.begin_ns * 1e-9 - 1.0)] = np.array(rows).T
    return found


def mean_figures(found: dict[int, np.ndarray]) -> np.ndarray:
    """Means (4, k) as in FIGURES over the compared gait cycles."""
    begin = round(1.0e-9 * PERIOD_NS * SAMPLES * BREAK)
    cycles = [found[i] for i in range(begin + COMPARED.start, begin + COMPARED.stop)]
    means = np.mean(cycles, axis=0)
    means[3] = 1e12 * (cycles[-1][3] - cycles[0][3]) / (len(cycles) - 1)
    return means


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--keep", type=Path, default=Path("build/corrected_twin"))
    parser.add_argument("--leg", choices=list(LEGS), default="d")
    options = parser.parse_args()
    options.keep.mkdir(parents=True, exist_ok=True)
    paper = load_mechanism("bionic_leg")
    leg, joints = truth(paper, options.leg), paper.clearance_joints
    off = ", ".join(
        f"{body} {100.0 * (LEGS[options.leg].masses.get(body, 1.0) - 1.0):+.1f}" for body in BODIES
    )
    print(f"leg {options.leg}, masses off by [%] {off}; ripple {100 * RIPPLE:g} %")
    healthy, parts = kept(options.keep / f"{options.leg}.pkl", functools.partial(walks, leg))
    monitors = {}
    for correct in (False, True):
        config = MonitorConfig()
        config = attrs.evolve(config, diagnosis=attrs.evolve(config.diagnosis, correct=correct))
        monitor = WearMonitor(paper, config)
        reported(monitor, samples_of(healthy, 0, np.random.default_rng(1)))
        monitors[correct] = monitor, monitor.snapshot()
        print(
            f"after {BREAK} healthy gait cycles: {monitor.diagnosis.state.value} {monitor.diagnosis.reason}"
        )
    for k, joint in enumerate(joints):
        seen = []
        for monitor, snapshot in monitors.values():
            monitor.restore(snapshot)
            seen.append(
                mean_figures(reported(monitor, samples_of(parts[k], BREAK, np.random.default_rng(k))))
            )
        changes = [one for one in monitor.diagnosis.changes if one.is_corrected]
        for one in changes:
            clearance = f"{1e3 * one.value:.3f} ± {1e3 * one.sigma:.3f} mm"
            print(f"{joint} broken out: {one.subject} corrected to {clearance}")
        real = parts[k].figures[COMPARED]
        mean, scatter = real.mean(axis=0), real.std(axis=0, ddof=1)
        for f, figure in enumerate(FIGURES):
            for j, other in enumerate(joints):
                offs = [(one[f, j] - mean[f, j]) / scatter[f, j] for one in seen]
                print(
                    f"| {joint} | {other} | {figure} | {mean[f, j]:.4g} ± {scatter[f, j]:.2g} "
                    f"| {seen[0][f, j]:.4g} | {offs[0]:+.1f} | {seen[1][f, j]:.4g} | {offs[1]:+.1f} |",
                    flush=True,
                )


if __name__ == "__main__":
    main()
