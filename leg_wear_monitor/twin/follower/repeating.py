"""The part of the torque residual that repeats over gait cycles, by crank phase (physics.md section 9).

What a lost sample, a stamp that is off, noise and the chance of impacts leave in one gait cycle, they do not
leave in the next at the same phase: it shows as scatter over cycles, and is taken off. A mismatch of the leg
repeats.
"""

import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.twin.follower.state import LOAD
from leg_wear_monitor.twin.follower.torque_estimate import bounded, bounds
from leg_wear_monitor.twin.statistics import TorqueProfile

# gait cycles whose mean is taken, and how many are needed; fewer have more scatter, more have a longer delay
# (tuned on the synthetic leg in full coordinates at 60 rpm: knocks in A and G, lost samples, late stamps)
CYCLES, LEAST_CYCLES = 4, 3  # of averages
INSTANT_CYCLES = 8  # of instants, whose scatter is larger
_LEAST_PHASES = 8
_LONGEST_LAG_S = 0.01  # beyond the declared one: more is wrong as received, and is not explained
_LEAST_WEIGHT = 0.05  # of a phase, as a fraction of the mean one: less is of samples elsewhere in the turn


class RepeatingResidual:
    """The torque residual by crank phase over the last gait cycles.

    Parameters
    ----------
    most, least : int
        Gait cycles that are kept, and that are needed.

    Attributes
    ----------
    cycles : tuple of (6, n) arrays
        For each gait cycle, the newest last, rows by phase: weight, then weight times residual, and weight
        times its regressors load, friction, lag and load friction.
    """

    def __init__(self, most: int = INSTANT_CYCLES, least: int = INSTANT_CYCLES) -> None:
        self._most, self._least = most, least
        self.cycles: tuple[Floats, ...] = ()

    def take(self, by_phase: Floats) -> None:
        """Add the sums (6, n) of a complete gait cycle."""
        self.cycles = (*self.cycles, by_phase.copy())[-self._most :]

    def rms_nm(
        self,
        loads: tuple[float, float] = (-np.inf, np.inf),
        other_m: Floats | None = None,
        acting_n: float = 0.0,
        tolerated_nm: Floats | None = None,
    ) -> tuple[float, float]:
        """RMS [N m] of the repeating residual without load, frictions and lag, and that load [N].

        The squared standard error of the mean over cycles is subtracted, so that pure scatter gives 0 on
        average. NaN without enough cycles.

        Parameters
        ----------
        loads : (float, float)
            Least and largest possible load of the residual [N].
        other_m : (phases,) array, optional
            Torque per newton of a load of another shape over the gait cycle than the supposed one.
        acting_n : float, optional
            Load of the supposed shape that acted in the model, for another one instead.
        tolerated_nm : (phases,) array, optional
            Torque that may be there up to this size, with either sign.
        """
        number = len(self.cycles)
        if number < self._least:
            return float("nan"), float("nan")
        sums = np.stack(self.cycles)
        seen = (sums[:, 0] > 0.0).all(axis=0)
        sums = sums[:, :, seen]
        if sums.shape[2] < _LEAST_PHASES:
            return float("nan"), float("nan")
        weight = sums[:, 0]
        total = sums.sum(axis=0)
        mean, rows = total[1] / total[0], total[2:] / total[0]
        if not np.isfinite(mean).all():
            return float("inf"), float("nan")
        there = mean
        if other_m is not None:
            there = mean + acting_n * rows[LOAD]
            rows[LOAD] = other_m[seen]
        low, high = bounds(loads)
        if tolerated_nm is not None:
            rows = np.vstack([rows, tolerated_nm[seen]])
            low, high = np.append(low, -1.0), np.append(high, 1.0)
        values = bounded(rows @ rows.T, rows @ there, low, high)
        fraction = weight / total[0]
        scatter = (fraction**2 * (sums[:, 1] / weight - mean) ** 2).sum(axis=0) * number / (number - 1)
        square = ((there - values @ rows) ** 2).mean() - scatter.mean()
        return float(np.sqrt(max(square, 0.0))), float(values[LOAD])


def behind_low_pass(signature: Floats, phases: int, cutoff: float, speed: float, is_late: bool) -> Floats:
    """A torque (n,) at even steps of the crank angle as it is in the cycles of a residual, (phases,).

    Parameters
    ----------
    signature : (n,) array
    phases : int
    cutoff : float
        Of the low-pass filter [rad/s].
    speed : float
        Of the crank [rad/s].
    is_late : bool
        Whether the filter has its delay, as for instants, or none, as for averages.
    """
    order = np.arange(len(signature) // 2 + 1)
    response = 1.0 / (1.0 + 1j * order * speed / cutoff) ** 2
    smooth = np.fft.irfft(np.fft.rfft(signature) * (response if is_late else np.abs(response)))
    middles = (np.arange(phases) + 0.5) / phases * len(signature)
    return np.asarray(np.interp(middles, np.arange(len(signature)), smooth, period=len(signature)))


def averages_by_phase(
    profile: TorqueProfile,
    acting_n: float,
    lag_s: tuple[float, float],
    direction: int,
    duration_s: float,
    cutoff: float,
) -> Floats:
    """Sums (6, n) of a gait cycle of averages for `RepeatingResidual`.

    Each sample counts by the time that it stands for: where some are lost, the others weigh alone. Weights
    decrease with the time to a sample as exp(-cutoff t): as the two stages of the low-pass filter, without
    their delay.

    Parameters
    ----------
    profile : TorqueProfile
    acting_n : float
        Foot load that acted in the model.
    lag_s : (float, float)
        Delay of the torque as declared, and as estimated: the difference of two times is the derivative
        between them.
    direction : int
        1 or -1.
    duration_s : float
        Of the gait cycle.
    cutoff : float
        Of the low-pass filter [rad/s].
    """
    weight, n = profile.number, len(profile.number)
    apart = np.minimum(np.arange(n), n - np.arange(n)) / n * duration_s
    near = np.exp(-cutoff * apart)[np.abs(np.subtract.outer(np.arange(n), np.arange(n)))]
    residual = profile.measured_nm - profile.predicted_nm
    predicted = profile.predicted_nm + acting_n * profile.lever_m
    rubbing = direction * np.abs(predicted)
    columns = [weight, residual, profile.lever_m, direction * weight, predicted, rubbing]
    smooth = near @ np.stack(columns, axis=1)
    of_all = smooth[:, 0].copy()
    torque = smooth[:, 4] / np.where(of_all > 0.0, of_all, 1.0)
    rate = (np.roll(torque, -1) - np.roll(torque, 1)) * n / (2.0 * duration_s)  # along the crank's angle
    declared_s, found_s = lag_s
    more_s = min(max(found_s - declared_s, -_LONGEST_LAG_S), _LONGEST_LAG_S)

    def earlier(values: Floats, time_s: float) -> Floats:
        at = np.arange(n) - time_s * direction / duration_s * n
        return np.asarray(np.interp(at, np.arange(n), values, period=n))

    smooth[:, 1] -= (earlier(torque, declared_s) - torque) * of_all
    smooth[:, 4] = -earlier(rate, declared_s + 0.5 * more_s) * direction * of_all
    smooth[of_all < _LEAST_WEIGHT * of_all.mean()] = 0.0
    return np.asarray(smooth.T)
