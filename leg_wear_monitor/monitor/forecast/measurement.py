"""A measured clearance and its effects on the joint, as values and sentences."""

import math
from collections.abc import Sequence

import attrs
import numpy as np

from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.estimate.cause import SURE_SIGMAS
from leg_wear_monitor.mechanism.loader import measured_fault, sigma_fault
from leg_wear_monitor.mechanism.spec import Clearance
from leg_wear_monitor.monitor.alarms import WARN_FRACTION
from leg_wear_monitor.monitor.config.settings import Forecasting
from leg_wear_monitor.monitor.forecast.wear_coefficients import (
    ClearanceAtWear,
    CoefficientEstimate,
    corrections_of,
    estimate_coefficient,
    usual_prior,
)
from leg_wear_monitor.monitor.ledger.entry import JointWear, Measurement, Recount

# Accuracy of past forecasts: the ledger has the expected value of each measured clearance.


LEAST = 5  # measurements, below which fractions have no meaning


def validity(measurements: Sequence[Measurement]) -> str:
    """Agreement of measurements with the forecasts before each of them, in a line for operators.

    Measurements that contradict the model count as well, and withdrawn measurements do not. In the long run
    80 % are between the p10 and the p90 of the expected clearance.
    """
    below = np.array([m.expected_below for m in measurements if not m.is_withdrawn])
    within = int(np.count_nonzero((below >= 0.1) & (below <= 0.9)))
    text = f"{within} of {len(below)} measured clearances were between expected p10 and p90"
    if len(below) < LEAST:
        return f"{text}; too few to evaluate the forecast"
    bias = float(below.mean() - 0.5)  # above 0, joints wear faster than forecast
    # a mean of n even numbers from 0 to 1 has a standard deviation of 1 / sqrt(12 n)
    if abs(bias) * np.sqrt(12.0 * len(below)) < 2.0:
        return f"{text}; no bias found"
    return f"{text}; joints wear {'faster' if bias > 0.0 else 'slower'} than forecast"


CONTRADICTS = 0.00135  # probability of a tail: three standard deviations of a normal one

AT_LIMIT, CONTRADICTS_MODEL, NOT_STORED = "AT_LIMIT", "CONTRADICTS_MODEL", "NOT_STORED"
"""Codes that begin a service's reply in brackets if the operator has to act: ``[AT_LIMIT] A: …``."""

_SAYS_SOMETHING = 0.9  # a measurement is informative if it leaves at most this fraction of the spread


@attrs.frozen(eq=False)
class MeasurementResult:
    """Meaning of a measurement.

    Attributes
    ----------
    measurement : Measurement
        To be noted in the ledger.
    before, after : CoefficientEstimate
        Of the joint's wear coefficient.
    contradicts : bool
        True if the model holds it next to impossible.
    modelled_m : float
        Clearance that the twin had modelled for this part.
    words : tuple of str
        For people, a line each.
    shown_m, shown_sigma_m, shown_by : float, float, str
        Estimate of the joint by encoders or the drive torque before, with its source in words; NaN and empty
        without an estimate.
    eased : str
        Effect on an alarm of the clearance that an earlier measurement had raised, such as ``ends``; empty if
        it stays.
    limit_m : float
        Limit of the joint's clearance.
    earlier : sequence of Measurement
        All of the ledger, without this one.
    """

    measurement: Measurement
    before: CoefficientEstimate
    after: CoefficientEstimate
    contradicts: bool
    modelled_m: float
    words: tuple[str, ...]
    shown_m: float = math.nan
    shown_sigma_m: float = math.nan
    shown_by: str = ""
    eased: str = ""
    limit_m: float = math.nan
    earlier: Sequence[Measurement] = ()

    @property
    def agrees(self) -> bool:
        """True if the measurement agrees with the estimate by encoders or the drive torque."""
        sigma_m = math.hypot(self.measurement.sigma_m, self.shown_sigma_m)
        return abs(self.measurement.clearance_m - self.shown_m) <= SURE_SIGMAS * sigma_m  # not with NaN

    def _compared(self) -> list[str]:
        """The measurement against the estimate by encoders or the drive torque."""
        if math.isnan(self.shown_m) or math.isnan(self.shown_sigma_m):
            return []
        now, shown = self.measurement, f"{_mm(self.shown_m)} ± {_mm(self.shown_sigma_m)}"
        if self.agrees:
            return [f"this agrees with {self.shown_by}: {shown}"]
        line = f"this contradicts {self.shown_by}: {shown}"
        if now.clearance_m + SURE_SIGMAS * now.sigma_m < self.limit_m <= self.shown_m:
            line += f": the alarm clearance {now.joint} is acknowledged with it"
        return [line]

    @property
    def lines(self) -> tuple[str, ...]:
        """The measurement and its effects for operators, one line each."""
        now, limit_m = self.measurement, self.limit_m
        size = f"{_mm(now.clearance_m)} ± {_mm(now.sigma_m)}"
        lines = [f"{now.joint}: {size}, {now.cycles} gait cycles after the part was new"]
        lines.append(f"the modelled clearance stays at {_mm(self.modelled_m)} (limit {_mm(limit_m)})")
        if now.clearance_m >= limit_m:
            lines.append(
                "the measured clearance is at its limit: stop the leg when it is safe; "
                f"the alarm clearance {now.joint} is raised"
            )
        elif now.clearance_m >= WARN_FRACTION * limit_m:
            part = f"{100.0 * WARN_FRACTION:g} % of its limit"
            lines.append(f"the measured clearance is above {part}: the alarm clearance {now.joint} is raised")
        if self.eased:
            lines.append(f"the alarm clearance {now.joint} that an earlier measurement raised {self.eased}")
        lines += self._compared()
        if self.agrees and self.contradicts:  # the wear model is wrong, not the measurement
            used = "uses" if now.counts else "does not use"
            lines.append(f"the joint has not worn as modelled; the forecast {used} the measurement")
            lines += self.words[-1:] if now.counts else []
            return (*lines, validity([*self.earlier, now]))
        return (*lines, *self.words, validity([*self.earlier, now]))

    @property
    def codes(self) -> list[str]:
        """Codes of the findings on which the caller has to act."""
        at_limit = [AT_LIMIT] if self.measurement.clearance_m >= self.limit_m else []
        return at_limit + ([CONTRADICTS_MODEL] if self.contradicts and not self.agrees else [])


