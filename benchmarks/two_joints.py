"""Two joints of a leg that open at once: what the diagnosis says of both, before and after its corrections.

Legs in full coordinates in the air, with masses 4 % off the file, behind a drive of `drives.py`; the joints
open after 690 gait cycles, and the leg walks on for 90. Each correction is counted, as the monitor does it.
With `--ground-n`, they walk on the ground as in `ground.py`, and nobody measures its force.
`python benchmarks/two_joints.py --keep DIRECTORY [--drive none]` takes a quarter of an hour.
"""

import argparse
from pathlib import Path

import one_core  # noqa: F401

# isort: split
import numpy as np
from diagnosis import NEW, kept
from disturbed import COMMISSIONED, HEALTHY, MASSES, walked, watched
from drives import DRIVES, WARM, cycles_of, warming
from ground import walked as walked_on_ground

from leg_wear_monitor import MonitorConfig, load_mechanism
from leg_wear_monitor.estimate.signature import TorqueSensor
from leg_wear_monitor.gait.config import LoadConfig
from leg_wear_monitor.mechanism.position import TURN, build_linkage
from leg_wear_monitor.monitor.config.inputs import Load
from leg_wear_monitor.monitor.diagnosis.observer import TorqueObserver
from leg_wear_monitor.twin.load import torque_size
from leg_wear_monitor.twin.reference import LegParameters
from leg_wear_monitor.twin.sample import GROUND

CASES = (
    {"A": 0.45}, {"B": 0.45}, {"G": 0.6}, {"I": 0.45}, {"J": 0.45}, {"J": 1.0},
    {"A": 0.45, "G": 0.45}, {"A": 0.6, "B": 0.6}, {"G": 0.6, "I": 0.6}, {"B": 0.6, "J": 0.6},
    {"A": 0.42, "B": 0.36, "G": 0.39, "I": 0.33, "J": 0.33},
)  # fmt: skip
STEPS = (11, 20, 20, 20, 20)  # gait cycles; by the end of the first, a joint is corrected
PERIODS = 12  # evaluation periods of a gait cycle: about as many as on a robot, so that references are made


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--keep", type=Path)
    parser.add_argument("--drive", choices=sorted(DRIVES), default="none")
    parser.add_argument("--ground-n", type=float, default=0.0)
    options = parser.parse_args()
    leg = load_mechanism("bionic_leg")
    mass, joints = np.array([MASSES.get(body, 1.0) for body in leg.bodies]), leg.clearance_joints
    real, size = LegParameters(mass, np.ones(len(mass))).applied(leg), torque_size(build_linkage(leg), TURN)
    sensor, drive = TorqueSensor(0.005, 1.0, size), DRIVES[options.drive]
    peak_n = options.ground_n
    config = MonitorConfig(load=Load(model=GROUND)) if peak_n else MonitorConfig()
    load, suffix = LoadConfig(ground_n=peak_n, shape="treadmill"), f" {peak_n:g} N" if peak_n else ""

    def walk(sizes_mm: dict[str, float], cycles: int) -> np.ndarray:
        clearance = np.array([1e-3 * sizes_mm[joint] if joint in sizes_mm else NEW[0] for joint in joints])
        name = " ".join(f"{joint}{mm:g}" for joint, mm in sizes_mm.items()) or "new"
        file = options.keep / f"two {name}{suffix}.pkl" if options.keep else None

        def rows() -> np.ndarray:
            if peak_n:
                return walked_on_ground(real, clearance, cycles + 3, load, 7).rows
            return walked(real, clearance, cycles + 3, 0.0, 7)

        return kept(file, rows)

    healthy = cycles_of(walk({}, HEALTHY), drive, sensor, 5)
    before = COMMISSIONED + WARM // 2
    rows = warming(healthy, [i % healthy.shape[1] for i in range(before)])
    one, _ = watched(leg, size, rows, config=config, periods=4 if peak_n else 1)
    commissioned = one.snapshot()
    print(f"{options.drive}{suffix}: misfit {one.models.misfit(one.state):.2f}\n")
    print(f"| opened | corrected (gait cycle) | {' | '.join(joints)} | reason |")
    print(f"|---|---{'|---' * len(joints)}|---|")
    for case in CASES:
        one.restore(commissioned)
        worn, at, corrected = cycles_of(walk(case, 60), drive, sensor, 6), before, []
        for step in STEPS:
            rows = warming(worn, [(at - before + i) % worn.shape[1] for i in range(step)], at)
            _, found = watched(leg, size, rows, one, at, periods=PERIODS, counted_m=one.state.counted_m)
            corrected += [text for text in found if "corrected" in text]
            at += step
        cells = _opened(case), _corrections(corrected, before), _sizes(one), one.diagnosis.reason
        print(f"| {' | '.join(cells)} |", flush=True)


def _opened(case: dict[str, float]) -> str:
    return ", ".join(f"{joint} {mm:g}" for joint, mm in case.items())


def _corrections(found: list[str], before: int) -> str:
    corrections = (text.partition(": corrected ") for text in found)
    return ", ".join(f"{what} ({int(at) - before + 1})" for at, _, what in corrections) or "none"


def _sizes(one: TorqueObserver) -> str:
    seen = one.diagnosis
    pairs = zip(seen.clearance_m, seen.sigma_m, strict=True)
    return " | ".join("-" if np.isnan(mm) else f"{1e3 * mm:.2f} ± {1e3 * sigma:.2f}" for mm, sigma in pairs)


if __name__ == "__main__":
    main()
