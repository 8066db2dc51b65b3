"""What a shorter lag of the crank tracker costs: a table of physics.md.

The leg, its crank's ripple and its encoder are those of `tracking`; crank and drive torque are sampled at
1 kHz each. A minute.
"""

import numpy as np
from tracking import NOISE_RAD, RIPPLE, START_NS, crank, seen

from leg_wear_monitor import load_mechanism
from leg_wear_monitor.compiled.kernel import new_records
from leg_wear_monitor.dynamics.clearance.stepper import ClearanceStepper
from leg_wear_monitor.dynamics.run import ARCHARD, DONE, TORQUE, new_run_statistics
from leg_wear_monitor.dynamics.simulation import prepare
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.twin import TORQUE as TORQUE_KIND
from leg_wear_monitor.twin.crank_motion import MOVE, SPLINE_NODE, join_smoothly
from leg_wear_monitor.twin.digital_twin import DigitalTwin
from leg_wear_monitor.twin.sample import TrackerSettings, TwinSettings, gait_samples
from leg_wear_monitor.twin.tracker import CrankTracker

LAGS_S = (
    (0.1, 0.025), (0.1, 0.01), (0.1, 0.005), (0.06, 0.025), (0.06, 0.01), (0.04, 0.025), (0.04, 0.01),
    (0.02, 0.025), (0.02, 0.01), (0.005, 0.025),
)  # fmt: skip
"""Pairs of lag and least time between nodes, the default first."""
RATE_HZ, CYCLES, SKIPPED = 1000, 40, 2


def motion_errors(settings: TrackerSettings, rate: float = float(RATE_HZ)) -> Floats:
    """RMS errors (3,) of the tracked angle [rad], speed [rad/s] and acceleration [rad/s^2] at a rate [Hz]."""
    errors: list[Floats] = []
    for steps, n in CrankTracker(settings).update(seen(20.0, rate, RIPPLE, NOISE_RAD)):
        for step in steps[:n]:
            if step["code"] != MOVE or step["begin_ns"] < START_NS + 1_000_000_000:
                continue
            tau = np.linspace(0.0, 1.0e-9 * (step["end_ns"] - step["begin_ns"]), 9)[:-1]
            polynomial = np.polynomial.Polynomial(step["motion"])
            found = np.stack([polynomial(tau), polynomial.deriv(1)(tau), polynomial.deriv(2)(tau)])
            error = found - crank(1.0e-9 * (step["begin_ns"] - START_NS) + tau, RIPPLE)
            error[0] -= TURN * np.round(error[0] / TURN)  # turns are counted apart
            errors.append(error)
    return np.asarray(np.sqrt(np.mean(np.concatenate(errors, axis=1) ** 2, axis=1)))


def leg() -> tuple[Floats, Floats]:
    """Archard integrals (CYCLES, k) [J] of the leg with this crank, and means of its torque [N m]."""
    setup = prepare(load_mechanism("bionic_leg"), wear=True)
    stepper, joints, h = ClearanceStepper(setup), setup.contacts.joint, 1.0 / RATE_HZ
    statistics = new_run_statistics(len(setup.linkage.mechanism.joints))
    polynomial, nodes = np.zeros(7), new_records(2, SPLINE_NODE)
    archard, torque = [], []
    before = np.zeros(2)
    for i in range((CYCLES + SKIPPED + 1) * RATE_HZ):
        if i % RATE_HZ == 0:
            archard.append(statistics.integral[joints, ARCHARD].copy())
        polynomial[0] = i * h
        nodes["angle"], nodes["speed"], nodes["acceleration"] = crank(h * np.array([i, i + 1.0]), RIPPLE)
        join_smoothly(nodes[0], nodes[1], h, polynomial[1:])
        if stepper.advance(polynomial, (i + 1) * h, statistics)[0] != DONE:
            raise RuntimeError("the leg's motion could not be resolved")
        sums = np.array([statistics.drive_integral[TORQUE], statistics.time[0]])
        torque.append((sums - before)[0] / (sums - before)[1])
        before = sums
    return np.diff(archard, axis=0)[SKIPPED:], np.array(torque)


def followed(settings: TrackerSettings, torque: Floats) -> tuple[Floats, float]:
    """Archard integrals (n, k) [J] of a twin that follows the leg, and the unexplained torque [N m]."""
    twin = DigitalTwin(load_mechanism("bionic_leg"), TwinSettings(tracker=settings))
    angles = seen(len(torque) / RATE_HZ, float(RATE_HZ), RIPPLE, NOISE_RAD)
    stamps = START_NS + np.round(1.0e9 * (np.arange(len(torque)) + 1.0) / RATE_HZ).astype(np.int64)
    torques = gait_samples(stamps, TORQUE_KIND, torque_nm=torque)
    cycles = twin.update(np.stack([angles, torques], axis=1).ravel()).cycles[SKIPPED - 1 :]
    unexplained = float(np.median([cycle.torque.unexplained_rms_nm for cycle in cycles]))
    return np.array([cycle.archard_j for cycle in cycles]), unexplained


def main() -> None:
    """Print the table."""
    truth, torque = leg()
    for lag_s, knot_interval_s in LAGS_S:
        settings = TrackerSettings(lag_s=lag_s, knot_interval_s=knot_interval_s)
        angle, speed, acceleration = motion_errors(settings)
        slower = motion_errors(settings, 200.0)[2]
        wear, unexplained = followed(settings, torque)
        first = wear[:, 0].mean() / truth[:, 0].mean() - 1.0
        rest = wear[:, 1:].sum(axis=1).mean() / truth[:, 1:].sum(axis=1).mean() - 1.0
        print(
            f"| {1e3 * lag_s:.0f} | {1e3 * knot_interval_s:.0f} | {1e3 * angle:.2f} | {speed:.4f} "
            f"| {acceleration:.2f}, {slower:.2f} | {unexplained:.2f} "
            f"| {100.0 * first:+.1f} % | {100.0 * rest:+.1f} % |",
            flush=True,
        )
    scatter = truth[:, 1:].sum(axis=1)
    print(f"scatter of the last: {100.0 * scatter.std() / scatter.mean() * np.sqrt(2.0 / len(truth)):.2f} %")


if __name__ == "__main__":
    main()
