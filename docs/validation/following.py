"""How the twin's wear errs with noise, rate and losses of its samples: a table of physics.md.

A leg in full coordinates walks for 40 gait cycles at 60 rpm, and wears; the twin sees its crank and torque.
Three minutes, most of them for that leg.
"""

import numpy as np

from leg_wear_monitor import load_mechanism
from leg_wear_monitor.gait.config import GaitConfig, LoadConfig
from leg_wear_monitor.gait.leg import SyntheticLeg
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.twin.digital_twin import DigitalTwin
from leg_wear_monitor.twin.sample import Samples, TwinSettings, gait_samples

START_NS, CYCLES, RATE_HZ = 1_700_000_000_000_000_000, 40, 1000
# noise of the encoder [rad], rate [Hz], fraction of samples lost
CASES = (
    (0.0, 1000, 0.0), (1.0e-3, 200, 0.0), (3.0e-3, 200, 0.0), (1.0e-2, 200, 0.0), (1.0e-3, 50, 0.0),
    (1.0e-3, 100, 0.0), (1.0e-3, 1000, 0.0), (1.0e-3, 200, 0.1), (1.0e-3, 200, 0.3), (1.0e-3, 200, 0.6),
)  # fmt: skip


def walk(cycles: int, load: LoadConfig) -> tuple[Floats, Floats, Floats]:
    """Angle (n,), torque impulse (n,) every millisecond, and growth (cycles - 1, k) of the clearances [m]."""
    leg = SyntheticLeg(GaitConfig(load=load))
    instants = [leg.advance(i / RATE_HZ) for i in range((cycles + 1) * RATE_HZ)]
    clearance = np.array([leg.truth()["clearance_m"][name] for name in leg.clearance_joints])
    angle, impulse = (
        np.array([i.crank.angle for i in instants]),
        np.array([i.torque_impulse for i in instants]),
    )
    return angle, impulse, np.diff(clearance, axis=1)[:, 1:-1].T


def seen(angle: Floats, impulse: Floats, noise: float, rate: int, lost: float) -> Samples:
    """What encoder and torque sensor say of it, and what of that arrives."""
    chance, every = np.random.default_rng(1), RATE_HZ // rate
    angles, impulses = angle[every::every], impulse[::every]
    stamps = START_NS + np.arange(every, len(angle), every) * (10**9 // RATE_HZ)
    samples = gait_samples(
        stamps,
        crank_angle_rad=(angles + noise * chance.standard_normal(len(angles))) % TURN,
        torque_nm=np.diff(impulses) * rate + 0.05 * chance.standard_normal(len(angles)),
    )
    return samples[chance.random(len(samples)) >= lost]


def main() -> None:
    """Print the table."""
    angle, impulse, growth = walk(CYCLES, LoadConfig())
    scatter = growth.std(axis=0) / growth.mean(axis=0) * np.sqrt(2.0 / len(growth))
    mechanism = load_mechanism("bionic_leg")
    print(
        f"joints {mechanism.clearance_joints}; scatter of each difference [%]: {(100.0 * scatter).round(1)}"
    )
    for noise, rate, lost in CASES:
        twin = DigitalTwin(mechanism, TwinSettings())
        update = twin.update(seen(angle, impulse, noise, rate, lost))
        grown = np.mean([cycle.growth_mean_m for cycle in update.cycles], axis=0)
        error = 100.0 * (grown / growth.mean(axis=0) - 1.0)
        unexplained = np.mean([cycle.torque.unexplained_rms_nm for cycle in update.cycles])
        print(
            f"{noise:6.4f} rad {rate:5d} Hz {lost:4.0%} lost: "
            + " ".join(
                f"{name} {value:+5.1f}" for name, value in zip(twin.clearance_joints, error, strict=True)
            )
            + f" %; torque unexplained {unexplained:.2f} N m; {len(update.cycles)} cycles",
            flush=True,
        )
    loaded(mechanism)


def loaded(mechanism: Mechanism) -> None:
    """Print what a load at the toe does, with and without its estimate at work."""
    angle, impulse, growth = walk(13, LoadConfig(ground_n=60.0, friction_nm=1.0))
    for acts in (True, False):
        twin = DigitalTwin(mechanism, TwinSettings(estimate_load=acts))
        cycles = twin.update(seen(angle, impulse, 1.0e-3, 200, 0.0)).cycles
        grown = np.mean([cycle.growth_mean_m for cycle in cycles[2:]], axis=0)
        print(100.0 * (grown / growth[2:].mean(axis=0) - 1.0))
        for cycle in (cycles[0], cycles[-1]):
            torque = cycle.torque
            print(
                f"{torque.load_n:.1f} +- {torque.load_sigma_n:.1f} N, {torque.friction_nm:.3f} N m,", end=" "
            )
            print(f"{1e3 * torque.torque_lag_s:.2f} ms")


if __name__ == "__main__":
    main()
