"""Joint encoders: their commissioning, their samples, and the clearances that they see."""

from collections.abc import Sequence
from typing import NamedTuple

import attrs
import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats, Ints
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor.angle_regression import (
    ESTIMATED_M,
    ClearanceEstimate,
    ClearanceObservation,
    ClearanceRegression,
    ClearanceRegressionSnapshot,
    Estimate,
    binned,
    clearance_estimates,
    rms,
)
from leg_wear_monitor.monitor.config.inputs import Encoders
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.ledger.entry import Commissioned
from leg_wear_monitor.twin.reference import (
    PHASES,
    CrankProfile,
    ReferenceRun,
    ReferenceSnapshot,
    angle_model,
    cycle_profile,
    mean_profile,
)
from leg_wear_monitor.twin.sample import KeepsSamples, Samples, indices_within, newest, of_crank
from leg_wear_monitor.twin.statistics import CycleStatistics

# The encoders' own errors: unknown at first, estimated while the clearances are known, then fixed.


_OFFSET_SIGMA_RAD = 0.05  # standard deviation of an encoder's offset before commissioning
_SCALE_SIGMA = 0.01


@attrs.frozen(eq=False)
class EncoderErrors:
    """Estimated errors of m encoders.

    Attributes
    ----------
    centre_rad : (m,) array
        Zero of an encoder's deviation, NaN before the first gait cycle: the zero of an encoder is arbitrary.
    mean : (1 + 2 m,) array
        Offset of the crank's encoder, offsets from the centres [rad] and scale errors of the others.
    covariance : array
    known : tuple of bool
        Which encoders were commissioned.
    """

    centre_rad: Floats
    mean: Floats
    covariance: Floats
    known: tuple[bool, ...]


def names_of(encoders: Encoders) -> tuple[str, ...]:
    """Identification of each encoder: name, joint and sign."""
    signs = encoders.signs or (1.0,) * len(encoders.names)
    return tuple(
        f"{name} on {joint} {sign:+.0f}"
        for name, joint, sign in zip(encoders.names, encoders.joints, signs, strict=True)
    )


def errors_of(encoders: Encoders, held: Commissioned | None) -> EncoderErrors:
    """Stored errors of commissioned encoders; the errors of the others are unknown."""
    names = names_of(encoders)
    m = len(names)
    centre, mean = np.full(m, np.nan), np.zeros(1 + 2 * m)
    sigma = np.concatenate([np.full(1 + m, _OFFSET_SIGMA_RAD), np.full(m, _SCALE_SIGMA)])
    covariance = np.diag(np.square(sigma))
    if held is None:
        return EncoderErrors(centre, mean, covariance, (False,) * m)
    common = [(i, held.encoders.index(name)) for i, name in enumerate(names) if name in held.encoders]
    here, there = [i for i, _ in common], [j for _, j in common]
    own, kept = _rows(here, m), _rows(there, len(held.encoders))
    centre[here], mean[own] = held.centre_rad[there], held.mean[kept]
    covariance[np.ix_(own, own)] = held.covariance[np.ix_(kept, kept)]
    return EncoderErrors(centre, mean, covariance, tuple(name in held.encoders for name in names))


def _rows(which: Sequence[int], m: int) -> list[int]:
    """Rows of the crank's offset, and of the offsets and scale errors of some encoders."""
    return [0, *(1 + i for i in which), *(1 + m + i for i in which)]


def held(errors: EncoderErrors, encoders: Encoders, stamp_ns: int) -> Commissioned:
    """Errors of the commissioned encoders, as stored in the ledger."""
    which = [i for i, known in enumerate(errors.known) if known]
    rows = _rows(which, len(errors.known))
    return Commissioned(
        stamp_ns,
        tuple(names_of(encoders)[i] for i in which),
        errors.centre_rad[which],
        errors.mean[rows],
        errors.covariance[np.ix_(rows, rows)],
    )


