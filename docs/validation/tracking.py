"""What the crank tracker makes of noise and of speed ripple, over its bandwidth: a table of physics.md.

The crank turns at 60 rpm with a ripple of 3 % twice a turn; an encoder of 1e-3 rad sees it. Half a minute.
"""

import numpy as np

from leg_wear_monitor import load_mechanism
from leg_wear_monitor.compiled.kernel import new_records
from leg_wear_monitor.dynamics.clearance.stepper import ClearanceStepper
from leg_wear_monitor.dynamics.run import ARCHARD, DONE, new_run_statistics
from leg_wear_monitor.dynamics.simulation import prepare
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.position import TURN, ideal_motion
from leg_wear_monitor.twin.crank_motion import MOVE, SPLINE_NODE, join_smoothly
from leg_wear_monitor.twin.digital_twin import DigitalTwin
from leg_wear_monitor.twin.sample import Samples, TrackerSettings, TwinSettings, gait_samples
from leg_wear_monitor.twin.tracker import CrankTracker

BANDWIDTHS_HZ, RATES_HZ = (3.0, 5.0, 8.0, 12.0, 20.0), (50.0, 200.0, 1000.0)
NOISE_RAD, RIPPLE, WAVES = 1.0e-3, 0.03, 2
START_NS, CYCLES, SKIPPED = 1_700_000_000_000_000_000, 30, 2


def crank(t: Floats, ripple: float) -> Floats:
    """Angle, speed and acceleration (3, n) of the crank."""
    w, swing = WAVES * TURN, ripple * TURN
    return np.stack(
        [TURN * t + swing / w * np.sin(w * t), TURN + swing * np.cos(w * t), -swing * w * np.sin(w * t)]
    )


def seen(seconds: float, rate: float, ripple: float, noise: float) -> Samples:
    """What the encoder says."""
    t = np.arange(round(seconds * rate)) / rate
    angle = crank(t, ripple)[0] + noise * np.random.default_rng(1).standard_normal(len(t))
    stamps = START_NS + np.round(1.0e9 * t).astype(np.int64)
    return gait_samples(stamps, crank_angle_rad=angle % TURN)


def acceleration_error(bandwidth: float, rate: float, ripple: float, noise: float) -> float:
    """RMS of what the leg's crank is accelerated by in error [rad/s^2]."""
    errors = []
    for steps, n in CrankTracker(TrackerSettings(bandwidth_hz=bandwidth)).update(
        seen(20.0, rate, ripple, noise)
    ):
        for step in steps[:n]:
            begin, end = step["begin_ns"], step["end_ns"]
            if step["code"] == MOVE and begin > START_NS + 1_000_000_000:
                tau = np.linspace(0.0, 1.0e-9 * (end - begin), 9)[:-1]
                found = np.polynomial.Polynomial(step["motion"]).deriv(2)(tau)
                errors.append(found - crank(1.0e-9 * (begin - START_NS) + tau, ripple)[2])
    return float(np.sqrt(np.mean(np.concatenate(errors) ** 2)))


def wear_of_the_leg() -> Floats:
    """Archard integrals (CYCLES, k) [J] of the leg whose crank moves truly so."""
    setup = prepare(load_mechanism("bionic_leg"), wear=True)
    stepper, joints, cycles = ClearanceStepper(setup), setup.contacts.joint, []
    t, h = 0.0, 0.01
    polynomial, nodes = np.zeros(7), new_records(2, SPLINE_NODE)
    for cycle in range(CYCLES + SKIPPED):
        statistics = new_run_statistics(len(setup.linkage.mechanism.joints))
        for _ in range(100):
            polynomial[0] = t
            nodes["angle"], nodes["speed"], nodes["acceleration"] = crank(np.array([t, t + h]), RIPPLE)
            join_smoothly(nodes[0], nodes[1], h, polynomial[1:])
            t += h
            if stepper.advance(polynomial, t, statistics)[0] != DONE:
                raise RuntimeError("the leg's motion could not be resolved")
        if cycle >= SKIPPED:
            cycles.append(statistics.integral[joints, ARCHARD])
    return np.array(cycles)


def wear_of_the_twin(bandwidth: float) -> Floats:
    """The same (n, k) of a twin that follows it by noisy samples at 200 Hz."""
    settings = TwinSettings(tracker=TrackerSettings(bandwidth_hz=bandwidth))
    twin = DigitalTwin(load_mechanism("bionic_leg"), settings)
    update = twin.update(seen(CYCLES + SKIPPED + 1.0, 200.0, RIPPLE, NOISE_RAD))
    return np.array([cycle.archard_j for cycle in update.cycles[1:]])


def main() -> None:
    """Print the table."""
    linkage = prepare(load_mechanism("bionic_leg")).linkage
    angles = np.linspace(0.0, TURN, 72, endpoint=False)
    torques = [ideal_motion(linkage, angles, 0.0, a).drive_torque for a in (0.0, 1.0)]
    inertia = float(np.sqrt(np.mean((torques[1] - torques[0]) ** 2)))
    truth = wear_of_the_leg()
    print(f"inertia seen by the drive, RMS over the turn: {inertia:.3f} kg m^2")
    print(f"RMS acceleration of the ripple: {np.std(crank(np.linspace(0, 1, 1000), RIPPLE)[2]):.2f} rad/s^2")
    print("bandwidth  noise [rad/s^2] at 50, 200, 1000 Hz  torque [N m]  ripple's error  wear A, all others")
    for bandwidth in BANDWIDTHS_HZ:
        noise = [acceleration_error(bandwidth, rate, 0.0, NOISE_RAD) for rate in RATES_HZ]
        lost = acceleration_error(bandwidth, 200.0, RIPPLE, 0.0)
        wear = wear_of_the_twin(bandwidth)
        first = wear[:, 0].mean() / truth[:, 0].mean() - 1.0
        rest = wear[:, 1:].sum(axis=1).mean() / truth[:, 1:].sum(axis=1).mean() - 1.0
        by_rate = "  ".join(f"{a:6.3f}" for a in noise)
        print(
            f"{bandwidth:4.0f} Hz  {by_rate}  {inertia * noise[1]:6.3f}  {lost:6.3f}"
            f"  {100.0 * first:+5.2f} %  {100.0 * rest:+5.2f} %",
            flush=True,
        )
    scatter = truth[:, 1:].sum(axis=1)
    print(f"scatter of the last: {100.0 * scatter.std() / scatter.mean() * np.sqrt(2.0 / len(truth)):.2f} %")


if __name__ == "__main__":
    main()
