"""How a crank turns in a gait cycle: its mean speed and its ripple, from samples of its angle."""

from collections.abc import Sequence

import attrs
import numpy as np

from leg_wear_monitor.dynamics.run.drive import CrankMotion
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ideal import TURN

# of the mean speed: a crank that turns otherwise by more is not compared. At 57 rpm a leg looks as if its
# joints were 0.03 to 0.09 mm wider than at 60, and what a clearance changes is in other phases (diagnosis.md)
UNLIKE = 0.015

# of a sensor's period: times in whole milliseconds, as tables have them, move samples at 200 Hz by up to a
# tenth of it, so that the speed of the same crank differs by 2 % from gait cycle to gait cycle
_COARSE = 0.01
_LOST = 1.5  # steps: in a longer time between two samples, some were lost

HARMONICS = 8  # of a turn; what is faster is noise of the encoder more than motion of the crank


@attrs.frozen(eq=False)
class CrankProfile:
    """Angle of a crank that turns in the same way in each gait cycle.

    The angle is phi + sum over h of ``cosine[h - 1]`` cos(h phi) + ``sine[h - 1]`` sin(h phi), phi the angle
    of a crank that turns at the mean speed.

    Attributes
    ----------
    speed : float
        Mean speed [rad/s], negative for a crank that turns clockwise.
    cosine, sine : (HARMONICS,) arrays
        Ripple [rad].
    """

    speed: float
    cosine: Floats
    sine: Floats

    @classmethod
    def steady(cls, speed: float) -> "CrankProfile":
        """Profile of a crank that turns at a constant speed [rad/s]."""
        return cls(speed, np.zeros(HARMONICS), np.zeros(HARMONICS))

    @property
    def cadence_rpm(self) -> float:
        """Mean speed [rpm]."""
        return 60.0 * self.speed / TURN

    def at(self, phi: float) -> CrankMotion:
        """Motion at an angle phi [rad] of the evenly turning crank."""
        h = np.arange(1.0, HARMONICS + 1.0)
        c, s = np.cos(h * phi), np.sin(h * phi)
        return CrankMotion(
            float(phi + self.cosine @ c + self.sine @ s),
            float(self.speed * (1.0 + h @ (self.sine * c - self.cosine * s))),
            float(-(self.speed**2) * (h**2 @ (self.cosine * c + self.sine * s))),
        )

    def angles(self, phi: Floats) -> Floats:
        """Crank angles (n,) [rad] at angles (n,) of the evenly turning crank."""
        h = np.outer(phi, np.arange(1.0, HARMONICS + 1.0))
        return np.asarray(phi + np.cos(h) @ self.cosine + np.sin(h) @ self.sine)

    def departure(self, other: "CrankProfile") -> float:
        """Largest difference of the speeds in a turn, as a fraction of the mean speed."""
        own, others = self._speeds(), other._speeds()
        return float(np.abs(own - others).max() / abs(other.speed))

    def is_like(self, other: "CrankProfile") -> bool:
        """Whether a torque under this motion can be compared with one under another."""
        return self.departure(other) <= UNLIKE

    def _speeds(self) -> Floats:
        """Speeds [rad/s] at some phases of a turn."""
        h = np.arange(1.0, HARMONICS + 1.0)
        phases = np.outer(np.arange(8 * HARMONICS) * (TURN / (8 * HARMONICS)), h)
        ripple = np.cos(phases) @ (h * self.sine) - np.sin(phases) @ (h * self.cosine)
        return np.asarray(self.speed * (1.0 + ripple))


def cycle_profile(time_s: Floats, angle: Floats, duration_s: float) -> CrankProfile:
    """Profile of one gait cycle, by least squares.

    Coarse times, such as whole milliseconds, are evened if the angles then fit better.

    Parameters
    ----------
    time_s, angle : (n,) arrays
        Times since the crank passed its zero [s] and continuous crank angles [rad], in order.
    duration_s : float
        Time until the crank passes its zero again.
    """
    stamped, rest, _ = _fitted(time_s, angle, duration_s)
    even_s = _evened(time_s)
    if even_s is None:
        return stamped
    _, _, longer = _fitted(even_s, angle, duration_s, is_whole=False)  # its passages are as coarse
    even, rest_of_even, _ = _fitted(even_s, angle, duration_s * longer)
    return even if rest_of_even < rest else stamped


def _fitted(
    time_s: Floats, angle: Floats, duration_s: float, is_whole: bool = True
) -> tuple[CrankProfile, float, float]:
    """Profile of angles at some times, the RMS of what it leaves over [rad], and a factor on the duration.

    The factor is 1 if the gait cycle is whole, that is, if its duration is known.
    """
    speed = float(np.copysign(TURN / duration_s, angle[-1] - angle[0]))
    phi = speed * time_s
    h = np.arange(1.0, HARMONICS + 1.0)
    columns = np.hstack([np.ones((len(phi), 1)), np.cos(np.outer(phi, h)), np.sin(np.outer(phi, h))])
    if not is_whole:
        columns = np.hstack([columns, phi[:, None]])
    found = np.linalg.lstsq(columns, angle - phi, rcond=None)[0]
    rest = float(np.sqrt(np.mean((angle - phi - columns @ found) ** 2)))
    # ripple counts from angle 0 of the evenly turning crank, which is not where the crank passes its zero
    turned = found[0] - TURN * np.round(found[0] / TURN)
    sines = slice(1 + HARMONICS, 1 + 2 * HARMONICS)
    ripple = (found[1 : 1 + HARMONICS] - 1j * found[sines]) * np.exp(-1j * h * turned)
    profile = CrankProfile(speed, np.asarray(ripple.real), np.asarray(-ripple.imag))
    return profile, rest, 1.0 if is_whole else 1.0 / (1.0 + float(found[-1]))


def _evened(time_s: Floats) -> Floats | None:
    """Times (n,) of samples that come evenly, but for lost ones; None where those given are not coarse."""
    steps = np.diff(time_s)
    period = float(np.mean(steps[steps <= _LOST * np.median(steps)]))
    if np.gcd.reduce(np.rint(1.0e9 * steps).astype(np.int64)) < 1.0e9 * _COARSE * period:
        return None
    number = np.concatenate([[0.0], np.cumsum(np.round(steps / period))])
    even_s = np.asarray(np.polyval(np.polyfit(number, time_s, 1), number))
    return even_s if np.abs(even_s - time_s).max() > _COARSE * period else None


def mean_profile(profiles: Sequence[CrankProfile]) -> CrankProfile:
    """Mean of the profiles of several gait cycles."""
    return CrankProfile(
        float(np.mean([one.speed for one in profiles])),
        np.asarray(np.mean([one.cosine for one in profiles], axis=0)),
        np.asarray(np.mean([one.sine for one in profiles], axis=0)),
    )
