"""Runs of the leg that several tests look at, each made once."""

from collections.abc import Callable, Sequence
from functools import cache

import attrs
import numpy as np
import pytest

from leg_wear_monitor import Mechanism
from leg_wear_monitor.dynamics.full_run import TOLERANCE_M, FullRun
from leg_wear_monitor.dynamics.result import EnergyBalance
from leg_wear_monitor.dynamics.run import ARCHARD, CONTACT, FORCE, RunStatistics, new_run_statistics
from leg_wear_monitor.dynamics.simulation import prepare
from leg_wear_monitor.dynamics.statistics import energy_balance


@attrs.frozen(eq=False)
class Cycle:
    """One gait cycle of the leg at 60 rpm, which takes a second.

    Attributes
    ----------
    statistics : RunStatistics
    energy : EnergyBalance
        Balance over the cycle [J].
    depth : (k, 2) array
        Largest wear on bushing and journal of the clearance joints since the start of counting [m].
    """

    statistics: RunStatistics
    energy: EnergyBalance
    depth: np.ndarray


class Cycles:
    """Counted cycles of the leg with some clearance joints.

    Parameters
    ----------
    joints : (k,) array of int
        The clearance joints.
    cycles : sequence of Cycle
    """

    def __init__(self, joints: np.ndarray, cycles: Sequence[Cycle]) -> None:
        self.cycles = cycles
        integrals = np.array([cycle.statistics.integral[joints] for cycle in cycles])
        self.force = integrals[:, :, FORCE]  # mean contact force [N] of each cycle and clearance joint
        self.archard = integrals[:, :, ARCHARD]  # J
        self.contact = integrals[:, :, CONTACT]  # fraction of the time


def _mirrored(mechanism: Mechanism) -> Mechanism:
    def points(named):
        return {name: (-x, y) for name, (x, y) in named.items()}

    start = mechanism.assembly
    bodies = {
        name: attrs.evolve(body, com=(-body.com[0], body.com[1]), points=points(body.points))
        for name, body in mechanism.bodies.items()
    }
    return attrs.evolve(
        mechanism,
        gravity=(-mechanism.gravity[0], mechanism.gravity[1]),
        ground=attrs.evolve(mechanism.ground, points=points(mechanism.ground.points)),
        bodies=bodies,
        drive=attrs.evolve(mechanism.drive, speed=-mechanism.drive.speed),
        assembly=attrs.evolve(
            start,
            crank_angle=-start.crank_angle,
            poses={name: (-x, y, -angle) for name, (x, y, angle) in start.poses.items()},
        ),
    )


@pytest.fixture(scope="session")
def mirrored() -> Callable[[Mechanism], Mechanism]:
    """Makes the mechanism seen in a mirror: x -> -x, its bodies too, and its crank turns the other way."""
    return _mirrored


@pytest.fixture(scope="session")
def leg_cycles(leg: Mechanism) -> Callable[..., Cycles]:
    """Cycles of the leg with the clearance joints named in a string, the first second dropped."""

    @cache
    def run(
        clearance_joints: str, count: int, clearance_m: float = 3.0e-4, tolerance_m: float = TOLERANCE_M
    ) -> Cycles:
        setup = prepare(leg, clearances=tuple(clearance_joints), clearance_m=clearance_m)
        motion, joints = FullRun(setup, tolerance_m=tolerance_m), len(leg.joints)
        motion.advance(1.0, new_run_statistics(joints))
        before, cycles = setup.surfaces.depth.copy(), []
        for second in range(1, count + 1):
            statistics, stored = new_run_statistics(joints), motion.stored_energy
            motion.advance(1.0 + second, statistics)
            energy = energy_balance(statistics, stored, motion.stored_energy)
            cycles.append(Cycle(statistics, energy, (setup.surfaces.depth - before).max(axis=2)))
        return Cycles(setup.contacts.joint, cycles)

    return run
