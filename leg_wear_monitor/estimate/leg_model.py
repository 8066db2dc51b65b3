"""The expected leg: its signatures and its baseline, the fit of its clearances, and how a change is named."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import attrs
import numpy as np

from leg_wear_monitor.errors import AssemblyError
from leg_wear_monitor.estimate.cause import SURE_LOG_ODDS, Cause, Change
from leg_wear_monitor.estimate.explanations import (
    MODEL_ERROR,
    POOREST,
    Explainer,
    Explanation,
    Nuisance,
    Point,
    gauss_newton,
    opened,
)
from leg_wear_monitor.estimate.ground_load import (
    commissioned_baseline,
    nuisances,
    other_channels,
    parts_left_out,
    unknown_baseline,
    with_scatter_of,
)
from leg_wear_monitor.estimate.signature import (
    CommissionedTorque,
    SignatureModel,
    TorqueSensor,
    ideal_torque,
    mean_signatures,
    signature_model,
    signature_of_torque,
)
from leg_wear_monitor.mechanism.arrays import Floats, Ints
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.twin.reference import LegParameters
from leg_wear_monitor.twin.torque_reference import (
    HEAVIER,
    LONGER,
    ROUGHER,
    STIFFER,
    TorqueReference,
    levels_of,
)

# Masses, lengths, friction and the drive's compliance of a commissioned leg, from its drive torque.
#
# A real leg is not quite that of its mechanism file. Where its impacts fall, and what a clearance changes,
# depends on its masses, lengths and friction: a length that is 1 % off, or friction twice that of the file,
# makes a reference name wrong joints. So the reference is simulated again with the parameters that explain
# the torque of the leg when it was commissioned.
#
# Simulated legs show what each parameter changes, near the leg that is simulated. All parameters are changed
# at once: with one leg for each, 4 % of a body's mass changed less than the scatter of simulated legs, and
# slopes of masses were noise.
#
# Where a leg is far from its file, the torque with ideal joints leads near it: lengths that are 5 % off
# change that by half of the torque's size.


UNLIKE_FILE = 0.8  # misfit from which on the leg is not that of its file (docs/explanation/diagnosis.md)

# misfit from which on a leg is identified, and, as it is not that of its file then, down to which: scatter
# alone leaves 0.1 to 0.25, and 0.5 to 0.6 where samples fall at the same angles in each gait cycle. J at
# 0.45 mm was 0.48 to 0.50 mm where 0.39 was left, 0.54 at 0.58, and 0.62, or I was taken for it, at 0.68
# (2026-11-26)
WORTH_IDENTIFYING, ONLY_SCATTER = 0.6, 0.45

FAR_FROM_FILE = 20.0  # misfit from which on the ideal torque comes first

_MASS, _LENGTH = 0.03, 0.006  # standard deviations of a leg's bodies about those of its file
_LOG_FRICTION = 0.7  # of the logarithm of its friction: a factor of two, greased or not
_LOG_COMPLIANCE = 0.2  # of that of the drive's compliance, about that of the ideal leg's torque
_FAR = 0.03  # that of masses and lengths of a leg far from its file
_HARMONICS = 6  # of the torque that show masses and lengths rather than impacts
_IDEAL = 0.01  # of the torque's size: what impacts change in each of them
_STEP = 1.0e-4  # of the differences by masses and lengths, in standard deviations
_DONE = 1.0e-3  # last step of them
_SENSOR = 5.0  # times the usual changes of friction, scale, offset and load: they are constant here

# a model with the right parameters is off by a part of the torque's size, by a part of its steps where it is
# steep, and in its roughness (docs/explanation/diagnosis.md)
_OF_SIZE, _OF_STEP, _ROUGHNESS = 0.005, 0.1, 0.1


def misfit(model: SignatureModel, nuisances: Sequence[Nuisance], commissioned: CommissionedTorque) -> float:
    """Mean square of what a model does not explain of a commissioned leg, in units of its uncertainty."""
    rest = commissioned.mean - model.at(commissioned.clearance_m)[0]
    covariance = _covariance(model, nuisances, commissioned.cycles)
    return float(rest @ np.linalg.solve(covariance, rest)) / len(rest)


def identified_leg(
    legs: TorqueReference,
    model: SignatureModel,
    nuisances: Sequence[Nuisance],
    commissioned: CommissionedTorque,
    is_drive_known: bool = False,
) -> LegParameters:
    """Most probable parameters of a commissioned leg: one step of Gauss and Newton.

    What the torque does not show of them stays that of the file. Lengths are supposed to be as far from the
    file as those of the simulated leg are.

    Parameters
    ----------
    legs : TorqueReference
        Of `begin_identification`, with the clearances of the commissioned leg.
    model : SignatureModel
    nuisances : sequence of Nuisance
    commissioned : CommissionedTorque
    is_drive_known : bool
        Whether the compliance of the drive stays as it is.
    """
    means = mean_signatures(legs, model.sensor)
    bodies, near = len(legs.parameters.mass), legs.parameters
    # friction and compliance are positive, and known to a factor: their logarithms are the unknowns
    before = np.concatenate([near.mass - 1.0, near.length - 1.0, [math.log(near.friction)]])
    far = float(np.sqrt(np.mean(np.square(near.length - 1.0))))
    steps = np.append(np.repeat([HEAVIER, LONGER], bodies), math.log(ROUGHER))
    sigma = np.append(np.repeat([_MASS, np.hypot(_LENGTH, far)], bodies), _LOG_FRICTION)
    levels = levels_of(near)[1:]
    if near.compliance and not is_drive_known:  # its deviation from the compliance of the simulated leg
        before, steps, sigma = (
            np.append(before, 0.0),
            np.append(steps, -math.log(STIFFER)),
            np.append(sigma, _LOG_COMPLIANCE),
        )
    slopes = means[1:].T @ levels[:, : len(steps)] / (len(levels) * steps)
    weighted = np.linalg.solve(_covariance(model, nuisances, commissioned.cycles), slopes)
    information = slopes.T @ weighted + np.diag(sigma**-2.0)
    rest = commissioned.mean - means[0]
    found = before + np.linalg.solve(information, weighted.T @ rest - before / sigma**2)
    mass, length, (log_friction, *log_compliance) = np.split(found, [bodies, 2 * bodies])
    compliance = near.compliance * math.exp(sum(log_compliance))
    friction = math.exp(log_friction)
    return attrs.evolve(near, mass=1.0 + mass, length=1.0 + length, friction=friction, compliance=compliance)


def leg_of_ideal_torque(
    mechanism: Mechanism, model: SignatureModel, commissioned: CommissionedTorque, speed: float, load: Floats
) -> LegParameters:
    """Masses and lengths near those of a leg far from its file, by the torque with ideal joints.

    That torque differs from the torque of the file's leg as the measured mean torque differs from the
    model's, if impacts have the same part in both.

    Parameters
    ----------
    mechanism : Mechanism
    model : SignatureModel
        Of the leg of the file.
    commissioned : CommissionedTorque
    speed : float
        Of the crank [rad/s].
    load : (PHASES, 2) array
        Of the model's leg [N], or none.
    """
    phases, bodies = model.sensor.phases, len(mechanism.bodies)
    unit = _IDEAL * model.sensor.size_nm
    rest = (commissioned.mean - model.at(commissioned.clearance_m)[0])[:phases]

    def bodies_at(x: Floats) -> LegParameters:
        return LegParameters(1.0 + _FAR * x[:bodies], 1.0 + _FAR * x[bodies:], load=load)

    def residual(x: Floats) -> Floats:
        torque = ideal_torque(bodies_at(x).applied(mechanism), speed) - of_file
        left = _harmonics(signature_of_torque(torque, phases)[:phases] - rest)
        return np.concatenate([left / unit, x])

    def at(x: Floats) -> Point:
        try:
            now = residual(x)
        except AssemblyError:  # such a leg cannot move
            return Point(np.full(1, np.inf), lambda: np.zeros((1, len(x))))
        steps = _STEP * np.eye(len(x))
        return Point(now, lambda: np.array([residual(x + one) - now for one in steps]).T / _STEP)

    of_file = ideal_torque(bodies_at(np.zeros(2 * bodies)).applied(mechanism), speed)
    return bodies_at(gauss_newton(at, np.zeros(2 * bodies), done=_DONE).x)


def _harmonics(torque: Floats) -> Floats:
    """The mean and the first harmonics (1 + 2 n,) of a torque over the phases."""
    found = np.fft.rfft(torque)[: _HARMONICS + 1] / len(torque)
    return np.concatenate([found.real, found.imag[1:]])


def _covariance(model: SignatureModel, nuisances: Sequence[Nuisance], cycles: int) -> Floats:
    """Covariance (F, F) of what a leg's mean signature over some cycles is off its model."""
    phases = model.sensor.phases
    steep = np.hypot(_OF_SIZE * model.sensor.size_nm, _OF_STEP * np.exp(model.mean[phases:]))
    found = model.covariance * (1.0 / cycles + model.own)
    found = found + np.diag(np.concatenate([steep, np.full(phases, _ROUGHNESS)]) ** 2)
    for one in nuisances:
        found = found + (_SENSOR * one.spread) ** 2 * np.outer(one.column, one.column)
    return np.asarray(found)