def with_codes(codes: Sequence[str], reply: str) -> str:
    """A reply of a service that begins with codes; `has_codes` finds them."""
    return f"[{', '.join(codes)}] {reply}" if codes else reply


def has_codes(reply: str) -> bool:
    """True if a service's reply has a code: the operator has to act."""
    return reply.startswith("[")


def last_measured(measurements: Sequence[Measurement], joint: str, replaced_ns: int) -> Measurement | None:
    """The last measurement of a joint's present part, even if the model contradicts it; None without one."""
    own = [
        m for m in measurements if m.joint == joint and m.replaced_ns == replaced_ns and not m.is_withdrawn
    ]
    return own[-1] if own else None


def judged_clearance_m(
    modelled_m: float, measured: Measurement | None, best_estimate_m: float = math.nan
) -> float:
    """Clearance to compare with the limit: the modelled clearance, or a larger measured clearance.

    Parameters
    ----------
    modelled_m : float
    measured : Measurement or None
        Last measurement of the part. A measurement that does not count for the forecast is still a finding on
        the leg.
    best_estimate_m : float
        Median of the estimate from model and measurements together; NaN if it is not known.
    """
    if measured is None:
        return modelled_m
    believed = [best_estimate_m] if measured.counts and not math.isnan(best_estimate_m) else []
    return max(modelled_m, measured.clearance_m, *believed)


def observations_of(
    measurements: Sequence[Measurement], joint: str, replaced_ns: int
) -> list[ClearanceAtWear]:
    """Measurements of a joint's present part that count."""
    return [
        ClearanceAtWear(m.clearance_m, m.sigma_m, m.wear_m)
        for m in measurements
        if m.joint == joint and m.replaced_ns == replaced_ns and m.counts and not m.is_withdrawn
    ]


