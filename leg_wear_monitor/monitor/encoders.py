"""Joint encoders: their errors, their samples, and the clearances estimated from them.

A joint encoder, or further encoder, measures the angle of a revolute joint other than the crank's. Its
deviation from the angle of the ideal linkage shows clearances, once its own errors (offset, scale) are known.
"""

import math
from collections.abc import Mapping, Sequence

import attrs
import numpy as np

from leg_wear_monitor.errors import LegWearError
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.monitor import alarm_specs
from leg_wear_monitor.monitor.alarms import ENCODERS, worst_code
from leg_wear_monitor.monitor.config.inputs import Encoders
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.evaluation import AlarmBoard
from leg_wear_monitor.monitor.forecast.forecaster import RENEWED_NS
from leg_wear_monitor.monitor.forecast.wear_coefficients import ClearanceAtWear
from leg_wear_monitor.monitor.ledger.entry import Commissioned
from leg_wear_monitor.monitor.observer import Observer
from leg_wear_monitor.monitor.reports import ClearanceEstimate, ClearanceObservation, Status
from leg_wear_monitor.monitor.verdict.situation import KnownClearance
from leg_wear_monitor.monitor.wear_model import WearModel
from leg_wear_monitor.state import Level
from leg_wear_monitor.twin.reference import CrankProfile, cycle_profile, mean_profile
from leg_wear_monitor.twin.references import (
    PHASES,
    AngleModel,
    AngleReference,
    AngleReferenceRun,
    angle_model,
)
from leg_wear_monitor.twin.sample import GAIT_SAMPLE, Samples, newest, of_crank, within
from leg_wear_monitor.twin.statistics import CycleStatistics

# Regression of encoder angles on clearances and on the encoders' own errors, one gait cycle at a time.


_RIDGE = 1.0e-9
_HUBER = 1.5  # standard deviations beyond which a bin loses weight
_ROUNDS = 4
_BLIND = 1.0e-3  # fraction of the largest singular value: smaller ones are unobservable


@attrs.frozen(eq=False)
class Estimate:
    """Clearances and encoder errors, with their covariance.

    Attributes
    ----------
    mean : (k + 1 + 2 m,) array
        Clearances [m], offset of the crank's encoder [rad], offsets [rad] and scale errors of the others.
    covariance : array
    joints : int
        Number k of clearance joints.
    """

    mean: Floats
    covariance: Floats
    joints: int

    @property
    def clearance_m(self) -> Floats:
        """Clearances (k,)."""
        return self.mean[: self.joints]

    @property
    def sigma_m(self) -> Floats:
        """Standard deviations of the clearances (k,)."""
        return np.asarray(np.sqrt(np.diagonal(self.covariance)[: self.joints]))


def binned(model: AngleModel, crank_angle: Floats, angles: Floats) -> tuple[Floats, Floats]:
    """Mean deviation (P, m) [rad] of a cycle's samples in each phase, NaN without any; and their counts."""
    at = np.minimum((crank_angle % TURN) * (PHASES / TURN), PHASES - 0.5).astype(np.int64)
    deviation = model.deviation(crank_angle, angles)
    there = np.isfinite(deviation)
    sums, counts = np.zeros((2, PHASES, angles.shape[1]))
    np.add.at(sums, at, np.where(there, deviation, 0.0))
    np.add.at(counts, at, there.astype(float))
    with np.errstate(invalid="ignore"):
        return sums / counts, counts


