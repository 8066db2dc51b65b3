"""The forecast as gait cycles come in: renewed once a minute of their stamps, or when more is known."""

import math
import reprlib
from collections.abc import Callable, Sequence
from typing import Any, TypeVar

import attrs
import numpy as np

from leg_wear_monitor.configuration import Doubt
from leg_wear_monitor.errors import ConfigError, LegWearError
from leg_wear_monitor.files import read_json, share_directory
from leg_wear_monitor.life.result import SCHEMA_VERSION
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor.config.sections import Forecasting
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.forecast import measurement
from leg_wear_monitor.monitor.forecast.forecast import (
    Forecast,
    GrowthLaw,
    JointCondition,
    SimulatedLife,
    fitted_law,
    forecast,
    no_law,
)
from leg_wear_monitor.monitor.forecast.growth import GrowthRate, GrowthWindow, all_extended, growth_rate
from leg_wear_monitor.monitor.forecast.model_error import ModelError
from leg_wear_monitor.monitor.forecast.wear_coefficients import (
    ClearanceAtWear,
    CoefficientEstimate,
    corrections_of,
    estimate_coefficient,
    usual_prior,
)
from leg_wear_monitor.monitor.ledger.entry import (
    CorrectedClearance,
    JointWear,
    Measurement,
    Recount,
    fingerprint,
)
from leg_wear_monitor.twin.statistics import CycleStatistics

_T = TypeVar("_T")

# Lives from files of ``leg-wear-monitor life --json``, each bound to the leg it was simulated for.


def law_of(mechanism: Mechanism, path: str, sigma: float) -> GrowthLaw:
    """Law of growth of a leg.

    Parameters
    ----------
    mechanism : Mechanism
        As the configuration wants it.
    path : str
        A file of its lives. If empty, the file of the package for this leg; without such a file, growth is
        assumed constant.
    sigma : float
        Standard deviation of ln growth, if lives do not show it.

    Raises
    ------
    ConfigError
        If the file cannot be read, or describes a different leg.
    """
    lives = read_lives(path, mechanism) if path else _shipped_lives(mechanism)
    if not lives:
        fresh = [mechanism.clearances[joint].radial_clearance for joint in mechanism.clearance_joints]
        return no_law(np.array(fresh), sigma)
    return fitted_law(lives, sigma)


def life_doubts(config: MonitorConfig, leg: Mechanism) -> tuple[Doubt, ...]:
    """Simulated lives that end before the limit of a clearance.

    Raises
    ------
    ConfigError
        If the file of lives cannot be used.
    """
    given = config.forecast.growth_law_file
    ends_m = float(law_of(leg, given, config.forecast.model_sigma).widest_m.max(initial=0.0))
    joints = leg.clearance_joints
    limits = dict(zip(joints, config.limits.of_clearances(len(joints))[1], strict=True))
    joint = max(joints, key=lambda name: limits[name])
    if limits[joint] <= ends_m:
        return ()
    lives = f"the lives of {given}" if given else "the lives of this leg that come with the package"
    text = (
        f"{lives} end at {1e3 * ends_m:.3g} mm, below the limit of joint {joint}, "
        f"{1e3 * limits[joint]:g} mm; beyond, the forecast assumes constant growth. Expected lives from "
        f"`leg-wear-monitor life --limit-m {limits[joint]:g}`"
    )
    return (Doubt("forecast.growth_law_file", text),)


def read_lives(path: str, mechanism: Mechanism) -> Sequence[SimulatedLife]:
    """Lives of a leg from their file, its joints in the mechanism's order.

    Raises
    ------
    ConfigError
        If the file cannot be read, or describes a different leg.
    """
    document = _document(path)
    own = fingerprint(mechanism)
    if document.get("fingerprint") != own:
        raise ConfigError(
            path,
            "fingerprint",
            f"{document.get('fingerprint')!r} belongs to a different leg than this one, {own!r} (bodies, "
            f"joints, or "
            "clearances when new); simulate its lives again with `leg-wear-monitor life --json`",
        )
    return _lives_in(document, path, mechanism)


def _shipped_lives(mechanism: Mechanism) -> Sequence[SimulatedLife]:
    """Lives that come with the package for just this leg; none if there are none."""
    own = fingerprint(mechanism)
    for file in sorted((share_directory() / "config" / "lives").glob("*.json")):
        document = _document(str(file))
        if document.get("fingerprint") == own:
            return _lives_in(document, str(file), mechanism)
    return ()


