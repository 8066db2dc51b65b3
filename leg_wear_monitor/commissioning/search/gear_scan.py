"""Where to start: every gear ratio, direction, offset and torque sign at once, judged by the leg's model.

Over the joint's angle, the torque is periodic with the crank's turn. One spectrum holds its harmonics for
every gear ratio; their correlation with those of the model, over all offsets, is a further Fourier transform.
Multiples and fractions of the true ratio have the wrong harmonics, and the model the wrong speed.
"""

import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.estimate.torque_fit.pairing import Pair
from leg_wear_monitor.estimate.torque_fit.start import Start
from leg_wear_monitor.estimate.torque_fit.torque_model import TorqueModel
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ideal import TURN

LEAST_TURNS = 5.0
_HARMONICS = 10
_FINE = (
    2 * _HARMONICS
)  # steps of a ratio within a turn more or less: half a step of the highest harmonic's line
_OFFSETS = 64
_LEAST_SAMPLES_PER_TURN = 2.5 * _HARMONICS
_FASTEST_RADPS = 60.0  # 570 rpm
_APART = 2 * _FINE  # two ratios nearer than two turns in the recording are one


def scan(pair: Pair, model: TorqueModel, count: int) -> list[Start]:
    """The best starts of each direction and torque sign, at most ``count`` each; none if there is too little.

    Parameters
    ----------
    pair : Pair
        A steady stretch.
    model : TorqueModel
    count : int
    """
    reach = float(np.ptp(pair.position_rad)) if len(pair.position_rad) else 0.0
    size = float(pair.torque.std()) if len(pair.torque) else 0.0
    if reach == 0.0 or not size > 0.0:
        return []
    speed = float(np.median(pair.speed_radps))
    lines = _lines(len(pair.torque), reach, abs(speed))
    if not len(lines):
        return []
    spectrum, origin = _spectrum(pair)
    ratio: Floats = TURN / (_FINE * reach) * lines.astype(np.float64)
    measured = spectrum[np.outer(lines, np.arange(1, _HARMONICS + 1))]
    starts = []
    for direction in (1, -1):
        wanted = _model_harmonics(model, direction * ratio * speed)
        both = wanted.conj() * measured if direction == 1 else (wanted * measured).conj()
        along = np.fft.fft(both, _OFFSETS, axis=1).real
        energy = (np.abs(wanted) ** 2).sum(axis=1)
        for sign in (1, -1):
            best = (sign * along).max(axis=1).clip(0.0)
            explained = 2.0 * best**2 / energy / size**2
            for peak in _peaks(explained, count):
                angle = TURN / _OFFSETS * float((sign * along[peak]).argmax())
                turned = direction * float(ratio[peak])
                offset = angle - turned * origin
                starts.append(Start(turned, offset, sign, float(explained[peak]), int(pair.recording[0])))
    return starts


def _lines(samples: int, reach: float, speed: float) -> NDArray[np.int64]:
    """Indices in the spectrum of the ratios with enough turns, enough samples a turn, a credible speed."""
    fastest = _FASTEST_RADPS / speed * reach / TURN
    most = min(samples / _LEAST_SAMPLES_PER_TURN, fastest)
    return np.arange(int(np.ceil(LEAST_TURNS * _FINE)), int(most * _FINE) + 1)


def _spectrum(pair: Pair) -> tuple[NDArray[np.complex128], float]:
    """Fourier coefficients of the torque over the joint's angle, and the angle that they start from."""
    order = np.argsort(pair.position_rad, kind="stable")
    position = pair.position_rad[order]
    even = np.linspace(position[0], position[-1], len(position), endpoint=False)
    torque = np.interp(even, position, pair.torque[order] - pair.torque.mean())
    return np.fft.rfft(torque, _FINE * len(even)) / len(even), float(position[0])


def _model_harmonics(model: TorqueModel, speed: Floats) -> NDArray[np.complex128]:
    """Harmonics (n, _HARMONICS) of the model at speeds (n,) of the crank [rad/s]."""
    tables = np.fft.rfft(model.tables[:3], axis=1)[:, 1 : _HARMONICS + 1] / model.tables.shape[1]
    motion = np.stack([np.ones_like(speed), speed, speed * speed], axis=1)
    return np.asarray(motion @ tables)


def _peaks(value: Floats, count: int) -> list[int]:
    """Indices of the largest local maxima, each apart from larger ones."""
    left, peaks = value.copy(), []
    for _ in range(count):
        peak = int(left.argmax())
        if left[peak] <= 0.0:
            break
        peaks.append(peak)
        left[max(0, peak - _APART) : peak + _APART + 1] = 0.0
    return peaks
