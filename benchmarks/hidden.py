"""Clearances that nobody tells, from hip, knee and ankle encoders on a leg in full coordinates.

Each joint in turn has opened from 0.3 to 0.45 mm. Encoders have offsets, scale errors and noise, the crank's
too; they are commissioned on 100 cycles of the new leg. `python benchmarks/hidden.py` takes about eight
minutes, most of them for the legs; with `--keep DIRECTORY` those are walked once.
"""

import argparse
import time
from pathlib import Path

import numpy as np

from leg_wear_monitor import load_mechanism
from leg_wear_monitor.dynamics.clearance.stepper import ClearanceStepper
from leg_wear_monitor.dynamics.full_run import FullRun
from leg_wear_monitor.dynamics.run import new_run_statistics, steady_drive
from leg_wear_monitor.dynamics.simulation import prepare
from leg_wear_monitor.mechanism.arrays import body_names
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor.angle_regression import (
    ClearanceObservation,
    ClearanceRegression,
    clearance_estimates,
    rms,
)
from leg_wear_monitor.monitor.config.inputs import Encoders
from leg_wear_monitor.monitor.encoders import commissioned, errors_of, prior_with
from leg_wear_monitor.twin.angle_reference import AngleReferenceRun, angle_model
from leg_wear_monitor.wear import SECTORS

SENSORS = {"B": "hip", "G": "knee", "I": "ankle"}
FRESH, WORN = 3.0e-4, 4.5e-4
ALL_WORN = FRESH + 1e-6 * np.array([150.0, 50.0, 45.0, 15.0, 10.0])  # as in a life of the leg
OFFSET, SCALE = np.array([0.01, -0.02, 0.015]), np.array([2e-3, -1e-3, 3e-3])
COMMISSIONING, WINDOW = 100, 60
COUNTS = (20, 40, 80, 160, 320)
UNKNOWN = errors_of(Encoders(names=tuple(SENSORS.values()), joints=tuple(SENSORS)), None)
UNKNOWN_M = 1.0e-3  # standard deviation of a clearance of which nothing is known