def known_with(errors: EncoderErrors, clearance_m: Floats, sigma_m: Floats | float) -> Estimate:
    """Estimate of the encoders' errors and of clearances (k,) with the given standard deviation."""
    k, p = len(clearance_m), len(errors.mean)
    covariance = np.zeros((k + p, k + p))
    covariance[:k, :k] = np.diag(np.square(np.broadcast_to(sigma_m, k)))
    covariance[k:, k:] = errors.covariance
    return Estimate(np.concatenate([clearance_m, errors.mean]), covariance, k)


def commissioned(errors: EncoderErrors, found: Estimate, present: Sequence[bool]) -> EncoderErrors:
    """Errors fixed at the given estimate."""
    k = found.joints
    known = tuple(was or is_ for was, is_ in zip(errors.known, present, strict=True))
    return EncoderErrors(errors.centre_rad, found.mean[k:], found.covariance[k:, k:], known)


# Samples of further encoders, kept until their gait cycle ends.


@attrs.frozen(eq=False)
class EncoderSamples:
    """Crank and encoder angles in the order of their arrival, with counts of unusable ones.

    Attributes
    ----------
    stamp_ns : (n,) array of int
    crank_rad : (n,) array
    encoder_rad : (n, m) array
        NaN where absent, infinite where the received value is not an angle.
    samples, absent, no_angle : (m,) arrays of int
        Counts since the start.
    """

    stamp_ns: Ints
    crank_rad: Floats
    encoder_rad: Floats
    samples: Ints
    absent: Ints
    no_angle: Ints

    def extended(self, piece: Samples) -> "EncoderSamples":
        """With the valid crank samples of a piece."""
        piece = of_crank(piece)
        if not len(piece):
            return self
        angles = piece["encoder_rad"][:, : self.encoder_rad.shape[1]]
        return EncoderSamples(
            np.concatenate([self.stamp_ns, piece["stamp_ns"]]),
            np.concatenate([self.crank_rad, piece["crank_angle_rad"]]),
            np.concatenate([self.encoder_rad, angles]),
            self.samples + np.isfinite(angles).sum(axis=0),
            self.absent + np.isnan(angles).sum(axis=0),
            self.no_angle + np.isinf(angles).sum(axis=0),
        )

    def after(self, stamp_ns: int) -> "EncoderSamples":
        """Those from a stamp on."""
        which = newest(self.stamp_ns, stamp_ns)
        return attrs.evolve(
            self,
            stamp_ns=self.stamp_ns[which],
            crank_rad=self.crank_rad[which],
            encoder_rad=self.encoder_rad[which],
        )


def no_encoder_samples(encoders: int) -> EncoderSamples:
    """Empty samples of a number of encoders."""
    none = np.zeros(encoders, np.int64)
    return EncoderSamples(np.zeros(0, np.int64), np.zeros(0), np.zeros((0, encoders)), none, none, none)


def within(kept: EncoderSamples, begin_ns: int, end_ns: int) -> tuple[Ints, Floats, Floats]:
    """Stamps (n,) [ns], crank (n,) and encoder angles (n, m) [rad] between two stamps."""
    which = indices_within(kept.stamp_ns, begin_ns, end_ns)
    return kept.stamp_ns[which], kept.crank_rad[which], kept.encoder_rad[which]


# State of the encoder observer, and possible faults of an encoder.


LEAST_PHASES = PHASES // 4  # with samples: at 60 rpm a rate of 32 Hz

_STRANGE_RAD = 0.1  # deviation within a cycle: many times the effect of clearances and scale errors


