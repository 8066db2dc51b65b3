"""Lives with different wear coefficients, which together show the effect of joints on each other."""

from collections.abc import Callable, Iterator
from itertools import islice
from typing import Any

import attrs
import numpy as np

from leg_wear_monitor.life.duty import Duty
from leg_wear_monitor.life.life import LifeRun, LifeSettings, simulate_life
from leg_wear_monitor.life.result import Life
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.spec import Mechanism

LEAST_FRACTION = 0.05  # least fraction of the growth to its limit that a joint reaches in every life
LEAST_OPENING = 1.0e-3  # of the first joint's opening: bounds the factor of a joint that hardly wears
_DIGITS = 6


def simulate_lives(
    mechanism: Mechanism,
    settings: LifeSettings,
    number: int,
    *,
    limit_m: float,
    horizon_cycles: float,
    wear_factor: float = 1.0,
    speed_rpm: float | None = None,
    duty: Duty | None = None,
    progress: Callable[[float], None] = lambda _fraction: None,
) -> Iterator[tuple[Floats, Life]]:
    """Simulate lives, each with factors (k,) on its wear coefficients: the nominal life first, then others.

    Parameters
    ----------
    mechanism : Mechanism
    settings : LifeSettings
    number : int
        Number of lives.
    limit_m, horizon_cycles : float
        As in `simulate_life`.
    wear_factor : float
        Factor on all wear coefficients.
    speed_rpm : float, optional
    duty : Duty, optional
    progress : callable
        Called with the completed fraction of all lives.

    Raises
    ------
    ConfigError, SimulationError
    """

    def life(index: int, factor: Floats) -> tuple[Floats, Life]:
        own = attrs.evolve(settings, seed=settings.seed + index * settings.legs)
        run = LifeRun(mechanism, own, speed_rpm=speed_rpm, wear_factor=factor, duty=duty)
        done = simulate_life(
            run,
            limit_m=limit_m,
            horizon_cycles=horizon_cycles,
            progress=lambda fraction: progress((index + fraction) / number),
        )
        return factor, done

    first = life(0, np.full(len(mechanism.clearance_joints), wear_factor))
    yield first
    for index, factor in enumerate(islice(spread_factors(first[1]), number - 1), start=1):
        yield life(index, wear_factor * factor)


def spread_factors(nominal: Life) -> Iterator[Floats]:
    """Factors (k,) on the wear coefficients, life by life, as an endless sequence.

    The clearances at the ends of the lives should be evenly distributed. In each life the first joint reaches
    its full growth, and the others reach fractions from an evenly distributed sequence (Roberts's additive
    recurrence), if they grow as in the nominal life.

    Parameters
    ----------
    nominal : Life
        The life with factors of 1.
    """
    opened = nominal.clearance_m[-1] - nominal.clearance_m[0]
    opened = np.maximum(opened, LEAST_OPENING * opened.max())
    step = _root(len(opened)) ** -np.arange(1.0, len(opened) + 1.0)
    number = 0
    while True:
        number += 1
        fraction = LEAST_FRACTION + (1.0 - LEAST_FRACTION) * ((0.5 + number * step) % 1.0)
        yield np.asarray(fraction / fraction.max() * opened.max() / opened)


def lives_document(lives: list[tuple[Floats, Life]], limit_m: float) -> dict[str, Any]:
    """Plain object for JSON: the nominal life, and the data of the others that the forecast needs.

    With a duty, also when each joint of the nominal life reaches the limit.
    """
    (factor, nominal), *further = lives
    duty = (
        {"duty": {**nominal.duty.to_dict(), "limit_m": limit_m, "end": nominal.end(limit_m)}}
        if nominal.duty
        else {}
    )
    return {
        **nominal.to_dict(),
        **duty,
        "wear_factor": _by_joint(nominal, factor),
        "further": [_short(factor, life) for factor, life in further],
    }


def _short(factor: Floats, life: Life) -> dict[str, Any]:
    names = ("clearance_m", "growth_m_per_cycle")
    columns = {name: _by_joint(life, getattr(life, name).T) for name in names}
    joints = {joint: {name: columns[name][joint] for name in names} for joint in life.clearance_joints}
    return {
        "wear_factor": _by_joint(life, factor),
        "cycles": _rounded(life.cycles),
        "joints": joints,
    }


def _by_joint(life: Life, values: Floats) -> dict[str, Any]:
    return dict(zip(life.clearance_joints, map(_rounded, values), strict=True))


def _rounded(values: Floats) -> Any:
    return np.vectorize(lambda value: float(f"{value:.{_DIGITS}g}"))(values).tolist()


def _root(dimension: int) -> float:
    """The root x > 1 of x^(dimension + 1) = x + 1."""
    x = 1.5
    for _ in range(60):
        x = (1.0 + x) ** (1.0 / (dimension + 1))
    return x
