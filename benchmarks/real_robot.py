"""Changes in the currents of a real robot's joints, found by the code for a leg's torque.

DIR contains the folder `dynamic_calibration` (https://github.com/shamilmamedov/dynamic_calibration), with the
currents of a UR10e at 100 Hz in `dataset_ur10e`. The current of a joint takes the place of the torque, and a
period of ten seconds takes the place of the gait cycle. The benchmark tests the part that compares a cycle
with a baseline: signatures by phase, their scatter, and causes that need no simulated leg: friction, scale,
an offset in time, and a load at the flange, with its lever as column (gravity and inertia of a mass there).
It cannot test a clearance and the tests for it, the drive dynamics, and the identification, because these
need simulated references of the robot. In the recordings of collisions, the robot stands and is pushed by
hand at times that are not noted: there is no motion with phases to compare, and after a push the current
stays elsewhere within static friction.

1. Nothing has changed: in `jointwise_motion` one joint after the other swings with a period of ten seconds,
five times. Each period is compared with a baseline of the other four periods.
2. A different load: the same motion was run without and with a load, once each. Each ten seconds of the first
run are the baseline of the same ten seconds of the second run. Case 1 gives the scatter of a period.

A change is reported if the odds of the best cause exceed the odds of one false finding in 240 hours, the
default of the monitor, which looks for causes only after a test for a clearance.
`python benchmarks/real_robot.py DIR` takes seconds, and `real_drive.py` prints the same.
"""

import argparse
import os
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

# numpy reads this once, when it is imported; on a busy machine its threads take six times as long
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# isort: split
import numpy as np

from leg_wear_monitor.estimate.cause import Cause, Change
from leg_wear_monitor.estimate.clearance_fit import threshold
from leg_wear_monitor.estimate.explanations import Explainer, Nuisance, change_of
from leg_wear_monitor.estimate.leg_model import commissioned_baseline, with_scatter_of
from leg_wear_monitor.estimate.signature import (
    Changes,
    CommissionedTorque,
    PhaseMeans,
    SignatureModel,
    TorqueSensor,
    averaged,
    signatures,
)
from leg_wear_monitor.mechanism.position import TURN

FOLDER = Path("dynamic_calibration/dataset_ur10e")
JOINTS, STEP_S, PERIOD_S = 6, 0.01, 10.0
PAIRS = (
    ("ur-20_01_31-unload", "ur-20_01_31-load"),
    ("ur-20_02_19_14harm50sec", "ur-20_02_19_14harm50secLoad"),
    ("ur-20_02_19_15harm50sec", "ur-20_02_19_15harm50secLoad"),
)
MOVING_RADPS, FURTHEST_RAD, LONGEST_S = 0.01, 7.0, 120.0
FALSE_ALARM_HOURS = 240.0

# Denavit-Hartenberg parameters of the UR10e as its maker publishes them [m, rad]
D = (0.1807, 0.0, 0.0, 0.17415, 0.11985, 0.11655)
A = (0.0, -0.6127, -0.57155, 0.0, 0.0, 0.0)
ALPHA = (np.pi / 2, 0.0, 0.0, np.pi / 2, -np.pi / 2, 0.0)
GRAVITY = 9.81
ROUNDED = 1.0e-6  # [N m/kg], the lever of the flange about the last joint's axis

# usual changes of a drive that is all right, as in estimate/ground_load.py
FRICTION, SCALE, OFFSET_RAD = 0.1, 0.02, 0.01


class Run(NamedTuple):
    """A recording in steps of STEP_S from the start of the motion: angles, speeds, currents (n, JOINTS)."""

    angle: np.ndarray
    speed: np.ndarray
    current: np.ndarray


def run_of(file: Path) -> Run:
    """A recording; lines that were damaged as they were written are left out."""
    if not file.exists():
        raise SystemExit(f"{file}: not there; fetch the public repository into the folder")
    rows = np.genfromtxt(
        (line for line in file.open() if line.count(",") == 30), delimiter=",", usecols=range(19)
    )
    time, middle = rows[:, 0], np.median(rows[:, 0])
    with np.errstate(invalid="ignore"):
        right = np.isfinite(rows).all(axis=1) & (np.abs(rows[:, 1:7]) < FURTHEST_RAD).all(axis=1)
        rows = rows[right & (np.abs(time - middle) < LONGEST_S)]
    rows = rows[np.unique(rows[:, 0], return_index=True)[1]]
    moving = rows[(np.abs(rows[:, 7:13]) > MOVING_RADPS).any(axis=1), 0]
    time = np.arange(moving[0], moving[-1], STEP_S)
    columns = np.array([np.interp(time, rows[:, 0], column) for column in rows[:, 1:].T]).T
    return Run(*np.split(columns, 3, axis=1))


