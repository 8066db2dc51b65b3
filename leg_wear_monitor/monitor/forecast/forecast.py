"""Remaining life of the joints and the leg, with its uncertainty: a distribution over all unknown quantities.

An ensemble of legs samples every joint's wear coefficient and clearance, the growth's own scatter and the
future load. In each leg all joints grow together until each has reached its limit (`cycles_to`).
"""

import math
from collections.abc import Mapping, Sequence
from enum import Enum
from functools import cache
from statistics import NormalDist

import attrs
import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.monitor.config.settings import Forecasting
from leg_wear_monitor.monitor.forecast.wear_coefficients import (
    CoefficientEstimate,
    CoefficientPrior,
)

# Draws of an ensemble: fixed, the same at every call, and spread evenly instead of at random.


MEMBERS = 1021
_MULTIPLIER = 333
_SHIFT = 631  # shifts each dimension by a different amount, so that no member is extreme in all dimensions


@cache
def even_fractions(dimensions: int) -> Floats:
    """Numbers in (0, 1), shape (dimensions, MEMBERS): a lattice of Korobov's.

    Each dimension has the same evenly spaced numbers, in a different order. With this multiplier every two of
    16 dimensions, which five joints need, are filled like a good two-dimensional lattice: lines that hold all
    members are at most 1/15 apart, where 1/34 is the least that could be.
    """
    member = np.arange(MEMBERS)
    rows = [
        (member * pow(_MULTIPLIER, axis, MEMBERS) + axis * _SHIFT) % MEMBERS for axis in range(dimensions)
    ]
    fractions = (np.array(rows) + 0.5) / MEMBERS
    fractions.flags.writeable = False
    return fractions


@cache
def even_normals(dimensions: int) -> Floats:
    """The same lattice as standard normal numbers."""
    inverse = np.array([NormalDist().inv_cdf((i + 0.5) / MEMBERS) for i in range(MEMBERS)])
    normals = inverse[np.floor(even_fractions(dimensions) * MEMBERS).astype(int)]
    normals.flags.writeable = False
    return np.asarray(normals)


class Answer(Enum):
    """Possible answers of the forecast; the value is human-readable."""

    KNOWN = "from the growth so far and its uncertainty"
    PARTLY_KNOWN = "of the joints whose growth is known; the others are not included"
    AT_LIMIT = "at its limit"
    NOT_ENOUGH_DATA = "not enough data for a growth rate yet"
    OUTSIDE_VALIDITY = "not valid: the model does not hold for this cadence, torque, clearance or load"
    NO_GROWTH = "clearance does not grow"
    NO_COEFFICIENT = "not known: the joint has no wear coefficient"


@attrs.frozen
class Quantiles:
    """Quantiles of an uncertain value.

    Attributes
    ----------
    p10 : float
        Value that is not exceeded with a probability of 10 %.
    p50 : float
        Value that is not exceeded with a probability of 50 %.
    p90 : float
        Value that is not exceeded with a probability of 90 %.
    """

    p10: float
    p50: float
    p90: float


@attrs.frozen(kw_only=True)
class JointForecast:
    """A joint's remaining life.

    Attributes
    ----------
    answer : Answer
        Answer of the forecast.
    cycles : Quantiles or None
        Gait cycles until the mean clearance reaches its limit; None unless known (0 at the limit).
    hours : Quantiles or None
        Hours of walking until then.
    clearance_m : Quantiles or None
        The present clearance, as far as it is known; None if the verdict marks it as not valid.
    measurements : int
        Measured clearances of this part that are in it.
    prior : CoefficientPrior or None
        Prior of its wear coefficient before any measurement of this part, and the regime that it holds for;
        None in a file of an older version.
    """

    answer: Answer
    cycles: Quantiles | None
    hours: Quantiles | None
    clearance_m: Quantiles | None
    measurements: int
    prior: CoefficientPrior | None = None

    @property
    def now_m(self) -> float:
        """Median of the clearance now; NaN if there is no valid estimate."""
        return self.clearance_m.p50 if self.clearance_m else math.nan


@attrs.frozen(kw_only=True)
class LegForecast:
    """The leg's remaining life: until the first of its joints reaches its limit.

    Attributes
    ----------
    answer : Answer
        Answer of the forecast.
    cycles : Quantiles or None
        Gait cycles; None unless known.
    hours : Quantiles or None
        Hours of walking; None unless known.
    first_probability : dict of str to float
        Probability that this joint is the first; empty unless known.
    """

    answer: Answer
    cycles: Quantiles | None
    hours: Quantiles | None
    first_probability: dict[str, float]

    @property
    def first(self) -> str | None:
        """The joint that is most likely the first."""
        return max(self.first_probability, key=lambda j: self.first_probability[j], default=None)


@attrs.frozen(kw_only=True)
class Forecast:
    """All joints', in the order of the clearance joints, and the leg's."""

    joints: tuple[JointForecast, ...]
    leg: LegForecast


