"""Statistics of a gait cycle from its sums."""

import numpy as np

from leg_wear_monitor.compiled.kernel import Record
from leg_wear_monitor.contact.arrays import ContactArrays
from leg_wear_monitor.dynamics.run import ARCHARD, FORCE, RunStatistics, percentile
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.twin.following import FRICTION, LAG, LOAD, LOAD_FRICTION, REGRESSORS
from leg_wear_monitor.twin.sample import LOADS_N
from leg_wear_monitor.twin.statistics import (
    CycleStatistics,
    LoadProfile,
    NotCompared,
    TorqueProfile,
    TorqueStatistics,
)

# Foot load, frictions and lag of the drive from the residual of its torque (physics.md section 9).
#
# By virtual work, a load F at the toe needs the drive torque -F dy/dtheta. If the load depends on the toe's
# height alone, this torque has no mean over a turn, while a constant friction torque has only a mean: the two
# are orthogonal. A lag tau changes the torque by -tau dT/dt. A gear loses a fraction of the torque that it
# transmits. The four parameters are estimated by least squares over each gait cycle and filtered over cycles
# by their scatter. Friction of the drive does not load the joints; the foot load does.


LEAST_SAMPLES = 8
_SMALL = 1.0e-9
# prior standard deviations of the four around 0 [N, N m, s, -], and random walk per cycle
_UNKNOWN = np.array([1000.0, 10.0, 0.02, 0.2])
_DRIFT = np.array([1.0, 0.02, 1.0e-4, 1.0e-3])
MOST_LOAD_FRICTION = 0.45  # planetary servos have up to 0.31 (config/drives)
_SUDDEN = 3.0  # a deviation of this many standard deviations counts as a sudden change
_ACTS_ABOVE, _CEASES_BELOW = 3.0, 2.0  # standard deviations from 0 at which a load begins and ceases to act


def find(
    sums: Record, correlated: float, loads: tuple[float, float] = (-np.inf, np.inf)
) -> tuple[Floats, Floats, float] | None:
    """Least-squares estimate of the four parameters from the sums of a cycle.

    Parameters
    ----------
    sums : Record
        `TORQUE_SUMS` of the cycle.
    correlated : float
        Number of samples per independent sample, because of the low-pass filter.
    loads : (float, float)
        Least and largest possible load minus the acting load [N].

    Returns
    -------
    values, sigma, left : (4,) array, (4,) array and float, or None
        Values, which are not bounded, their standard deviations, and the RMS residual [N m] of values within
        their bounds; None without enough samples. For a mechanism without a toe, the load is 0 with a
        standard deviation of 0.
    """
    gram, along = sums.gram, sums.along
    scale = np.sqrt(np.diag(gram))
    active = scale > _SMALL * max(scale.max(), _SMALL)
    if sums.number < LEAST_SAMPLES or not active[FRICTION]:
        return None
    scaled = gram[np.ix_(active, active)] / np.outer(scale[active], scale[active])
    if not float(np.linalg.cond(scaled)) ** 0.5 < 1.0 / _SMALL:
        return None
    inverse = np.linalg.inv(scaled) / np.outer(scale[active], scale[active])
    values, sigma = np.zeros(REGRESSORS), np.zeros(REGRESSORS)
    values[active] = inverse @ along[active]
    likely = bounded(gram, along, *bounds(loads))
    square = float(sums.residual_squares - 2.0 * likely @ along + likely @ gram @ likely)
    left = max(square, 0.0) / sums.weight
    sigma[active] = np.sqrt(left * max(correlated, 1.0) * np.diag(inverse))
    return values, sigma, float(left**0.5)


def bounded(gram: Floats, along: Floats, low: Floats, high: Floats) -> Floats:
    """Least squares (n,) within bounds: values outside are set to their bounds, the furthest first.

    Parameters
    ----------
    gram : (n, n) array
        Products of the regressors with each other; zeros for an absent regressor, whose value is 0.
    along : (n,) array
        Products of the regressors with the quantity to be explained.
    low, high : (n,) arrays
    """
    scale = np.sqrt(np.diag(gram))
    free = scale > _SMALL * max(scale.max(), _SMALL)
    values = np.zeros(len(along))
    while free.any():
        by = scale[free]
        rest = (along - gram @ np.where(free, 0.0, values))[free] / by
        values[free] = np.linalg.lstsq(gram[np.ix_(free, free)] / np.outer(by, by), rest, rcond=None)[0] / by
        beyond = np.where(free, np.maximum(np.maximum(low - values, values - high), 0.0), 0.0) * scale
        worst = int(beyond.argmax())
        if not beyond[worst] > 0.0:
            break
        values[worst], free[worst] = min(max(float(values[worst]), low[worst]), high[worst]), False
    return values


