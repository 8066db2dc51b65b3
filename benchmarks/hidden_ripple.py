"""Clearances from hip, knee and ankle encoders on a leg whose crank has 3 % of ripple, in full coordinates.

Masses are those of leg a of `diagnosis.py`. Encoders are commissioned on 100 gait cycles of the new leg. Each
case is a leg with one wider joint, walked for 32 cycles; its estimate by the reference of the new leg, then
by references at the estimates. `python benchmarks/hidden_ripple.py --keep DIRECTORY` walks a leg once.
"""

import argparse
from pathlib import Path

import attrs
import numpy as np
from diagnosis import NEW, profile_of, truth
from hidden import OFFSET, SCALE, SENSORS, UNKNOWN, UNKNOWN_M

from leg_wear_monitor import load_mechanism
from leg_wear_monitor.dynamics.full_run import FullRun
from leg_wear_monitor.dynamics.run import TORQUE, new_run_statistics, quintic
from leg_wear_monitor.dynamics.simulation import prepare
from leg_wear_monitor.gait.config import PaceConfig
from leg_wear_monitor.gait.leg import Pace
from leg_wear_monitor.mechanism.arrays import body_names
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor.angle_regression import ClearanceRegression
from leg_wear_monitor.monitor.encoders import EncoderErrors, commissioned, prior_with
from leg_wear_monitor.twin.angle_reference import AngleModel, AngleReference, AngleReferenceRun, angle_model
from leg_wear_monitor.twin.reference import CrankProfile
from leg_wear_monitor.wear import SECTORS

RATE = 1000  # steps of a gait cycle at which a walk is kept; encoders give each fifth
RIPPLE, NOISE_RAD = 0.03, 1.0e-4
COMMISSIONING, HEALTHY, AFTER = 100, 192, 34
SIZES = (3.6e-4, 4.5e-4, 1.0e-3)
NEW_SIGMA_M = 5.0e-6  # of a clearance when new


def walked(leg: Mechanism, clearance_m: np.ndarray, cycles: int) -> np.ndarray:
    """Time [s], crank angle [rad], impulse of the torque [N m s], angles of the sensors (cycles RATE, 6)."""
    setup, pace, names = prepare(leg), Pace(PaceConfig(ripple=RIPPLE)), body_names(leg)
    setup.contacts.clearance[:] = clearance_m
    run = FullRun(attrs.evolve(setup, speed=pace.at(0.0).speed), tolerance_m=1e-9)
    pairs = [[names.index(body) for body in leg.sides(joint)] for joint in SENSORS]
    statistics, before, walk = new_run_statistics(len(leg.joints)), 0.0, np.empty((cycles * RATE, 6))
    for i in range(len(walk)):
        t = (i + 1) / RATE
        run.polynomial[:] = quintic(before, pace.at(before), t - before, pace.at(t))
        run.advance(t, statistics)
        turned = [run.q[journal, 2] - run.q[bushing, 2] for bushing, journal in pairs]
        walk[i] = t, pace.at(t).angle, statistics.drive_integral[TORQUE], *turned
        before = t
    return walk


def cycles_of(walk: np.ndarray, random: np.random.Generator) -> list[tuple[np.ndarray, np.ndarray]]:
    """Crank angles (n,) and what encoders give (n, m) in each whole gait cycle after the first two."""
    walk = walk[4::5]
    crank = walk[:, 1] + NOISE_RAD * random.standard_normal(len(walk))
    angles = walk[:, 3:] * (1.0 + SCALE) + OFFSET + NOISE_RAD * random.standard_normal((len(walk), 3))
    number = np.floor(walk[:, 1] / TURN - 1e-9).astype(np.int64)
    return [(crank[number == n], angles[number == n]) for n in range(2, number.max())]


def referred(
    leg: Mechanism, model: AngleModel, clearance_m: np.ndarray, profile: CrankProfile
) -> AngleReference:
    """A reference at some clearances."""
    run = AngleReferenceRun(leg, model)
    run.begin(clearance_m, np.zeros((5, 2, SECTORS)), profile)
    found = run.finish()
    if found is None:
        raise SystemExit("the leg could not be simulated")
    return found


def estimated(model: AngleModel, reference: AngleReference, errors: EncoderErrors, cycles) -> np.ndarray:
    """Clearances (k,) [m] from some gait cycles."""
    regression = ClearanceRegression(model, reference, prior_with(errors, reference.clearance_m, UNKNOWN_M))
    for cycle in cycles:
        regression.add(*cycle)
    return regression.fused().clearance_m


def commission(model: AngleModel, reference: AngleReference, cycles) -> EncoderErrors:
    """The encoders' errors, from the first gait cycles of a new leg."""
    regression = ClearanceRegression(model, reference, prior_with(UNKNOWN, NEW, NEW_SIGMA_M))
    for cycle in cycles[:COMMISSIONING]:
        regression.add(*cycle)
    return commissioned(UNKNOWN, regression.fused(), [True] * len(SENSORS))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--keep", type=Path)
    parser.add_argument("--cases", nargs="*", help="such as 'I 1.00'; all by default")
    parser.add_argument("--references", type=int, default=4, help="for openings of more than 100 um")
    parser.add_argument("--steady", action="store_true", help="references of a steady crank")
    options = parser.parse_args()
    leg, random = load_mechanism("bionic_leg"), np.random.default_rng(1)
    real, model = truth(leg, "a"), angle_model(leg, tuple(SENSORS))

    def walk(name: str, clearance_m: np.ndarray, cycles: int) -> np.ndarray:
        file = options.keep / f"{name}.npy" if options.keep else None
        if file and file.exists():
            return np.load(file)
        made = walked(real, clearance_m, cycles)
        if file:
            np.save(file, made)
        return made

    new = walk("new", NEW, HEALTHY)
    profile = CrankProfile.steady(TURN) if options.steady else profile_of(new[:, :3])
    first, healthy = referred(leg, model, NEW, profile), cycles_of(new, random)
    errors = commission(model, first, healthy)
    print("new", np.round(1e6 * estimated(model, first, errors, healthy[COMMISSIONING:])), flush=True)
    for size in SIZES:
        for k, joint in enumerate(leg.clearance_joints):
            name = f"{joint} {1e3 * size:.2f}"
            if options.cases and name not in options.cases:
                continue
            cycles = cycles_of(walk(name, np.where(np.arange(5) == k, size, NEW), AFTER), random)
            reference = first
            for again in range(options.references):
                found = estimated(model, reference, errors, cycles)
                print(name, "reference", again, np.round(1e6 * found), flush=True)
                if np.abs(found - reference.clearance_m).max() <= 1.0e-4 or again + 1 == options.references:
                    break
                reference = referred(leg, model, np.maximum(found, 1e-4), profile)


if __name__ == "__main__":
    main()