def regress(columns: Floats, deviation: Floats, counts: Floats, before: Estimate) -> Floats:
    """Clearances and encoder errors (k + 1 + 2 m,) of one cycle, by Huber's M-estimate.

    Unobservable directions keep their prior values.

    Parameters
    ----------
    columns : (P, m, k + 1 + 2 m) array
        As `design` gives them.
    deviation, counts : (P, m) arrays
        Results of `binned`.
    before : Estimate
        Prior, which has a very small weight and separates values that the sensors cannot.
    """
    p = columns.shape[-1]
    used = (counts > 0.0).ravel()
    x, y = columns.reshape(-1, p)[used], deviation.ravel()[used]
    root = np.sqrt(counts.ravel()[used])
    y = y - x @ before.mean
    length = np.linalg.norm(x, axis=0)
    scale = 1.0 / np.where(length > 0.0, length, 1.0)
    x = x * scale
    weight, solution = root.copy(), np.zeros(p)
    for _ in range(_ROUNDS):
        a = x * weight[:, None]
        ridge = _RIDGE * np.linalg.norm(a) ** 2 / p
        solution = np.linalg.solve(a.T @ a + ridge * np.eye(p), a.T @ (y * weight))
        residual = np.abs(y - x @ solution) * root
        spread = max(1.4826 * float(np.median(residual)), 1.0e-12)
        weight = root * np.sqrt(np.minimum(1.0, _HUBER * spread / np.maximum(residual, 1.0e-300)))
    return np.asarray(before.mean + scale * solution)


def blind_directions(columns: Floats, counts: Floats) -> Floats:
    """Unobservable changes (n, p) of the parameters; ``counts`` (P, m) are the samples in each bin."""
    a = columns.reshape(-1, columns.shape[-1])[(counts > 0.0).ravel()]
    length = np.linalg.norm(a, axis=0)
    length[length == 0.0] = 1.0
    _, s, vt = np.linalg.svd(a / length, full_matrices=len(a) < a.shape[1])
    shown = np.pad(s, (0, len(vt) - len(s)))
    return np.asarray(vt[shown <= _BLIND * s[0]] / length)


# Clearance estimates from the joint states: a regression on the angles of further joints, cycle by cycle.
#
# Each gait cycle gives an estimate of all clearances and of the encoders' own errors, robust against
# outliers. Single cycles are chaotic, so the uncertainty of their mean is computed from the scatter of the
# cycles alone. The mean is fused with the prior: the expected clearances, and the encoders' errors as fixed
# at commissioning. A sensor that is added later starts with unknown errors.


LEAST_CYCLES = 20
# error of the linear model and its reference against full coordinates
MODEL_SIGMA_M = 2.0e-5

_BATCH = 2  # cycles per batch: neighbouring cycles are correlated
_NO_NEWS = 1.0e6  # times the prior variance: no information


