"""The forecaster: growth over gait cycles, a new forecast once a minute, effects of measured clearances."""

import math
from collections.abc import Callable, Sequence
from typing import TypeVar

import attrs
import numpy as np

from leg_wear_monitor.errors import ConfigError, LegWearError
from leg_wear_monitor.estimate.cause import SURE_SIGMAS
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.loader import measured_fault, sigma_fault
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor.config.settings import Forecasting
from leg_wear_monitor.monitor.forecast.forecast import Forecast, JointCondition, forecast
from leg_wear_monitor.monitor.forecast.wear_coefficients import (
    ClearanceAtWear,
    CoefficientEstimate,
    estimate_coefficient,
    usual_prior,
    when_new,
)
from leg_wear_monitor.monitor.ledger.entry import CorrectedClearance, JointWear, Measurement
from leg_wear_monitor.monitor.verdict.verdict import table
from leg_wear_monitor.twin.statistics import CycleStatistics

# The meaning of a measured clearance.


CONTRADICTS = 0.00135  # probability of a tail: three standard deviations of a normal one

AT_LIMIT, CONTRADICTS_MODEL, NOT_STORED = "AT_LIMIT", "CONTRADICTS_MODEL", "NOT_STORED"
"""Codes that begin a service's reply in brackets if the operator has to act: ``[AT_LIMIT] A: …``."""

_SAYS_SOMETHING = 0.9  # a measurement is informative if it leaves at most this fraction of the spread


@attrs.frozen(eq=False, kw_only=True)
class MeasurementResult:
    """Meaning of a measurement.

    Attributes
    ----------
    measurement : Measurement
        To be noted in the ledger.
    before, after : CoefficientEstimate
        Of the joint's wear coefficient.
    contradicts : bool
        True if the model holds it next to impossible.
    modelled_m : float
        Clearance that the twin had modelled for this part.
    shown_m, shown_sigma_m, shown_by : float, float, str
        Estimate of the joint by encoders or the drive torque before, with its source in words; NaN and empty
        without an estimate.
    eased : str
        Effect on an alarm that an earlier measurement had raised: a name of a sentence; empty if it stays.
    limit_m : float
        Limit of the joint's clearance.
    """

    measurement: Measurement
    before: CoefficientEstimate
    after: CoefficientEstimate
    contradicts: bool
    modelled_m: float
    shown_m: float = math.nan
    shown_sigma_m: float = math.nan
    shown_by: str = ""
    eased: str = ""
    limit_m: float = math.nan

    @property
    def agrees(self) -> bool:
        """True if the measurement agrees with the estimate by encoders or the drive torque."""
        sigma_m = math.hypot(self.measurement.sigma_m, self.shown_sigma_m)
        return abs(self.measurement.clearance_m - self.shown_m) <= SURE_SIGMAS * sigma_m  # not with NaN

    @property
    def findings(self) -> tuple[str, ...]:
        """Names of the sentences on this measurement in the table of the verdict."""
        now, found = self.measurement, ["measured", "modelled"]
        found += ["at_limit"] if now.clearance_m >= self.limit_m else []
        found += [self.eased] if self.eased else []
        if self.agrees:
            found.append("agrees")
        elif math.isfinite(self.shown_m + self.shown_sigma_m):
            found.append("differs")
        if self.contradicts and self.agrees:  # the modelled wear is wrong, not the measurement
            found.append("not_by_wear")
        elif self.contradicts:
            found.append("accepted" if now.counts else "not_accepted")
        if now.counts:
            is_informative = self.after.sigma <= _SAYS_SOMETHING * self.before.sigma
            found.append("coefficient" if is_informative else "adds_little")
        return tuple(found)

    @property
    def lines(self) -> tuple[str, ...]:
        """The measurement and its effects for operators, one line each."""
        now, texts = self.measurement, table().measurement
        low, middle, high = np.exp(self.after.log_factors((0.1, 0.5, 0.9))).tolist()
        words = {
            "joint": now.joint,
            "size": f"{_mm(now.clearance_m)} ± {_mm(now.sigma_m)}",
            "cycles": now.cycles,
            "modelled": _mm(self.modelled_m),
            "limit": _mm(self.limit_m),
            "by": self.shown_by,
            "shown": f"{_mm(self.shown_m)} ± {_mm(self.shown_sigma_m)}",
            "more": "larger" if now.expected_below > 0.5 else "smaller",
            "factors": f"{middle:.3g} times the nominal one, {low:.3g} to {high:.3g} (p10 to p90)",
            "narrower": f"{self.before.sigma / self.after.sigma:.3g}",
        }
        return tuple(texts[name].format(**words) for name in self.findings)

    @property
    def codes(self) -> list[str]:
        """Codes of the findings on which the caller has to act."""
        at_limit = [AT_LIMIT] if self.measurement.clearance_m >= self.limit_m else []
        return at_limit + ([CONTRADICTS_MODEL] if self.contradicts and not self.agrees else [])


