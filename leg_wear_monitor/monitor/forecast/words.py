"""How long something lasts, and how large a clearance is, in as many digits as are known."""

import math
from collections.abc import Mapping

import attrs

from leg_wear_monitor.monitor.forecast.coefficient_prior import CoefficientPrior
from leg_wear_monitor.monitor.forecast.forecast import JointForecast, LegForecast

UNKNOWN = {
    f"{fraction}_{key}": math.nan for key in ("cycles", "hours", "days") for fraction in ("p10", "p50", "p90")
}
"""What `lifetime_values` gives, not known."""

_SIGMAS_APART = 2.5631  # p10 and p90 of a normal distribution


def lifetime_values(forecast: JointForecast | LegForecast) -> dict[str, float]:
    """Quantiles of cycles, hours and days of duty by keys such as ``p50_hours``; none if not known."""
    values: dict[str, float] = {}
    for key in ("cycles", "hours", "days"):
        quantiles = getattr(forecast, key)
        if quantiles is not None:
            values |= {f"{fraction}_{key}": value for fraction, value in attrs.asdict(quantiles).items()}
    return values


def answer_words(forecast: JointForecast) -> str:
    """What can be said of a joint's life, and what it holds for."""
    held = "" if forecast.prior is None else f"; {_basis(forecast.prior)}"
    return f"{forecast.answer.value}{held}"


def bases(forecasts: Mapping[str, JointForecast]) -> list[str]:
    """What the lives of some joints hold for, a sentence for all joints alike."""
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


def clearance_mm(value_m: float, p10_m: float, p90_m: float) -> str:
    """A counted clearance [mm] in the digits that it deserves: the last is that of its standard deviation.

    Parameters
    ----------
    value_m : float
    p10_m, p90_m : float
        Quantiles of what it may be.
    """
    sigma_mm = 1.0e3 * (p90_m - p10_m) / _SIGMAS_APART
    digits = -math.floor(math.log10(sigma_mm)) if sigma_mm > 0.0 else 6
    return f"{1.0e3 * value_m:.{min(max(digits, 2), 6)}f}"