class ClearanceRegression:
    """Estimates clearances from encoders, cycle by cycle.

    Parameters
    ----------
    model : AngleModel
    reference : AngleReference, optional
        Expected angles; cycles are kept without evaluation until it is given.
    before : Estimate, optional
        Prior knowledge without these cycles; given with the reference.
    most : int
        Number of cycles that are kept; the estimate uses the last ones.

    Attributes
    ----------
    most : int
        As above; may be changed.
    """

    def __init__(
        self,
        model: AngleModel,
        reference: AngleReference | None = None,
        before: Estimate | None = None,
        most: int = 300,
    ) -> None:
        self._model, self.most = model, most
        self._reference, self._before = reference, before
        self._cycles: list[tuple[Floats, Floats]] = []
        self._each: list[Floats] = []

    def add(self, deviation: Floats, counts: Floats) -> None:
        """Add a gait cycle as returned by `binned`."""
        self._cycles.append((deviation, counts))
        if self._reference is not None:
            self._each.append(self._regressed(deviation, counts))
        del self._cycles[: -self.most], self._each[: -self.most]

    def refer(self, reference: AngleReference, before: Estimate) -> None:
        """Evaluate the kept cycles with a new reference and a new prior."""
        self._reference, self._before = reference, before
        self._each = [self._regressed(*cycle) for cycle in self._cycles]

    def forget(self) -> None:
        """Drop the kept cycles, because the leg has changed."""
        self._cycles, self._each = [], []

    def _regressed(self, deviation: Floats, counts: Floats) -> Floats:
        reference, before = self._given()
        joints = before.joints
        columns = self._columns
        # the prior is expressed at the linearisation point: at the clearances of the reference
        shift = reference.deviation - columns[:, :, :joints] @ reference.clearance_m
        return regress(columns, deviation - shift, counts, before)

    @property
    def _columns(self) -> Floats:
        """Columns of the regression.

        Joints without a direct effect are excluded: an effect through other joints alone is not
        proportional to the clearance and would give wrong estimates.
        """
        reference, before = self._given()
        shown = self._model.by_e.any(axis=(0, 1, 3))
        columns = reference.columns.copy()
        columns[:, :, : before.joints][:, :, ~shown] = 0.0
        return columns

    def _given(self) -> tuple[AngleReference, Estimate]:
        if self._reference is None or self._before is None:
            raise LegWearError("no reference was given yet")
        return self._reference, self._before

    @property
    def reference(self) -> AngleReference | None:
        """Reference that the cycles are compared with."""
        return self._reference

    @property
    def cycles(self) -> int:
        """Number of kept cycles."""
        return len(self._cycles)

    def alone(self) -> Estimate | None:
        """Estimate from the cycles alone, without the prior; None while there are not enough."""
        if len(self._each) < LEAST_CYCLES:
            return None
        reference, before = self._given()
        each = np.array(self._each)
        size = len(each) // _BATCH
        batches = each[len(each) - _BATCH * size :].reshape(size, _BATCH, -1).mean(axis=1)
        # scatter from differences of neighbouring cycles, so that slow changes do not add to it
        steps = np.diff(batches, axis=0)
        scatter = steps.T @ steps / (2.0 * len(steps))
        # the reference adds the scatter of the cycles that it was simulated from
        covariance = scatter * (1.0 / size + _BATCH / reference.cycles)
        floor = 1.0e-6 * np.diagonal(before.covariance)
        floor[: before.joints] += MODEL_SIGMA_M**2
        return Estimate(np.median(batches, axis=0), covariance + np.diag(floor), before.joints)

    def fused(self) -> Estimate | None:
        """Cycles and prior, weighted by their covariances (update step of a Kalman filter)."""
        alone = self.alone()
        if alone is None:
            return None
        _, before = self._given()
        counts = np.sum([counts for _, counts in self._cycles], axis=0)
        blind = blind_directions(self._columns, counts)
        # in unobservable directions, each cycle repeats the prior and adds no information
        scale = np.sqrt(np.diagonal(before.covariance))
        across = blind / scale
        across /= np.linalg.norm(across, axis=1, keepdims=True)
        prior = before.covariance / np.outer(scale, scale)
        noise = alone.covariance / np.outer(scale, scale) + _NO_NEWS * across.T @ across
        gain = np.linalg.solve(prior + noise, prior).T
        mean = before.mean + scale * (gain @ ((alone.mean - before.mean) / scale))
        rest = np.eye(len(mean)) - gain
        covariance = rest @ prior @ rest.T + gain @ noise @ gain.T
        return Estimate(mean, covariance * np.outer(scale, scale), before.joints)


# Estimate of a joint's clearance from further encoders.


ESTIMATED_M = 1.0e-4  # largest standard deviation of an observable clearance


def clearance_estimates(found: Estimate, modelled_m: Floats) -> tuple[ClearanceEstimate, ...]:
    """Estimates of each joint, compared with the modelled clearances (k,) [m]."""
    return tuple(
        _estimate(float(clearance), float(sigma), float(counted))
        for clearance, sigma, counted in zip(found.clearance_m, found.sigma_m, modelled_m, strict=True)
    )


def _estimate(clearance_m: float, sigma_m: float, modelled_m: float) -> ClearanceEstimate:
    if sigma_m > ESTIMATED_M:
        return ClearanceEstimate(observation=ClearanceObservation.NOT_OBSERVABLE)
    return ClearanceEstimate(
        observation=ClearanceObservation.SEEN,
        clearance_m=clearance_m,
        sigma_m=sigma_m,
        departure_m=clearance_m - modelled_m,
    )


