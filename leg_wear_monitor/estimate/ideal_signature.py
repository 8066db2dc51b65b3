"""The drive torque of the leg with ideal joints, and what it makes of a signature."""

import numpy as np

from leg_wear_monitor.estimate.signature import PhaseMeans
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ideal import TURN, one_cycle
from leg_wear_monitor.mechanism.position import build_linkage
from leg_wear_monitor.mechanism.spec import Mechanism

_POINTS = 240  # of a gait cycle: three in each of 80 phases


def ideal_torque(mechanism: Mechanism, speed: float) -> Floats:
    """Drive torque (n,) [N m] with ideal joints at equal steps of the crank angle, at a crank speed [rad/s].

    Raises
    ------
    AssemblyError
        If the linkage does not close or has a dead point.
    """
    return one_cycle(build_linkage(mechanism), _POINTS, speed).drive_torque


def signature_of_torque(torque: Floats, phases: int) -> Floats:
    """Signature's change by a torque that is added at equal steps of the crank angle, without roughness."""
    angle: Floats = np.linspace(0.0, TURN, len(torque), endpoint=False)
    first = np.zeros(len(torque), np.int64)
    return np.concatenate([PhaseMeans(first, angle, (1, phases)).of(torque)[0], np.zeros(phases)])