def with_codes(codes: Sequence[str], reply: str) -> str:
    """A reply of a service that begins with codes; `has_codes` finds them."""
    return f"[{', '.join(codes)}] {reply}" if codes else reply


def has_codes(reply: str) -> bool:
    """True if a service's reply has a code: the operator has to act."""
    return reply.startswith("[")


def _mm(value_m: float) -> str:
    return f"{1.0e3 * value_m:.4g} mm"


# Mean growth over gait cycles: single cycles of a chaotic motion scatter.


GROWTH_CYCLES = 30  # over which the reported growth is averaged
LEAST_CYCLES = 10
LARGEST_ERROR = 0.5  # fraction of the mean: beyond it, the mean says nothing

_BATCHES = 5  # batches of six cycles in a window of thirty: longer than the correlation of neighbours
# five means leave four degrees of freedom: Student's t, not a normal distribution. With this factor, a normal
# distribution has the same interval from p10 to p90 as t: 1.533 standard errors, not 1.282
_WIDER = 1.533 / 1.282


@attrs.frozen
class GrowthRate:
    """Mean growth over a window.

    Attributes
    ----------
    per_cycle_m, sampling_m : float
        A gait cycle, and the uncertainty of this mean because single cycles scatter.
    per_second_m : float
        A second of walking.
    """

    per_cycle_m: float
    sampling_m: float
    per_second_m: float

    def error_m(self, model_error: float) -> float:
        """Uncertainty of a gait cycle's growth in this leg: of the mean, and of the model.

        As of a normal distribution: 80 % lie within 1.28 of it either way.

        Parameters
        ----------
        model_error : float
            Standard deviation of the relative growth.
        """
        return math.hypot(self.sampling_m, model_error * self.per_cycle_m)


def growth_rate(growth_m: Floats, moving_s: Floats) -> GrowthRate | None:
    """Mean growth, None while there is not enough data to know it.

    A mean is used and not a median: wear comes in bursts, and means add up. Neighbouring cycles of a chaotic
    motion are correlated, so the scatter is computed from the means of batches.

    Parameters
    ----------
    growth_m : (n,) array
        Growth of the mean clearance in each of the last gait cycles.
    moving_s : (n,) array
        Time in motion of each.
    """
    if len(growth_m) < LEAST_CYCLES:
        return None
    mean, sampling = float(growth_m.mean()), _WIDER * _standard_error(growth_m)
    if not sampling <= LARGEST_ERROR * abs(mean):
        return None
    return GrowthRate(mean, sampling, float(growth_m.sum() / moving_s.sum()))


def _standard_error(values: Floats) -> float:
    size = len(values) // _BATCHES
    means = values[len(values) - _BATCHES * size :].reshape(_BATCHES, size).mean(axis=1)
    return float(means.std(ddof=1) / math.sqrt(_BATCHES))


# Forecasts as gait cycles come in: renewed once a minute of their stamps, or when more is known.


_T = TypeVar("_T")

RENEWED_NS = 60_000_000_000