def _lives_in(document: dict[str, Any], path: str, mechanism: Mechanism) -> Sequence[SimulatedLife]:
    try:
        return [_life(each, mechanism.clearance_joints) for each in (document, *document["further"])]
    except (ValueError, KeyError, TypeError, OverflowError) as error:
        joints = ", ".join(mechanism.clearance_joints)
        raise ConfigError(
            path, "", f"is not a life of the joints {joints}. Expected the output of `life --json`"
        ) from error


def _document(path: str) -> dict[str, Any]:
    document = read_json(path)
    if not isinstance(document, dict):
        raise ConfigError(path, "", "is not a life. Expected the output of `life --json`")
    version = document.get("schema_version", 1)
    if version != SCHEMA_VERSION:
        fault = f"{reprlib.repr(version)} is not {SCHEMA_VERSION}, the version that this program reads"
        raise ConfigError(path, "schema_version", f"{fault}; simulate the lives again")
    return document


def _life(record: dict[str, Any], clearance_joints: Sequence[str]) -> SimulatedLife:
    def columns(name: str) -> Floats:
        return np.array([record["joints"][joint][name] for joint in clearance_joints], dtype=float).T

    life = SimulatedLife(
        factor=np.array([record["wear_factor"][joint] for joint in clearance_joints], dtype=float),
        cycles=np.array(record["cycles"], dtype=float),
        clearance_m=columns("clearance_m"),
        growth_m_per_cycle=columns("growth_m_per_cycle"),
    )
    shapes = {life.clearance_m.shape, life.growth_m_per_cycle.shape, (len(life.cycles), len(life.factor))}
    if len(shapes) > 1 or len(life.cycles) < 2 or not (life.clearance_m > 0.0).all():
        raise ValueError("values that do not fit together")
    return life


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
    corrections : sequence of CorrectedClearance and CoefficientSpan
        Of the ledger.

    Attributes
    ----------
    growth : tuple of GrowthWindow
    coefficient_estimates : tuple of CoefficientEstimate
    measurements, corrections : tuples of Measurement, of CorrectedClearance and CoefficientSpan
        Of the ledger, and since.

    Raises
    ------
    ConfigError
        For a file of lives that cannot be used.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        settings: Forecasting,
        measurements: Sequence[Measurement],
        replaced_ns: Sequence[int],
        corrections: Sequence[Recount] = (),
    ) -> None:
        self._settings, self._clearance_joints = settings, mechanism.clearance_joints
        self._clearances = [mechanism.clearances[joint] for joint in mechanism.clearance_joints]
        self._fresh_m = [clearance.radial_clearance for clearance in self._clearances]
        self._law = law_of(mechanism, settings.growth_law_file, settings.model_sigma)
        self.growth = tuple(GrowthWindow() for _ in self._clearance_joints)
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
        model: ModelError,
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
        model : ModelError
            Error of the growth because of the load.
        """
        self.growth = all_extended(self.growth, statistics, self._settings.window_cycles)
        is_recent = 0 <= statistics.stamp_ns - self._stamp_ns < RENEWED_NS
        rates = [growth_rate(window) for window in self.growth]
        if self._last is None or not is_recent or _known(rates) > self._known:
            self._stamp_ns = statistics.stamp_ns
            return self.renewed(wear_m, limits_m, is_valid(), model)
        return self._last

    def renewed(
        self,
        wear_m: Floats,
        limits_m: Sequence[float],
        is_valid: bool,
        model: ModelError,
    ) -> Forecast:
        """A new forecast from the present state; parameters as in `after`."""
        rates = [growth_rate(window) for window in self.growth]
        self._known = _known(rates)
        now = [
            JointCondition(
                joint=joint,
                fresh_m=self._fresh_m[k],
                wear_m=float(wear_m[k]),
                limit_m=limits_m[k],
                growth_m=rate.per_cycle_m if rate else None,
                growth_error_m=rate.error_m(model.by_load(k, rate.per_cycle_m)) if rate else 0.0,
                has_coefficient=max(self._clearances[k].wear_coefficient) > 0.0,
            )
            for k, (joint, rate) in enumerate(zip(self._clearance_joints, rates, strict=True))
        ]
        # the window of a new part is shorter than the windows of the other joints
        walked = max((window.moving_s for window in self.growth), key=len)
        self._last = forecast(
            now,
            self.coefficient_estimates,
            self._settings,
            self._law,
            cycle_s=float(np.mean(walked)),
            valid=is_valid,
        )
        return self._last

    def expire(self) -> None:
        """Make a new forecast after the next gait cycle, because its inputs have changed."""
        self._last = None

    def last_measured(self, replaced_ns: Sequence[int]) -> tuple[Measurement | None, ...]:
        """Last measurement of each joint's present part, None without one."""
        parts = zip(self._clearance_joints, replaced_ns, strict=True)
        return tuple(measurement.last_measured(self.measurements, joint, when) for joint, when in parts)

    def replaced(self, joint: str, replaced_ns: int) -> None:
        """Reset the estimate of a joint with a new part to the prior knowledge of this part."""
        k = self._clearance_joints.index(joint)
        self.growth = _with(self.growth, k, GrowthWindow())
        self._update_coefficients(k, self._estimate(k, replaced_ns))

    def corrected(self, correction: CorrectedClearance) -> None:
        """Count the wear of a joint from a corrected clearance on."""
        self.corrections += (correction,)
        self.replaced(correction.joint, correction.replaced_ns)

    def measured(
        self,
        wear: JointWear,
        *,
        clearance_m: float,
        sigma_m: float,
        stamp_ns: int,
        who: str,
        kept_ns: int = 0,
        accept: bool = False,
    ) -> measurement.MeasurementResult:
        """Update with a measured clearance; parameters as in `measure`."""
        k = self._clearance_joints.index(wear.name)
        found = measurement.measure(
            self._settings,
            self._clearances[k],
            wear,
            self.measurements,
            clearance_m=clearance_m,
            sigma_m=sigma_m,
            stamp_ns=stamp_ns,
            who=who,
            kept_ns=kept_ns,
            accept=accept,
            corrections=self.corrections,
        )
        self.measurements += (found.measurement,)
        self._update_coefficients(k, found.after)
        return found

    def withdrawn(self, number: int, stamp_ns: int, who: str) -> Measurement:
        """Withdraw the measurement with an `id`; the estimate of its joint is renewed by `replaced`."""
        found = {one.id: one for one in self.measurements if one.id}
        if number not in found or found[number].is_withdrawn:
            fault = "is withdrawn already" if number in found else "is not in the ledger"
            raise LegWearError(f"measurement {number}: {fault}")
        now = attrs.evolve(found[number], withdrawn_ns=stamp_ns, withdrawn_by=who)
        measurements = self.measurements
        self.measurements = tuple(now if one.id == number else one for one in measurements)
        return now

    def best_estimate_m(self, k: int, modelled_m: float) -> float:
        """Median of the clearance of joint k by counting and measurements; NaN without a measurement."""
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
        is_plausible = measurement.CONTRADICTS <= below <= 1.0 - measurement.CONTRADICTS
        self._update_coefficients(
            k, self._estimate(k, replaced_ns, observation) if is_plausible else estimate
        )
        return is_plausible

    def _estimate(self, k: int, replaced_ns: int, *further: ClearanceAtWear) -> CoefficientEstimate:
        """Estimate for a part, from its prior, the measurements that count, and further ones."""
        joint = self._clearance_joints[k]
        observations = measurement.observations_of(self.measurements, joint, replaced_ns)
        return estimate_coefficient(
            self._settings,
            self._fresh_m[k],
            [*observations, *further],
            usual_prior(self._clearances[k]),
            corrections_of(self.corrections, joint, replaced_ns),
        )

    def _update_coefficients(self, k: int, coefficient_estimate: CoefficientEstimate) -> None:
        self.coefficient_estimates = _with(self.coefficient_estimates, k, coefficient_estimate)
        self._last = None


def _known(rates: Sequence[GrowthRate | None]) -> int:
    return sum(rate is not None for rate in rates)


def _with(values: tuple[_T, ...], k: int, new: _T) -> tuple[_T, ...]:
    """Values with a new value at k."""
    return (*values[:k], new, *values[k + 1 :])
