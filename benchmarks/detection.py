"""Is a torque as good as `commission` says? Joints that it judges, and what the tests find of worn ones.

The leg of `disturbed.py` in the air, in full coordinates, with masses 4 % off the file, at 60 rpm: a healthy
walk is judged as `commission` judges it, behind several sensors; then legs with one joint at 1.5 times and
twice its clearance walk behind the same sensors, each begun at several gait cycles. A row a sensor and joint:
gait cycles until detection as expected, and found (median); until the joint is named, as judged, and how many
of the windows of as many gait cycles name it, name another joint, or nothing for sure.
`python benchmarks/detection.py --keep DIRECTORY` takes ten minutes, two of them again.
"""

import argparse
import math
from pathlib import Path

import one_core  # noqa: F401

# isort: split
import disturbed
import numpy as np
from diagnosis import NEW, kept

from leg_wear_monitor import MonitorConfig, load_mechanism
from leg_wear_monitor.commissioning.detection import OPENED, SOON, Walk, joint_detections
from leg_wear_monitor.estimate.cause import Cause
from leg_wear_monitor.estimate.change_detector import ChangeDetector
from leg_wear_monitor.estimate.explanations import change_of
from leg_wear_monitor.estimate.leg_model import explainer_of
from leg_wear_monitor.estimate.signature import TorqueSensor
from leg_wear_monitor.mechanism.position import TURN, build_linkage
from leg_wear_monitor.monitor.config.fitting import fitted
from leg_wear_monitor.monitor.diagnosis.reference_file import shipped_references
from leg_wear_monitor.monitor.diagnosis.references import COMMISSIONING_CYCLES, LegModels
from leg_wear_monitor.monitor.diagnosis.state import SignedCycle
from leg_wear_monitor.twin.load import torque_size
from leg_wear_monitor.twin.reference import LegParameters

SENSORS = (
    (200.0, 0.5, 0.0),
    (200.0, 3.0, 0.0),
    (200.0, 0.5, 20.0),
    (200.0, 3.0, 20.0),
    (100.0, 0.5, 0.0),
    (100.0, 3.0, 0.0),
    (50.0, 0.5, 0.0),
)
EVERY = 3  # gait cycles between two begins


def walk_of(leg, signatures: np.ndarray, sensor: TorqueSensor, profile) -> Walk:
    cycles = (SignedCycle(i, i + 1, row, profile, 0.0) for i, row in enumerate(signatures))
    return Walk(leg, MonitorConfig(), np.zeros(len(signatures)), tuple(cycles), sensor)


def detected(detector: ChangeDetector, rows: np.ndarray) -> float:
    state = detector.fresh()
    for i, row in enumerate(rows, 1):
        state = detector.with_cycle(state, row, i)
        if detector.detected_ns(state):
            return i
    return math.inf


def named(explainer, rows: np.ndarray) -> str:
    change = change_of(explainer.explanations(rows.mean(axis=0), len(rows), NEW), 1)
    if change is None or not change.is_sure or change.cause is not Cause.CLEARANCE:
        return ""
    return change.subject


def shown(cycles: float) -> str:
    return f"{cycles:.0f}" if math.isfinite(cycles) and cycles <= 10 * SOON else "never"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--keep", type=Path)
    options = parser.parse_args()
    leg = fitted(load_mechanism("bionic_leg"), MonitorConfig())
    mass = np.array([disturbed.MASSES.get(body, 1.0) for body in leg.bodies])
    real = LegParameters(mass, np.ones(len(mass))).applied(leg)
    size, reference = torque_size(build_linkage(leg), TURN), shipped_references(leg)[0]

    def rows_of(joint: str, size_mm: float, sensor: TorqueSensor, hz: float, seed: int) -> np.ndarray:
        clearance = np.where(np.array(leg.clearance_joints) == joint, 1e-3 * size_mm, NEW)
        cycles = disturbed.WORN if joint else disturbed.HEALTHY
        file = options.keep / f"{joint or 'new'} {size_mm:.2f} 0.pkl" if options.keep else None
        walk = kept(file, lambda: disturbed.walked(real, clearance, cycles + 3, 0.0, round(1000 * size_mm)))
        return disturbed.signed(disturbed.received(walk, hz=hz), sensor, seed)

    print(
        "| Hz | noise [N m] | low-pass [Hz] | joint [mm] | detected: expected, found | "
        "named: judged, right, wrong |"
    )
    print("|---|---|---|---|---|---|")
    for rate, noise, hz in SENSORS:
        disturbed.NOISE_NM = noise
        sensor = TorqueSensor(1.0 / rate, 1.0, size)
        walk = walk_of(leg, rows_of("", 0.3, sensor, hz, 5)[:COMMISSIONING_CYCLES], sensor, reference.profile)
        found = {one.joint: one for one in joint_detections(walk, reference)}
        models = LegModels(leg)
        own = models.channel(reference, sensor, walk.baseline)
        explainer = explainer_of(leg, reference, own, walk.baseline)
        detector = ChangeDetector(explainer, NEW, 3600.0 * MonitorConfig().diagnosis.false_alarm_hours)
        for joint, one in found.items():
            for i, factor in enumerate(OPENED):
                rows = rows_of(joint, 0.3 * factor, sensor, hz, 6)
                begins = [np.concatenate([rows[j:], rows]) for j in range(0, len(rows) - 2, EVERY)]
                waits = [detected(detector, part) for part in begins]
                judged = one.named_cycles[i]
                length = round(judged) if math.isfinite(judged) else len(rows)
                names = [named(explainer, part[:length]) for part in begins]
                right, wrong = names.count(joint), sum(name not in ("", joint) for name in names)
                print(
                    f"| {rate:.0f} | {noise} | {hz or '-'} | {joint} {0.3 * factor:.2f} | "
                    f"{shown(one.cycles[i])}, {shown(float(np.median(waits)))} | "
                    f"{shown(judged)}, {right} of {len(names)}, {wrong} |",
                    flush=True,
                )


if __name__ == "__main__":
    main()