def walked(
    leg: Mechanism, clearance: np.ndarray, cycles: int, depth: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Crank (cycles, 1000) and encoder angles (cycles, 1000, m) at 1 kHz, without errors."""
    setup, names = prepare(leg, wear=depth is not None), body_names(leg)
    setup.contacts.clearance[:] = clearance
    if depth is not None:
        setup.contacts.wear_coefficient[:], setup.surfaces.depth[:] = 0.0, depth
    run, statistics = FullRun(setup, tolerance_m=1e-9), new_run_statistics(len(leg.joints))
    run.advance(1.0, statistics)
    angle = np.empty((cycles * 1000, len(names)))
    for i in range(len(angle)):
        run.advance(1.0 + (i + 1) / 1000.0, statistics)
        angle[i] = run.q[:, 2]
    pairs = [[names.index(body) for body in leg.sides(joint)] for joint in SENSORS]
    encoders = np.stack([angle[:, j] - angle[:, b] for b, j in pairs], axis=1)
    crank = angle[:, names.index(leg.drive.body)]
    return crank.reshape(cycles, 1000), encoders.reshape(cycles, 1000, -1)


def walks_of(leg, keep):
    """Walks by who is worn: clearances, crank and encoder angles."""
    legs = {"none": np.full(5, FRESH)}
    legs |= {name: np.where(np.arange(5) == k, WORN, FRESH) for k, name in enumerate(leg.clearance_joints)}
    walks = {}
    for name, clearance in (legs | {"all": ALL_WORN}).items():
        file = Path(keep, f"{name}.npz") if keep else None
        if file and file.exists():
            walk = np.load(file)["crank"], np.load(file)["encoders"]
        else:
            walk = walked(leg, clearance, COUNTS[-1] + (COMMISSIONING if name == "none" else 0))
        if file and not file.exists():
            np.savez(file, crank=walk[0], encoders=walk[1])
        walks[name] = clearance, *walk
    return walks


def read(walk, every, noise, seed):
    """What encoders say of a walk, a cycle at a time."""
    random = np.random.default_rng(seed)
    for crank, encoders in zip(*walk, strict=True):
        angle, turned = crank[every - 1 :: every], encoders[every - 1 :: every]
        yield (
            angle + noise * random.standard_normal(angle.shape),
            turned * (1.0 + SCALE) + OFFSET + noise * random.standard_normal(turned.shape),
        )


def worn_by_archard(leg: Mechanism) -> np.ndarray:
    """Depths of a leg that walked until A had opened by 150 um; wear 50 000 times as fast."""
    setup = prepare(leg, wear=True)
    setup.contacts.wear_coefficient[:] *= 5.0e4
    stepper, statistics = ClearanceStepper(setup), new_run_statistics(len(leg.joints))
    stepper.init(0.0, setup.speed)
    cycle = 0
    while setup.surfaces.depth[0].sum(axis=0).mean() < WORN - FRESH:
        cycle += 1
        stepper.advance(steady_drive(0.0, setup.speed), float(cycle), statistics)
    return setup.surfaces.depth


def referred(leg, model, clearance, depth=None):
    """A reference, and what it took [s]."""
    run, began = AngleReferenceRun(leg, model), time.process_time()
    run.begin(clearance, np.zeros((5, 2, SECTORS)) if depth is None else depth)
    return run.finish(), time.process_time() - began


def commission(model, reference, walk, every, noise):
    """The encoders' errors, from the first gait cycles of a new leg."""
    new = ClearanceRegression(model, reference, prior_with(UNKNOWN, np.full(5, FRESH), 5e-6))
    for cycle in read([part[:COMMISSIONING] for part in walk], every, noise, 0):
        new.add(*cycle)
    return commissioned(UNKNOWN, new.fused(), [True] * len(SENSORS))


def known(reference, encoder_errors):
    """The encoders' errors as estimated, and nothing of clearances."""
    return prior_with(encoder_errors, reference.clearance_m, UNKNOWN_M)


def show_observability(leg, model, reference, walk):
    """What the monitor says that some of the encoders show, and by how much."""
    print("rad of RMS deviation that a metre of clearance makes beyond what others can")
    encoder_errors, names = commission(model, reference, walk, 5, 1e-4), list(SENSORS.values())
    for chosen in ([0], [1], [2], [0, 1], [0, 2], [1, 2], [0, 1, 2]):
        absent = [i for i in range(len(names)) if i not in chosen]
        hidden = ClearanceRegression(model, reference, known(reference, encoder_errors))
        for crank, angles in read([part[-WINDOW:] for part in walk], 5, 1e-4, 5):
            angles[:, absent] = np.nan
            hidden.add(crank, angles)
        seen = clearance_estimates(hidden.fused(), reference.clearance_m)
        shown = [k for k, one in enumerate(seen) if one.observation is ClearanceObservation.SEEN]
        beyond = dict(zip(shown, beyond_others(reference.columns, chosen, shown), strict=True))
        cells = [f"{beyond[k]:.2f}" if k in beyond else one.observation.value for k, one in enumerate(seen)]
        cells = "  ".join(f"{joint} {cell}" for joint, cell in zip(leg.clearance_joints, cells, strict=True))
        print(f"  {'+'.join(names[i] for i in chosen):>14}: {cells}")


def beyond_others(columns, sensors, shown):
    """RMS [rad/m] that each joint's clearance makes beyond what the others and encoders' errors can."""
    m = columns.shape[1]
    k = columns.shape[2] - 1 - 2 * m
    used = [*shown, k, *(k + 1 + i for i in sensors), *(k + 1 + m + i for i in sensors)]
    a = columns[:, sensors][:, :, used].reshape(-1, len(used))
    for i in range(len(shown)):
        others = np.delete(a, i, axis=1)
        yield rms(a[:, i] - others @ np.linalg.lstsq(others, a[:, i], rcond=1.0e-9)[0])


def show_convergence(leg, model, reference, encoder_errors, walks, every, noise):
    """RMS of the errors over all legs but that with all joints worn, by cycles."""
    errors, sigmas = {n: [] for n in COUNTS}, {n: [] for n in COUNTS}
    for name, (clearance, *walk) in walks.items():
        if name == "all":
            continue
        hidden = ClearanceRegression(model, reference, known(reference, encoder_errors), most=COUNTS[-1])
        for count, cycle in enumerate(read([part[-COUNTS[-1] :] for part in walk], every, noise, 1), 1):
            hidden.add(*cycle)
            if count in COUNTS:
                found = hidden.fused()
                errors[count].append(found.clearance_m - clearance)
                sigmas[count].append(found.sigma_m)
    for n in COUNTS:
        off = 1e6 * np.sqrt(np.mean(np.square(errors[n]), axis=0))
        worst = 1e6 * np.abs(errors[n]).max(axis=0)
        said = 1e6 * np.mean(sigmas[n], axis=0)
        rows = zip(leg.clearance_joints, off, worst, said, strict=True)
        cells = "  ".join(f"{joint} {o:.0f} ({w:.0f}) {s:.0f}" for joint, o, w, s in rows)
        print(f"  {n:>4} cycles: {cells}")


def show_finding(leg, model, reference, encoder_errors, walks, every, noise):
    """After how many cycles of a leg that was new before a joint is found, and which one is named."""
    new = [part[COMMISSIONING : COMMISSIONING + WINDOW] for part in walks["none"][1:]]
    for name, (_, *walk) in walks.items():
        if name == "all":
            continue
        hidden = ClearanceRegression(model, reference, known(reference, encoder_errors), most=WINDOW)
        first, named = None, {}
        for cycle in read(new, every, noise, 2):
            hidden.add(*cycle)
        for count, cycle in enumerate(read([part[-200:] for part in walk], every, noise, 3), 1):
            hidden.add(*cycle)
            for joint, one in zip(
                leg.clearance_joints, clearance_estimates(hidden.fused(), np.full(5, FRESH)), strict=True
            ):
                if one.is_other:
                    first = first or count
                    named[joint] = named.get(joint, 0) + 1
        found = hidden.fused()
        cells = " ".join(f"{1e6 * c:.0f}" for c in found.clearance_m)
        print(
            f"  worn {name:>4}: found after {first or '-':>3} cycles, named {named or '-'}; now [um] {cells}"
        )


def show_all_worn(leg, model, reference, encoder_errors, walk):
    """A leg with all joints worn: by the reference of the new leg, then by one of what was found."""
    clearance, *walk = walk
    for again in range(3):
        hidden = ClearanceRegression(model, reference, known(reference, encoder_errors))
        for cycle in read([part[:WINDOW] for part in walk], 5, 1e-4, 4):
            hidden.add(*cycle)
        found = hidden.fused()
        print(f"  reference {again}: off [um]", np.round(1e6 * (found.clearance_m - clearance)))
        reference, _ = referred(leg, model, found.clearance_m)


def show_locally_worn(leg, model, reference, encoder_errors):
    """A leg worn where its joints bear: by the reference of a new one, then by one of what was counted."""
    depth = worn_by_archard(leg)
    opened = depth.sum(axis=1).mean(axis=1)
    print("  worn by [um]", np.round(1e6 * opened), "deepest", np.round(1e6 * depth.sum(axis=1).max(axis=1)))
    walk = walked(leg, np.full(5, FRESH), WINDOW, depth)
    for fraction in (0.0, 1.0, 0.5, 0.25):
        if fraction:
            reference, _ = referred(leg, model, FRESH + fraction * opened, fraction * depth)
        hidden = ClearanceRegression(model, reference, known(reference, encoder_errors))
        for cycle in read(walk, 5, 1e-4, 4):
            hidden.add(*cycle)
        off = hidden.fused().clearance_m - FRESH - opened
        print(f"  counted {fraction:g} of it: off [um]", np.round(1e6 * off))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--keep", help="directory for the walks")
    keep = parser.parse_args().keep
    leg = load_mechanism("bionic_leg")
    walks = walks_of(leg, keep)
    model = angle_model(leg, tuple(SENSORS))
    reference, took_s = referred(leg, model, np.full(5, FRESH))
    print(f"reference: {took_s:.1f} s")
    show_observability(leg, model, reference, walks["none"][1:])
    for noise in (1e-4, 1e-3):
        for every, rate in ((5, 200), (1, 1000)):
            print(f"\nnoise {noise:g} rad, {rate} Hz: RMS off (most) stated [um]")
            began = time.process_time()
            encoder_errors = commission(model, reference, walks["none"][1:], every, noise)
            print(f"  a cycle takes {1e3 * (time.process_time() - began) / COMMISSIONING:.2f} ms")
            show_convergence(leg, model, reference, encoder_errors, walks, every, noise)
            show_finding(leg, model, reference, encoder_errors, walks, every, noise)
            if (noise, every) == (1e-4, 5):
                show_all_worn(leg, model, reference, encoder_errors, walks["all"])
                show_locally_worn(leg, model, reference, encoder_errors)


if __name__ == "__main__":
    main()
