"""Phase of the crank, in whose bins torques are summed over a gait cycle."""

import math

from leg_wear_monitor.kernel import kernel

_TURN = 2.0 * math.pi


@kernel
def in_turn(angle):
    """Crank angle [rad] in [0, 2 pi)."""
    return angle - _TURN * math.floor(angle / _TURN)


@kernel
def phase_of(angle, phases):
    """Index below ``phases`` of a crank angle [rad]."""
    return min(int(in_turn(angle) / _TURN * phases), phases - 1)