@attrs.define
class EncoderState:
    """State besides the regression and the reference; every value is immutable.

    Attributes
    ----------
    samples : EncoderSamples
    errors : EncoderErrors
    due : tuple of (int, int)
        Begin and end [ns] of ended gait cycles that are not evaluated yet.
    present : tuple of bool
        Which encoders the kept cycles have; empty before the first.
    otherwise : tuple of bool
        Encoders of the last cycles, if they differ from `present`.
    otherwise_cycles : int
        Number of these cycles.
    faults : tuple of str
        Fault of each encoder in the last cycle; empty before the first.
    asked : bool
        Whether a reference was requested since the last change of the leg.
    since_reference : int
        Cycles since the last reference was ready.
    profiles : tuple of CrankProfile
        How the crank turned in the last cycles.
    found : Estimate or None
    updated_ns : int
        Stamp of the last forecast update with it, 0 if an update is due.
    other, believed : tuple of bool
        Clearances that then differed significantly from the counted ones, and those that the forecast used.
    """

    samples: EncoderSamples
    errors: EncoderErrors
    due: tuple[tuple[int, int], ...] = ()
    present: tuple[bool, ...] = ()
    otherwise: tuple[bool, ...] = ()
    otherwise_cycles: int = 0
    faults: tuple[str, ...] = ()
    asked: bool = False
    since_reference: int = 0
    profiles: tuple[CrankProfile, ...] = ()
    found: Estimate | None = None
    updated_ns: int = 0
    other: tuple[bool, ...] = ()
    believed: tuple[bool, ...] = ()


def fault_of(raw: Floats, deviation: Floats, joint: str) -> str:
    """Fault of an encoder in a cycle; empty if there is none."""
    finite = deviation[np.isfinite(deviation)]
    if len(finite) < LEAST_PHASES:
        return "gives no angle" if np.isinf(raw).any() else "is not in joint_states with the crank"
    if rms(finite - finite.mean()) > _STRANGE_RAD:
        return f"does not turn as joint {joint} does, look at encoders.joints and encoders.signs"
    return ""


def faults(names: Sequence[str], state: EncoderState) -> list[str]:
    """Faults of the encoders, for operators."""
    return [f"{name} {fault}" for name, fault in zip(names, state.faults, strict=False) if fault]


# Further encoders in the monitor: from their samples to clearance estimates.
#
# All evaluation takes place at the ends of evaluation periods, which depend on the order of arrival only.
# Each period evaluates the gait cycles that ended, and simulates at most one cycle for the reference.


OTHERWISE_CYCLES = 20  # in a row with other encoders than before, until the change is accepted

_UNKNOWN_M = 1.0e-3  # prior standard deviation of a clearance without prior knowledge
_FAR_M = 1.0e-4  # difference of a clearance from the reference at which the reference is renewed
_UNLIKE = 0.015  # of the mean speed: the reference is renewed if the crank turns otherwise by more
_PROFILES = 10  # gait cycles whose crank motion is averaged
_AGAIN_CYCLES = 100  # least number of cycles between two references


class EncoderSnapshot(NamedTuple):
    """Whole state of an `EncoderObserver`."""

    state: EncoderState
    regression: ClearanceRegressionSnapshot
    reference: ReferenceSnapshot


