"""Choice among hypotheses: the fewest causes that explain a torque mismatch, and all that do so."""

import math
from collections.abc import Iterator, Sequence

import attrs
import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ideal import TURN, one_cycle
from leg_wear_monitor.mechanism.position import build_linkage
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.torque_causes.curves import TorqueCurves, curves_of
from leg_wear_monitor.monitor.torque_causes.explanation import NamedCause, TorqueCause, TorqueExplanation
from leg_wear_monitor.monitor.torque_causes.fit import Allowed, Fit, Hypothesis, Refined, fit, refined
from leg_wear_monitor.monitor.torque_causes.timing import timing_of
from leg_wear_monitor.twin.settings import STANCE, TwinSettings
from leg_wear_monitor.twin.statistics import CycleStatistics

_MOST_CAUSES = 3
_BETTER = 0.5  # a further cause has to leave at most so much of what fewer leave unexplained
# alternatives may leave so many times what the best leaves, and an error of the model
_ALIKE, _MODEL_ERROR = 3.0, 0.02
_LEAST_MASS = 0.02  # a body counts if its double mass changes the torque by this fraction of its RMS
_STEPS = 128  # of a turn, for the ideal torque


class TorqueExplainer:
    """Explains torques that are not as predicted.

    Parameters
    ----------
    mechanism : Mechanism
    """

    def __init__(self, mechanism: Mechanism) -> None:
        self._mechanism = mechanism
        self._bodies: dict[str, Floats] | None = None

    def explanation(
        self,
        cycles: Sequence[CycleStatistics],
        config: MonitorConfig,
        settings: TwinSettings,
        max_friction_nm: float,
    ) -> TorqueExplanation | None:
        """Explanation of some gait cycles; None if there is nothing to explain, or with too few samples.

        Parameters
        ----------
        cycles : sequence of CycleStatistics
        config : MonitorConfig
        settings : TwinSettings
        max_friction_nm : float
            Largest constant torque that friction can be.
        """
        curves = curves_of([one.torque_profile for one in cycles], self._body_torques(config))
        if curves is None or not curves.predicted_rms_nm > 0.0:
            return None
        speed = float(np.mean([one.direction * TURN / one.moving_s for one in cycles]))
        samples = float(np.mean([one.torque_profile.number.sum() for one in cycles]))
        least_n = 0.0 if settings.load_shape == STANCE else -settings.load_limit_n
        # a sample belongs to the half of its period before it, by which an instant may be off
        angle = config.drive_torque.max_lag_s * abs(speed) + 0.5 * TURN / samples
        allowed = Allowed(angle, (least_n, settings.load_limit_n))
        limit = config.limits.warn_fraction * config.limits.torque_mismatch
        chosen = _chosen(curves, allowed, limit)
        if chosen is None:
            return None
        before, found = chosen
        best = refined(curves, found[0] if found else before)
        friction = math.copysign(best.constant_nm, best.constant_nm * speed * best.fit.factor)
        friction /= abs(best.fit.factor)
        return TorqueExplanation(
            alternatives=tuple(_named(refined(curves, one)) for one in found),
            before=before.unexplained,
            after=best.fit.unexplained,
            after_sigma=best.unexplained_sigma,
            limit=limit,
            speed_radps=speed,
            timing=timing_of(cycles, best.fit) if found and found[0].hypothesis.is_turned else None,
            bias_nm=min(friction, 0.0) + max(friction - max_friction_nm, 0.0),
            bias_sigma_nm=best.constant_sigma_nm / abs(best.fit.factor),
            cycles=len(cycles),
        )

    def _body_torques(self, config: MonitorConfig) -> dict[str, Floats]:
        """Torque [N m] that each body adds if its mass doubles, where it is worth mentioning."""
        if self._bodies is None:
            speed = config.cadence.commanded_rpm * TURN / 60.0
            own = _ideal(self._mechanism, speed)
            self._bodies = {}
            for name, body in self._mechanism.bodies.items():
                heavier = attrs.evolve(body, mass=2.0 * body.mass, inertia=2.0 * body.inertia)
                changed = attrs.evolve(self._mechanism, bodies={**self._mechanism.bodies, name: heavier})
                added = _ideal(changed, speed) - own
                if added.std() > _LEAST_MASS * own.std():
                    self._bodies[name] = added
        return self._bodies


def _ideal(mechanism: Mechanism, speed: float) -> Floats:
    return one_cycle(build_linkage(mechanism), _STEPS, speed).drive_torque


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


def _chosen(curves: TorqueCurves, allowed: Allowed, limit: float) -> tuple[Fit, list[Fit]] | None:
    """The fit without a cause, and those of the fewest causes that explain; None if no cause is needed."""
    fits: list[list[Fit]] = [[] for _ in range(_MOST_CAUSES + 1)]
    for one in _hypotheses(curves):
        found = fit(curves, one, allowed)
        if found is not None:
            fits[one.size].append(found)
    for each in fits:
        each.sort(key=lambda one: one.unexplained)
    left = [each[0].unexplained if each else math.inf for each in fits]
    size = 0
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


def _named(one: Refined) -> tuple[NamedCause, ...]:
    """The causes of a fit."""
    found, of = one.fit, one.fit.hypothesis
    factor_sigma, angle_sigma, load_sigma, mass_sigma = one.sigma
    causes = []
    if of.sign < 0:
        causes.append(NamedCause(TorqueCause.SIGN, found.factor, factor_sigma))
    if of.is_scaled:
        causes.append(NamedCause(TorqueCause.SCALE, abs(found.factor), factor_sigma))
    if of.is_turned:
        causes.append(NamedCause(TorqueCause.TIMING, found.angle_rad, angle_sigma))
    if of.is_loaded:
        causes.append(NamedCause(TorqueCause.LOAD, found.load_n, load_sigma))
    if of.body:
        causes.append(NamedCause(TorqueCause.MASS, found.mass, mass_sigma, of.body))
    return tuple(causes)
