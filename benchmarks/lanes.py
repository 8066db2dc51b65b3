"""The trial step of several legs at once, a leg a lane of a vector, beside the scalar one: an experiment.

Each lane is a leg with a start of its own after a cycle: its tables, contacts and step length. Both must give
the same step, to rounding. Dry contacts on fresh surfaces with Hertz's law, hysteresis and Ambrosio's
friction; neither worn walls nor anything but the trial step, 40 % of the time of a leg, is in lanes.
"""

import argparse
import statistics
from typing import Any

import numpy as np

from leg_wear_monitor import load_mechanism
from leg_wear_monitor.dynamics.batch.leg import Leg
from leg_wear_monitor.dynamics.clearance import contact as columns
from leg_wear_monitor.dynamics.clearance.step import try_step
from leg_wear_monitor.dynamics.clearance.stepper import ClearanceStepper
from leg_wear_monitor.dynamics.clearance.tables import build_tables
from leg_wear_monitor.dynamics.joint.contact_event import F_N
from leg_wear_monitor.dynamics.run.drive import steady_drive
from leg_wear_monitor.dynamics.run.run_statistics import new_run_statistics
from leg_wear_monitor.kernel import entry
from leg_wear_monitor.mechanism.ideal import TURN
from leg_wear_monitor.wear.surfaces import Surfaces

# isort: split
# after the kernels: numba alone would take coverage.py here for the package of that name

from lane_step import trials
from lane_vectors import LANES
from watch import Watch

STEP_S = 1.0e-5
NOW = ("inverse_mass", "lever", "lever_response", "lever_drive", "speed")
SAMPLE = (F_N, columns.NX, columns.NY, columns.STIFFNESS, columns.DAMPING)


@entry
def scalar_trials(count, h, model, surfaces, approach, now, system, x, start, end):  # type: ignore[no-untyped-def]
    """The scalar step many times over; returns its error over the tolerance."""
    error = 0.0
    for _ in range(count):
        error = try_step(model, surfaces, approach, h, 0.0, now, system, x, start, end)
        x[0, 0] += 0.0 * error
    return error


def legs(cycles: float) -> tuple[list[ClearanceStepper], Surfaces]:
    """Legs after so many cycles from different starts, and their surfaces, which do not wear."""
    mechanism, found, tables = load_mechanism("bionic_leg"), [], None
    for seed in range(LANES):
        leg = Leg(mechanism=mechanism, perturb_m=1.0e-4, seed=seed)
        setup = leg.prepare()
        tables = tables or build_tables(setup.linkage, setup.contacts)
        stepper = ClearanceStepper(setup, tables=tables)
        leg.start(stepper)
        run = new_run_statistics(len(mechanism.joints))
        stepper.advance(steady_drive(0.0, setup.speed), cycles * TURN / abs(setup.speed), run)
        found.append(stepper)
    return found, setup.surfaces


def side_by_side(arrays: list[np.ndarray]) -> np.ndarray:
    """Arrays of one shape as vectors over the lanes, flat."""
    return np.ascontiguousarray(np.stack(arrays, axis=-1), dtype=float).ravel()


def in_lanes(steppers: list[ClearanceStepper]) -> dict[str, Any]:
    """Arguments of the step in lanes."""
    works, laws = [one.work for one in steppers], [one.model.law for one in steppers]
    vectors = {name: side_by_side([getattr(work.now, name) for work in works]) for name in NOW}
    for name in ("E0", "V0", "A0", "DRIFT"):
        vectors[name.lower()] = side_by_side([work.x[getattr(columns, name)] for work in works])
    vectors["start"] = side_by_side([work.start[:, list(SAMPLE)].T for work in works])
    approaches = [one.state.approach for one in steppers]
    loss = [
        np.where(a > 0.0, law[:, columns.HYSTERESIS_FACTOR] / np.where(a > 0.0, a, 1.0), 0.0)
        for a, law in zip(approaches, laws, strict=True)
    ]
    coefficient = [
        np.where(a > 0.0, law[:, columns.FRESH_COEFFICIENT], 0.0)  # open joints have no force
        for a, law in zip(approaches, laws, strict=True)
    ]
    ramp = [law[:, [columns.FRICTION_COEFFICIENT, columns.RAMP_0, columns.RAMP_1]].T for law in laws]
    vectors["laws"] = side_by_side(
        [
            np.concatenate([[c], [own], [one.model.contacts.clearance], r[:2], [1.0 / (r[2] - r[1])]])
            for c, own, r, one in zip(coefficient, loss, ramp, steppers, strict=True)
        ]
    )
    return vectors


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cycles", type=float, nargs="+", default=[1.1, 1.3, 1.5, 1.7, 1.9])
    parser.add_argument("--calls", type=int, default=20_000)
    arguments = parser.parse_args()
    ratios = []
    for cycles in arguments.cycles:
        steppers, surfaces = legs(cycles)
        vectors, k = in_lanes(steppers), len(steppers[0].state.approach)
        h, tolerance = np.full(LANES, STEP_S), steppers[0].model.tolerance
        out, room = np.zeros((2, 2 * k * LANES)), np.zeros((40 * k + k * k + 2 * k * k) * LANES)
        errors = np.zeros(LANES)
        spent: dict[str, list[float]] = {"lanes": [], "scalar": []}
        for calls in (1, *[arguments.calls] * 5):
            watch = Watch()
            trials(calls, k, h, tolerance, *vectors.values(), out[0], out[1], errors, room)
            spent["lanes"].append(watch.processor / calls / LANES)
            watch, found = Watch(), []
            for one in steppers:
                work = one.work
                rest = (one.state.approach, work.now, work.system, work.x, work.start, work.end)
                found.append(scalar_trials(calls, STEP_S, one.model, surfaces, *rest))
            spent["scalar"].append(watch.processor / calls / LANES)
        np.testing.assert_allclose(errors, found, rtol=1e-6)
        for row, lanes in zip((columns.E1, columns.V1), out, strict=True):
            expected = side_by_side([one.work.x[row] for one in steppers])
            np.testing.assert_allclose(lanes, expected, rtol=1e-9, atol=1e-12 * np.abs(expected).max())
        touching = np.mean([(one.state.approach > 0.0).sum() for one in steppers])
        lanes, scalar = (1e9 * statistics.median(spent[name][1:]) for name in ("lanes", "scalar"))
        ratios.append(scalar / lanes)
        print(
            f"{cycles:4.1f} cycles, {touching:.1f} contacts: scalar {scalar:4.0f} ns, "
            f"{LANES} lanes {lanes:4.0f} ns",
            flush=True,
        )
    print(f"scalar over lanes: {min(ratios):.1f} to {max(ratios):.1f}")


if __name__ == "__main__":
    main()
