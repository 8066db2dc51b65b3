"""Curves of the drive torque over a crank turn, as Fourier coefficients: a turned curve is a product."""

from collections.abc import Mapping, Sequence

import attrs
import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.twin.statistics import TorqueProfile

Complex = NDArray[np.complex128]

# the knocks above are chaotic, and the comparison's low-pass filter has 10 Hz, too; a slow sensor has fewer
_HARMONICS = (10, 6)
_LEAST_POINTS = 3  # phases with samples per harmonic


@attrs.frozen(eq=False)
class TorqueCurves:
    """Curves of several gait cycles.

    Attributes
    ----------
    measured, predicted, lever : (h,) array
        Coefficients of the harmonics from the first on: measured torque, predicted torque without a foot
        load [N m], torque per foot load [N m/N].
    bodies : mapping of str to (h,) array
        Torque by which a body of double mass changes the predicted one [N m].
    means : (3,) array
        Means of measured torque, predicted torque and torque per load.
    """

    measured: Complex
    predicted: Complex
    lever: Complex
    bodies: Mapping[str, Complex]
    means: Floats

    @property
    def predicted_rms_nm(self) -> float:
        """RMS of the predicted torque."""
        return float(np.sqrt(inner(self.predicted, self.predicted) + self.means[1] ** 2))


def curves_of(profiles: Sequence[TorqueProfile], bodies: Mapping[str, Floats]) -> TorqueCurves | None:
    """Curves of gait cycles; None with too few samples.

    Parameters
    ----------
    profiles : sequence of TorqueProfile
    bodies : mapping of str to (m,) array
        Torques by a body's mass at equal steps of the crank angle from 0 [N m].
    """
    sums = np.sum([attrs.astuple(one, recurse=False) for one in profiles], axis=0)
    number, angle, *rest = sums[:, sums[0] > 0.0]
    harmonics = next((n for n in _HARMONICS if len(number) >= _LEAST_POINTS * n), 0)
    if not harmonics:
        return None
    turns = np.exp(1j * np.outer(angle / number, np.arange(1, harmonics + 1)))
    matrix = np.concatenate([np.ones((len(number), 1)), turns.real, -turns.imag], axis=1)
    weight = np.sqrt(number)[:, None]
    found = np.linalg.lstsq(weight * matrix, weight * (np.array(rest) / number).T, rcond=1e-6)[0]
    measured, predicted, lever = 0.5 * (found[1 : harmonics + 1] + 1j * found[harmonics + 1 :]).T
    return TorqueCurves(
        measured,
        predicted,
        lever,
        {name: np.fft.rfft(curve)[1 : harmonics + 1] / len(curve) for name, curve in bodies.items()},
        found[0],
    )


def inner(one: Complex, other: Complex) -> float:
    """Mean of the product of two curves over a turn."""
    return float(2.0 * (one @ other.conj()).real)


def turned(curve: Complex, angle_rad: float) -> Complex:
    """A curve f as f(x + angle)."""
    return np.asarray(curve * np.exp(1j * angle_rad * np.arange(1, len(curve) + 1)))


def slope(curve: Complex) -> Complex:
    """Derivative of a curve by the crank angle."""
    return np.asarray(curve * 1j * np.arange(1, len(curve) + 1))


def values_of(curve: Complex, points: int) -> Floats:
    """Values (points,) of a curve at equal steps of the crank angle."""
    angle = 2.0 * np.pi * np.arange(points) / points
    harmonics = np.arange(1, len(curve) + 1)
    return np.asarray(2.0 * (np.exp(1j * np.outer(angle, harmonics)) @ curve).real)
