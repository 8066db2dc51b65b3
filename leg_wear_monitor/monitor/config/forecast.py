"""Parameters of the forecast: uncertain quantities and their standard deviations."""

import attrs

from leg_wear_monitor.configuration.quantity import described, quantity

_LEAST_SIGMA = 0.001  # below, the grid of the estimate would be finer than rounding


def _not_next_to_0(sigma: float) -> str | None:
    if sigma == 0.0 or sigma >= _LEAST_SIGMA:
        return None
    return f"{sigma!r} is neither 0 nor at least {_LEAST_SIGMA:g}"


@attrs.frozen(kw_only=True)
class Forecasting:
    """Uncertainties of the forecast as standard deviations; those of factors are of the natural logarithm."""

    wear_coefficient_sigma: float = quantity(
        "",
        "standard deviation of the logarithm of a joint's wear coefficient about the given one; 0: the "
        "spread of the joint's material pair, or 0.7 where that gives none",
        at_least=0.0,
        at_most=3.0,
        default=0.0,
        check=_not_next_to_0,
    )
    load_sigma: float = quantity(
        "",
        "standard deviation of the logarithm of future wear per cycle, because load and pace vary",
        at_least=0.0,
        at_most=3.0,
        default=0.1,
    )
    model_sigma: float = quantity(
        "",
        "standard deviation of the logarithm of the growth, which is assumed constant without simulated "
        "lives (docs/explanation/forecast.md)",
        at_least=0.0,
        at_most=3.0,
        default=0.4,
    )
    clearance_sigma_m: float = quantity(
        "m", "standard deviation of a new joint's clearance", at_least=1.0e-9, at_most=1.0e-3, default=5.0e-6
    )
    duty_hours_per_day: float = quantity("h", "walking per day", at_least=0.01, at_most=24.0, default=8.0)
    duty_sigma: float = quantity(
        "",
        "standard deviation of the logarithm of the walking per day",
        at_least=0.0,
        at_most=3.0,
        default=0.2,
    )
    window_cycles: int = quantity(
        "",
        "gait cycles over which the growth of the forecast is averaged",
        at_least=10,
        at_most=100000,
        default=2000,
    )
    life: str = described(
        "file that `leg-wear-monitor life --lives 16 --json` wrote for this leg: how growth changes as all "
        "clearances open; empty: the one that comes with the package for just this leg, if there is one",
        default="",
    )
    priors: str = described(
        "file of priors that a fleet has learned for this leg's wear coefficients; empty: "
        "the spread of wear_coefficient_sigma about the given ones",
        default="",
    )