# All clearances at once from a mean signature, with their covariance.


_LEAST_FACTOR = 0.7  # of the expected clearance
_FLAT = 1.0  # prior standard deviation of a clearance's logarithm: what shows nothing keeps its prior
_NARROWER = 0.03  # that of a new part's on the narrow side: wear only opens
# mean square up to which clearances explain: one joint that opened leaves 0.4 to 1.3, two at once do not add
# up. A and G at 0.45 mm left 2.1 to 2.4, and G was 0.33 ± 0.01 mm, B 0.35 ± 0.02 (2026-11-26)
_EXPLAINED = 1.75
_FIT_ROUNDS = 2
_ELSEWHERE = 1.5  # times a clearance, where a search for each joint begins, too
_MODEL_M = 5.0e-6  # error of the model against full coordinates (docs/explanation/diagnosis.md)


@attrs.frozen(eq=False)
class ClearanceFit:
    """Clearances (k,) [m] and their covariance (k, k) [m^2].

    `square` is the mean square of what they leave over, about 1 if the model holds; `unlikely` is minus twice
    the logarithm of their probability, less a constant.
    """

    clearance_m: Floats
    covariance: Floats
    square: float
    unlikely: float

    @property
    def sigma_m(self) -> Floats:
        """Standard deviations (k,)."""
        return np.asarray(np.sqrt(np.diagonal(self.covariance)))

    @property
    def explains(self) -> bool:
        """Whether the clearances explain what was measured."""
        return self.square <= _EXPLAINED