# Errors of the encoders: unknown at first, estimated together with the clearances of a leg whose clearances
# are nearly known (commissioning), then fixed and stored in the ledger.


# standard deviations before commissioning, of an encoder's offset and scale error
_OFFSET_SIGMA_RAD, _SCALE_SIGMA = 0.05, 0.01


@attrs.frozen(eq=False)
class EncoderErrors:
    """Estimated errors of m encoders.

    Attributes
    ----------
    centre_rad : (m,) array
        Mean deviation of each encoder in its first gait cycle, subtracted from all its angles, since the zero
        of an encoder is arbitrary; NaN before that cycle.
    mean : (1 + 2 m,) array
        Offset of the crank's encoder, offsets from the centres [rad] and scale errors of the others.
    covariance : array
    known : bool
        True if the encoders are commissioned.
    """

    centre_rad: Floats
    mean: Floats
    covariance: Floats
    known: bool


def names_of(encoders: Encoders) -> tuple[str, ...]:
    """Identification of each encoder: name, joint and sign."""
    signs = encoders.signs or (1.0,) * len(encoders.names)
    return tuple(
        f"{name} on {joint} {sign:+.0f}"
        for name, joint, sign in zip(encoders.names, encoders.joints, signs, strict=True)
    )


def errors_of(encoders: Encoders, stored: Commissioned | None) -> EncoderErrors:
    """Errors as stored in the ledger; unknown for other encoders than the stored ones."""
    if stored is not None and stored.encoders == names_of(encoders):
        return EncoderErrors(stored.centre_rad, stored.mean, stored.covariance, True)
    m = len(encoders.names)
    sigma = np.concatenate([np.full(1 + m, _OFFSET_SIGMA_RAD), np.full(m, _SCALE_SIGMA)])
    return EncoderErrors(np.full(m, np.nan), np.zeros(1 + 2 * m), np.diag(np.square(sigma)), False)


def prior_with(errors: EncoderErrors, clearance_m: Floats, sigma_m: Floats | float) -> Estimate:
    """Prior of clearances (k,) with the given standard deviation, and of the encoders' errors."""
    k, p = len(clearance_m), len(errors.mean)
    covariance = np.zeros((k + p, k + p))
    covariance[:k, :k] = np.diag(np.square(np.broadcast_to(sigma_m, k)))
    covariance[k:, k:] = errors.covariance
    return Estimate(np.concatenate([clearance_m, errors.mean]), covariance, k)


def commissioned(errors: EncoderErrors, found: Estimate) -> EncoderErrors:
    """Errors fixed at an estimate."""
    k = found.joints
    return EncoderErrors(errors.centre_rad, found.mean[k:], found.covariance[k:, k:], True)


# State of the observer (below), and the faults of an encoder.


_LEAST_PHASES = PHASES // 4  # crank phases with samples that a cycle needs: at 60 rpm a rate of 32 Hz
# RMS deviation about its mean in a cycle: many times the effect of clearances and scale errors
_FAULTY_RAD = 0.1


