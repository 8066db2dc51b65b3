"""The low-pass of a drive: by how rough the torque of the expected leg comes through it.

At one cadence a low-pass delays slow changes of the torque as a lag does. What is fast, the impacts of the
joints, becomes smoother: one simulated leg shows how rough the torque would be without it.
"""

import math

import attrs
import numpy as np

from leg_wear_monitor.commissioning.evidence.walk import Walk
from leg_wear_monitor.errors import AssemblyError
from leg_wear_monitor.estimate.channel import channel_of
from leg_wear_monitor.estimate.drive_figures import DriveFigures
from leg_wear_monitor.estimate.nuisances import nuisances
from leg_wear_monitor.estimate.signature_model import with_noise_of
from leg_wear_monitor.mechanism.ideal import TURN
from leg_wear_monitor.twin.reference.leg_parameters import LegParameters
from leg_wear_monitor.twin.reference.leg_simulation import LegSimulation
from leg_wear_monitor.twin.reference.torque_reference import TorqueReference
from leg_wear_monitor.wear.surfaces import SECTORS

_SETTLING, _CYCLES = 2, 40
# legs in full coordinates, joints of 0.2 to 0.4 mm, 30 to 85 rpm, low-passes of 15 to 120 Hz: the logarithm
# of the corner frequency is off by 0.24 where the mean square s of what is left over is below 0.3, by 0.32
# below 0.6, by 0.65 below 1.2; beyond, clearances or masses are too far off, and 6 of 12 low-passes do not
# show. 100 Hz were found for 3 of 5 sensors without a low-pass (n = 75, 2026-11-24)
_SPREAD, _BY_SQUARE, _POOR = 0.2, 0.5, 1.0
# corner frequencies that show, and their part of the sampling rate: at 100 Hz, 116 Hz seemed to be 50
_SHOWS_HZ, _OF_RATE = 70.0, 0.4


@attrs.frozen
class LowPass:
    """A first-order low-pass between a leg's torque and its samples.

    Attributes
    ----------
    time_constant_s : float
        0 where none shows; NaN where it cannot be told.
    log_sigma : float
        Standard deviation of its logarithm.
    square : float
        Mean square of what it leaves over.
    least_hz : float
        Corner frequency that a low-pass has at least where none shows.
    """

    time_constant_s: float
    log_sigma: float
    square: float
    least_hz: float

    @property
    def is_told(self) -> bool:
        """Whether the recording tells if there is one."""
        return math.isfinite(self.time_constant_s)

    @property
    def bandwidth_hz(self) -> float:
        """Corner frequency [Hz]; NaN where none shows."""
        return 1.0 / (TURN * self.time_constant_s) if self.time_constant_s else math.nan


def low_pass_of(walk: Walk, reference: TorqueReference) -> LowPass | None:
    """The low-pass that explains a walk; None without a sensor.

    Parameters
    ----------
    walk : Walk
        With signatures.
    reference : TorqueReference
        The leg as expected, of that walk.
    """
    if walk.sensor is None:
        return None
    mean = walk.baseline.mean
    columns = nuisances(walk.mechanism, reference, walk.sensor)
    found = channel_of(reference, with_noise_of(reference, walk.sensor, mean), mean, columns)
    one = found.channel
    least_hz = min(_SHOWS_HZ, _OF_RATE / walk.sensor.period_s)
    shows = TURN * one.time_constant_s * least_hz > 0.99
    # a direct channel is what is taken where no other one is surely better
    is_told = found.square <= _POOR and bool(one.delay_s or one.time_constant_s)
    log_sigma = _SPREAD + _BY_SQUARE * found.square
    time_constant_s = one.time_constant_s if shows else 0.0
    return LowPass(time_constant_s if is_told else math.nan, log_sigma, found.square, least_hz)


def low_pass_time(found: LowPass | None, declared: DriveFigures) -> tuple[float, float]:
    """Time constant of the low-pass that is declared or found, and its standard deviation [s]; 0 for none."""
    if math.isfinite(declared.bandwidth_hz):
        return 1.0 / (TURN * declared.bandwidth_hz), 0.0
    if found is None or not found.is_told:
        return 0.0, 0.0
    return found.time_constant_s, found.time_constant_s * found.log_sigma


def expected_leg(walk: Walk) -> TorqueReference | None:
    """A reference of the new leg alone, under the walk's own motion; None where it cannot be simulated."""
    own, new_m = LegParameters.none(walk.mechanism), walk.new_m
    unworn = np.zeros((len(new_m), 2, SECTORS))
    try:
        torque = LegSimulation(walk.mechanism).torque(walk.profile, own, new_m, unworn, _SETTLING + _CYCLES)
    except AssemblyError:
        return None
    if torque is None:
        return None
    return TorqueReference(walk.profile, new_m[None], (torque[_SETTLING:].astype(np.float16),), own)