class EncoderObserver(KeepsSamples):
    """Estimates clearances from further encoders, and the encoders' errors while they are new.

    Parameters
    ----------
    mechanism : Mechanism
        With the parameters of the configuration applied.
    config : MonitorConfig
    coefficient_sigma : sequence of float
        Prior standard deviation of the logarithm of each clearance joint's wear coefficient.
    known : Commissioned or None
        Stored encoder errors of the ledger.

    Raises
    ------
    ConfigError, AssemblyError
    """

    def __init__(
        self,
        mechanism: Mechanism,
        config: MonitorConfig,
        coefficient_sigma: Sequence[float],
        known: Commissioned | None,
    ) -> None:
        self._coefficient_sigma = np.array(coefficient_sigma)
        self._settings, self.config = config.encoders, config
        self._fresh = np.array(
            [mechanism.clearances[joint].radial_clearance for joint in mechanism.clearance_joints]
        )
        self._model = angle_model(mechanism, self._settings.joints)
        self._reference = ReferenceRun(mechanism, self._model)
        self._clearance_regression = ClearanceRegression(self._model)
        errors = errors_of(self._settings, known)
        self.state = EncoderState(no_encoder_samples(len(self._settings.names)), errors)

    @property
    def cycles(self) -> int:
        """Number of gait cycles in the estimate."""
        return self._clearance_regression.cycles

    @property
    def commissions(self) -> bool:
        """Whether the errors of some available encoder are unknown."""
        return any(
            here and not known
            for here, known in zip(self.state.present, self.state.errors.known, strict=False)
        )

    @property
    def has_failed(self) -> bool:
        """Whether there is no reference, since the leg could not be simulated for one."""
        return (
            self.state.asked and not self._reference.is_busy and self._clearance_regression.reference is None
        )

    def ended(self, statistics: CycleStatistics) -> None:
        """Note the end of a gait cycle, which is used if the leg walked as commanded."""
        if statistics.is_steady and self.config.cadence.allows(statistics.cadence_rpm):
            self.state.due = (*self.state.due, (statistics.begin_ns, statistics.stamp_ns))

    def end_period(self, clearance_m: Floats, depth: Floats) -> Commissioned | None:
        """Evaluate the gait cycles that ended, and simulate one more for the reference.

        Parameters
        ----------
        clearance_m : (k,) array
            Counted mean clearances.
        depth : (k, 2, N) array
            Counted wear [m].

        Returns
        -------
        Commissioned or None
            Errors of the encoders, if this period completed their commissioning.
        """
        state, new = self.state, None
        for begin_ns, end_ns in state.due:
            self._add_cycle(begin_ns, end_ns)
            new = self._evaluate(end_ns) or new
        state.samples = state.samples.after(state.due[-1][1] if state.due else 0)
        state.due = ()
        self._refer(clearance_m, depth)
        return new

    def replaced(self) -> None:
        """Start again after the replacement of a part."""
        self._clearance_regression.forget()
        self.state.found, self.state.asked, self.state.updated_ns = None, False, 0

    def estimates(self, counted_m: Floats) -> tuple[ClearanceEstimate, ...]:
        """Clearance estimate of each joint, compared with the counted clearances (k,) [m]."""
        found = self.state.found
        if found is None:
            observation = (
                ClearanceObservation.COMMISSIONING if self.commissions else ClearanceObservation.WAITING
            )
            return (ClearanceEstimate(observation=observation),) * len(counted_m)
        return clearance_estimates(found, counted_m)

    def snapshot(self) -> EncoderSnapshot:
        """A copy of the whole state."""
        return EncoderSnapshot(
            attrs.evolve(self.state), self._clearance_regression.snapshot(), self._reference.snapshot()
        )

    def restore(self, snapshot: EncoderSnapshot) -> None:
        """Restore a snapshot of the same mechanism and parameters; results are then bit for bit the same."""
        self.state = attrs.evolve(snapshot.state)
        self._clearance_regression.restore(snapshot.regression)
        self._reference.restore(snapshot.reference)

    def _add_cycle(self, begin_ns: int, end_ns: int) -> None:
        """Add a gait cycle if its encoders are those of the previous cycles."""
        state = self.state
        stamp_ns, crank, raw = within(state.samples, begin_ns, end_ns)
        if len(crank) >= LEAST_PHASES:
            turned: Floats = np.asarray(np.unwrap(crank, period=TURN), dtype=np.float64)
            since_s = np.asarray(1.0e-9 * (stamp_ns - begin_ns), dtype=np.float64)
            profile = cycle_profile(since_s, turned, 1.0e-9 * (end_ns - begin_ns))
            state.profiles = (*state.profiles, profile)[-_PROFILES:]
        angles = np.where(np.isfinite(raw), raw, np.nan)
        self._centre(crank, angles)
        deviation, counts = binned(self._model, crank, angles - state.errors.centre_rad)
        state.faults = tuple(
            fault_of(raw[:, i], deviation[:, i], joint) for i, joint in enumerate(self._settings.joints)
        )
        present = tuple(not fault for fault in state.faults)
        if present != state.present and not self._is_changed(present):
            return
        absent = [not here for here in present]
        deviation[:, absent], counts[:, absent] = np.nan, 0.0
        if any(present):
            settings = self._settings
            self._clearance_regression.most = (
                settings.commissioning_cycles if self.commissions else settings.window_cycles
            )
            self._clearance_regression.add_binned(deviation, counts)
            state.since_reference += 1

    def _is_changed(self, present: tuple[bool, ...]) -> bool:
        """Whether the set of available encoders has changed for more than a few cycles."""
        state = self.state
        state.otherwise_cycles = state.otherwise_cycles + 1 if present == state.otherwise else 1
        state.otherwise = present
        if state.present and state.otherwise_cycles < OTHERWISE_CYCLES:
            return False
        state.present, state.otherwise, state.otherwise_cycles = present, (), 0
        state.found = None
        self._clearance_regression.forget()
        self._re_evaluate()
        return True

    def _centre(self, crank: Floats, angles: Floats) -> None:
        """Set the zero of an encoder's deviation from its first cycle."""
        errors = self.state.errors
        if not np.isnan(errors.centre_rad).any() or not len(crank):
            return
        deviation = self._model.deviation(crank, angles)
        is_sufficient = np.isfinite(deviation).sum(axis=0) >= LEAST_PHASES
        mean = np.angle(np.nansum(np.exp(1j * deviation), axis=0))
        first = np.isnan(errors.centre_rad) & is_sufficient
        self.state.errors = attrs.evolve(errors, centre_rad=np.where(first, mean, errors.centre_rad))

    def _evaluate(self, stamp_ns: int) -> Commissioned | None:
        """Renew the estimate; fix the encoders' errors if there are enough cycles."""
        state, regression = self.state, self._clearance_regression
        if regression.reference is None or not any(state.present):
            return None
        if not self.commissions:
            state.found = regression.fused()
            return None
        found = regression.fused() if regression.cycles >= self._settings.commissioning_cycles else None
        if found is None:
            return None
        state.errors = commissioned(state.errors, found, state.present)
        self._re_evaluate()
        return held(state.errors, self._settings, stamp_ns)

    def _refer(self, clearance_m: Floats, depth: Floats) -> None:
        """Continue the simulation of a reference, or begin a new one if required."""
        state = self.state
        reference = self._reference.advance()
        if reference is not None:
            state.since_reference = 0
            self._clearance_regression.refer(reference, self._before(reference.clearance_m))
        if self._reference.is_busy or not any(state.present):
            return
        if not state.asked and state.profiles:
            state.asked = True
            self._reference.begin(clearance_m, depth, mean_profile(state.profiles))
        elif self._is_far():
            state.since_reference = 0
            self._reference.begin(self._best(clearance_m), depth, mean_profile(state.profiles))

    def _is_far(self) -> bool:
        found, reference = self.state.found, self._clearance_regression.reference
        if found is None or reference is None or self.state.since_reference < _AGAIN_CYCLES:
            return False
        if mean_profile(self.state.profiles).departure(reference.profile) > _UNLIKE:
            return True
        off = np.abs(found.clearance_m - reference.clearance_m)
        return bool((off[found.sigma_m <= ESTIMATED_M] > _FAR_M).any())

    def _best(self, counted_m: Floats) -> Floats:
        """Estimated clearances where available, otherwise the counted ones."""
        found = self.state.found
        if found is None:
            return counted_m
        return np.where(found.sigma_m <= ESTIMATED_M, found.clearance_m, counted_m)

    def _re_evaluate(self) -> None:
        """Evaluate the kept cycles with the present errors of the encoders."""
        reference = self._clearance_regression.reference
        if reference is not None:
            self._clearance_regression.refer(reference, self._before(reference.clearance_m))

    def _before(self, clearance_m: Floats) -> Estimate:
        """Prior without the cycles; includes the clearances only during commissioning of the encoders."""
        forecast = self.config.forecast
        if not self.commissions:
            return known_with(self.state.errors, clearance_m, _UNKNOWN_M)
        worn = self._coefficient_sigma * (clearance_m - self._fresh)
        return known_with(self.state.errors, clearance_m, np.hypot(forecast.clearance_sigma_m, worn))
