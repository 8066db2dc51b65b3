"""The embedded Runge-Kutta pair of order 5(4) of Dormand and Prince 1980, first same as last."""

import math

import numpy as np

from leg_wear_monitor.kernel import kernel

STAGES = 7

NODES = np.array([0.0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1.0, 1.0])
TABLEAU = np.array(
    [
        [0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [1 / 5, 0.0, 0.0, 0.0, 0.0, 0.0],
        [3 / 40, 9 / 40, 0.0, 0.0, 0.0, 0.0],
        [44 / 45, -56 / 15, 32 / 9, 0.0, 0.0, 0.0],
        [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729, 0.0, 0.0],
        [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656, 0.0],
        [35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84],
    ]
)
WEIGHTS = np.array([35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84, 0.0])
# fifth-order minus fourth-order solution
ERROR = np.array([71 / 57600, 0.0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40])


@kernel
def stage_state(stage, h, y, k, out_y):
    """State at a stage: y + h sum_i a_si k_i; y and out_y (d,), slopes k (7, d), step h [s]."""
    for i in range(y.shape[0]):
        total = 0.0
        for s in range(stage):
            total += TABLEAU[stage, s] * k[s, i]
        out_y[i] = y[i] + h * total


@kernel
def error_norm(h, k, scale):
    """Largest component of the local error over its scale (d,) [-]; infinite if a component is not finite."""
    worst = 0.0
    for i in range(k.shape[1]):
        total = 0.0
        for s in range(STAGES):
            total += ERROR[s] * k[s, i]
        ratio = abs(h * total) / scale[i]
        if not math.isfinite(ratio):
            return math.inf
        worst = max(worst, ratio)
    return worst


@kernel
def next_step(h, error, growth):
    """Next step length [s] after a local error relative to the tolerance; at most ``growth`` times h."""
    if not error < 1.0e12:
        return 0.1 * h
    return h * min(growth, max(0.2, 0.9 * max(error, 1.0e-10) ** -0.2))


@kernel
def hermite(u, h, y0, v0, y1, v1):
    """Value and rate of the cubic Hermite interpolant at the fraction u of a step h [s], from both ends."""
    u2, u3 = u * u, u * u * u
    value = (
        (2 * u3 - 3 * u2 + 1) * y0 + (u3 - 2 * u2 + u) * h * v0 + (3 * u2 - 2 * u3) * y1 + (u3 - u2) * h * v1
    )
    rate = (6 * u2 - 6 * u) * (y0 - y1) / h + (3 * u2 - 4 * u + 1) * v0 + (3 * u2 - 2 * u) * v1
    return value, rate