@attrs.frozen(kw_only=True)
class JointCondition:
    """A joint as the twin has it, with the nominal wear coefficient.

    Attributes
    ----------
    joint : str
    fresh_m, wear_m, limit_m : float
        Clearance when new, wear since, and limit of the mean clearance.
    growth_m : float or None
        Of the mean clearance in a gait cycle; None while there is not enough data.
    growth_error_m : float
        Standard error of `growth_m`, by the scatter of cycles and the uncertainty of an estimated load. The
        error of the model is not in it: it is the same in all cycles of a leg, and belongs to the factor of
        the wear coefficient, which a measured clearance corrects.
    has_coefficient : bool
        True if its wear coefficient is above 0; without one no wear is modelled.
    """

    joint: str
    fresh_m: float
    wear_m: float
    limit_m: float
    growth_m: float | None
    growth_error_m: float
    has_coefficient: bool = True

    def answer(self, clearance_m: float, valid: bool) -> Answer:
        """Answer for the joint, assuming its clearance."""
        if clearance_m >= self.limit_m:
            return Answer.AT_LIMIT
        if not valid:
            return Answer.OUTSIDE_VALIDITY
        if not self.has_coefficient:
            return Answer.NO_COEFFICIENT
        if self.growth_m is None:
            return Answer.NOT_ENOUGH_DATA
        return Answer.KNOWN if self.growth_m > 0.0 else Answer.NO_GROWTH


def forecast(
    now: Sequence[JointCondition],
    estimates: Sequence[CoefficientEstimate],
    settings: Forecasting,
    *,
    cycle_s: float,
    valid: bool,
) -> Forecast:
    """Remaining life of all clearance joints, and of the leg.

    Parameters
    ----------
    now : sequence of JointCondition
    estimates : sequence of CoefficientEstimate
        Of their wear coefficients.
    settings : Forecasting
    cycle_s : float
        Time of a gait cycle.
    valid : bool
        True if the model is valid for the present operation of the leg.
    """
    clearance_m, growth_m = _legs(now, estimates, settings)
    clearances = [quantiles(row) for row in clearance_m]
    answers = [each.answer(q.p50, valid) for each, q in zip(now, clearances, strict=True)]
    fresh_m, limit_m = (np.array([[getattr(each, name)] for each in now]) for name in ("fresh_m", "limit_m"))
    ends = cycles_to(limit_m, clearance_m, growth_m, fresh_m)
    ends[[answer is Answer.AT_LIMIT for answer in answers]] = 0.0
    joints = tuple(
        JointForecast(
            answer=a, **_life(a, end, cycle_s), clearance_m=q, measurements=one.observations, prior=one.prior
        )
        for a, end, q, one in zip(answers, ends, clearances, estimates, strict=True)
    )
    answer = _leg_answer(answers)
    # a joint of no or of unknown growth does not end the leg, though its clearance may be at the limit
    ends[[each in (*_NOT_KNOWN, Answer.NO_GROWTH) for each in answers]] = np.inf
    life, first = _life(answer, ends.min(axis=0), cycle_s), {}
    if life["cycles"] is not None:
        fraction = np.bincount(ends.argmin(axis=0), minlength=len(now)) / MEMBERS
        first = {each.joint: float(p) for each, p in zip(now, fraction, strict=True)}
    return Forecast(joints=joints, leg=LegForecast(answer=answer, **life, first_probability=first))


def _legs(
    now: Sequence[JointCondition], estimates: Sequence[CoefficientEstimate], settings: Forecasting
) -> tuple[Floats, Floats]:
    """Clearances and growth per gait cycle (k, n) of the ensemble of n legs that might be this one."""
    k = len(now)
    fractions, normals = even_fractions(3 * k + 1), even_normals(3 * k + 1)
    log_factor = np.array([one.log_factors(row) for one, row in zip(estimates, fractions, strict=False)])
    excess = np.array(
        [
            np.interp(own, one.log_factor, one.excess_m) + one.excess_sigma_m * row
            for own, one, row in zip(log_factor, estimates, normals[k:], strict=False)
        ]
    )
    wear, growth, error = (
        np.array([[getattr(each, name) or 0.0] for each in now])
        for name in ("wear_m", "growth_m", "growth_error_m")
    )
    known, before = (
        np.array([[getattr(each.known, name)] for each in estimates]) for name in ("clearance_m", "wear_m")
    )
    clearance = np.maximum(known + excess + np.exp(log_factor) * (wear - before), 0.0)
    relative = np.divide(error, growth, out=np.zeros_like(error), where=growth > 0.0)
    log_rate = log_factor + np.hypot(settings.model_sigma, relative) * normals[2 * k : 3 * k]
    log_rate += settings.load_sigma * normals[3 * k]
    return clearance, np.maximum(growth, 0.0) * np.exp(log_rate)


