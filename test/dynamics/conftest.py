"""Runs of the leg that several tests look at, each made once."""

from collections.abc import Callable
from functools import cache

import attrs
import numpy as np
import pytest
from counted_run import counted

from leg_wear_monitor import Mechanism
from leg_wear_monitor.dynamics.full_run import TOLERANCE_M, FullRun
from leg_wear_monitor.dynamics.result import EnergyBalance
from leg_wear_monitor.dynamics.run import ARCHARD, CONTACT, FORCE, new_run_statistics
from leg_wear_monitor.dynamics.simulation import prepare


@attrs.frozen(eq=False)
class Cycles:
    """Counted gait cycles of the leg at 60 rpm, each of which takes a second.

    Attributes
    ----------
    force, archard, contact : (cycles, k) arrays
        Mean contact force [N], Archard's integral [J] and fraction of the time in contact of each clearance
        joint.
    energy : list of EnergyBalance
        Balance over each cycle [J].
    """

    force: np.ndarray
    archard: np.ndarray
    contact: np.ndarray
    energy: list[EnergyBalance]


@pytest.fixture(scope="session")
def leg_cycles(leg: Mechanism) -> Callable[..., Cycles]:
    """Cycles of the leg with the clearance joints named in a string, the first second dropped."""

    @cache
    def run(
        clearance_joints: str, count: int, clearance_m: float = 3.0e-4, tolerance_m: float = TOLERANCE_M
    ) -> Cycles:
        setup = prepare(leg, clearances=tuple(clearance_joints), clearance_m=clearance_m)
        motion = FullRun(setup, tolerance_m=tolerance_m)
        motion.advance(1.0, new_run_statistics(len(leg.joints)))
        cycles = [counted(motion, 0.0, 1.0 + second) for second in range(1, count + 1)]
        integrals = np.array([statistics.integral[setup.contacts.joint] for statistics, _ in cycles])
        sums = (integrals[:, :, what] for what in (FORCE, ARCHARD, CONTACT))
        return Cycles(*sums, [energy for _, energy in cycles])

    return run
