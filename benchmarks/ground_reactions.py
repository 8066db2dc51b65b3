"""Measured ground reactions on the leg: the error of the stance template, and of wear modelled with it.

DIR contains the public repositories opensim-models (opensim-org) and BMC (BMClab). None of these stances
equals the template. The truth is the leg in full coordinates under the measured shape. The modelled wear
comes from the clearance model under the template with the same peak, start and end.
"""

import argparse
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from leg_wear_monitor import Mechanism, load_mechanism, simulate
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.person import (
    FORE_AFT,
    PHASES,
    Stance,
    nominal_stance,
    stance_template,
    with_ground_reaction,
    with_toe_force,
)
from leg_wear_monitor.mechanism.position import build_linkage

PEAK_N = 600.0
STANDS_N = 20.0
BETWEEN_S = (0.15, 1.2)  # durations that a stance has
S = np.linspace(0.0, 1.0, 257)
HARMONICS = 12
APART_M = 1.0e-9  # between the clearances of two runs
# file below DIR, columns of the forces of a foot (along the walk, vertical), name
FILES = (
    ("opensim-models/Pipelines/Rajagopal/ExpData/grf_walk.mot", "ground_force_r_v", "treadmill, right"),
    ("opensim-models/Pipelines/Rajagopal/ExpData/grf_walk.mot", "ground_force_l_v", "treadmill, left"),
    ("BMC/data/BiomecII2018_gait_d.txt", "F", "overground, d"),
    ("BMC/data/BiomecII2018_gait_n.txt", "F", "overground, n"),
    ("opensim-models/Pipelines/Hamner/subject02_running_grf.mot", "ground_force_v", "running"),
)


class Measured(NamedTuple):
    """A foot's stances: vertical and fore-aft force at S (n, 257), over their mean vertical peak."""

    name: str
    vertical: Floats
    fore_aft: Floats

    @property
    def shape(self) -> tuple[Floats, Floats]:
        """Mean vertical and fore-aft force (257,), over the vertical peak; braking is positive."""
        vertical, along = self.vertical.mean(axis=0), self.fore_aft.mean(axis=0)
        return vertical / vertical.max(), along / vertical.max()


def table(file: Path) -> dict[str, Floats]:
    """Columns of a text table, after ``endheader`` where there is one."""
    if not file.exists():
        raise SystemExit(f"{file}: not there; fetch the public repository into its folder")
    lines = [line.split() for line in file.read_text().splitlines() if line.strip()]
    begin = lines.index(["endheader"]) + 1 if ["endheader"] in lines else 0
    return dict(zip(lines[begin], np.array(lines[begin + 1 :], dtype=float).T, strict=True))


def stances(file: Path, columns: str, name: str) -> Measured:
    """Whole stances of one foot in a recording."""
    rows = table(file)
    time, vertical, along = (rows[key] for key in (next(iter(rows)), f"{columns}y", f"{columns}x"))
    ends = np.flatnonzero(np.diff((vertical > STANDS_N).astype(int)))
    ends = ends[1:] if vertical[0] > STANDS_N else ends
    found = []
    for begin, end in zip(ends[::2], ends[1::2] + 1, strict=False):
        if BETWEEN_S[0] < time[end] - time[begin] < BETWEEN_S[1]:
            at = time[begin] + S * (time[end] - time[begin])
            found.append([np.interp(at, time, force) for force in (vertical, along)])
    both = np.array(found) / np.array([one[0].max() for one in found]).mean()
    braking = np.sign(both[:, 1, : len(S) // 2].mean())
    return Measured(name, both[:, 0], braking * both[:, 1])


def force_on(stance: Stance, shape: tuple[Floats, Floats]) -> Floats:
    """Force (PHASES, 2) over the vertical peak, of a shape (257,) in stance."""
    s = (stance.turned * (np.arange(PHASES) / PHASES - stance.heel_strike)) % 1.0
    s = s / ((stance.turned * (stance.toe_off - stance.heel_strike)) % 1.0)
    vertical, along = (np.interp(s, S, one, right=0.0) for one in shape)
    return np.outer(vertical, stance.up) + np.outer(along, stance.back)


def archard(leg: Mechanism, model: str, runs: int, cycles: int) -> Floats:
    """Archard integrals (runs, k) [J/cycle] of runs with clearances that are APART_M."""
    return np.array([
        [
            joint.archard_integral_j_per_cycle
            for joint in simulate(
                leg, clearance_m=3.0e-4 + i * APART_M, model=model, cycles=cycles, skip_cycles=2
            ).joints.values()
            if joint.archard_integral_j_per_cycle is not None
        ]
        for i in range(runs)
    ])  # fmt: skip


def rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2)))


