"""How long a joint will last, and how sure that is: a distribution, from all that is not known.

An ensemble over the joint's wear coefficient and its excess clearance as believed, the growth's own scatter,
and the load to come. Wear enters by coefficient times cycles, so a member needs no simulation of its own: its
remaining life is the nominal one divided by its factors. This is exact where all joints' coefficients are off
alike; where they differ, joints act upon each other through their clearances (docs/forecast.md has figures).
"""

import json
import math
from enum import Enum
from pathlib import Path
from statistics import NormalDist
from typing import Any

import attrs
import numpy as np

from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.monitor.belief import Belief
from leg_wear_monitor.monitor.forecast_config import Forecasting

MEMBERS = 1024


class Answer(Enum):
    """What the forecast can say; the value is fit for people."""

    KNOWN = "from growth as it is, and what is not known of it"
    AT_LIMIT = "at its limit"
    NOT_ENOUGH_DATA = "not enough data for a growth rate yet"
    OUTSIDE_VALIDITY = "outside validity: the leg does not do what the model holds for"
    NO_GROWTH = "clearance does not grow"


@attrs.frozen
class Quantiles:
    """Values that are not exceeded with a probability of 10, 50 and 90 %."""

    p10: float
    p50: float
    p90: float


@attrs.frozen(kw_only=True)
class JointForecast:
    """A joint's remaining life.

    Attributes
    ----------
    answer : Answer
    cycles, hours, days : Quantiles or None
        Gait cycles, hours of walking and days at the usual duty until the mean clearance reaches its limit;
        None unless known (0 at the limit).
    clearance_m : Quantiles
        The clearance now, as far as it is known.
    measurements : int
        Measured clearances of this part that are in it.
    """

    answer: Answer
    cycles: Quantiles | None
    hours: Quantiles | None
    days: Quantiles | None
    clearance_m: Quantiles
    measurements: int


@attrs.frozen(kw_only=True)
class JointNow:
    """A joint as the twin has it, with the nominal wear coefficient.

    Attributes
    ----------
    fresh_m, wear_m, limit_m : float
        Clearance when new, wear since, and limit of the mean clearance.
    growth_m : float or None
        A cycle; None while there is not enough data.
    growth_error_m : float
        Its standard error.
    cycle_s : float
        Time of a gait cycle.
    valid : bool
        Whether the model holds for what the leg does.
    """

    fresh_m: float
    wear_m: float
    limit_m: float
    growth_m: float | None
    growth_error_m: float
    cycle_s: float
    valid: bool


@attrs.frozen(eq=False)
class LifeShape:
    """How the growth of a joint's clearance changes as it opens, from a simulated life.

    Attributes
    ----------
    clearance_m : (p,) array
        Rising.
    spent : (p,) array
        Nominal cycles until then; any unit.
    """

    clearance_m: Floats
    spent: Floats

    def growth(self, clearance_m: float) -> float:
        """Growth at a clearance, in the life's own unit: of the stretch that it lies in."""
        p = len(self.spent)
        i = int(np.clip(np.searchsorted(self.clearance_m, clearance_m) - 1, 0, p - 2))
        low, high = max(0, i - 1), min(p - 1, i + 2)
        opened = self.clearance_m[high] - self.clearance_m[low]
        return float(opened / (self.spent[high] - self.spent[low]))

    def cycles_at(self, clearance_m: Floats) -> Floats:
        """Cycles at clearances; beyond the ends at the growth there."""
        c, t = self.clearance_m, self.spent
        inside = np.interp(clearance_m, c, t)
        after = np.maximum(clearance_m - c[-1], 0.0) / self.growth(float(c[-1]))
        before = np.minimum(clearance_m - c[0], 0.0) / self.growth(float(c[0]))
        return np.asarray(inside + after + before)


def _draws() -> Floats:
    """Standard normal numbers (5, MEMBERS), evenly spread: an additive recurrence, the same at every call."""
    golden = 1.1673039782614187  # of dimension 5: the root of x^6 = x + 1 (Roberts's sequence)
    golden = _root(5, golden)
    index = np.arange(1, MEMBERS + 1)
    normal = NormalDist().inv_cdf
    return np.array(
        [[normal((0.5 + i * golden**-axis) % 1.0) for i in index.tolist()] for axis in range(1, 6)]
    )


