"""Runs of the leg that several tests look at, each made once."""

from collections.abc import Callable, Sequence
from functools import cache

import attrs
import numpy as np
import pytest

from leg_wear_monitor import Mechanism
from leg_wear_monitor.dynamics.full.run import TOLERANCE_M, FullRun
from leg_wear_monitor.dynamics.result import energy_balance
from leg_wear_monitor.dynamics.run.run_statistics import ARCHARD, CONTACT, FORCE, Tally, new_tally
from leg_wear_monitor.dynamics.simulation import prepare


@attrs.frozen(eq=False)
class Cycle:
    """One gait cycle of the leg at 60 rpm, which takes a second.

    Attributes
    ----------
    tally : Tally
    energy : dict of str to float
        Balance over the cycle [J].
    depth : (k, 2) array
        Largest wear on bushing and journal of the loose joints since the start of counting [m].
    """

    tally: Tally
    energy: dict[str, float]
    depth: np.ndarray


class Cycles:
    """Counted cycles of the leg with some joints loose.

    Parameters
    ----------
    joints : (k,) array of int
        The loose joints.
    cycles : sequence of Cycle
    """

    def __init__(self, joints: np.ndarray, cycles: Sequence[Cycle]) -> None:
        self.cycles = cycles
        integrals = np.array([cycle.tally.integral[joints] for cycle in cycles])
        self.force = integrals[:, :, FORCE]  # mean contact force [N] of each cycle and loose joint
        self.archard = integrals[:, :, ARCHARD]  # J
        self.contact = integrals[:, :, CONTACT]  # share of the time


@pytest.fixture(scope="session")
def leg_cycles(leg: Mechanism) -> Callable[..., Cycles]:
    """Cycles of the leg with the loose joints named in a string, the first second dropped."""

    @cache
    def run(loose: str, count: int, clearance_m: float = 3.0e-4, tolerance_m: float = TOLERANCE_M) -> Cycles:
        setup = prepare(leg, clearances=tuple(loose), clearance_m=clearance_m)
        motion, joints = FullRun(setup, tolerance_m=tolerance_m), len(leg.joints)
        motion.advance(1.0, new_tally(joints))
        before, cycles = setup.surfaces.depth.copy(), []
        for second in range(1, count + 1):
            tally, stored = new_tally(joints), motion.stored_energy
            motion.advance(1.0 + second, tally)
            energy = energy_balance(tally, stored, motion.stored_energy)
            cycles.append(Cycle(tally, energy, (setup.surfaces.depth - before).max(axis=2)))
        return Cycles(setup.contacts.joint, cycles)

    return run