class Forecaster:
    """Forecasts all clearance joints, and the leg.

    Parameters
    ----------
    mechanism : Mechanism
        As the configuration wants it.
    settings : Forecasting
    measurements : sequence of Measurement
        Of the ledger.
    replaced_ns : sequence of int
        When each joint's part was replaced, 0 if it never was.
    corrections : sequence of CorrectedClearance
        Of the ledger.

    Attributes
    ----------
    coefficient_estimates : tuple of CoefficientEstimate
    measurements, corrections : tuples of Measurement and of CorrectedClearance
        Of the ledger, and since.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        settings: Forecasting,
        measurements: Sequence[Measurement],
        replaced_ns: Sequence[int],
        corrections: Sequence[CorrectedClearance] = (),
    ) -> None:
        self._settings, self._clearance_joints = settings, mechanism.clearance_joints
        self._clearances = [mechanism.clearances[joint] for joint in mechanism.clearance_joints]
        self._fresh_m = [clearance.radial_clearance for clearance in self._clearances]
        # growth of each joint's clearance, and time in motion (2, n), of the last gait cycles of its part
        self._cycles: tuple[Floats, ...] = (np.zeros((2, 0)),) * len(self._fresh_m)
        self.measurements, self.corrections = tuple(measurements), tuple(corrections)
        self._last: Forecast | None = None  # None before the first, and when something is new
        self._stamp_ns, self._known = 0, 0  # stamp of the last forecast; joints whose growth was known then
        self.coefficient_estimates = tuple(
            self._estimate(k, when) for k, when in zip(range(len(self._fresh_m)), replaced_ns, strict=True)
        )

    def after(
        self,
        statistics: CycleStatistics,
        wear_m: Floats,
        limits_m: Sequence[float],
        is_valid: Callable[[], bool],
        load_sigma: float,
    ) -> Forecast:
        """Forecast after a gait cycle: a new one if it is due, else the last.

        Parameters
        ----------
        statistics : CycleStatistics
        wear_m : (k,) array
            Wear modelled by the twin for each part [m].
        limits_m : sequence of float
            Of the mean clearances.
        is_valid : callable
            True if the leg is in the range of the model.
        load_sigma : float
            Standard deviation of an estimated load, as a fraction of it; growth is at most in proportion.
        """
        longest, moving_s = self._settings.window_cycles, statistics.moving_s
        self._cycles = tuple(
            np.column_stack([cycles, [growth_m, moving_s]])[:, -longest:]
            for cycles, growth_m in zip(self._cycles, statistics.growth_mean_m.tolist(), strict=True)
        )
        is_recent = 0 <= statistics.stamp_ns - self._stamp_ns < RENEWED_NS
        if self._last is None or not is_recent or _known(self._rates) > self._known:
            self._stamp_ns = statistics.stamp_ns
            return self.renewed(wear_m, limits_m, is_valid(), load_sigma)
        return self._last

    def renewed(
        self,
        wear_m: Floats,
        limits_m: Sequence[float],
        is_valid: bool,
        load_sigma: float,
    ) -> Forecast:
        """A new forecast from the present state; parameters as in `after`."""
        rates = self._rates
        self._known = _known(rates)
        now = [
            JointCondition(
                joint=joint,
                fresh_m=self._fresh_m[k],
                wear_m=float(wear_m[k]),
                limit_m=limits_m[k],
                growth_m=rate.per_cycle_m if rate else None,
                growth_error_m=rate.error_m(load_sigma) if rate else 0.0,
                has_coefficient=max(self._clearances[k].wear_coefficient) > 0.0,
            )
            for k, (joint, rate) in enumerate(zip(self._clearance_joints, rates, strict=True))
        ]
        # a new part has fewer gait cycles than the parts of the other joints
        moving_s = max((moving_s for _, moving_s in self._cycles), key=len)
        self._last = forecast(
            now,
            self.coefficient_estimates,
            self._settings,
            cycle_s=float(np.mean(moving_s)),
            valid=is_valid,
        )
        return self._last

    @property
    def _rates(self) -> list[GrowthRate | None]:
        """Growth of each joint's clearance over its window; None while there is not enough data."""
        return [growth_rate(*cycles) for cycles in self._cycles]

    def last_rate(self, k: int) -> GrowthRate | None:
        """Growth of the clearance of joint k over the last gait cycles; None without enough data."""
        return growth_rate(*self._cycles[k][:, -GROWTH_CYCLES:])

    def expire(self) -> None:
        """Make a new forecast after the next gait cycle, because its inputs have changed."""
        self._last = None

    def last_measured(self, replaced_ns: Sequence[int]) -> tuple[Measurement | None, ...]:
        """Last measurement of each joint's present part, None without one."""
        parts = zip(self._clearance_joints, replaced_ns, strict=True)
        return tuple(
            next((one for one in reversed(self._of_part(*part)) if not one.is_withdrawn), None)
            for part in parts
        )

    def _of_part(self, joint: str, replaced_ns: int) -> list[Measurement]:
        """Measurements of one part of a joint, including withdrawn ones."""
        return [one for one in self.measurements if (one.joint, one.replaced_ns) == (joint, replaced_ns)]

    def replaced(self, joint: str, replaced_ns: int) -> None:
        """Forget the growth of a joint, and estimate its coefficient from all that is known of its part."""
        self._cycles = _with(self._cycles, self._clearance_joints.index(joint), np.zeros((2, 0)))
        self.estimate_anew(joint, replaced_ns)

    def estimate_anew(self, joint: str, replaced_ns: int) -> None:
        """Estimate the wear coefficient of a joint from all that is known of its part."""
        k = self._clearance_joints.index(joint)
        self._update_coefficients(k, self._estimate(k, replaced_ns))

    def corrected(
        self, wear: JointWear, clearance_m: float, sigma_m: float, stamp_ns: int, factor: float = 1.0
    ) -> CorrectedClearance:
        """Start the wear of a joint again from a known clearance; see `CorrectedClearance`."""
        correction = CorrectedClearance(
            stamp_ns=stamp_ns,
            joint=wear.name,
            clearance_m=clearance_m,
            sigma_m=sigma_m,
            wear_m=wear.mean_m,
            replaced_ns=wear.replaced_ns,
            measurements=len(self._of_part(wear.name, wear.replaced_ns)),
            factor=factor,
        )
        self.corrections += (correction,)
        self.replaced(wear.name, wear.replaced_ns)
        return correction

    def other_coefficient(self, wear: JointWear, now_per_pa: float, stamp_ns: int) -> CorrectedClearance:
        """Start the wear of a joint again, because its wear coefficient has changed."""
        estimate = self.coefficient_estimates[self._clearance_joints.index(wear.name)]
        return self.corrected(
            wear,
            estimate.clearance_m(wear.mean_m),
            estimate.clearance_sigma_m(wear.mean_m),
            stamp_ns,
            now_per_pa / wear.wear_coefficient_per_pa,
        )

    def measured(
        self,
        wear: JointWear,
        *,
        clearance_m: float,
        sigma_m: float,
        stamp_ns: int,
        who: str,
        accept: bool = False,
        limit_m: float = math.nan,
    ) -> MeasurementResult:
        """Update with a measured clearance.

        Parameters
        ----------
        wear : JointWear
            The joint's present part. The measurement counts for the wear in it, whatever the clock says.
        clearance_m, sigma_m : float
            Radial, and its standard deviation.
        stamp_ns : int
            By the clock.
        who : str
        accept : bool
            True if it counts even if it contradicts the model.
        limit_m : float
            Limit of the clearance.

        Raises
        ------
        ConfigError
            For impossible values: they are likely meant in a different unit.
        """
        k, joint = self._clearance_joints.index(wear.name), wear.name
        fresh_m, radius_m = self._fresh_m[k], self._clearances[k].bushing_radius
        for name, fault in (
            ("clearance", measured_fault(joint, fresh_m, radius_m, clearance_m)),
            ("sigma", sigma_fault(clearance_m, sigma_m)),
        ):
            if fault:
                raise ConfigError(name, "", fault)
        before = self._estimate(k, wear.replaced_ns)
        below = before.probability_below(ClearanceAtWear(clearance_m, sigma_m, wear.mean_m))
        contradicts = not CONTRADICTS <= below <= 1.0 - CONTRADICTS
        new = Measurement(
            stamp_ns=stamp_ns,
            joint=joint,
            who=who,
            clearance_m=clearance_m,
            sigma_m=sigma_m,
            wear_m=wear.mean_m,
            cycles=wear.cycles,
            replaced_ns=wear.replaced_ns,
            expected_below=below,
            counts=accept or not contradicts,
        )
        self.measurements = (*self.measurements, new)
        self.estimate_anew(joint, wear.replaced_ns)
        return MeasurementResult(
            measurement=new,
            before=before,
            after=self.coefficient_estimates[k],
            contradicts=contradicts,
            modelled_m=fresh_m + wear.mean_m,
            limit_m=limit_m,
        )

    def withdrawn(self, number: int, stamp_ns: int, who: str) -> Measurement:
        """Withdraw the measurement with an `id`; the estimate of its joint is renewed by `estimate_anew`."""
        found = {one.id: one for one in self.measurements if one.id}
        if number not in found or found[number].is_withdrawn:
            fault = "is withdrawn already" if number in found else "is not in the ledger"
            raise LegWearError(f"measurement {number}: {fault}")
        now = attrs.evolve(found[number], withdrawn_ns=stamp_ns, withdrawn_by=who)
        measurements = self.measurements
        self.measurements = tuple(now if one.id == number else one for one in measurements)
        return now

    def best_estimate_m(self, k: int, modelled_m: float) -> float:
        """Median of the clearance of joint k from wear model and measurements; NaN without a measurement."""
        estimate = self.coefficient_estimates[k]
        return estimate.clearance_m(modelled_m - self._fresh_m[k]) if estimate.observations else math.nan

    def use_estimate(self, k: int, observation: ClearanceAtWear, replaced_ns: int) -> bool:
        """Update with a clearance estimated from encoders, instead of the previous one.

        Parameters
        ----------
        k : int
            Of the clearance joint.
        observation : ClearanceAtWear
            Its error does not average out, so only the newest counts.
        replaced_ns : int
            When its part was replaced, 0 if it never was.

        Returns
        -------
        bool
            True if it is used: not if its tail probability is below `CONTRADICTS`.
        """
        estimate = self._estimate(k, replaced_ns)
        below = estimate.probability_below(observation)
        is_plausible = CONTRADICTS <= below <= 1.0 - CONTRADICTS
        self._update_coefficients(
            k, self._estimate(k, replaced_ns, observation) if is_plausible else estimate
        )
        return is_plausible

    def _estimate(self, k: int, replaced_ns: int, *further: ClearanceAtWear) -> CoefficientEstimate:
        """Estimate for a part, from its prior, the measurements that count, and further ones."""
        part, number = (self._clearance_joints[k], replaced_ns), 0
        measured = self._of_part(*part)
        known, prior = when_new(self._settings, self._fresh_m[k]), usual_prior(self._clearances[k])
        for one in self.corrections:
            if (one.joint, one.replaced_ns) == part:
                before = estimate_coefficient(known, _counting(measured[number : one.measurements]), prior)
                if before.sigma < _SAYS_SOMETHING * prior.sigma:  # otherwise only the nominal one is known
                    mean = before.mean - math.log(one.factor)
                    prior = attrs.evolve(prior, mean=mean, sigma=before.sigma)
                known, number = ClearanceAtWear(one.clearance_m, one.sigma_m, one.wear_m), one.measurements
        found = estimate_coefficient(known, [*_counting(measured[number:]), *further], prior)
        return attrs.evolve(found, observations=len(_counting(measured)) + len(further))

    def _update_coefficients(self, k: int, coefficient_estimate: CoefficientEstimate) -> None:
        self.coefficient_estimates = _with(self.coefficient_estimates, k, coefficient_estimate)
        self._last = None


def _counting(measured: Sequence[Measurement]) -> list[ClearanceAtWear]:
    """Measurements that the forecast uses."""
    counting = (one for one in measured if one.counts and not one.is_withdrawn)
    return [ClearanceAtWear(one.clearance_m, one.sigma_m, one.wear_m) for one in counting]


def _known(rates: Sequence[GrowthRate | None]) -> int:
    return sum(rate is not None for rate in rates)


def _with(values: tuple[_T, ...], k: int, new: _T) -> tuple[_T, ...]:
    """Values with a new value at k."""
    return (*values[:k], new, *values[k + 1 :])
