"""A measured clearance: what it says of the joint, in figures and in words."""

import math
from collections.abc import Sequence

import attrs
import numpy as np

from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.estimate.cause import SURE_SIGMAS
from leg_wear_monitor.mechanism.arrays import Floats, body_names
from leg_wear_monitor.mechanism.person import GROUND_LOAD, heavier_person, with_toe_force
from leg_wear_monitor.mechanism.plausible import measured_fault, sigma_fault
from leg_wear_monitor.mechanism.position import TURN, build_linkage, one_cycle
from leg_wear_monitor.mechanism.spec import Clearance, Mechanism
from leg_wear_monitor.monitor.config.sections import Forecasting
from leg_wear_monitor.monitor.forecast.wear_coefficients import (
    ClearanceAtWear,
    CoefficientEstimate,
    CoefficientPrior,
    corrections_of,
    estimate_coefficient,
)
from leg_wear_monitor.monitor.ledger.entry import CorrectedClearance, JointWear, Measurement
from leg_wear_monitor.twin.reference import MASS_TOLERANCE
from leg_wear_monitor.twin.statistics import CycleStatistics

# How past forecasts did: a measured clearance is later reality, and the ledger says what was expected.


LEAST = 5  # measurements, below which fractions have no meaning


@attrs.frozen
class Validity:
    """Predicted against measured.

    Attributes
    ----------
    measurements : int
    within : int
        Of them between p10 and p90 of what was expected: 80 % in the long run.
    bias : float
        Mean probability with which less was expected, less one half: above 0, joints wear faster than
        forecast; from -0.5 to 0.5.
    """

    measurements: int
    within: int
    bias: float

    @property
    def words(self) -> str:
        """In a line, for operators."""
        text = f"{self.within} of {self.measurements} measured clearances were between expected p10 and p90"
        if self.measurements < LEAST:
            return f"{text}; too few to evaluate the forecast"
        # a mean of n even numbers from 0 to 1 has a standard deviation of 1 / sqrt(12 n)
        if abs(self.bias) * np.sqrt(12.0 * self.measurements) < 2.0:
            return f"{text}; no bias found"
        return f"{text}; joints wear {'faster' if self.bias > 0.0 else 'slower'} than forecast"


def validity(measurements: Sequence[Measurement]) -> Validity:
    """What measurements say of the forecasts before each of them; contradictions too, not withdrawn ones."""
    below = np.array([m.expected_below for m in measurements if not m.is_withdrawn])
    within = int(np.count_nonzero((below >= 0.1) & (below <= 0.9)))
    return Validity(len(below), within, float(below.mean() - 0.5) if len(below) else 0.0)


CONTRADICTS = 0.00135  # probability of a tail: three standard deviations of a normal one

CONTRADICTION = "this contradicts the model"
AGREES = "this agrees with what"
AT_LIMIT = "the measured clearance is at its limit"

_SAYS_SOMETHING = 0.9  # of the spread before: what is left after a measurement that says something


