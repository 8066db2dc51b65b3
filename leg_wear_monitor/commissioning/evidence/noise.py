"""Noise of the torque: of the sensor where the joints are quiet, and of everything that does not repeat."""

import math

import numpy as np

from leg_wear_monitor.estimate.torque_fit.blocks import BINS
from leg_wear_monitor.estimate.torque_fit.fit import Fit
from leg_wear_monitor.estimate.torque_fit.likeness import repeating
from leg_wear_monitor.mechanism.arrays import Floats

_QUIETEST = 5  # parts of the turn of 48: so many that the median of an odd number is taken
_MEDIAN_TO_SIGMA = 1.0 / 0.6745  # of a normal distribution's absolute values


def sensor_noise(one: Fit) -> float:
    """Standard deviation of the torque samples in the quietest parts of the turn, in the sensor's unit.

    From differences of neighbours, so that the leg's own torque, which changes slowly, drops out; in the
    parts of the turn without impacts these are the sensor's. Even turns choose the parts, odd ones are
    measured: the least of many estimates would be too small.
    """
    first, length = one.blocks.first, one.blocks.length
    block = np.repeat(np.arange(len(first)), length)
    inside = np.diff(block) == 0
    part = one.blocks.part[block[1:][inside]]
    # second differences would be quieter still, but steps of the sensor's resolution repeat in them
    steps, bins, is_odd = np.diff(one.pair.torque)[inside], part % BINS, part // BINS % 2 == 1
    even = {i: _size(steps[(bins == i) & ~is_odd]) for i in np.unique(bins).tolist()}
    quietest = sorted(even, key=lambda i: even[i])[:_QUIETEST]
    sizes = [_size(steps[(bins == i) & is_odd]) for i in quietest]
    return float(np.median(sizes)) * _MEDIAN_TO_SIGMA / math.sqrt(2.0) if sizes else 0.0


def _size(steps: Floats) -> float:
    """Median size of steps about their median; infinite if there are none."""
    return float(np.median(np.abs(steps - np.median(steps)))) if len(steps) else math.inf


def scatter(one: Fit) -> float:
    """RMS of what does not repeat, in means over a twelfth of a turn, in the sensor's unit."""
    energy = float(np.mean(one.rest**2)) - (repeating(one) * float(one.measured.std())) ** 2
    return math.sqrt(max(energy, 0.0))