def bounds(loads: tuple[float, float]) -> tuple[Floats, Floats]:
    """Least and largest possible values (4,) of load, friction, lag and load friction."""
    low, high = np.full(REGRESSORS, -np.inf), np.full(REGRESSORS, np.inf)
    low[[LOAD, LOAD_FRICTION]] = loads[0], 0.0
    high[[LOAD, LOAD_FRICTION]] = loads[1], MOST_LOAD_FRICTION
    return low, high


class LoadEstimate:
    """Load [N], friction [N m], lag [s] and load friction, filtered over cycles; each is a random walk.

    Attributes
    ----------
    values : (4,) array
    acting : float
        The load that acts on the leg [N].
    """

    def __init__(self) -> None:
        self.values, self.acting = np.zeros(REGRESSORS), 0.0
        self._variance = _UNKNOWN**2

    @property
    def sigma(self) -> Floats:
        """Standard deviations (4,) of the values."""
        return np.asarray(np.sqrt(self._variance))

    @property
    def room(self) -> tuple[float, float]:
        """Least and largest possible load minus the acting load [N]."""
        return LOADS_N[0] - self.acting, LOADS_N[1] - self.acting

    def take(self, found: Floats, sigma: Floats, acts: bool) -> None:
        """Update by a cycle's estimate (4,); ``acts``: whether a significant load acts on the leg."""
        values, variance = self.values, self._variance
        measured = found.copy()
        measured[LOAD] += self.acting
        variance += _DRIFT**2
        surprise = measured - values
        sudden = surprise**2 > _SUDDEN**2 * (variance + sigma**2)
        variance += np.where(sudden, surprise**2, 0.0)
        gain = variance / (variance + sigma**2 + _SMALL)
        values += gain * surprise
        variance *= 1.0 - gain
        values[LOAD] = np.clip(values[LOAD], *LOADS_N)
        values[LOAD_FRICTION] = np.clip(values[LOAD_FRICTION], 0.0, MOST_LOAD_FRICTION)
        enough = (_CEASES_BELOW if self.acting else _ACTS_ABOVE) * self.sigma[LOAD]
        self.acting = float(values[LOAD]) if acts and abs(values[LOAD]) > enough else 0.0


def clear_run_statistics(statistics: RunStatistics) -> None:
    """Empty run statistics in place."""
    for part in statistics:
        part[...] = 0
    statistics.drive_range[:] = np.inf, -np.inf


def clearances(contacts: ContactArrays, depth: Floats) -> Floats:
    """Mean and largest radial clearance (2, k) [m] of worn joints, depth (k, 2, N)."""
    opened = depth.sum(axis=1)
    return np.stack([contacts.clearance + opened.mean(axis=1), contacts.clearance + opened.max(axis=1)])


def torque_statistics(sums: Record, settled: LoadEstimate, unexplained_nm: float) -> TorqueStatistics:
    """Torque statistics of one cycle.

    Parameters
    ----------
    sums : Record
        `TORQUE_SUMS` of the cycle.
    settled : LoadEstimate
        Estimate filtered over cycles.
    unexplained_nm : float
        RMS of the unexplained residual over the last cycles that were compared.
    """
    n, weight = int(sums.number), sums.weight

    def rms(squares: float) -> float:
        return float(np.sqrt(squares / weight)) if n else np.nan

    load, friction, lag, load_friction = settled.values.tolist()
    return TorqueStatistics(
        samples=n,
        measured_rms_nm=rms(sums.measured_squares),
        predicted_rms_nm=rms(sums.predicted_squares),
        residual_rms_nm=rms(sums.residual_squares),
        unexplained_rms_nm=unexplained_nm,
        load_n=load,
        load_sigma_n=float(settled.sigma[LOAD]),
        load_acting_n=settled.acting,
        friction_nm=friction,
        torque_lag_s=lag,
        load_friction=load_friction,
        load_friction_sigma=float(settled.sigma[LOAD_FRICTION]),
        friction_sigma_nm=float(settled.sigma[FRICTION]),
        torque_lag_sigma_s=float(settled.sigma[LAG]),
    )


def torque_profile(sums: Record, acting_n: float) -> TorqueProfile:
    """Torques of a cycle by phase; ``acting_n`` is the foot load in the model [N]."""
    number, angle, measured, predicted, lever = sums.profile.copy()
    return TorqueProfile(number, angle, measured, predicted - acting_n * lever, lever)