@attrs.frozen(eq=False)
class MeasurementResult:
    """What a measurement says.

    Attributes
    ----------
    measurement : Measurement
        To be noted in the ledger.
    before, after : CoefficientEstimate
        Of the joint's wear coefficient.
    contradicts : bool
        Whether the model holds it next to impossible.
    counted_m : float
        Clearance that the twin had counted for this part.
    words : tuple of str
        For people, a line each.
    shown_m, shown_sigma_m, shown_by : float, float, str
        What encoders or the drive torque showed of the joint before, with its source in words; NaN and empty
        if they showed nothing.
    """

    measurement: Measurement
    before: CoefficientEstimate
    after: CoefficientEstimate
    contradicts: bool
    counted_m: float
    words: tuple[str, ...]
    shown_m: float = math.nan
    shown_sigma_m: float = math.nan
    shown_by: str = ""

    @property
    def agrees(self) -> bool:
        """Whether the measurement is what encoders or the drive torque showed."""
        sigma_m = math.hypot(self.measurement.sigma_m, self.shown_sigma_m)
        return abs(self.measurement.clearance_m - self.shown_m) <= SURE_SIGMAS * sigma_m  # not with NaN

    def _compared(self, limit_m: float) -> list[str]:
        """The measurement against what encoders or the drive torque showed."""
        if math.isnan(self.shown_m):
            return []
        now, shown = self.measurement, f"{_mm(self.shown_m)} ± {_mm(self.shown_sigma_m)}"
        if self.agrees:
            return [f"{AGREES} {self.shown_by} shows, {shown}"]
        line = f"{self.shown_by} showed {shown}, and this measurement contradicts it"
        if now.clearance_m + SURE_SIGMAS * now.sigma_m < limit_m <= self.shown_m:
            line += f": the alarm clearance {now.joint} is acknowledged with it"
        return [line]

    def told(self, limit_m: float, warn_fraction: float, earlier: Sequence[Measurement]) -> tuple[str, ...]:
        """The measurement and what came of it, for people, a line each.

        Parameters
        ----------
        limit_m : float
            Of the joint's clearance.
        warn_fraction : float
            Of the limit, where its alarm begins.
        earlier : sequence of Measurement
            All of the ledger, without this one.
        """
        now = self.measurement
        size = f"{_mm(now.clearance_m)} ± {_mm(now.sigma_m)}"
        lines = [f"{now.joint}: {size}, {now.cycles} gait cycles after the part was new"]
        lines.append(f"{_mm(self.counted_m)} is counted (limit {_mm(limit_m)}); that stays as it is")
        if now.clearance_m >= limit_m:
            lines.append(
                f"{AT_LIMIT}: stop the leg when it is safe; the alarm clearance {now.joint} is raised"
            )
        elif now.clearance_m >= warn_fraction * limit_m:
            part = f"{100.0 * warn_fraction:g} % of its limit"
            lines.append(f"the measured clearance is above {part}: the alarm clearance {now.joint} is raised")
        lines += self._compared(limit_m)
        if self.agrees and self.contradicts:  # the counting is wrong, not the measurement
            used = "uses" if now.counts else "does not use"
            lines.append(f"the joint has opened otherwise than counted; the forecast {used} the measurement")
            return (*lines, validity([*earlier, now]).words)
        return (*lines, *self.words, validity([*earlier, now]).words)

    def has_findings(self, limit_m: float) -> bool:
        """Whether the caller has to act: the measurement contradicts the model, or is at the limit."""
        is_odd = self.contradicts and not self.agrees
        return is_odd or self.measurement.clearance_m >= limit_m


def asks_to_act(told: str) -> bool:
    """Whether `MeasurementResult.told` contains a finding, for a program that has the text alone."""
    return AT_LIMIT in told or CONTRADICTION in told


def last_measured(measurements: Sequence[Measurement], joint: str, replaced_ns: int) -> Measurement | None:
    """The last measurement of a joint's present part, even if the model contradicts it; None without one."""
    own = [
        m for m in measurements if m.joint == joint and m.replaced_ns == replaced_ns and not m.is_withdrawn
    ]
    return own[-1] if own else None


def judged_clearance_m(counted_m: float, measured: Measurement | None, believed_m: float = math.nan) -> float:
    """Clearance that is compared with the limit: the counted one, or a larger one by measurement.

    Parameters
    ----------
    counted_m : float
    measured : Measurement or None
        The last one of the part. A measurement that does not count for the forecast is still what somebody
        found on the leg.
    believed_m : float
        Median of what counting and measurements together give; NaN if it is not known.
    """
    if measured is None:
        return counted_m
    believed = [believed_m] if measured.counts and not math.isnan(believed_m) else []
    return max(counted_m, measured.clearance_m, *believed)