def shapes(measured: list[Measured]) -> Iterator[str]:
    """Rows on how far the template is from the shapes."""
    template = np.array(stance_template(S)) * np.array([[1.0], [FORE_AFT]])
    waves = np.sin(np.pi * np.outer(S, np.arange(1, HARMONICS + 1)))
    for one in measured:
        off = np.array(one.shape) - template
        order = np.abs(np.linalg.lstsq(waves, off.T, rcond=None)[0]).max(axis=0)
        far = f"{rms(off[0]):.3f} | {rms(off[1]):.3f} | {order[0]:.3f} | {order[1]:.3f}"
        peaks = one.vertical.max(axis=1)
        scatter = f"{peaks.std(ddof=1):.3f}" if len(peaks) > 1 else "–"
        low, high = one.shape[1].min(), one.shape[1].max()
        yield f"| {one.name} | {len(peaks)} | {scatter} | {high:.2f}, {low:.2f} | {far} |"


def wear(measured: list[Measured], peak_n: float, runs: int, cycles: int) -> Iterator[str]:
    """Rows on wear modelled under the template, against wear under each shape in full coordinates."""
    leg = load_mechanism("bionic_leg")
    stance = nominal_stance(build_linkage(leg))
    known = archard(with_ground_reaction(leg, peak_n), "clearance", runs, cycles)
    air = archard(leg, "clearance", runs, cycles)
    template = Measured("template itself", *(one[None] for one in stance_template(S)))
    template = template._replace(fore_aft=FORE_AFT * template.fore_aft)
    for one in [template, *measured]:
        true = archard(with_toe_force(leg, peak_n * force_on(stance, one.shape)), "full", runs, cycles)
        for what, counted in (("template", known), ("none", air)):
            off = counted.mean(axis=0) / true.mean(axis=0) - 1.0
            error = np.hypot(*(each.std(axis=0, ddof=1) / each.mean(axis=0) for each in (counted, true)))
            error /= np.sqrt(runs)
            cells = (f"{100.0 * a:+.1f} ± {100.0 * b:.1f}" for a, b in zip(off, error, strict=True))
            yield f"| {one.name} | {what} | {' | '.join(cells)} |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, metavar="DIR")
    parser.add_argument("--peak", type=float, default=PEAK_N, help="vertical peak on the leg [N]")
    parser.add_argument("--runs", type=int, default=5, help="runs of each case")
    parser.add_argument("--cycles", type=int, default=10, help="counted gait cycles of each run")
    options = parser.parse_args()
    measured = [stances(options.folder / file, columns, name) for file, columns, name in FILES]
    print("| shape | stances | peak scatters | fore-aft, braking and pushing | template off, vertical | "
          "fore-aft | largest harmonic, vertical | fore-aft |")  # fmt: skip
    print("|---|---|---|---|---|---|---|---|")
    print(*shapes(measured), sep="\n")
    joints = load_mechanism("bionic_leg").clearance_joints
    print(f"\n| true shape, {options.peak:g} N | counted under | {' | '.join(joints)} |")
    print("|---|---|" + "---|" * len(joints))
    for row in wear(measured, options.peak, options.runs, options.cycles):
        print(row, flush=True)


if __name__ == "__main__":
    main()
