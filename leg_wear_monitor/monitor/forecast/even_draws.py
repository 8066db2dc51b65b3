"""Draws of an ensemble: fixed, the same at every call, and spread evenly instead of at random."""

from functools import cache
from statistics import NormalDist

import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats

MEMBERS = 1021
_MULTIPLIER = 333
_TURN = 631  # shifts each dimension by another amount, so that no member lies in a corner of all of them


@cache
def even_fractions(dimensions: int) -> Floats:
    """Numbers in (0, 1), shape (dimensions, MEMBERS): a lattice of Korobov's.

    Each dimension has the same evenly spaced numbers, in another order. By this multiplier every two of 17
    dimensions, which five joints need, are filled like a good lattice of two: lines that hold all members
    are at most 1/15 apart, where 1/34 is the least that could be; of 32 dimensions 1/6 (see the test).
    """
    member = np.arange(MEMBERS)
    rows = [(member * pow(_MULTIPLIER, axis, MEMBERS) + axis * _TURN) % MEMBERS for axis in range(dimensions)]
    fractions = (np.array(rows) + 0.5) / MEMBERS
    fractions.flags.writeable = False
    return fractions


@cache
def even_normals(dimensions: int) -> Floats:
    """The same as standard normal numbers."""
    inverse = np.array([NormalDist().inv_cdf((i + 0.5) / MEMBERS) for i in range(MEMBERS)])
    normals = inverse[np.floor(even_fractions(dimensions) * MEMBERS).astype(int)]
    normals.flags.writeable = False
    return np.asarray(normals)
