"""Legs behind a coupling or a belt: is its stiffness found, and are joints named?

A leg in full coordinates with masses 4 % off the file walks behind a spring and a damper between the measured
angle and the crank: a controller with their gains. The first table is of the leg when healthy, with the
reference of the file (rigid drive), with the coupling of the ideal leg's torque, and with what is identified
after it. The second one says which joint is named in windows of five gait cycles, with the first and the last
of these references. `python benchmarks/compliant.py --keep DIRECTORY` takes half an hour.
"""

import argparse
import functools
from pathlib import Path

import one_core  # noqa: F401, before numpy

# isort: split
import attrs
import numpy as np
from diagnosis import bodies_of, explained, kept, measured, named, rounds_of
from disturbed import MASSES, NEW, NOISE_NM, walked

from leg_wear_monitor import load_mechanism
from leg_wear_monitor.estimate.change_detector import ChangeDetector
from leg_wear_monitor.estimate.coupling import leg_behind_coupling
from leg_wear_monitor.estimate.explanations import Explainer
from leg_wear_monitor.estimate.signature import TorqueSensor
from leg_wear_monitor.mechanism.position import TURN, build_linkage, one_cycle
from leg_wear_monitor.mechanism.spec import Mechanism, Track, TrackDrive
from leg_wear_monitor.monitor.diagnosis.reference_file import shipped_references
from leg_wear_monitor.twin.load import torque_size
from leg_wear_monitor.twin.reference import COUPLING_DAMPING, LegParameters
from leg_wear_monitor.twin.torque_reference import TorqueReference

STIFFNESS_NM_PER_RAD = (1000.0, 200.0)
OPENINGS = (("G", 0.6), ("J", 1.0), ("B", 0.45), ("A", 0.45), ("I", 0.6))
HEALTHY, WORN, WINDOW, MONTH = 157, 40, 5, 8.64e5  # gait cycles


def behind(leg: Mechanism, stiffness: float, damping_ratio: float = COUPLING_DAMPING) -> Mechanism:
    """The leg behind a coupling: a controller that turns steadily, with its stiffness and damping."""
    linkage = build_linkage(leg)
    inertia = one_cycle(linkage, 240, 0.0, 1.0).drive_torque - one_cycle(linkage, 240, 0.0).drive_torque
    damping = 2.0 * damping_ratio * float(np.sqrt(stiffness * inertia.mean()))
    track = Track(speed_radps=TURN, kp_nm_per_rad=stiffness, kd_nm_s_per_rad=damping)
    return attrs.evolve(leg, drive=TrackDrive(body=leg.drive.body, track=track))


def next_leg(leg: Mechanism, explainer: Explainer, known, last: TorqueReference) -> LegParameters:
    """The leg behind a coupling that the ideal leg's torque shows; with one, or without any, its bodies."""
    found = None
    if not last.parameters.compliance:
        found = leg_behind_coupling(leg, explainer.model.sensor, last.profile, known.mean)
    return bodies_of(leg, explainer, known, last) if found is None else found


def references(leg: Mechanism, walk: np.ndarray, sensor: TorqueSensor, file) -> list[TorqueReference]:
    """The reference of the file, that of the ideal leg's coupling, and those identified after it."""
    found, draws = [], functools.partial(np.random.default_rng, 5)
    for one in rounds_of(leg, shipped_references(leg)[0], walk, sensor, NOISE_NM, draws, file, next_leg):
        print_leg(leg, one.reference, one.explainer.model.sensor, one.misfit)
        found.append(one.reference)
    return found


def print_leg(leg: Mechanism, reference: TorqueReference, sensor: TorqueSensor, off: float) -> None:
    """Stiffness and bodies of a reference, the channel found with it, and the misfit."""
    own = reference.parameters
    stiffness = f"{1.0 / own.compliance:.0f}, {own.damping:.3f}" if own.compliance else "rigid"
    bodies = " ".join(f"{100.0 * (value - 1.0):.1f}" for value in own.mass)
    own_channel = sensor.channel
    channel = f"{1e3 * own_channel.delay_s:.2f}, {1e3 * own_channel.time_constant_s:.2f}"
    print(f"| {stiffness} | {bodies} | {own.friction:.2f} | {channel} | {off:.2f} |", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--keep", type=Path)
    parser.add_argument("--stiffness", type=float, nargs="+", default=STIFFNESS_NM_PER_RAD)
    parser.add_argument("--damping-ratio", type=float, default=COUPLING_DAMPING)
    options = parser.parse_args()
    leg = load_mechanism("bionic_leg")
    mass = np.array([MASSES.get(body, 1.0) for body in leg.bodies])
    real = LegParameters(mass, np.ones(len(mass))).applied(leg)
    sensor = TorqueSensor(0.005, 1.0, torque_size(build_linkage(leg), TURN))
    for stiffness in options.stiffness:
        driven = behind(real, stiffness, options.damping_ratio)

        def file(what, stiffness=stiffness):
            name = f"{what} {stiffness:.0f} {options.damping_ratio:g}.pkl"
            return options.keep / name if options.keep else None

        def walk(joint, size_mm, cycles, driven=driven, file=file) -> np.ndarray:
            clearance = np.where(np.array(leg.clearance_joints) == joint, 1e-3 * size_mm, NEW)
            make = functools.partial(walked, driven, clearance, cycles + 3, 0.0, round(1000 * size_mm))
            return kept(file(f"{joint or 'new'} {size_mm:.2f}"), make)

        print(f"\n{stiffness:g} N m/rad\n")
        print("| stiffness [N m/rad], damping | masses [% off] | friction | channel [ms] | misfit |")
        print("|---|---|---|---|---|")
        healthy = walk("", 0.3, HEALTHY)
        found = references(leg, healthy, sensor, file)
        print("\n| reference | opened [mm] | named in windows of five gait cycles |\n|---|---|---|")
        for reference in [found[0], found[-1]]:
            explainer, _, rest = explained(
                leg, reference, healthy, sensor, NOISE_NM, np.random.default_rng(5)
            )
            detector = ChangeDetector(explainer, NEW, MONTH)
            state, most = detector.fresh(), 0.0
            for i, signature in enumerate(rest):
                state = detector.with_cycle(state, signature, i + 1)
                most = max(most, float(state.sums.max()))
            drive = "coupling" if reference.parameters.compliance else "rigid"
            print(f"| {drive} | none | largest sum {most:.1f} of {detector.threshold:.1f} |", flush=True)
            for joint, size_mm in OPENINGS:
                cycles = measured(walk(joint, size_mm, WORN), sensor, NOISE_NM, np.random.default_rng(6))
                starts = range(0, len(cycles) - WINDOW + 1, WINDOW)
                names = [named(explainer, cycles[i : i + WINDOW].mean(axis=0), WINDOW) for i in starts]
                right = f"{names.count(joint)} of {len(names)}"
                others = ", ".join(sorted({name for name in names if name != joint}))
                print(f"| {drive} | {joint} {size_mm} | {right} {others} |", flush=True)


if __name__ == "__main__":
    main()
