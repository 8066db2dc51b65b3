"""How far the toe and the drive torque are from the ideal linkage at the same crank angle."""

import math
from typing import NamedTuple

import numpy as np

from leg_wear_monitor.dynamics.run.run_statistics import TORQUE_ERROR
from leg_wear_monitor.kernel import kernel
from leg_wear_monitor.mechanism.arrays import Floats, body_names, point_from_com
from leg_wear_monitor.mechanism.constraints import arm
from leg_wear_monitor.mechanism.ideal import TURN, one_cycle, point_motion
from leg_wear_monitor.mechanism.position import Linkage

POINTS = 1440  # of a cycle: cubic interpolation between them errs by 1e-9 of the curve's range


class Toe(NamedTuple):
    """The point whose motion is compared, and what it does in the ideal linkage.

    ``body`` its body, -1 if there is nothing to compare; ``point`` (2,) from the centre of mass;
    ``ideal`` (N, 7) position, velocity, acceleration and drive torque at N equal steps of the crank.
    """

    body: int
    point: Floats
    ideal: Floats


NO_TOE = Toe(-1, np.zeros(2), np.zeros((1, 7)))


def ideal_toe(linkage: Linkage, speed: float) -> Toe:
    """Table of the toe's ideal motion at a crank speed [rad/s]; nothing to compare without a toe."""
    mechanism = linkage.mechanism
    if mechanism.toe is None:
        return NO_TOE
    body, point = mechanism.toe
    motion = one_cycle(linkage, POINTS, speed)
    ideal = np.column_stack([*point_motion(motion, linkage, body, point), motion.drive_torque])
    return Toe(body_names(mechanism).index(body), np.array(point_from_com(mechanism, body, point)), ideal)


@kernel
def interpolate(table, column, crank_angle):
    """Value of a periodic table at a crank angle: the cubic through the four nearest points."""
    n = table.shape[0]
    u = crank_angle / TURN * n
    floor = math.floor(u)
    i, w = int(floor) % n, u - floor
    a, b = table[(i - 1) % n, column], table[i, column]
    c, d = table[(i + 1) % n, column], table[(i + 2) % n, column]
    outer = -w * (w - 1.0) * (w - 2.0) / 6.0 * a + (w + 1.0) * w * (w - 1.0) / 6.0 * d
    return outer + (w + 1.0) * (w - 1.0) * (w - 2.0) / 2.0 * b - (w + 1.0) * w * (w - 2.0) / 2.0 * c


@kernel
def toe_motion(toe, cs, q, v, a):
    """Position, velocity and acceleration of the toe."""
    i = toe.body
    sx, sy = arm(cs, i, toe.point)
    w, alpha = v[i, 2], a[i, 2]
    return (
        q[i, 0] + sx,
        q[i, 1] + sy,
        v[i, 0] - w * sy,
        v[i, 1] + w * sx,
        a[i, 0] - alpha * sy - w * w * sx,
        a[i, 1] + alpha * sx - w * w * sy,
    )


@kernel
def compare_toe(toe, crank_angle, cs, q, v, a, torque, out_response):
    """Raise the largest deviations (4,) seen so far; nothing without a toe."""
    if toe.body < 0:
        return
    motion = toe_motion(toe, cs, q, v, a)
    for i in range(3):
        dx = motion[2 * i] - interpolate(toe.ideal, 2 * i, crank_angle)
        dy = motion[2 * i + 1] - interpolate(toe.ideal, 2 * i + 1, crank_angle)
        out_response[i] = max(out_response[i], math.hypot(dx, dy))
    error = abs(torque - interpolate(toe.ideal, 6, crank_angle))
    out_response[TORQUE_ERROR] = max(out_response[TORQUE_ERROR], error)
