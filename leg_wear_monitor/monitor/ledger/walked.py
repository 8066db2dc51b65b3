"""Foot loads under which a leg has walked: gait cycles by the size of the load's peak."""

from collections.abc import Iterable

import attrs
import numpy as np

_CLASS_N = 100


@attrs.frozen
class WalkedLoad:
    """Gait cycles under foot loads of about one size.

    Attributes
    ----------
    about_n : int
        Largest vertical foot load of each of the cycles, to the nearest 100 N.
    cycles : int
        Gait cycles.
    moving_s : float
        Time in motion.
    mean_n, sigma_n : float
        Mean and standard deviation of the largest vertical foot load of a gait cycle.
    """

    about_n: int
    cycles: int
    moving_s: float
    mean_n: float
    sigma_n: float

    @classmethod
    def of_cycle(cls, peak_n: float, moving_s: float) -> "WalkedLoad":
        """One gait cycle."""
        return cls(_CLASS_N * round(peak_n / _CLASS_N), 1, moving_s, peak_n, 0.0)


def together(loads: Iterable[WalkedLoad]) -> tuple[WalkedLoad, ...]:
    """All cycles under loads of about one size as one, by rising loads."""
    found: dict[int, list[WalkedLoad]] = {}
    for load in loads:
        found.setdefault(load.about_n, []).append(load)
    return tuple(_one(found[about_n]) for about_n in sorted(found))


def _one(loads: list[WalkedLoad]) -> WalkedLoad:
    cycles, moving_s, mean_n, sigma_n = np.array([attrs.astuple(load)[1:] for load in loads]).T
    mean = float(np.average(mean_n, weights=cycles))
    variance = np.average(sigma_n**2 + (mean_n - mean) ** 2, weights=cycles)
    return WalkedLoad(
        loads[0].about_n, int(cycles.sum()), float(moving_s.sum()), mean, float(np.sqrt(variance))
    )


def walked_words(loads: Iterable[WalkedLoad]) -> str:
    """Such as ``walked 12.1 h at 290 N, 2 h at 0 N``, the longest first; empty for a leg in the air."""
    longest = sorted(loads, key=lambda load: -load.moving_s)
    if not any(load.about_n for load in longest):
        return ""
    return "walked " + ", ".join(f"{_time(load.moving_s)} at {load.mean_n:.0f} N" for load in longest)


def _time(seconds: float) -> str:
    for unit, size in (("h", 3600.0), ("min", 60.0)):
        if seconds >= size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds:.3g} s"