def observations_of(
    measurements: Sequence[Measurement], joint: str, replaced_ns: int
) -> list[ClearanceAtWear]:
    """Measurements of a joint's present part that count."""
    return [
        ClearanceAtWear(m.clearance_m, math.hypot(m.sigma_m, m.wear_sigma_m), m.wear_m)
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
    prior: CoefficientPrior | None = None,
    corrections: Sequence[CorrectedClearance] = (),
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
        Whether it counts even if it contradicts the model.
    prior : CoefficientPrior, optional
        Without it, the configured spread about the nominal coefficient.
    corrections : sequence of CorrectedClearance
        All of the ledger.

    Raises
    ------
    ConfigError
        For figures that cannot be: they are likely meant in another unit.
    """
    fresh_m, radius_m = clearance.radial_clearance, clearance.bushing_radius
    for name, fault in (
        ("clearance", measured_fault(wear.name, fresh_m, radius_m, clearance_m)),
        ("sigma", sigma_fault(radius_m, sigma_m)),
    ):
        if fault:
            raise ConfigError(name, "", fault)
    observations = observations_of(earlier, wear.name, wear.replaced_ns)
    wear_sigma_m = math.sqrt(wear.sampling_m2)
    observation = ClearanceAtWear(clearance_m, math.hypot(sigma_m, wear_sigma_m), wear.mean_m)
    corrected = corrections_of(corrections, wear.name, wear.replaced_ns)
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
        wear_sigma_m=wear_sigma_m,
    )
    words = _clock(stamp_ns, kept_ns)
    if contradicts:
        words += _contradiction(accept, below, wear.name)
    return MeasurementResult(
        measurement=measurement,
        before=before,
        after=after,
        contradicts=contradicts,
        counted_m=fresh_m + observation.wear_m,
        words=(*words, _change(before, after)),
    )


def _mm(value_m: float) -> str:
    return f"{1.0e3 * value_m:.4g} mm"


def _clock(stamp_ns: int, kept_ns: int) -> list[str]:
    if not kept_ns or stamp_ns >= kept_ns:
        return []
    return [
        f"the clock is {(kept_ns - stamp_ns) / 3.6e12:.3g} h before the ledger's last entry; "
        "the measurement counts for the wear that is in the ledger now"
    ]


def _contradiction(accept: bool, below: float, joint: str) -> list[str]:
    more = "larger" if below > 0.5 else "smaller"
    done = "it counts, as requested" if accept else "it is kept in the ledger, but does not count"
    return [
        f"{CONTRADICTION}: the clearance of {joint} is far {more} than possible; {done}",
        "measure again; if the part was replaced, reset its wear first; if load or clearance when new are "
        "other than configured, correct that; if the measurement is correct, use --accept",
    ]


def _change(before: CoefficientEstimate, after: CoefficientEstimate) -> str:
    if after.observations == before.observations:
        return "the estimate of the wear coefficient is unchanged"
    if after.sigma > _SAYS_SOMETHING * before.sigma:
        return "it adds little: the wear is still too small for its accuracy"
    low, middle, high = (float(x) for x in np.exp(after.log_factors((0.1, 0.5, 0.9))))
    return (
        f"the wear coefficient is {middle:.3g} times the nominal one, {low:.3g} to {high:.3g} (p10 to p90); "
        f"its uncertainty is {before.sigma / after.sigma:.3g} times smaller than before"
    )


# How far the growth of a real leg may be from that of the leg on paper, because of its masses and its load.
#
# Wear grows with force times sliding. What the ideal motion makes of it follows from its reactions, and so
# does its sensitivity to each body's mass: without a simulation, a fraction of a second for any mechanism.
# The rest is made by impacts.


# squared sensitivity of what impacts make: by regression over the joints of sixteen legs as built
# (`benchmarks/growth_coverage.py --quick --legs 16`)
_OF_IMPACTS = 1.6
# what a load changes in the part of the growth that impacts make, of what it changes in the other one: least
# squares over five joints under 300 and 600 N (docs/appendix/forecast.md, lives under a load of the ground)
_LOAD_OF_IMPACTS = 0.3
_POINTS = 160  # of a gait cycle
_MASS_STEP = 0.01


@attrs.frozen(eq=False)
class ModelError:
    """What the counted growth of each clearance joint may be off.

    Attributes
    ----------
    ideal_m : (k,) array
        Growth a gait cycle that the ideal motion makes.
    sensitivity : (k,) array
        Of its logarithm to those of all masses, root sum of squares; the person's is known less well.
    load : (k,) array
        Change of its logarithm by the standard deviation of the load's size.
    """

    ideal_m: Floats
    sensitivity: Floats
    load: Floats

    @classmethod
    def none(cls, joints: int) -> "ModelError":
        """Of a leg that is known."""
        return cls(*np.zeros((3, joints)))

    def relative(self, k: int, growth_m: float) -> float:
        """Standard deviation of a joint's growth a gait cycle, as a fraction of it.

        Impacts depend on masses, lengths and ripple in a rugged way, not by sensitivities: their fraction of
        the growth adds to the variance in proportion.
        """
        masses = MASS_TOLERANCE * math.sqrt(
            self.sensitivity[k] ** 2 + _OF_IMPACTS * self._impacts(k, growth_m)
        )
        return math.hypot(masses, self.by_load(k, growth_m))

    def by_load(self, k: int, growth_m: float) -> float:
        """Standard deviation of it by the load alone."""
        return float(self.load[k]) * (1.0 - (1.0 - _LOAD_OF_IMPACTS) * self._impacts(k, growth_m))

    def _impacts(self, k: int, growth_m: float) -> float:
        """Fraction of a joint's growth that impacts make."""
        return min(1.0, abs(1.0 - self.ideal_m[k] / growth_m)) if growth_m > 0.0 else 0.0


def model_error(
    mechanism: Mechanism, speed_radps: float, wear_acceleration: float = 1.0, load_sigma: float = 0.0
) -> ModelError:
    """Model error of a leg on paper.

    Parameters
    ----------
    mechanism : Mechanism
        The masses of its bodies are independent of each other, and inertias follow them.
    speed_radps : float
        Of its crank.
    wear_acceleration : float
        Factor on all wear.
    load_sigma : float
        Standard deviation of the size of the ground's force on its toe, as a fraction of it.
    """
    sliding = _force_times_sliding(mechanism, speed_radps)
    square = np.zeros_like(sliding)
    for name, body in mechanism.bodies.items():
        factor = 1.0 + _MASS_STEP
        heavier = attrs.evolve(body, mass=factor * body.mass, inertia=factor * body.inertia)
        changed = attrs.evolve(mechanism, bodies={**mechanism.bodies, name: heavier})
        square += np.square((_force_times_sliding(changed, speed_radps) - sliding) / _MASS_STEP)
    if mechanism.person_kg:
        more = _force_times_sliding(heavier_person(mechanism), speed_radps) - sliding
        square += np.square(more / MASS_TOLERANCE)
    load = np.zeros_like(sliding)
    if load_sigma:
        force = (1.0 + load_sigma) * np.array(mechanism.loads[GROUND_LOAD].force)
        load = np.abs(_force_times_sliding(with_toe_force(mechanism, force), speed_radps) - sliding)
    # a joint that carries nothing on paper: all of its growth is made by impacts
    sensitivity, load = (
        np.divide(change, sliding, out=np.zeros_like(sliding), where=sliding > 0.0)
        for change in (np.sqrt(square), load)
    )
    parts = [mechanism.clearances[joint] for joint in mechanism.clearance_joints]
    # Archard's law, spread over the contact's area: both surfaces open the clearance (wear.py)
    per_joule = [sum(part.wear_coefficient) / (TURN * part.bushing_radius * part.width) for part in parts]
    return ModelError(wear_acceleration * np.array(per_joule) * sliding, sensitivity, load)


def _force_times_sliding(mechanism: Mechanism, speed_radps: float) -> Floats:
    """Force times sliding distance [J] over a gait cycle in each clearance joint, all joints ideal (k,)."""
    motion = one_cycle(build_linkage(mechanism), _POINTS, speed_radps)
    names, joints, found = body_names(mechanism), list(mechanism.joints), []
    for name in mechanism.clearance_joints:
        bushing, journal = (names.index(body) for body in mechanism.sides(name))
        turning = np.abs(motion.v[:, journal, 2] - motion.v[:, bushing, 2])
        force = np.linalg.norm(motion.joint_force[:, joints.index(name)], axis=1)
        radius = mechanism.clearances[name].bushing_radius
        found.append(radius * (force * turning).mean() * TURN / abs(speed_radps))
    return np.array(found)


# How fast clearances grow: averaged over gait cycles, since single cycles of a chaotic motion scatter.


LEAST_CYCLES = 10
LARGEST_ERROR = 0.5  # of the mean: beyond it the scatter says more than the mean

_BATCHES = 5  # of six cycles each in a window of thirty: longer than neighbours hang together
# five means leave four degrees of freedom: Student's t, not a normal distribution. So wide is the normal one
# whose interval from p10 to p90 is that of t: 1.533 standard errors, not 1.282
_WIDER = 1.533 / 1.282


@attrs.frozen(eq=False)
class GrowthWindow:
    """The last gait cycles of one joint.

    Attributes
    ----------
    growth_m : (n,) array
        Of the mean clearance in each cycle.
    moving_s : (n,) array
        Time in motion of each.
    """

    growth_m: Floats = attrs.field(factory=lambda: np.zeros(0))
    moving_s: Floats = attrs.field(factory=lambda: np.zeros(0))


@attrs.frozen
class GrowthRate:
    """Mean growth over a window.

    Attributes
    ----------
    per_cycle_m, sampling_m : float
        A gait cycle, and the uncertainty of this mean because single cycles scatter.
    per_second_m : float
        A second of walking.
    """

    per_cycle_m: float
    sampling_m: float
    per_second_m: float

    def error_m(self, model_error: float) -> float:
        """Uncertainty of a gait cycle's growth in this leg: of the mean, and of the model.

        As of a normal distribution: 80 % lie within 1.28 of it either way.

        Parameters
        ----------
        model_error : float
            Standard deviation of the relative growth (`ModelError`).
        """
        return math.hypot(self.sampling_m, model_error * self.per_cycle_m)


def extended(window: GrowthWindow, growth_m: float, moving_s: float, cycles: int) -> GrowthWindow:
    """Window of at most so many cycles with one more."""
    keep = max(0, len(window.growth_m) + 1 - cycles)
    return GrowthWindow(
        np.append(window.growth_m[keep:], growth_m), np.append(window.moving_s[keep:], moving_s)
    )


def all_extended(
    windows: Sequence[GrowthWindow], statistics: CycleStatistics, cycles: int
) -> tuple[GrowthWindow, ...]:
    """Windows of all joints, with a gait cycle that was followed."""
    each = zip(windows, statistics.growth_mean_m.tolist(), strict=True)
    return tuple(extended(window, growth_m, statistics.moving_s, cycles) for window, growth_m in each)


def growth_rate(window: GrowthWindow) -> GrowthRate | None:
    """Mean growth, None while there is not enough data to know it.

    A mean is used and not a median: wear comes in bursts, and the mean is what adds up. Neighbouring cycles
    of a chaotic motion hang together, so the scatter is that of the means of batches.
    """
    n = len(window.growth_m)
    if n < LEAST_CYCLES:
        return None
    mean = float(window.growth_m.mean())
    sampling = _WIDER * _standard_error(window.growth_m)
    if not sampling <= LARGEST_ERROR * abs(mean):
        return None
    return GrowthRate(mean, sampling, float(window.growth_m.sum() / window.moving_s.sum()))


def _standard_error(values: Floats) -> float:
    size = len(values) // _BATCHES
    means = values[len(values) - _BATCHES * size :].reshape(_BATCHES, size).mean(axis=1)
    return float(means.std(ddof=1) / math.sqrt(_BATCHES))