def levers(run: Run) -> np.ndarray:
    """Torque of each joint (n, JOINTS) by a mass of 1 kg at the flange [N m/kg]."""
    n = len(run.angle)
    rotation, place = np.broadcast_to(np.eye(3), (n, 3, 3)), np.zeros((n, 3))
    axes, origins = [], []
    for k in range(JOINTS):
        axes.append(rotation[:, :, 2])
        origins.append(place)
        c, s = np.cos(run.angle[:, k]), np.sin(run.angle[:, k])
        ca, sa, zero = np.cos(ALPHA[k]), np.sin(ALPHA[k]), np.zeros(n)
        place = place + np.einsum("nij,nj->ni", rotation, np.stack([A[k] * c, A[k] * s, D[k] + zero], axis=1))
        turn = np.stack([c, -s * ca, s * sa, s, c * ca, -c * sa, zero, sa + zero, ca + zero], axis=1)
        rotation = rotation @ turn.reshape(n, 3, 3)
    arms = [np.cross(axis, place - origin) for axis, origin in zip(axes, origins, strict=True)]
    velocity = sum(arm * run.speed[:, [k]] for k, arm in enumerate(arms))
    force = np.gradient(velocity, STEP_S, axis=0) + np.array([0.0, 0.0, GRAVITY])
    return np.stack([(arm * force).sum(axis=1) for arm in arms], axis=1)


def sensor_of(current: np.ndarray) -> TorqueSensor:
    """The sensor of a joint, with the RMS of its current as the size."""
    return TorqueSensor(STEP_S, PERIOD_S, float(np.sqrt(np.square(current).mean())))