def fit_clearances(
    explainer: Explainer,
    mean: Floats,
    cycles: int,
    start_m: Floats,
    counted_m: Floats,
    known_sigma_m: Floats | float = 0.0,
) -> ClearanceFit:
    """Generalised least squares over the logarithms of all clearances.

    Parameters
    ----------
    explainer : Explainer
    mean : (F,) array
        Mean signature.
    cycles : int
    start_m, counted_m : (k,) arrays
        Where the search begins, and the counted clearances.
    known_sigma_m : (k,) array, optional
        Standard deviations of the clearances that the baseline was taken with.
    """
    model = explainer.model
    measured, counted = mean - explainer.baseline.offset, np.log(counted_m)
    low, high = np.log(_LEAST_FACTOR * model.grid_m[:, 0]), np.log(model.grid_m[:, -1])
    new, flat = np.log(np.minimum(counted_m, explainer.fresh_m)), np.eye(len(counted_m)) / _FLAT
    clearance: Floats = start_m
    for _ in range(_FIT_ROUNDS):  # what the model may be off depends on the clearances
        change = model.at(clearance)[0] - model.at(counted_m)[0]
        scatter = model.scatter_at(clearance) + explainer.error(change[None])[0]
        root = np.linalg.cholesky(explainer.covariance(cycles) + scatter * model.covariance)
        whiten = np.linalg.inv(root)

        def at(x: Floats, whiten: Floats = whiten) -> Point:
            expected, slopes = model.at(np.exp(x))
            below = np.minimum(x - new, 0.0) / _NARROWER
            rest = np.concatenate([whiten @ (expected - measured), (x - counted) / _FLAT, below])
            return Point(rest, lambda: np.vstack([whiten @ slopes, flat, np.diag((below < 0.0) / _NARROWER)]))

        found = gauss_newton(at, np.log(clearance), low=low, high=high)
        clearance = np.asarray(np.exp(found.x), dtype=np.float64)
    # what a clearance changes is known to a fraction, and so is a clearance that is far from the counted one
    uncertain = np.hypot(_MODEL_M, MODEL_ERROR * (clearance - counted_m))
    # a baseline after a correction hides what that is off
    covariance = found.covariance * np.outer(clearance, clearance) + np.diag(uncertain**2 + known_sigma_m**2)
    square = float(np.square(found.point.rest[: len(mean)]).mean())
    unlikely = found.point.square + 2.0 * float(np.log(np.diagonal(root)).sum())
    fit = ClearanceFit(clearance, max(1.0, square) * covariance, square, unlikely)
    if fit.explains:
        return fit
    return attrs.evolve(fit, covariance=fit.covariance + np.diag(clearance**2))