def load_profile(leg: Record) -> LoadProfile | None:
    """Foot load of the cycle of a `LEG_STATE`; None without a sample."""
    sums = leg.load
    if not sums.samples:
        return None
    number, *force = sums.profile.copy()
    return LoadProfile(
        1.0e-9 * float(sums.gap_ns), float(sums.least), float(sums.largest), number, np.stack(force)
    )


def cycle_statistics(
    leg: Record, stamp: int, contacts: ContactArrays, depth: Floats, before: Floats,
    statistics: RunStatistics, torque: TorqueStatistics, profile: TorqueProfile,
    not_compared: NotCompared | None, load_peak_n: float,
) -> CycleStatistics:  # fmt: skip
    """Statistics of a cycle at its end from a `LEG_STATE`; ``before`` (2, k) [m]: initial clearances."""
    joint, moving = contacts.joint, float(statistics.time[0])
    motion, now = leg.motion, clearances(contacts, depth)
    return CycleStatistics(
        cycle=int(motion.cycles),
        begin_ns=int(motion.cycle_begin_ns),
        stamp_ns=stamp,
        direction=1 if motion.cut_rises else -1,
        moving_s=moving,
        bridged_s=float(motion.cycle_bridged_ns) * 1.0e-9,
        peak_force_n=statistics.peak[joint],
        p99_force_n=np.array([percentile(statistics.force_time[j], 0.99) for j in joint]),
        mean_force_n=statistics.integral[joint, FORCE] / moving,
        impacts=statistics.impacts[joint],
        archard_j=statistics.integral[joint, ARCHARD],
        clearance_mean_m=now[0],
        clearance_max_m=now[1],
        growth_mean_m=now[0] - before[0],
        torque=torque,
        torque_profile=profile,
        not_compared=not_compared,
        load=load_profile(leg),
        load_peak_n=load_peak_n,
    )


# The part of the torque residual that repeats over gait cycles, by crank phase (physics.md section 9).
#
# A lost sample, a wrong stamp, noise or a random impact changes one gait cycle, but not the next cycle at the
# same phase. Such a residual shows as scatter over cycles, and is subtracted. A residual from a wrong leg
# model repeats.


# gait cycles whose mean is taken, and how many are needed; fewer have more scatter, more have a longer delay
# (tuned on the synthetic leg in full coordinates at 60 rpm: knocks in A and G, lost samples, late stamps)
CYCLES, LEAST_CYCLES = 4, 3  # cycles for averages
INSTANT_CYCLES = 8  # cycles for instants, whose scatter is larger
_LEAST_PHASES = 8
_LONGEST_LAG_S = 0.01  # beyond the declared lag: a larger lag is an input fault, and is not explained
_LEAST_WEIGHT = 0.05  # weight of a phase over the mean weight; less comes from samples elsewhere in the turn


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
        self, loads: tuple[float, float] = (-np.inf, np.inf), tolerated_nm: Floats | None = None
    ) -> float:
        """RMS [N m] of the repeating residual without load, frictions and lag.

        The squared standard error of the mean over cycles is subtracted, so that pure scatter gives 0 on
        average. NaN without enough cycles.

        Parameters
        ----------
        loads : (float, float)
            Least and largest possible load of the residual [N].
        tolerated_nm : (phases,) array, optional
            Torque that is tolerated up to this size, with either sign.
        """
        number = len(self.cycles)
        if number < self._least:
            return float("nan")
        sums = np.stack(self.cycles)
        seen = (sums[:, 0] > 0.0).all(axis=0)
        sums = sums[:, :, seen]
        if sums.shape[2] < _LEAST_PHASES:
            return float("nan")
        weight = sums[:, 0]
        total = sums.sum(axis=0)
        mean, rows = total[1] / total[0], total[2:] / total[0]
        if not np.isfinite(mean).all():
            return float("inf")
        low, high = bounds(loads)
        if tolerated_nm is not None:
            rows = np.vstack([rows, tolerated_nm[seen]])
            low, high = np.append(low, -1.0), np.append(high, 1.0)
        values = bounded(rows @ rows.T, rows @ mean, low, high)
        fraction = weight / total[0]
        scatter = (fraction**2 * (sums[:, 1] / weight - mean) ** 2).sum(axis=0) * number / (number - 1)
        square = ((mean - values @ rows) ** 2).mean() - scatter.mean()
        return float(np.sqrt(max(square, 0.0)))


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
        True if the filter has its delay, as for instants; False for averages.
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

    Each sample is weighted by its duration, so lost samples have no weight. Weights
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