def signed(values: np.ndarray, sensor: TorqueSensor, offset_rad: float = 0.0) -> np.ndarray:
    """Signatures (periods, F) of whole periods of a quantity (n,)."""
    n = round(PERIOD_S / STEP_S)
    values = averaged(values[: len(values) // n * n], sensor.together)
    place = TURN * sensor.together * STEP_S / PERIOD_S * (np.arange(len(values)) + 0.5)
    cycle = np.arange(len(values)) * sensor.together // n
    return signatures(cycle, place + offset_rad, values, np.diff(values, prepend=np.nan), sensor)


def mean_column(values: np.ndarray, sensor: TorqueSensor) -> np.ndarray:
    """Column (F,) of a quantity (n,) of one period that adds to the mean current, per unit."""
    values = averaged(values, sensor.together)
    place = TURN * sensor.together * STEP_S / PERIOD_S * (np.arange(len(values)) + 0.5)
    means = PhaseMeans(np.zeros(len(values), np.int64), place, (1, sensor.phases)).of(values)[0]
    return np.concatenate([means, np.zeros(sensor.phases)])


class Period(NamedTuple):
    """Current, speed and lever (n,) of a joint in one period."""

    current: np.ndarray
    speed: np.ndarray
    lever: np.ndarray


def pooled(cycles: np.ndarray) -> np.ndarray:
    """Covariance (F, F) of a period by the scatter of some, of all phases alike."""
    variance = np.var(cycles, axis=0, ddof=1).reshape(2, -1).mean(axis=1)
    return np.diag(np.repeat(variance, cycles.shape[1] // 2))


def explainer(first: Period, cycles: np.ndarray, sensor: TorqueSensor, scatter: np.ndarray) -> Explainer:
    """Explains changes against a baseline: signatures (n, F) of periods like a first one."""
    phases, size = sensor.phases, sensor.size_nm
    later, earlier = (signed(first.current, sensor, sign * OFFSET_RAD)[0] for sign in (1.0, -1.0))
    scaled = (signed(factor * first.current, sensor)[0] for factor in (1.05, 0.95))
    nuisances = [
        Nuisance(Cause.FRICTION, "", mean_column(np.sign(first.speed), sensor), FRICTION * size),
        Nuisance(Cause.SCALE, "", np.subtract(*scaled) / 0.1, SCALE),
        Nuisance(Cause.TIMING, "", (later - earlier) / (2.0 * OFFSET_RAD), OFFSET_RAD),
        Nuisance(Cause.LOAD, "", mean_column(first.lever, sensor), 0.0),
    ]
    nuisances = [one for one in nuisances if np.abs(one.column).max() > ROUNDED]
    nothing, no_joint = np.zeros(2 * phases), np.zeros(0)
    covariance = with_scatter_of(scatter, cycles)
    known = CommissionedTorque(0, no_joint, cycles)
    model = SignatureModel(
        sensor,
        nothing,
        Changes(np.zeros((0, 2)), np.zeros((0, 2, 2 * phases))),
        covariance,
        1.0 / len(cycles),
    )
    return Explainer(model, (), commissioned_baseline(known, nothing, covariance), nuisances)


def changed(own: Explainer, signature: np.ndarray) -> Change | None:
    """The change of one period; None where its odds are too small."""
    explanations = own.explanations(signature, 1, np.zeros(0))
    change = change_of(explanations, 0)
    least = threshold(FALSE_ALARM_HOURS * 3600.0 / PERIOD_S, len(explanations) - 1)
    return change if change is not None and change.log_odds > least else None


def in_words(change: Change | None) -> str:
    """Name of the change."""
    return "nothing" if change is None else change.cause.value


def swings(folder: Path) -> Iterator[tuple[int, Run]]:
    """Each joint that swings, counted from 0, and the recording over its even periods."""
    for joint in range(JOINTS):
        run = run_of(folder / f"jointwise_motion/ur-20_01_22-joint_{joint + 1}.csv")
        turns = np.flatnonzero(np.diff(np.sign(run.speed[:, joint])))
        # the first swing is shorter
        begin = next(int(at) for at in turns if at * STEP_S > 5.0)
        number = int((len(run.angle) - begin) * STEP_S / PERIOD_S)
        n = round(number * PERIOD_S / STEP_S)
        yield joint, Run(*(each[begin : begin + n] for each in run))


def period(run: Run, lever: np.ndarray, joint: int, k: int) -> Period:
    """One period of a joint."""
    n = round(PERIOD_S / STEP_S)
    part = slice(k * n, k * n + n)
    return Period(run.current[part, joint], run.speed[part, joint], lever[part, joint])


def unchanged(folder: Path) -> tuple[dict[tuple[bool, int], Counter], dict[int, np.ndarray]]:
    """Findings without any change, by whether the joint swings and by joint; and scatters."""
    found, scatters = {}, {}
    for swinging, run in swings(folder):
        lever = levers(run)
        for joint in range(JOINTS):
            sensor = sensor_of(run.current[:, joint])
            cycles = signed(run.current[:, joint], sensor)
            if joint == swinging:
                scatters[joint] = cycles
            counts = found.setdefault((joint == swinging, joint), Counter())
            for k, cycle in enumerate(cycles):
                known = np.delete(cycles, k, axis=0)
                own = explainer(period(run, lever, joint, 0), known, sensor, pooled(known))
                counts[in_words(changed(own, cycle))] += 1
    return found, scatters


def loaded(folder: Path, scatters: dict[int, np.ndarray]) -> list[Counter]:
    """How often each cause was the best with a load, by joint, over all motions."""
    found = [Counter() for _ in range(JOINTS)]
    for names in PAIRS:
        free, other = (run_of(folder / f"identification_data/{name}.csv") for name in names)
        lever = levers(free)
        for joint in range(JOINTS):
            sensor, scatter = sensor_of(free.current[:, joint]), pooled(scatters[joint])
            before, after = (signed(one.current[:, joint], sensor) for one in (free, other))
            for k in range(min(len(before), len(after))):
                own = explainer(period(free, lever, joint, k), before[k : k + 1], sensor, scatter)
                found[joint][in_words(changed(own, after[k]))] += 1
    return found


def of(found: Counter) -> str:
    """Each finding with its number of occurrences, in words."""
    return ", ".join(f"{name} {number}" for name, number in found.most_common())


def print_tables(folder: Path) -> None:
    """Print the findings for a robot's joints without a change and with a load."""
    found, scatters = unchanged(folder)
    print("| joint | in the period it | periods without a change | found |\n|---|---|---|---|")
    for (is_swinging, joint), names in sorted(found.items()):
        row = [str(joint + 1), "swings" if is_swinging else "stands", str(names.total()), of(names)]
        print(f"| {' | '.join(row)} |")
    print("\n| joint | periods with a load | found |\n|---|---|---|")
    for joint, names in enumerate(loaded(folder, scatters)):
        print(f"| {joint + 1} | {names.total()} | {of(names)} |")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, metavar="DIR")
    print_tables(parser.parse_args().folder / FOLDER)


if __name__ == "__main__":
    main()
