"""How long joints and the leg will last, and how sure that is: a distribution, from all that is not known.

An ensemble of legs over what is believed of every joint's wear coefficient and clearance, over the growth's
own scatter and the load to come. In each of them all joints grow together by the law of growth, until each
has reached its limit (`growth_law.py`).
"""

from collections.abc import Sequence
from enum import Enum

import attrs
import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.monitor.config.forecast import Forecasting
from leg_wear_monitor.monitor.forecast.coefficient_prior import CoefficientPrior
from leg_wear_monitor.monitor.forecast.even_draws import MEMBERS, even_fractions, even_normals
from leg_wear_monitor.monitor.forecast.growth_law import GrowthLaw, cycles_to
from leg_wear_monitor.monitor.forecast.wear_coefficients import CoefficientEstimate, MeasuredClearance


class Answer(Enum):
    """What the forecast can say; the value is human-readable."""

    KNOWN = "from the growth so far and its uncertainty"
    PARTLY_KNOWN = "of the joints whose growth is known; the others are not included"
    AT_LIMIT = "at its limit"
    NOT_ENOUGH_DATA = "not enough data for a growth rate yet"
    OUTSIDE_VALIDITY = "not valid: the model does not hold for this cadence, torque, clearance or load"
    NO_GROWTH = "clearance does not grow"
    NO_COEFFICIENT = "not known: the joint has no wear coefficient"


@attrs.frozen
class Quantiles:
    """Quantiles of what is not known.

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
        What can be said of it.
    cycles : Quantiles or None
        Gait cycles until the mean clearance reaches its limit; None unless known (0 at the limit).
    hours : Quantiles or None
        Hours of walking until then.
    days : Quantiles or None
        Days at the usual duty until then.
    clearance_m : Quantiles
        The clearance now, as far as it is known.
    measurements : int
        Measured clearances of this part that are in it.
    prior : CoefficientPrior or None
        What was believed of its wear coefficient before any measurement of this part, and the regime that it
        holds for; None in a file of an older version.
    """

    answer: Answer
    cycles: Quantiles | None
    hours: Quantiles | None
    days: Quantiles | None
    clearance_m: Quantiles
    measurements: int
    prior: CoefficientPrior | None = None


