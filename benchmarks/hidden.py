"""Clearances that nobody tells, from hip, knee and ankle encoders on a leg in full coordinates.

Each joint in turn has opened from 0.3 to 0.45 mm. Encoders have offsets, scale errors and noise, the crank's
too; they are commissioned on the new leg. `python benchmarks/hidden.py` (about a minute).
"""

import argparse

import numpy as np

from leg_wear_monitor import load_mechanism
from leg_wear_monitor.dynamics.full_run import FullRun
from leg_wear_monitor.dynamics.simulation import prepare
from leg_wear_monitor.dynamics.tally import new_tally
from leg_wear_monitor.mechanism.arrays import body_names
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor.angle_regression import known_before, observability, with_clearances
from leg_wear_monitor.monitor.hidden import LEAST_CYCLES, HiddenClearance, likeliest_worn, worn_joint
from leg_wear_monitor.twin.joint_angles import angle_model, contact_shape, design

SENSORS = {"B": "hip", "G": "knee", "I": "ankle"}
FRESH, WORN = 3.0e-4, 4.5e-4
OFFSET, SCALE = np.array([0.01, -0.02, 0.015]), np.array([2e-3, -1e-3, 3e-3])


def walked(leg: Mechanism, clearance: np.ndarray, cycles: int) -> tuple[np.ndarray, np.ndarray]:
    """Crank (cycles, 1000) and encoder angles (cycles, 1000, m) at 1 kHz, without errors."""
    setup, names = prepare(leg), body_names(leg)
    setup.contacts.clearance[:] = clearance
    run, tally = FullRun(setup, tolerance_m=1e-9), new_tally(len(leg.joints))
    run.advance(1.0, tally)
    angle = np.empty((cycles * 1000, len(names)))
    for i in range(len(angle)):
        run.advance(1.0 + (i + 1) / 1000.0, tally)
        angle[i] = run.q[:, 2]
    pairs = [[names.index(body) for body in leg.sides(joint)] for joint in SENSORS]
    encoders = np.stack([angle[:, j] - angle[:, b] for b, j in pairs], axis=1)
    crank = angle[:, names.index(leg.drive.body)]
    return crank.reshape(cycles, 1000), encoders.reshape(cycles, 1000, -1)


def read(walk, every, noise, seed):
    """What encoders say of a walk, a cycle at a time."""
    random = np.random.default_rng(seed)
    for crank, encoders in zip(*walk, strict=True):
        angle, turned = crank[every - 1 :: every], encoders[every - 1 :: every]
        yield (
            angle + noise * random.standard_normal(angle.shape),
            turned * (1.0 + SCALE) + OFFSET + noise * random.standard_normal(turned.shape),
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cycles", type=int, default=40)
    cycles = parser.parse_args().cycles
    leg = load_mechanism("bionic_leg")
    model, fresh = angle_model(leg, tuple(SENSORS)), np.full(len(leg.loose), FRESH)
    shape = contact_shape(leg, fresh)
    print("observable, by rad of RMS deviation a metre of clearance makes on its own")
    names = list(SENSORS.values())
    for chosen in ([0], [1], [2], [0, 1], [0, 2], [1, 2], [0, 1, 2]):
        seen = observability(design(model, shape), chosen, len(leg.loose))
        cells = "  ".join(f"{j} {w.value} {x:.2f}" for j, (w, x) in zip(leg.loose, seen, strict=True))
        print(f"  {'+'.join(names[i] for i in chosen):>14}: {cells}")
    walks = {None: walked(leg, fresh, cycles)}
    for k in range(len(leg.loose)):
        walks[k] = walked(leg, np.where(np.arange(len(fresh)) == k, WORN, FRESH), cycles)
    for noise in (1e-4, 1e-3):
        for every, rate in ((5, 200), (1, 1000)):
            print(f"\nnoise {noise:g} rad, {rate} Hz: um found (± sigma), cycles until named, name")
            new = HiddenClearance(model, shape, known_before(fresh, 5e-6, len(SENSORS)))
            for cycle in read(walks[None], every, noise, 0):
                new.add(*cycle)
            held = with_clearances(new.fused(), fresh, 2e-4)
            for k, walk in walks.items():
                told(leg, k, watch(leg, model, shape, held, read(walk, every, noise, 1)), held)


def watch(leg, model, shape, held, cycles):
    """The regression after all cycles, and when and what it first named."""
    hidden, first = HiddenClearance(model, shape, held), None
    for count, cycle in enumerate(cycles, 1):
        hidden.add(*cycle)
        if first is None and count >= LEAST_CYCLES:
            named = worn_joint(held, hidden.fused())
            first = None if named is None else count
    return hidden, first


def told(leg, k, watched, held):
    hidden, first = watched
    found = hidden.fused()
    cells = " ".join(
        f"{j} {1e6 * c:4.0f} ({1e6 * s:.0f})"
        for j, c, s in zip(leg.loose, found.clearance_m, found.sigma_m, strict=True)
    )
    true = "none" if k is None else leg.loose[k]
    print(f"  worn {true:>4}: {cells}   {first or '-':>3}", end="")
    if first is not None:
        named, clearance_m = likeliest_worn(leg, hidden, held)
        print(f"  {leg.loose[named]}, {1e6 * clearance_m:.0f}", end="")
    print()


if __name__ == "__main__":
    main()