def explainer_of(
    mechanism: Mechanism,
    reference: TorqueReference,
    sensor: TorqueSensor,
    commissioned: CommissionedTorque | None,
) -> Explainer:
    """What explains changes of a leg, measured by a sensor whose noise is known."""
    model = signature_model(reference, sensor)
    found, joints = nuisances(mechanism, reference, sensor), mechanism.clearance_joints
    if commissioned is None:
        baseline = unknown_baseline(found, sensor, model.own * model.covariance)
    else:
        expected = model.at(commissioned.clearance_m)[0]
        left_out = parts_left_out(model.covariance, commissioned.signatures)
        covariance = with_scatter_of(model.covariance, commissioned.signatures)
        model = attrs.evolve(model, covariance=covariance)
        baseline = commissioned_baseline(commissioned, expected, covariance, left_out)
    fresh_m = np.array([mechanism.clearances[joint].radial_clearance for joint in joints])
    return Explainer(model, joints, baseline, found, other_channels(reference, sensor), fresh_m)


def best_fit(
    explainer: Explainer,
    mean: Floats,
    cycles: int,
    counted_m: Floats,
    starts: Sequence[Floats],
    known_sigma_m: Floats | float = 0.0,
) -> ClearanceFit:
    """All clearances from a mean signature, from the best of several starts: there are several minima."""
    fits = [fit_clearances(explainer, mean, cycles, start, counted_m, known_sigma_m) for start in starts]
    return min(fits, key=lambda fit: fit.unlikely)


def starts_of(explainer: Explainer, change: Change | None, counted_m: Floats) -> list[Floats]:
    """Clearances (k,) [m] where searches begin: after a change, and from there with each joint wider."""
    widest, first = explainer.model.grid_m[:, -1], start_of(change, explainer.joints, counted_m)
    wider = np.minimum(_ELSEWHERE * first, np.maximum(widest, first))
    return [first, *(opened(first, k, size) for k, size in enumerate(wider.tolist()))]


def with_rivals(
    found: ClearanceFit, explanations: Sequence[Explanation], joints: Sequence[str]
) -> ClearanceFit:
    """A fit with the clearances that explain a change as well, alone: which of them it was is not known."""
    best = min((one.misfit for one in explanations), default=0.0)
    apart = np.zeros(len(joints))
    for one in explanations:
        if one.cause is Cause.CLEARANCE and 0.5 * (one.misfit - best) < SURE_LOG_ODDS:
            k = joints.index(one.subject)
            apart[k] = one.value - found.clearance_m[k]
    return attrs.evolve(found, covariance=found.covariance + np.diag(apart**2))


