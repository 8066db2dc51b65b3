"""Deviation of the toe and of the drive torque from the ideal linkage at the same crank angle."""

import math
from typing import NamedTuple

import numpy as np

from leg_wear_monitor.dynamics.run.run_statistics import TORQUE_ERROR
from leg_wear_monitor.kernel import kernel
from leg_wear_monitor.mechanism.arrays import Floats, body_names, point_from_com
from leg_wear_monitor.mechanism.constraints import arm
from leg_wear_monitor.mechanism.ideal import TURN, one_cycle, point_motion
from leg_wear_monitor.mechanism.position import Linkage

POINTS = 1440  # table points per cycle: the error of cubic interpolation is 1e-9 of the curve's range


class Toe(NamedTuple):
    """The toe and its ideal motion.

    ``body``: index of its body, -1 without a toe; ``point`` (2,) [m]: from the centre of mass, in the body's
    frame; ``ideal`` (N, 7): position [m], velocity [m/s], acceleration [m/s^2] and drive torque [N m] at N
    equal steps of the crank.
    """

    body: int
    point: Floats
    ideal: Floats


NO_TOE = Toe(-1, np.zeros(2), np.zeros((1, 7)))


def ideal_toe(linkage: Linkage, speed: float) -> Toe:
    """The toe with its ideal motion at a crank speed [rad/s]; `NO_TOE` for a mechanism without a toe."""
    mechanism = linkage.mechanism
    if mechanism.toe is None:
        return NO_TOE
    body, point = mechanism.toe
    motion = one_cycle(linkage, POINTS, speed)
    ideal = np.column_stack([*point_motion(motion, linkage, body, point), motion.drive_torque])
    return Toe(body_names(mechanism).index(body), np.array(point_from_com(mechanism, body, point)), ideal)


@kernel
def interpolate(table, column, crank_angle):
    """Value of a column of a periodic table (N, m) at a crank angle [rad], cubic through four points."""
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
    """Position [m], velocity [m/s] and acceleration [m/s^2] of the toe, x and y each; q, v, a (n, 3)."""
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
    """Update the largest deviations out_response (4,) of toe and drive torque; no effect without a toe."""
    if toe.body < 0:
        return
    motion = toe_motion(toe, cs, q, v, a)
    for i in range(3):
        dx = motion[2 * i] - interpolate(toe.ideal, 2 * i, crank_angle)
        dy = motion[2 * i + 1] - interpolate(toe.ideal, 2 * i + 1, crank_angle)
        out_response[i] = max(out_response[i], math.hypot(dx, dy))
    error = abs(torque - interpolate(toe.ideal, 6, crank_angle))
    out_response[TORQUE_ERROR] = max(out_response[TORQUE_ERROR], error)