def measure(
    settings: Forecasting,
    clearance: Clearance,
    wear: JointWear,
    earlier: Sequence[Measurement],
    *,
    clearance_m: float,
    sigma_m: float,
    stamp_ns: int,
    who: str,
    kept_ns: int = 0,
    accept: bool = False,
    corrections: Sequence[Recount] = (),
) -> MeasurementResult:
    """Evaluate a measured clearance.

    Parameters
    ----------
    settings : Forecasting
    clearance : Clearance
        Settings of the joint: its nominal clearance when new, and its bushing.
    wear : JointWear
        The joint's present part. The measurement counts for the wear in it, whatever the clock says.
    earlier : sequence of Measurement
        All of the ledger.
    clearance_m, sigma_m : float
        Radial, and its standard deviation.
    stamp_ns : int
        By the clock.
    who : str
    kept_ns : int
        Stamp of the ledger's last entry, 0 if there is none.
    accept : bool
        True if it counts even if it contradicts the model.
    corrections : sequence of CorrectedClearance and CoefficientSpan
        All of the ledger.

    Raises
    ------
    ConfigError
        For impossible values: they are likely meant in a different unit.
    """
    fresh_m, radius_m = clearance.radial_clearance, clearance.bushing_radius
    for name, fault in (
        ("clearance", measured_fault(wear.name, fresh_m, radius_m, clearance_m)),
        ("sigma", sigma_fault(clearance_m, sigma_m)),
    ):
        if fault:
            raise ConfigError(name, "", fault)
    observations = observations_of(earlier, wear.name, wear.replaced_ns)
    observation = ClearanceAtWear(clearance_m, sigma_m, wear.mean_m)
    corrected = corrections_of(corrections, wear.name, wear.replaced_ns)
    prior = usual_prior(clearance)
    before = estimate_coefficient(settings, fresh_m, observations, prior, corrected)
    below = before.probability_below(observation)
    contradicts = not CONTRADICTS <= below <= 1.0 - CONTRADICTS
    counts = accept or not contradicts
    observations += [observation] if counts else []
    after = estimate_coefficient(settings, fresh_m, observations, prior, corrected)
    measurement = Measurement(
        stamp_ns=stamp_ns,
        joint=wear.name,
        who=who,
        clearance_m=clearance_m,
        sigma_m=sigma_m,
        wear_m=observation.wear_m,
        cycles=wear.cycles,
        replaced_ns=wear.replaced_ns,
        expected_below=below,
        counts=counts,
    )
    words, per_pa = _clock(stamp_ns, kept_ns), max(clearance.wear_coefficient) if contradicts else 0.0
    if contradicts:
        words += _contradiction(accept, below, wear.name)
    return MeasurementResult(
        measurement=measurement,
        before=before,
        after=after,
        contradicts=contradicts,
        modelled_m=fresh_m + observation.wear_m,
        words=(*words, _change(before, after, per_pa)),
    )


def _mm(value_m: float) -> str:
    return f"{1.0e3 * value_m:.4g} mm"


def _clock(stamp_ns: int, kept_ns: int) -> list[str]:
    if not kept_ns or stamp_ns >= kept_ns:
        return []
    return [
        f"the clock is {(kept_ns - stamp_ns) / 3.6e12:.3g} h before the ledger's last entry; "
        "the measurement is assigned to the wear that is in the ledger now"
    ]


def _contradiction(accept: bool, below: float, joint: str) -> list[str]:
    more = "larger" if below > 0.5 else "smaller"
    done = "it is used, as requested" if accept else "it is stored in the ledger, but not used"
    last = "" if accept else "; if the measurement is correct, use --accept"
    return [
        f"this contradicts the model: the clearance of {joint} is far {more} than possible; {done}",
        "measure again; if the part was replaced, reset its wear first; if the load or the clearance "
        f"when new is wrong in the configuration, correct it{last}",
    ]


_MOST_PER_PA: float = attrs.fields_dict(Clearance)["wear_coefficient"].metadata["usual"][1]


def _change(before: CoefficientEstimate, after: CoefficientEstimate, doubted_per_pa: float) -> str:
    """Change of the coefficient; with its nominal value, whether the new value is possible for a joint."""
    if after.observations == before.observations:
        return "the estimate of the wear coefficient is unchanged"
    if after.sigma > _SAYS_SOMETHING * before.sigma:
        return "the measurement adds little: the wear is still too small for its accuracy"
    low, middle, high = (float(x) for x in np.exp(after.log_factors((0.1, 0.5, 0.9))))
    line = (
        f"the wear coefficient is {middle:.3g} times the nominal one, {low:.3g} to {high:.3g} (p10 to p90); "
        f"its uncertainty is {before.sigma / after.sigma:.3g} times smaller than before"
    )
    if middle * doubted_per_pa <= _MOST_PER_PA:
        return line
    return (
        f"{line}; that is {middle * doubted_per_pa:.2g} 1/Pa, usually below {_MOST_PER_PA:g} 1/Pa: wear "
        "alone cannot explain this clearance, and the forecast is far too short; withdraw the measurement "
        "and enter it without --accept"
    )
