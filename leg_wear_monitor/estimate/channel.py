"""The channel between a leg's drive torque and its samples: how late they are, and how filtered.

Torque is often motor current: it comes late by a control loop, through a low-pass. At one cadence an offset
of the crank looks like a delay. Both move the phases in which a torque is rough, by which clearances are told
apart, so a reference has to be late and filtered as the samples are.
"""

import attrs
import numpy as np

from leg_wear_monitor.estimate.signature import TorqueSensor
from leg_wear_monitor.estimate.signature_model import simulated_signatures, with_noise_of
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ideal import TURN
from leg_wear_monitor.twin.reference.torque_reference import TorqueReference

# an offset of 0.13 rad at 60 rpm, a lag of 40 ms; low-passes of 100 to 10 Hz
_DELAYS_S = 0.005 * np.arange(-4, 9)
_TIME_CONSTANTS_S = (0.0, *(1.0 / (TURN * hz) for hz in (100.0, 70.0, 50.0, 35.0, 25.0, 20.0, 14.0, 10.0)))
_FINER_S = (0.0025, 0.00125)  # steps about the best delay
_CYCLES = 20  # simulated gait cycles that are enough for a mean signature
# mean square by which another channel has to explain more than none: what the masses and lengths of a leg
# leave unexplained moves it by about 0.2 (docs/explanation/diagnosis.md)
_SURELY_BETTER = 0.3

# what a leg may have beside its channel: load, friction and masses in the first harmonics of the mean torque,
# and an error of the model in each phase, of the torque's size and of the roughness' logarithm
_HARMONICS, _HARMONIC_NM = 16, 100.0
_MEAN, _ROUGHNESS = 0.05, 0.4


def with_channel_of(reference: TorqueReference, sensor: TorqueSensor, measured: Floats) -> TorqueSensor:
    """The sensor with the noise, delay and low-pass by which the expected leg has a measured signature.

    Parameters
    ----------
    reference : TorqueReference
    sensor : TorqueSensor
    measured : (F,) array
        Mean of measured signatures of a leg as expected.
    """
    weight = _weight(sensor)

    def misfit(tried: TorqueSensor, delay_s: float) -> float:
        late = attrs.evolve(tried, delay_s=delay_s)
        rest = measured - simulated_signatures(reference, 0, late, cycles=_CYCLES).mean(axis=0)
        return float(rest @ weight @ rest) / len(rest)

    plain = with_noise_of(reference, attrs.evolve(sensor, delay_s=0.0, time_constant_s=0.0), measured)
    best, least = plain, misfit(plain, 0.0) - _SURELY_BETTER
    for time_constant_s in _TIME_CONSTANTS_S:
        tried = attrs.evolve(plain, time_constant_s=time_constant_s)
        found = {delay_s: misfit(tried, delay_s) for delay_s in _DELAYS_S.tolist()}
        for step_s in _FINER_S:
            middle = min(found, key=found.__getitem__)
            found |= {at: misfit(tried, at) for at in (middle - step_s, middle + step_s)}
        delay_s = min(found, key=found.__getitem__)
        if found[delay_s] < least:
            best, least = attrs.evolve(tried, delay_s=delay_s), found[delay_s]
    return with_noise_of(reference, best, measured) if best is not plain else plain


def _weight(sensor: TorqueSensor) -> Floats:
    """Inverse covariance (F, F) of what a leg may have beside its channel."""
    phases = sensor.phases
    order = np.arange(1, _HARMONICS + 1)[:, None] * (TURN * np.arange(phases) / phases)
    columns = np.vstack([np.ones((1, phases)), np.cos(order), np.sin(order)])
    columns = _HARMONIC_NM * np.hstack([columns, np.zeros_like(columns)])
    variance = np.repeat([_MEAN * sensor.size_nm, _ROUGHNESS], phases) ** 2
    return np.asarray(np.linalg.inv(np.diag(variance) + columns.T @ columns))
