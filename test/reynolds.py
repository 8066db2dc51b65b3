"""Reynolds' equation for a cylindrical bearing, by finite volumes: the second witness of the film's formulas.

With theta from the widest gap, H = 1 + epsilon cos(theta), Z the axial coordinate over the radius and the
pressure in units of 12 eta / psi^2:

    d/dtheta (H^3 dp/dtheta) + d/dZ (H^3 dp/dZ) = d(epsilon)/dt cos(theta) - epsilon omega_res / 2 sin(theta)

The pressure is 0 at the ends. The film breaks up and forms again where the solution with p >= 0 has it
(Reynolds' condition): p = 0, or the equation holds.
"""

import math

import numpy as np
from scipy.sparse import csr_array, diags, kron
from scipy.sparse.linalg import spsolve

AROUND, ALONG = 160, 8  # cells around the bearing, and from its middle to its end


def _flow(x: float, epsilon: float, fed: bool) -> csr_array:
    """Flow out of each cell by the pressures of all cells, per unit of area."""
    theta = np.arange(AROUND) * 2.0 * math.pi / AROUND  # of the faces before the cells
    face = (1.0 + epsilon * np.cos(theta)) ** 3 * (AROUND / (2.0 * math.pi)) ** 2
    after = np.roll(face, -1)
    across = diags(
        [face + after, -face[1:], -face[1:], [0.0 if fed else -face[0]], [0.0 if fed else -face[0]]],
        offsets=[0, 1, -1, AROUND - 1, 1 - AROUND],
    ).tolil()
    if fed:  # the pressure is 0 at the face itself, half a cell away
        across[0, 0] += face[0]
        across[AROUND - 1, AROUND - 1] += face[0]
    middle = np.full(ALONG, 2.0)
    middle[0], middle[-1] = 1.0, 3.0
    axial = diags([middle, -np.ones(ALONG - 1), -np.ones(ALONG - 1)], offsets=[0, 1, -1])
    gap = (1.0 + epsilon * np.cos(theta + math.pi / AROUND)) ** 3
    ends = kron(diags(gap), axial * (ALONG / x) ** 2)
    return csr_array(kron(across, diags(np.ones(ALONG))) + ends)


def _pressure(flow: csr_array, closing: np.ndarray) -> np.ndarray:
    """The pressure p >= 0 with flow @ p = closing where p > 0, and flow @ p >= closing elsewhere."""
    filled = closing > 0.0
    for _ in range(100):
        p, cells = np.zeros(len(closing)), np.flatnonzero(filled)
        p[cells] = spsolve(flow[cells][:, cells].tocsc(), closing[cells])
        corrected = np.where(filled, p > 0.0, flow @ p < closing)
        if (corrected == filled).all():
            return p
        filled = corrected
    raise ArithmeticError("the film's boundary does not settle")


def film_numbers(
    x: float, epsilon: float, omega_res: float, rate: float, fed: bool = False
) -> tuple[float, float]:
    """Force on the journal, F psi^2 / (b d eta), along the line of centres and across it [1/s].

    ``x``: width over diameter; ``omega_res`` and ``rate``, that of epsilon [1/s]; ``fed``: lubricant at no
    pressure enters along the widest gap.
    """
    theta = (np.arange(AROUND) + 0.5) * 2.0 * math.pi / AROUND
    closing = 0.5 * epsilon * omega_res * np.sin(theta) - rate * np.cos(theta)
    p = _pressure(_flow(x, epsilon, fed), np.repeat(closing, ALONG)).reshape(AROUND, ALONG).sum(axis=1)
    p *= 6.0 * 2.0 * math.pi / AROUND / ALONG
    return float(p @ np.cos(theta)), float(p @ np.sin(theta))