def start_of(change: Change | None, joints: Sequence[str], counted_m: Floats) -> Floats:
    """Clearances (k,) [m] after a change."""
    if change is None or change.cause is not Cause.CLEARANCE:
        return counted_m
    return opened(counted_m, joints.index(change.subject), change.value)


def change_of(explanations: Sequence[Explanation], since_ns: int) -> Change | None:
    """The change that explanations, the best first, amount to; None where the leg may be as counted.

    Of many causes one always explains a bit more than none.
    """
    best = explanations[0]
    nothing = next(one for one in explanations if one.cause is Cause.UNKNOWN)
    log_odds = 0.5 * (nothing.misfit - best.misfit)
    if log_odds < SURE_LOG_ODDS or not best.explains(nothing.square):
        if nothing.square <= POOREST:
            return None
        return Change(
            cause=Cause.UNKNOWN, since_ns=since_ns, value=0.0, sigma=0.0, counted=0.0, log_odds=log_odds
        )
    fact = (best.cause.fault_code, best.subject)
    second = next(one for one in explanations if (one.cause.fault_code, one.subject) != fact)
    runner_up = f"{second.cause.value} {second.subject}".strip()
    return Change(
        cause=best.cause,
        subject=best.subject,
        since_ns=since_ns,
        value=best.value,
        sigma=best.sigma,
        counted=best.counted,
        log_odds=log_odds,
        runner_up="as counted" if second is nothing else runner_up,
        runner_up_log_odds=0.5 * (second.misfit - best.misfit),
    )


def first_changed(explainer: Explainer, signatures: Floats, counted_m: Floats, changed_m: Floats) -> int:
    """Index of the first of some gait cycles, signatures (n, F), that belongs to a change of clearances.

    It is where the likelihood of the cycles before as counted, and of those after as changed, is largest.
    """
    before, after = (explainer.model.at(clearance)[0] for clearance in (counted_m, changed_m))
    weighted = np.linalg.solve(explainer.covariance(1), after - before)
    middle = 0.5 * (before + after) + explainer.baseline.offset
    gain = (signatures - middle) @ weighted
    return int(np.cumsum(gain[::-1])[::-1].argmax())


# Detects when a leg departs from the one that is counted: one CUSUM test for each joint and size.
#
# A CUSUM adds up, gait cycle by gait cycle, by how much a changed leg explains the signature better, and
# starts again where it falls below zero. Where the likelihoods are what it supposes, the mean time between
# two false alarms of a test is at least exp(threshold) cycles (Lorden 1971).


# on the counted clearance of one joint; two further tests are for a new part in a worn joint
FACTORS = (1.08, 1.2, 1.35, 1.5, 2.0, 2.5, 3.3, 5.0, 8.0)  # on the counted clearance of one joint

_LEAST_INFORMATION = 1.0e-6  # of one gait cycle, by which a test can tell anything
_SIGMAS = 4.0  # by which the baseline may be off
# of the threshold: what one gait cycle counts at most, so that two alone raise nothing. One of 260 healthy
# cycles on the ground looked like a wider joint: two in a row come each twenty hours by chance (2026-11-25)
_MOST = 0.4


class DetectorState(NamedTuple):
    """Sums (tests,), the stamp (tests,) [ns] and the number of cycles (tests,) since each was 0."""

    sums: Floats
    since_ns: Ints
    cycles: Ints


class Detection(NamedTuple):
    """A change: the test that raised it, the stamp since when, the cycles since then, and its sum."""

    test: int
    since_ns: int
    cycles: int
    log_odds: float


def threshold(false_alarm_cycles: float, tests: int) -> float:
    """Threshold of each of some tests for a mean number of gait cycles between two false alarms."""
    return math.log(false_alarm_cycles * tests)


def excess(scatter: Floats) -> Floats:
    """By how much more than expected the statistics (n, tests) of some tests scatter, at least 1.

    They are of gait cycles that the tests do not know, less their mean, in standard deviations.
    """
    pairs = len(scatter) // 2
    if not pairs:
        return np.ones(scatter.shape[1])
    # means of two: neighbouring cycles are correlated
    means = scatter[: 2 * pairs].reshape(pairs, 2, -1).mean(axis=1)
    return np.asarray(np.maximum(1.0, 2.0 * np.square(means).mean(axis=0)))


