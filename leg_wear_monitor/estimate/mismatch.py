"""Choice among hypotheses: the fewest causes that explain a torque mismatch, and all that do so."""

import math
from collections.abc import Iterator, Sequence

import attrs
import numpy as np

from leg_wear_monitor.estimate.body_torques import at_speed, body_torques
from leg_wear_monitor.estimate.cause import Cause, NamedCause, TorqueExplanation, beyond_friction
from leg_wear_monitor.estimate.hypotheses import Fit, Hypothesis, Refined, fit, refined, timing_of
from leg_wear_monitor.estimate.torque_curves import TorqueCurves, curves_of
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ideal import TURN
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.twin.statistics import CycleStatistics

_MOST_CAUSES = 3
_BETTER = 0.5  # a further cause has to leave at most so much of what fewer leave unexplained
# alternatives may leave so many times what the best leaves, and an error of the model
_ALIKE, _MODEL_ERROR = 3.0, 0.02
_LEAST_MASS = 0.02  # a body counts if its double mass changes the torque by this fraction of its RMS


@attrs.frozen(kw_only=True)
class Allowed:
    """What a leg may have without a fault.

    Attributes
    ----------
    lag_s : float
        Lag of the torque, late or early.
    loads_n : (float, float)
        Foot loads.
    friction_nm : float
        Largest constant torque that friction can be.
    unexplained : float
        Fraction of the predicted RMS below which a torque counts as predicted.
    """

    lag_s: float
    loads_n: tuple[float, float]
    friction_nm: float
    unexplained: float


def explanation(
    mechanism: Mechanism, cycles: Sequence[CycleStatistics], allowed: Allowed
) -> TorqueExplanation | None:
    """Explanation of some gait cycles; None if there is nothing to explain, or with too few samples."""
    speed = float(np.mean([one.direction * TURN / one.moving_s for one in cycles]))
    curves = curves_of([one.torque_profile for one in cycles], _body_torques(mechanism, speed))
    if curves is None or not curves.predicted_rms_nm > 0.0:
        return None
    samples = float(np.mean([one.torque_profile.number.sum() for one in cycles]))
    # a sample belongs to the half of its period before it, by which an instant may be off
    angle = allowed.lag_s * abs(speed) + 0.5 * TURN / samples
    chosen = _chosen(curves, angle, allowed)
    if chosen is None:
        return None
    before, found = chosen
    fits = [refined(curves, one) for one in found]
    best = fits[0] if fits else refined(curves, before)
    friction = math.copysign(best.constant_nm, best.constant_nm * speed * best.fit.factor)
    friction /= abs(best.fit.factor)
    return TorqueExplanation(
        alternatives=tuple(_named(one, cycles) for one in fits),
        before=before.unexplained,
        after=best.fit.unexplained,
        after_sigma=best.unexplained_sigma,
        limit=allowed.unexplained,
        speed_radps=speed,
        bias=beyond_friction(friction, best.constant_sigma_nm / abs(best.fit.factor), allowed.friction_nm),
        cycles=len(cycles),
    )


def _body_torques(mechanism: Mechanism, speed: float) -> dict[str, Floats]:
    """Torque [N m] that each body adds if its mass doubles, where it is worth mentioning."""
    found = body_torques(mechanism)
    least = _LEAST_MASS * at_speed(found.own, speed).std()
    added = zip(mechanism.bodies, at_speed(found.mass, speed), strict=True)
    return {name: torque for name, torque in added if torque.std() > least}


def _hypotheses(curves: TorqueCurves) -> Iterator[Hypothesis]:
    """All of at most three causes; a factor and a mass are not supposed at once, they look too alike."""
    loads = (False, True) if np.any(curves.lever) else (False,)
    for sign in (1, -1):
        for turned in (False, True):
            for loaded in loads:
                for scaled, body in ((False, ""), (True, ""), *((False, name) for name in curves.bodies)):
                    one = Hypothesis(
                        sign=sign, is_scaled=scaled, is_turned=turned, is_loaded=loaded, body=body
                    )
                    if one.size <= _MOST_CAUSES:
                        yield one


def _chosen(curves: TorqueCurves, angle_rad: float, allowed: Allowed) -> tuple[Fit, list[Fit]] | None:
    """The fit without a cause, and those of the fewest causes that explain; None if no cause is needed."""
    fits: list[list[Fit]] = [[] for _ in range(_MOST_CAUSES + 1)]
    for one in _hypotheses(curves):
        found = fit(curves, one, angle_rad, allowed.loads_n)
        if found is not None:
            fits[one.size].append(found)
    for each in fits:
        each.sort(key=lambda one: one.unexplained)
    left = [each[0].unexplained if each else math.inf for each in fits]
    limit, size = allowed.unexplained, 0
    while left[size] > limit:
        more = [k for k in range(size + 1, len(fits)) if left[k] <= _BETTER * left[size]]
        if not more:
            break
        size = more[0]
    before = fits[0][0]
    if size == 0:
        return None if before.unexplained <= limit else (before, [])
    enough = _ALIKE * left[size] + _MODEL_ERROR
    if left[size] <= limit:
        enough = min(enough, limit)
    return before, [one for one in fits[size] if one.unexplained <= enough]


def _named(one: Refined, cycles: Sequence[CycleStatistics]) -> tuple[NamedCause, ...]:
    """The causes of a fit."""
    found, of = one.fit, one.fit.hypothesis
    factor_sigma, angle_sigma, load_sigma, mass_sigma = one.sigma
    causes = []
    if of.sign < 0:
        causes.append(NamedCause(Cause.SIGN, found.factor, factor_sigma))
    if of.is_scaled:
        causes.append(NamedCause(Cause.SCALE, abs(found.factor), factor_sigma))
    if of.is_turned:
        together = NamedCause(Cause.TIMING, found.angle_rad, angle_sigma)
        causes += timing_of(cycles, found) or [together]
    if of.is_loaded:
        causes.append(NamedCause(Cause.LOAD, found.load_n, load_sigma))
    if of.body:
        causes.append(NamedCause(Cause.MASS, found.mass, mass_sigma, of.body))
    return tuple(causes)