def _root(dimension: int, x: float) -> float:
    for _ in range(40):
        x = (1.0 + x) ** (1.0 / (dimension + 1))
    return x


_NORMAL = _draws()
_SHARE = np.array([NormalDist().cdf(z) for z in _NORMAL[0].tolist()])


def forecast_joint(
    now: JointNow, belief: Belief, settings: Forecasting, shape: LifeShape | None = None
) -> JointForecast:
    """Remaining life of a joint.

    Parameters
    ----------
    now : JointNow
    belief : Belief
        Of its wear coefficient.
    settings : Forecasting
    shape : LifeShape, optional
        Without one, growth stays as it is.
    """
    log_factor = belief.log_factors(_SHARE)
    excess = np.interp(log_factor, belief.log_factor, belief.excess_m) + belief.excess_sigma_m * _NORMAL[1]
    clearance = np.maximum(now.fresh_m + excess + np.exp(log_factor) * now.wear_m, 0.0)
    seen = quantiles(clearance)

    def say(answer: Answer, cycles: Floats | None = None) -> JointForecast:
        if cycles is None:
            return JointForecast(
                answer=answer, cycles=None, hours=None, days=None, clearance_m=seen, measurements=belief.looks
            )
        hours = cycles * (now.cycle_s / 3600.0)
        duty = settings.duty_hours_per_day * np.exp(settings.duty_sigma * _NORMAL[4])
        return JointForecast(
            answer=answer,
            cycles=quantiles(cycles),
            hours=quantiles(hours),
            days=quantiles(hours / duty),
            clearance_m=seen,
            measurements=belief.looks,
        )

    if seen.p50 >= now.limit_m:
        return say(Answer.AT_LIMIT, np.zeros(MEMBERS))
    if not now.valid:
        return say(Answer.OUTSIDE_VALIDITY)
    if now.growth_m is None:
        return say(Answer.NOT_ENOUGH_DATA)
    if not now.growth_m > 0.0:
        return say(Answer.NO_GROWTH)
    log_rate = log_factor + math.hypot(settings.load_sigma, settings.model_sigma) * _NORMAL[2]
    log_rate += now.growth_error_m / now.growth_m * _NORMAL[3]
    room = np.maximum(now.limit_m - clearance, 0.0)
    if shape is not None:
        spent = shape.cycles_at(np.append(np.minimum(clearance, now.limit_m), now.limit_m))
        room = (spent[-1] - spent[:-1]) * shape.growth(now.fresh_m + now.wear_m)
    return say(Answer.KNOWN, room / (now.growth_m * np.exp(log_rate)))


def quantiles(values: Floats) -> Quantiles:
    """Quantiles of equally likely values."""
    return Quantiles(*np.quantile(values, (0.1, 0.5, 0.9)).tolist())


def life_shapes(path: str, loose: tuple[str, ...]) -> tuple[LifeShape | None, ...]:
    """Shapes of the loose joints from a file of `leg-wear-monitor life --json`; None each for no path.

    Raises
    ------
    ConfigError
        If the file cannot be read, or lacks a joint.
    """
    if not path:
        return (None,) * len(loose)
    try:
        life = json.loads(Path(path).read_text(encoding="utf-8"))
        return tuple(_shape(life, joint) for joint in loose)
    except OSError as error:
        raise ConfigError(path, "", f"cannot be read: {error.strerror}") from error
    except (ValueError, KeyError, TypeError) as error:
        raise ConfigError(
            path, "", f"is no life of the joints {', '.join(loose)}, expected what `life --json` writes"
        ) from error


def _shape(life: dict[str, Any], joint: str) -> LifeShape:
    clearance = np.array(life["joints"][joint]["clearance_m"], dtype=float)
    cycles = np.array(life["cycles"], dtype=float)
    rising = np.concatenate([[True], np.diff(np.maximum.accumulate(clearance)) > 0.0])
    if rising.sum() < 3 or len(cycles) != len(clearance) or not math.isfinite(clearance.sum()):
        raise ValueError(joint)
    return LifeShape(clearance[rising], cycles[rising])
