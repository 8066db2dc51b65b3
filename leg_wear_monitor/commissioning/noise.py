"""Noise of the torque: of the sensor where the joints are quiet, and of everything that does not repeat."""

import math

import numpy as np

from leg_wear_monitor.commissioning.blocks import BINS
from leg_wear_monitor.commissioning.fit import Fit
from leg_wear_monitor.commissioning.search import repeating

_MEDIAN_TO_SIGMA = 1.0 / 0.6745  # of a normal distribution's absolute values


def sensor_noise(one: Fit) -> float:
    """Standard deviation of the torque samples in the quietest part of the turn, in the sensor's unit.

    From differences of neighbours, so that the leg's own torque, which changes slowly, drops out; in the part
    of the turn without impacts these are the sensor's.
    """
    first, length = one.blocks.first, one.blocks.length
    bins = np.repeat(one.blocks.part % BINS, length)
    inside = np.diff(np.repeat(np.arange(len(first)), length)) == 0
    steps = np.diff(one.pair.torque)[inside]
    bins = bins[1:][inside]
    # second differences would be quieter still, but steps of the sensor's resolution repeat in them
    sizes = [
        float(np.median(np.abs(steps[bins == i] - np.median(steps[bins == i])))) for i in np.unique(bins)
    ]
    return min(sizes, default=0.0) * _MEDIAN_TO_SIGMA / math.sqrt(2.0)


def scatter(one: Fit) -> float:
    """RMS of what does not repeat, in means over a twelfth of a turn, in the sensor's unit."""
    energy = float(np.mean(one.rest**2)) - (repeating(one) * float(one.measured.std())) ** 2
    return math.sqrt(max(energy, 0.0))