@attrs.frozen(kw_only=True)
class LegForecast:
    """The leg's remaining life: until the first of its joints reaches its limit.

    Attributes
    ----------
    answer : Answer
    cycles, hours, days : Quantiles or None
        As those of a joint.
    first_probability : dict of str to float
        With which each joint is the first; empty unless known.
    simulated_lives : int
        That tell how joints act upon each other; 0: growth is supposed to stay as it is.
    """

    answer: Answer
    cycles: Quantiles | None
    hours: Quantiles | None
    days: Quantiles | None
    first_probability: dict[str, float]
    simulated_lives: int

    @property
    def first(self) -> str | None:
        """The joint that is most likely the first; None if that is not known."""
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
    wear_sigma_m : float
        Standard deviation of the wear, because not all gait cycles were followed.
    growth_m : float or None
        A cycle; None while there is not enough data.
    growth_error_m : float
        Uncertainty of this mean because cycles scatter. What the model is off is the same in all cycles of a
        leg: it is in the factor of the wear coefficient, which a measured clearance corrects.
    has_coefficient : bool
        Whether its wear coefficient is above 0; without one no wear is counted.
    """

    joint: str
    fresh_m: float
    wear_m: float
    limit_m: float
    growth_m: float | None
    growth_error_m: float
    has_coefficient: bool = True
    wear_sigma_m: float = 0.0

    def answer(self, clearance_m: float, valid: bool) -> Answer:
        """What can be said of it, supposing its clearance."""
        if clearance_m >= self.limit_m:
            return Answer.AT_LIMIT
        if not valid:
            return Answer.OUTSIDE_VALIDITY
        if not self.has_coefficient:
            return Answer.NO_COEFFICIENT
        if self.growth_m is None:
            return Answer.NOT_ENOUGH_DATA
        return Answer.KNOWN if self.growth_m > 0.0 else Answer.NO_GROWTH


@attrs.frozen(kw_only=True)
class ForecastBasis:
    """What a forecast rests on, besides wear coefficients and their measurements: it can be made again.

    Attributes
    ----------
    conditions : tuple of JointCondition
        In the order of the clearance joints.
    observed : tuple of MeasuredClearance or None
        What encoders showed of each joint, as far as the forecast uses it.
    cycle_s : float
        Time of a gait cycle.
    is_valid : bool
        Whether the model holds for what the leg does.
    """

    conditions: tuple[JointCondition, ...]
    observed: tuple[MeasuredClearance | None, ...]
    cycle_s: float
    is_valid: bool


@attrs.frozen(eq=False)
class _Legs:
    """The ensemble: n legs that might be this one.

    Attributes
    ----------
    clearance_m : (k, n) array
        Now.
    base_m : (k, n) array
        Growth a cycle when all was new.
    duty_h : (n,) array
        Walking a day.
    """

    clearance_m: Floats
    base_m: Floats
    duty_h: Floats


def forecast(
    now: Sequence[JointCondition],
    coefficient_estimates: Sequence[CoefficientEstimate],
    settings: Forecasting,
    law: GrowthLaw,
    *,
    cycle_s: float,
    valid: bool,
) -> Forecast:
    """Remaining life of all clearance joints, and of the leg.

    Parameters
    ----------
    now : sequence of JointCondition
    coefficient_estimates : sequence of CoefficientEstimate
        Of their wear coefficients.
    settings : Forecasting
    law : GrowthLaw
        Of the same joints in the same order.
    cycle_s : float
        Time of a gait cycle.
    valid : bool
        Whether the model holds for what the leg does.
    """
    legs = _legs(now, coefficient_estimates, settings, law)
    clearances = [quantiles(row) for row in legs.clearance_m]
    answers = [each.answer(q.p50, valid) for each, q in zip(now, clearances, strict=True)]
    limit = np.array([each.limit_m for each in now])
    ended = np.array([[answer is Answer.AT_LIMIT] for answer in answers])
    ends = cycles_to(law, np.where(ended, limit[:, None], legs.clearance_m), legs.base_m, limit)
    day = cycle_s / 3600.0 / legs.duty_h
    joints = tuple(
        JointForecast(
            answer=a,
            **_life(a, end, cycle_s, day),
            clearance_m=q,
            measurements=coefficient_estimate.observations,
            prior=coefficient_estimate.prior,
        )
        for a, end, q, coefficient_estimate in zip(
            answers, ends, clearances, coefficient_estimates, strict=True
        )
    )
    answer = _leg_answer(answers)
    life, first = _life(answer, ends.min(axis=0), cycle_s, day), {}
    if life["cycles"] is not None:
        fraction = np.bincount(ends.argmin(axis=0), minlength=len(now)) / MEMBERS
        first = {each.joint: float(p) for each, p in zip(now, fraction, strict=True)}
    leg = LegForecast(answer=answer, **life, first_probability=first, simulated_lives=law.lives)
    return Forecast(joints=joints, leg=leg)


def _legs(
    now: Sequence[JointCondition],
    coefficient_estimates: Sequence[CoefficientEstimate],
    settings: Forecasting,
    law: GrowthLaw,
) -> _Legs:
    k = len(now)
    fractions, normals = even_fractions(3 * k + 2), even_normals(3 * k + 2)
    log_factor = np.array(
        [
            coefficient_estimate.log_factors(row)
            for coefficient_estimate, row in zip(coefficient_estimates, fractions, strict=False)
        ]
    )
    excess = np.array(
        [
            np.interp(own, coefficient_estimate.log_factor, coefficient_estimate.excess_m)
            + np.hypot(coefficient_estimate.excess_sigma_m, np.exp(own) * each.wear_sigma_m) * row
            for own, coefficient_estimate, row, each in zip(
                log_factor, coefficient_estimates, normals[k:], now, strict=False
            )
        ]
    )
    fresh, wear, growth, error = (
        np.array([[getattr(each, name) or 0.0] for each in now])
        for name in ("fresh_m", "wear_m", "growth_m", "growth_error_m")
    )
    known, before = (
        np.array([[getattr(each.known, name)] for each in coefficient_estimates])
        for name in ("clearance_m", "wear_m")
    )
    clearance = np.maximum(known + excess + np.exp(log_factor) * (wear - before), 0.0)
    relative = np.divide(error, growth, out=np.zeros_like(error), where=growth > 0.0)
    log_rate = log_factor + np.hypot(law.sigma[:, None], relative) * normals[2 * k : 3 * k]
    log_rate += settings.load_sigma * normals[3 * k]
    # The twin's growth is that at its own clearances. What is believed of a factor is a mean over the part's
    # past, in which the other clearances departed from the twin's by and by: half of their doing is in it.
    here, twin = law.log_growth(clearance), law.log_growth(fresh + wear)
    log_base = log_rate + 0.5 * (here - twin) - here
    duty = settings.duty_hours_per_day * np.exp(settings.duty_sigma * normals[3 * k + 1])
    return _Legs(clearance, np.maximum(growth, 0.0) * np.exp(log_base), duty)


def _life(answer: Answer, cycles: Floats, cycle_s: float, day: Floats) -> dict[str, Quantiles | None]:
    """Remaining life in cycles, hours and days; ``day`` (n,) days of a cycle."""
    if answer not in (Answer.KNOWN, Answer.PARTLY_KNOWN, Answer.AT_LIMIT):
        return dict.fromkeys(("cycles", "hours", "days"))
    hours = cycles * (cycle_s / 3600.0)
    return {"cycles": quantiles(cycles), "hours": quantiles(hours), "days": quantiles(cycles * day)}


def _leg_answer(joints: Sequence[Answer]) -> Answer:
    for answer in (Answer.AT_LIMIT, Answer.OUTSIDE_VALIDITY):
        if answer in joints:
            return answer
    unknown = next((each for each in (Answer.NOT_ENOUGH_DATA, Answer.NO_COEFFICIENT) if each in joints), None)
    if Answer.KNOWN not in joints:
        return unknown or Answer.NO_GROWTH
    return Answer.PARTLY_KNOWN if unknown else Answer.KNOWN


def quantiles(values: Floats) -> Quantiles:
    """Quantiles of equally likely values."""
    return Quantiles(*np.quantile(values, (0.1, 0.5, 0.9)).tolist())
