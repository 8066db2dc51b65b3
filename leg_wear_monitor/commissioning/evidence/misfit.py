"""What repeats with each turn and is not the ideal leg's torque: a foot load, other masses, another leg."""

import attrs
import numpy as np

from leg_wear_monitor.estimate.body_torques import body_torques
from leg_wear_monitor.estimate.least_squares import solved
from leg_wear_monitor.estimate.torque_fit.fit import Fit, fit
from leg_wear_monitor.estimate.torque_fit.likeness import repeating
from leg_wear_monitor.estimate.torque_fit.regression import Terms
from leg_wear_monitor.estimate.torque_fit.torque_model import TorqueModel
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.spec import Mechanism

# Clearances of 0.3 mm in five joints of the default leg repeat with 0.03 to 0.17 of the torque, the most at
# 30 rpm and of a sensor that samples instants, whose impacts do not average out
_NOTABLE = 0.2
_LEAST_LOAD = (
    0.06  # repeating rest below which a load is not looked for: sensors that average have up to 0.05
)
_EXPLAINS = 0.5  # of the energy of the repeating rest, from which on a cause is named
_SURE = 5.0  # standard deviations


@attrs.frozen
class Load:
    """A foot load that explains most of what did not fit.

    Attributes
    ----------
    force_n, sigma_n : float
        Upward force at its peak, and its standard deviation [N].
    explained : float
        Fraction of the energy of the repeating rest.
    """

    force_n: float
    sigma_n: float
    explained: float


def with_load(one: Fit, model: TorqueModel, terms: Terms) -> tuple[Fit, Load | None]:
    """The fit with a foot load, if that explains most of the rest that repeats; else the fit as it is."""
    before = repeating(one) ** 2
    if not model.load.any() or before < _LEAST_LOAD**2:
        return one, None
    loaded = fit(one.pair, model, one.refined, attrs.evolve(terms, load=True), with_errors=True)
    after = repeating(loaded) ** 2
    force, sigma = loaded.linear["load"] / loaded.gain, loaded.sigma["load"] / abs(loaded.gain)
    explained = 1.0 - after / before if before > 0.0 else 0.0
    if explained < _EXPLAINS or abs(force) < _SURE * sigma or loaded.gain * one.gain < 0.0:
        return one, None
    return loaded, Load(force, sigma, explained)


def does_not_fit(one: Fit, mechanism: Mechanism) -> str:
    """What repeats and does not fit, and the body whose mass would explain most of it; empty if little."""
    rest = repeating(one)
    if rest < _NOTABLE:
        return ""
    told = (
        f"{100.0 * rest:.0f} % of the torque repeats with each turn and is not that of {mechanism.name}: "
        "other masses or lengths, a spring, a load, or impacts that a sensor of instants does not average"
    )
    body, change, explained = _heavier(one, mechanism)
    if explained < _EXPLAINS:
        return f"{told}; no body's mass alone explains it"
    more = f"{100.0 * abs(change):.0f} % {'more' if change > 0.0 else 'less'} mass and inertia of {body}"
    return f"{told}; {more} would explain {100.0 * explained:.0f} % of it"


def _heavier(one: Fit, mechanism: Mechanism) -> tuple[str, float, float]:
    """Body, relative change of its mass, and the fraction of the rest's energy that this explains."""
    angle, speed, acceleration = one.crank()
    before = float(one.rest @ one.rest)
    floor = before - len(one.rest) * (repeating(one) * float(one.measured.std())) ** 2
    best = ("", 0.0, 0.0)
    for name, tables in zip(mechanism.bodies, body_torques(mechanism).mass, strict=True):
        more = TorqueModel(tables, np.zeros(tables.shape[1])).torque(angle, speed, acceleration)[0]
        by = np.stack([one.blocks.mean(more), one.predicted / one.gain, np.ones_like(one.rest)])
        coefficients = solved(by.T, one.rest)
        left: Floats = one.rest - coefficients @ by
        explained = (before - float(left @ left)) / max(before - floor, 1.0e-12)
        gain = one.gain + float(coefficients[1])
        change = float(coefficients[0]) / gain if gain else -1.0
        if explained > best[2] and abs(change) < 1.0:
            best = (name, change, min(explained, 1.0))
    return best