@attrs.define
class EncoderState:
    """State of an `EncoderWatch` besides its regression and its reference.

    Attributes
    ----------
    errors : EncoderErrors
    samples : Samples
        Samples of the crank, with the encoders' angles, of gait cycles that are not evaluated yet.
    due : tuple of (int, int)
        Begin and end [ns] of ended gait cycles that are not evaluated yet.
    faults : tuple of str
        Fault of each encoder in the last cycle; empty before the first.
    is_requested : bool
        True if a reference was requested since the last change of the leg.
    since_reference : int
        Cycles since the last reference was ready.
    profiles : tuple of CrankProfile
        Crank motion of the last cycles.
    found : Estimate or None
        Latest estimate of clearances and encoder errors.
    updated_ns : int
        Stamp of the last forecast update with `found`, 0 if an update is due.
    other, believed : tuple of bool
        At that update: whether each clearance differed significantly from the modelled one, and whether the
        forecast used it.
    known : int
        Number of measurements and corrections in the forecast at that update.
    """

    errors: EncoderErrors
    samples: Samples = attrs.field(factory=lambda: np.zeros(0, GAIT_SAMPLE))
    due: tuple[tuple[int, int], ...] = ()
    faults: tuple[str, ...] = ()
    is_requested: bool = False
    since_reference: int = 0
    profiles: tuple[CrankProfile, ...] = ()
    found: Estimate | None = None
    updated_ns: int = 0
    other: tuple[bool, ...] = ()
    believed: tuple[bool, ...] = ()
    known: int = 0


def fault_of(raw: Floats, deviation: Floats, joint: str) -> str:
    """Fault of an encoder in a cycle; empty if there is none."""
    finite = deviation[np.isfinite(deviation)]
    if len(finite) < _LEAST_PHASES:
        return "gives no angle" if np.isinf(raw).any() else "is not in joint_states with the crank"
    if float(finite.std()) > _FAULTY_RAD:
        return f"does not turn like joint {joint}: check encoders.joints and encoders.signs"
    return ""


def faults(names: Sequence[str], state: EncoderState) -> list[str]:
    """Faults of the encoders as text for operators."""
    return [f"{name} {fault}" for name, fault in zip(names, state.faults, strict=False) if fault]


# The observer: from samples to clearance estimates.
#
# Everything is computed at the end of an evaluation period; periods depend on the order of arrival only, so a
# replay gives the same results. A period evaluates the gait cycles that ended in it. The cycles are compared
# with a reference, a simulation of the leg as modelled.


_MODEL_M = 5.0e-6  # standard deviation of a modelled clearance apart from the error of the new one
_UNKNOWN_SIGMA_M = 1.0e-3  # prior standard deviation of a clearance without prior knowledge
_PROFILE_CYCLES = 10  # gait cycles whose crank motion is averaged for a reference
# A reference is renewed if an observable clearance, or the crank's speed as a fraction of its mean, differs
# from the reference's by more; and at the earliest this many cycles after the last reference.
_CLEARANCE_DEPARTURE_M, _SPEED_DEPARTURE, _LEAST_BETWEEN_REFERENCES = 1.0e-4, 0.015, 100