def cycles_to(limit_m: Floats, clearance_m: Floats, growth_m: Floats, fresh_m: Floats) -> Floats:
    """Gait cycles (k, n) until each joint reaches its limit, all joints growing together.

    The wider the joints are, the harder all of them knock: the growth of each joint is in proportion to the
    mean of all clearances, each relative to its clearance when new. In the lives of the default leg, doubled
    clearances multiply the growth of a joint by 1.3 to 2.8. A joint at its limit stays there.

    Parameters
    ----------
    limit_m, fresh_m : (k, 1) arrays
    clearance_m, growth_m : (k, n) arrays
        Now, of n legs; growth per gait cycle.

    Returns
    -------
    (k, n) array
        Infinite where a clearance does not grow; 0 where it is at its limit.
    """
    way_m, grows = np.maximum(limit_m - clearance_m, 0.0), growth_m > 0.0
    # cycles at the present growth; they pass faster by the factor of the growth, which is linear between them
    even = np.divide(way_m, growth_m, out=np.zeros_like(way_m), where=grows)
    knots = np.concatenate([np.zeros((1, even.shape[1])), np.sort(even, axis=0)])
    opened_m = np.minimum(np.where(grows, growth_m, 0.0) * knots[:, None], way_m)
    factor = ((clearance_m + opened_m) / fresh_m).mean(axis=1)
    factor /= factor[0]
    rise = np.diff(factor, axis=0)
    pace = np.divide(np.diff(np.log(factor), axis=0), rise, out=1.0 / factor[1:], where=rise > 0.0)
    cycles = np.cumsum(np.diff(knots, axis=0) * pace, axis=0)
    ends = np.take_along_axis(cycles, even.argsort(axis=0).argsort(axis=0), axis=0)
    return np.where(grows | (way_m == 0.0), ends, np.inf)


def _life(answer: Answer, cycles: Floats, cycle_s: float) -> dict[str, Quantiles | None]:
    """Remaining life in cycles and hours."""
    if answer not in (Answer.KNOWN, Answer.PARTLY_KNOWN, Answer.AT_LIMIT):
        return dict.fromkeys(("cycles", "hours"))
    return {"cycles": quantiles(cycles), "hours": quantiles(cycles * (cycle_s / 3600.0))}


_NOT_KNOWN = (Answer.NOT_ENOUGH_DATA, Answer.NO_COEFFICIENT)


def _leg_answer(joints: Sequence[Answer]) -> Answer:
    for answer in (Answer.AT_LIMIT, Answer.OUTSIDE_VALIDITY):
        if answer in joints:
            return answer
    unknown = next((each for each in _NOT_KNOWN if each in joints), None)
    if Answer.KNOWN not in joints:
        return unknown or Answer.NO_GROWTH
    return Answer.PARTLY_KNOWN if unknown else Answer.KNOWN


def quantiles(values: Floats) -> Quantiles:
    """Quantiles of equally likely values."""
    return Quantiles(*np.quantile(values, (0.1, 0.5, 0.9)).tolist())


# How long something lasts, and how large a clearance is, in as many digits as are known.


UNKNOWN = {f"{fraction}_{key}": math.nan for key in ("cycles", "hours") for fraction in ("p10", "p50", "p90")}
"""Result of `lifetime_values` if nothing is known."""


def lifetime_values(forecast: JointForecast | LegForecast) -> dict[str, float]:
    """Quantiles of cycles and hours by keys such as ``p50_hours``; none if not known."""
    values: dict[str, float] = {}
    for key in ("cycles", "hours"):
        quantiles = getattr(forecast, key)
        if quantiles is not None:
            values |= {f"{fraction}_{key}": value for fraction, value in attrs.asdict(quantiles).items()}
    return values


def answer_words(forecast: JointForecast) -> str:
    """Answer on a joint's life, and the conditions that it holds for."""
    basis = "" if forecast.prior is None else f"; {_basis(forecast.prior)}"
    return f"{forecast.answer.value}{basis}"


def bases(forecasts: Mapping[str, JointForecast]) -> list[str]:
    """Conditions for the lives of some joints, one sentence for all joints alike."""
    found: dict[str, list[str]] = {}
    for joint, forecast in forecasts.items():
        if forecast.prior is not None:
            found.setdefault(_basis(forecast.prior), []).append(joint)
    return [f"{', '.join(joints)}: {basis}" for basis, joints in found.items()]


def _basis(prior: CoefficientPrior) -> str:
    factor = f"{math.exp(prior.sigma):.2g}"
    return f"holds for {prior.holds_for}, its wear coefficient known to a factor of {factor} ({prior.basis})"


def three_digits(value: float) -> str:
    """A number rounded to three digits, without an exponent as far as that is readable."""
    if value == 0.0 or not math.isfinite(value):
        return f"{value:.3g}"
    if not 1.0e-4 <= abs(value) < 1.0e9:
        return f"{value:.2e}"
    rounded = float(f"{value:.2e}")
    return f"{rounded:.{max(0, 2 - math.floor(math.log10(abs(rounded))))}f}"