def _scatter(explainer: Explainer, change: Floats) -> Floats:
    """Statistics (n, tests) of each part of the commissioned cycles, by tests that the others make."""
    own, found = explainer.model.covariance, [np.zeros((0, len(change)))]
    for part in explainer.baseline.left_out:
        weighted = np.linalg.solve(explainer.covariance(1) + part.covariance - own, change.T).T
        variance = ((weighted @ part.covariance) * weighted).sum(axis=1) * (1.0 + 1.0 / part.others)
        found.append(part.departures @ weighted.T / np.sqrt(np.maximum(variance, _LEAST_INFORMATION)))
    return np.concatenate(found)


class ChangeDetector:
    """CUSUM tests of a leg against one with a wider joint, and against one with a new part.

    Parameters
    ----------
    explainer : Explainer
    counted_m : (k,) array
        Counted clearances.
    false_alarm_cycles : float
        Mean number of gait cycles between two false alarms.
    """

    def __init__(self, explainer: Explainer, counted_m: Floats, false_alarm_cycles: float) -> None:
        model = explainer.model
        expected = model.at(counted_m)[0]
        changes = []
        for k in range(len(counted_m)):
            fresh = min(explainer.fresh_m[k], counted_m[k])
            sizes = [factor * counted_m[k] for factor in FACTORS] + [fresh, math.sqrt(fresh * counted_m[k])]
            changes += [model.at(opened(counted_m, k, size))[0] - expected for size in sizes]
        # for a leg that shows as much less of an opening as the model may be off
        change = (1.0 - MODEL_ERROR) * np.array(changes)
        weighted = np.linalg.solve(explainer.covariance(1), change.T).T
        self._expected = expected + explainer.baseline.offset
        self._weighted = weighted
        # the baseline is off by the same in each cycle: that alone must not drive a test upwards
        drift = np.sqrt(((weighted @ explainer.baseline.covariance) * weighted).sum(axis=1))
        information = (weighted * change).sum(axis=1)
        self._half = 0.5 * information + _SIGMAS * drift
        # a part that is new already cannot be renewed
        is_possible = information > _LEAST_INFORMATION
        self._half = np.where(is_possible, self._half, np.inf)
        self._excess = excess(_scatter(explainer, change))
        self.threshold = threshold(false_alarm_cycles, len(change))
        self._step, self._counted_m = (information - self._half) / self._excess, counted_m

    def unseen_m(self, cycles: int) -> Floats:
        """Widest clearances (k,) [m] that are not expected to be detected within some gait cycles."""
        steps = self._step.reshape(len(self._counted_m), -1)[:, : len(FACTORS)]
        factors = np.where(cycles * steps < self.threshold, FACTORS, 1.0)
        return np.asarray(factors.max(axis=1) * self._counted_m)

    def fresh(self) -> DetectorState:
        """State before the first gait cycle."""
        tests = len(self._half)
        return DetectorState(np.zeros(tests), np.zeros(tests, np.int64), np.zeros(tests, np.int64))

    def with_cycle(self, state: DetectorState, signature: Floats, begin_ns: int) -> DetectorState:
        """State after one more gait cycle, with its signature (F,) and the stamp of its begin."""
        ratio = (self._weighted @ (signature - self._expected) - self._half) / self._excess
        ratio = np.minimum(ratio, _MOST * self.threshold)
        since = np.where(state.cycles == 0, begin_ns, state.since_ns)
        sums = state.sums + ratio
        stays = sums > 0.0
        return DetectorState(
            np.where(stays, sums, 0.0), np.where(stays, since, 0), np.where(stays, state.cycles + 1, 0)
        )

    def detection(self, state: DetectorState) -> Detection | None:
        """The change that is detected; None where no test exceeds the threshold."""
        best = int(state.sums.argmax())
        if not state.sums[best] > self.threshold:
            return None
        return Detection(best, int(state.since_ns[best]), int(state.cycles[best]), float(state.sums[best]))