class EncoderWatch(Observer):
    """Watches the clearances by joint encoders; commissions encoders whose errors are unknown.

    Parameters
    ----------
    leg : WearModel
    board : AlarmBoard

    Attributes
    ----------
    state : EncoderState
    estimates : tuple of ClearanceEstimate or None
        Estimates of the last gait cycle, and whether the forecast uses them.

    Raises
    ------
    ConfigError, AssemblyError
    """

    def __init__(self, leg: WearModel, board: AlarmBoard) -> None:
        self._leg, self._board, self._config = leg, board, leg.config
        mechanism, self._settings = leg.mechanism, leg.config.encoders
        self._coefficient_sigma = np.array([one.prior.sigma for one in leg.forecaster.coefficient_estimates])
        self._new_m = np.array(
            [mechanism.clearances[joint].radial_clearance for joint in mechanism.clearance_joints]
        )
        self._model = angle_model(mechanism, self._settings.joints)
        self._reference = AngleReferenceRun(mechanism, self._model)
        self._regression = ClearanceRegression(self._model)
        self.estimates: tuple[ClearanceEstimate, ...] | None = None
        self.state = EncoderState(errors_of(self._settings, leg.ledger.commissioned if leg.ledger else None))

    def configure(self, config: MonitorConfig) -> None:
        """Use other parameters from now on."""
        self._config = config

    def go_live(self) -> None:
        """Never wait for simulations."""
        self._reference.may_be_late = True

    def leave(self) -> None:
        """Stop simulating ahead: the process is about to end."""
        self._reference.leave()

    def add_samples(self, piece: Samples) -> None:
        """Add samples that the twin follows."""
        self.state.samples = np.concatenate([self.state.samples, of_crank(piece)])

    def end_cycle(self, statistics: CycleStatistics, is_refused: bool) -> None:
        """Estimate the clearances; they update the forecast each minute of stamps, or if something is new."""
        del is_refused
        leg, state = self._leg, self.state
        if statistics.is_steady and self._config.cadence.allows(statistics.cadence_rpm):
            state.due = (*state.due, (statistics.begin_ns, statistics.stamp_ns))
        estimates = self._estimates(statistics.clearance_mean_m)
        is_seen = [one.observation is ClearanceObservation.SEEN for one in estimates]
        other = tuple(one.is_other for one in estimates)
        known = len(leg.forecaster.measurements) + len(leg.forecaster.corrections)
        is_new = other != state.other or known != state.known
        is_due = is_new or not 0 <= statistics.stamp_ns - state.updated_ns < RENEWED_NS
        if is_due and any(is_seen):
            state.updated_ns, state.other, state.known = statistics.stamp_ns, other, known
            worn_m, replaced_ns = leg.worn_m(statistics.clearance_mean_m), leg.accounting.replaced_ns
            state.believed = tuple(
                is_seen[k]
                and leg.forecaster.use_estimate(
                    k, ClearanceAtWear(one.clearance_m, one.sigma_m, float(worn_m[k])), replaced_ns[k]
                )
                for k, one in enumerate(estimates)
            )
        believed = state.believed or (False,) * len(estimates)
        each = zip(estimates, believed, is_seen, strict=True)
        self.estimates = tuple(attrs.evolve(one, believed=yes and seen) for one, yes, seen in each)

    def end_period(self) -> None:
        """Evaluate the gait cycles that ended in an evaluation period; continue to simulate the reference."""
        state, twin, new = self.state, self._leg.twin, None
        for begin_ns, end_ns in state.due:
            self._add_cycle(begin_ns, end_ns)
            new = self._evaluate(end_ns) or new
        state.samples = newest(state.samples, state.due[-1][1] if state.due else 0)
        state.due = ()
        self._advance_reference(twin.clearance_mean_m, twin.depth)
        if new is not None:
            self._leg.accounting.note(new)

    def replaced(self, k: int) -> None:
        """Forget the estimates of the former part of joint k; the errors of the encoders stay."""
        self._regression.forget()
        self.state.found, self.state.is_requested, self.state.updated_ns = None, False, 0
        if self.estimates:
            none = ClearanceEstimate(observation=ClearanceObservation.WAITING)
            self.estimates = (*self.estimates[:k], none, *self.estimates[k + 1 :])

    def _estimates(self, modelled_m: Floats) -> tuple[ClearanceEstimate, ...]:
        """Clearance estimate of each joint, compared with the modelled clearances (k,) [m]."""
        found = self.state.found
        if found is not None:
            return clearance_estimates(found, modelled_m)
        is_known = self.state.errors.known
        observation = ClearanceObservation.WAITING if is_known else ClearanceObservation.COMMISSIONING
        return (ClearanceEstimate(observation=observation),) * len(modelled_m)

    def _add_cycle(self, begin_ns: int, end_ns: int) -> None:
        """Add a gait cycle to the regression, unless an encoder has a fault."""
        state = self.state
        kept = within(state.samples, begin_ns, end_ns)
        stamp_ns, crank = kept["stamp_ns"], kept["crank_angle_rad"]
        raw = kept["encoder_rad"][:, : len(self._settings.names)]
        if len(crank) >= _LEAST_PHASES:
            turned: Floats = np.asarray(np.unwrap(crank, period=TURN), dtype=np.float64)
            since_s = np.asarray(1.0e-9 * (stamp_ns - begin_ns), dtype=np.float64)
            profile = cycle_profile(since_s, turned, 1.0e-9 * (end_ns - begin_ns))
            state.profiles = (*state.profiles, profile)[-_PROFILE_CYCLES:]
        angles = np.where(np.isfinite(raw), raw, np.nan)
        self._centre(crank, angles)
        deviation, counts = binned(self._model, crank, angles - state.errors.centre_rad)
        state.faults = tuple(
            fault_of(raw[:, i], deviation[:, i], joint) for i, joint in enumerate(self._settings.joints)
        )
        if not any(state.faults):
            settings = self._settings
            self._regression.most = (
                settings.window_cycles if state.errors.known else settings.commissioning_cycles
            )
            self._regression.add(deviation, counts)
            state.since_reference += 1

    def _centre(self, crank: Floats, angles: Floats) -> None:
        """Set the centre of each encoder that has none to its mean deviation in this cycle."""
        errors = self.state.errors
        if not np.isnan(errors.centre_rad).any() or not len(crank):
            return
        deviation = self._model.deviation(crank, angles)
        is_sufficient = np.isfinite(deviation).sum(axis=0) >= _LEAST_PHASES
        # mean of directions, because an arbitrary zero may lie anywhere, half a turn included
        mean = np.angle(np.nansum(np.exp(1j * deviation), axis=0))
        first = np.isnan(errors.centre_rad) & is_sufficient
        self.state.errors = attrs.evolve(errors, centre_rad=np.where(first, mean, errors.centre_rad))

    def _evaluate(self, stamp_ns: int) -> Commissioned | None:
        """Renew the estimate; during commissioning, fix the encoders' errors when there are enough cycles."""
        state, regression = self.state, self._regression
        if regression.reference is None:
            return None
        if state.errors.known:
            state.found = regression.fused()
            return None
        is_due = regression.cycles >= self._settings.commissioning_cycles
        found = regression.fused() if is_due else None
        if found is None:
            return None
        errors = state.errors = commissioned(state.errors, found)
        self._evaluate_again()
        names = names_of(self._settings)
        return Commissioned(stamp_ns, names, errors.centre_rad, errors.mean, errors.covariance)

    def _advance_reference(self, clearance_m: Floats, depth: Floats) -> None:
        """Continue the simulation of a reference, or begin a new one if required."""
        state = self.state
        reference = self._reference.advance()
        if reference is not None:
            state.since_reference = 0
            self._regression.refer(reference, self._prior(reference.clearance_m))
        if self._reference.is_busy or not self._regression.cycles:
            return
        if not state.is_requested and state.profiles:
            state.is_requested = True
            self._reference.begin(clearance_m, depth, mean_profile(state.profiles))
        elif self._is_reference_outdated():
            state.since_reference = 0
            self._reference.begin(
                self._reference_clearances(clearance_m), depth, mean_profile(state.profiles)
            )

    def _is_reference_outdated(self) -> bool:
        """True if the estimated clearances or the crank motion have left the reference's."""
        found, reference = self.state.found, self._regression.reference
        if found is None or reference is None or self.state.since_reference < _LEAST_BETWEEN_REFERENCES:
            return False
        if mean_profile(self.state.profiles).departure(reference.profile) > _SPEED_DEPARTURE:
            return True
        departure_m = np.abs(found.clearance_m - reference.clearance_m)
        return bool((departure_m[found.sigma_m <= ESTIMATED_M] > _CLEARANCE_DEPARTURE_M).any())

    def _reference_clearances(self, modelled_m: Floats) -> Floats:
        """Clearances for a new reference: estimated if observable, else modelled."""
        found = self.state.found
        if found is None:
            return modelled_m
        return np.where(found.sigma_m <= ESTIMATED_M, found.clearance_m, modelled_m)

    def _evaluate_again(self) -> None:
        """Evaluate the kept cycles again, with a prior from the present errors of the encoders."""
        reference = self._regression.reference
        if reference is not None:
            self._regression.refer(reference, self._prior(reference.clearance_m))

    def _prior(self, clearance_m: Floats) -> Estimate:
        """Prior of the regression.

        While encoders are commissioned, the clearances are the modelled ones, with uncertain wear: the error
        of a new clearance stays in all estimates. Afterwards they are practically unknown, so that the
        encoders alone decide.
        """
        if self.state.errors.known:
            return prior_with(self.state.errors, clearance_m, _UNKNOWN_SIGMA_M)
        wear_sigma_m = self._coefficient_sigma * (clearance_m - self._new_m)
        return prior_with(self.state.errors, clearance_m, np.hypot(_MODEL_M, wear_sigma_m))

    @property
    def seen(self) -> Sequence[KnownClearance | None]:
        """Clearance of each joint estimated from encoders; None if it is not observable.

        The encoders were commissioned with the modelled clearances, whose error is in each estimate.
        """
        return [
            KnownClearance("encoders", one.clearance_m, math.hypot(one.sigma_m, tolerance_m))
            if one.observation is ClearanceObservation.SEEN
            else None
            for one, tolerance_m in zip(self.estimates or (), self._leg.tolerance_m, strict=False)
        ]

    @property
    def shows(self) -> str:
        """Source of the estimated clearances."""
        return "encoders"

    @property
    def notes(self) -> Mapping[str, Sequence[str]]:
        """Encoders without usable angles."""
        return {"ENCODER": faults(self._leg.config.encoders.names, self.state)}

    @property
    def statuses(self) -> Sequence[Status]:
        """Further encoders: their faults, their errors, and the clearances estimated from them."""
        names, state = self._leg.config.encoders.names, self.state
        kinds = {spec.kind for spec in alarm_specs.ENCODERS}
        departures = [alarm for alarm in self._board.alarms.values() if alarm.kind in kinds]
        level, code = max(alarm.level for alarm in departures), worst_code(departures)
        values = {"cycles": float(self._regression.cycles)}
        for i, name in enumerate(names):
            if state.errors.known:  # mean: offset of the crank's encoder, then offsets, then scale errors
                values[f"{name}_offset_rad"] = float(state.errors.centre_rad[i] + state.errors.mean[1 + i])
                values[f"{name}_scale_error"] = float(state.errors.mean[1 + len(names) + i])
        for joint, one in zip(self._leg.clearance_joints, self.estimates or (), strict=False):
            values[f"{joint}_estimated_m"] = one.clearance_m
            values[f"{joint}_sigma_m"] = one.sigma_m
            values[f"{joint}_departure_m"] = one.departure_m
        wrong = faults(names, state)
        if state.is_requested and not self._reference.is_busy and self._regression.reference is None:
            wrong.append("no reference: the leg could not be simulated with its clearances")
        if wrong and level is Level.OK:
            level, code = Level.WARN, ENCODERS
        return (Status("encoders", level, "; ".join([*wrong, *self._words()]), values, code),)

    def _words(self) -> list[str]:
        """Joints that differ from the model, or the reason why there is no estimate."""
        if not self.estimates:
            return ["no whole gait cycle yet"]
        each = list(zip(self._leg.clearance_joints, self.estimates, strict=True))
        words = [
            f"joint {joint} is {'wider' if one.departure_m > 0.0 else 'narrower'} than modelled"
            for joint, one in each
            if one.is_other
        ]
        states = {one.observation for _, one in each}
        waiting = states & {ClearanceObservation.WAITING, ClearanceObservation.COMMISSIONING}
        if not words and not waiting and ClearanceObservation.SEEN in states:
            words = ["clearances agree with the model"]
        hidden = ClearanceObservation.NOT_OBSERVABLE
        words += [f"{joint} {hidden.value}" for joint, one in each if one.observation is hidden]
        return words + sorted(one.value for one in waiting)
