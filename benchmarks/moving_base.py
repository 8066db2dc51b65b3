"""A pelvis that rises and sways as people's do: what it changes in the drive torque, the forces and the wear.

In the frame of the pelvis, each body feels its mass times the pelvis' acceleration, backwards. The pelvis is
highest in the middle of stance, twice a stride, and runs ahead in between.
"""

import argparse

import attrs
import numpy as np

from leg_wear_monitor import Mechanism, load_mechanism, simulate
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.person import PHASES, nominal_stance, on_the_ground, with_person
from leg_wear_monitor.mechanism.position import TURN, build_linkage, one_cycle
from leg_wear_monitor.mechanism.spec import PhaseLoad

LEGS = ((0.0, 0.0), (300.0, 0.0), (600.0, 0.0), (600.0, 80.0))  # vertical peak [N], person [kg]
BASES = ((0.0, 0.0), (20.0e-3, 0.0), (30.0e-3, 0.0), (25.0e-3, 10.0e-3))  # amplitude up and ahead [m]
APART_M = 1.0e-9  # between the clearances of two runs


def on_moving_base(leg: Mechanism, up_m: float, ahead_m: float, rpm: float) -> Mechanism:
    """The mechanism with an inertial force on each body, by the motion of its ground with the amplitudes."""
    stance = nominal_stance(build_linkage(leg))
    whole = (stance.turned * (stance.toe_off - stance.heel_strike)) % 1.0
    phase = np.arange(PHASES) / PHASES
    since_middle = stance.turned * (phase - stance.heel_strike) - 0.5 * whole
    wave, rate = 2.0 * TURN * since_middle, 2.0 * TURN * rpm / 60.0
    acceleration = -(rate**2) * (
        np.outer(up_m * np.cos(wave), stance.up) - np.outer(ahead_m * np.sin(wave), stance.back)
    )
    bodies, loads = {}, {}
    for name, body in leg.bodies.items():
        force = -body.mass * acceleration
        bodies[name] = attrs.evolve(body, points={**body.points, "com": body.com})
        loads[f"inertia of {name}"] = PhaseLoad(
            body=name,
            point="com",
            phase=tuple(phase.tolist()),
            force=tuple((float(x), float(y)) for x, y in force),
        )
    return attrs.evolve(leg, bodies=bodies, loads={**leg.loads, **loads})


def statistics(leg: Mechanism, rpm: float, runs: int, cycles: int) -> Floats:
    """RMS torque [N m], then mean forces [N] and Archard integrals [J/cycle] by joint, of each run."""
    rows = []
    for i in range(runs):
        result = simulate(leg, clearance_m=3.0e-4 + i * APART_M, speed_rpm=rpm, cycles=cycles, skip_cycles=2)
        joints = [result.joints[name] for name in result.clearance_joints]
        wear = [joint.archard_integral_j_per_cycle or np.nan for joint in joints]
        rows.append([result.drive_torque_nm.rms, *(joint.mean_force_n for joint in joints), *wear])
    return np.array(rows)


def torque_part(leg: Mechanism, moved: Mechanism, rpm: float) -> float:
    """RMS of the torque that the base's motion adds with ideal joints, over that of the leg."""
    still, moving = (
        one_cycle(build_linkage(one), PHASES, rpm * TURN / 60.0).drive_torque for one in (leg, moved)
    )
    return float(np.sqrt(np.mean((moving - still) ** 2) / np.mean(still**2)))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rpm", type=float, default=60.0)
    parser.add_argument("--runs", type=int, default=6)
    parser.add_argument("--cycles", type=int, default=12, help="counted gait cycles of each run")
    options = parser.parse_args()
    bare = load_mechanism("bionic_leg")
    names = bare.clearance_joints
    columns = ["load [N], person [kg]", "up, ahead [mm]", "added torque", "RMS torque", *names]
    print(f"| {' | '.join(columns)} | {' | '.join(f'wear {name}' for name in names)} |")
    print("|---|---|---|---|" + "---|" * (2 * len(names)))
    for load_n, person_kg in LEGS:
        leg = on_the_ground(with_person(bare, person_kg), load_n)
        still = None
        for up_m, ahead_m in BASES:
            moved = on_moving_base(leg, up_m, ahead_m, options.rpm) if up_m else leg
            mean = statistics(moved, options.rpm, options.runs, options.cycles).mean(axis=0)
            still = mean if still is None else still
            cells = [f"{value:.3g}" for value in mean] if not up_m else [
                f"{100.0 * change:+.0f} %" for change in mean / still - 1.0
            ]  # fmt: skip
            where = f"{load_n:.0f}, {person_kg:.0f} | {1e3 * up_m:.0f}, {1e3 * ahead_m:.0f}"
            added = f"{100.0 * torque_part(leg, moved, options.rpm):.0f} %"
            print(f"| {where} | {added} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
