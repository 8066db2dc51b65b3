"""Joint encoders: their errors, their samples, and the clearances estimated from them.

A joint encoder, or further encoder, measures the angle of a revolute joint other than the crank's. Its
deviation from the angle of the ideal linkage shows clearances, once its own errors (offset, scale) are known.
"""

from collections.abc import Sequence

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
    Estimate,
    binned,
    clearance_estimates,
    rms,
)
from leg_wear_monitor.monitor.config.inputs import Encoders
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.ledger.entry import Commissioned
from leg_wear_monitor.twin.angle_reference import PHASES, AngleReferenceRun, angle_model
from leg_wear_monitor.twin.reference import CrankProfile, cycle_profile, mean_profile
from leg_wear_monitor.twin.sample import GAIT_SAMPLE, KeepsSamples, Samples, newest, of_crank, within
from leg_wear_monitor.twin.statistics import CycleStatistics

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
    known : tuple of bool
        True if each encoder is commissioned.
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


def errors_of(encoders: Encoders, stored: Commissioned | None) -> EncoderErrors:
    """Errors of encoders as stored in the ledger; errors of encoders that are not stored are unknown."""
    names = names_of(encoders)
    m = len(names)
    centre, mean = np.full(m, np.nan), np.zeros(1 + 2 * m)
    sigma = np.concatenate([np.full(1 + m, _OFFSET_SIGMA_RAD), np.full(m, _SCALE_SIGMA)])
    covariance = np.diag(np.square(sigma))
    if stored is None:
        return EncoderErrors(centre, mean, covariance, (False,) * m)
    # the configuration may list other encoders than the ledger, in a different order
    common = [(i, stored.encoders.index(name)) for i, name in enumerate(names) if name in stored.encoders]
    here, there = [i for i, _ in common], [j for _, j in common]
    own, theirs = _rows(here, m), _rows(there, len(stored.encoders))
    centre[here], mean[own] = stored.centre_rad[there], stored.mean[theirs]
    covariance[np.ix_(own, own)] = stored.covariance[np.ix_(theirs, theirs)]
    return EncoderErrors(centre, mean, covariance, tuple(name in stored.encoders for name in names))


def _rows(which: Sequence[int], m: int) -> list[int]:
    """Rows of `EncoderErrors.mean`: the crank's offset, and the offsets and scale errors of some encoders."""
    return [0, *(1 + i for i in which), *(1 + m + i for i in which)]


def stored_errors(errors: EncoderErrors, encoders: Encoders, stamp_ns: int) -> Commissioned:
    """Ledger entry with the errors of the commissioned encoders."""
    which = [i for i, known in enumerate(errors.known) if known]
    rows = _rows(which, len(errors.known))
    return Commissioned(
        stamp_ns,
        tuple(names_of(encoders)[i] for i in which),
        errors.centre_rad[which],
        errors.mean[rows],
        errors.covariance[np.ix_(rows, rows)],
    )


def prior_with(errors: EncoderErrors, clearance_m: Floats, sigma_m: Floats | float) -> Estimate:
    """Prior of clearances (k,) with the given standard deviation, and of the encoders' errors."""
    k, p = len(clearance_m), len(errors.mean)
    covariance = np.zeros((k + p, k + p))
    covariance[:k, :k] = np.diag(np.square(np.broadcast_to(sigma_m, k)))
    covariance[k:, k:] = errors.covariance
    return Estimate(np.concatenate([clearance_m, errors.mean]), covariance, k)


def commissioned(errors: EncoderErrors, found: Estimate, present: Sequence[bool]) -> EncoderErrors:
    """Errors fixed at an estimate; encoders that were present are commissioned from now on."""
    k = found.joints
    known = tuple(was or is_ for was, is_ in zip(errors.known, present, strict=True))
    return EncoderErrors(errors.centre_rad, found.mean[k:], found.covariance[k:, k:], known)


# Samples of the encoders: they arrive in pieces, and are kept until the gait cycle that they belong to is
# evaluated.


@attrs.frozen(eq=False)
class EncoderSamples:
    """Samples of the crank in the order of their arrival, with counts of unusable encoder angles.

    Attributes
    ----------
    crank : (n,) array of GAIT_SAMPLE
    samples, absent, no_angle : (m,) arrays of int
        Counts since the start.
    """

    crank: Samples
    samples: Ints
    absent: Ints
    no_angle: Ints

    def extended(self, piece: Samples) -> "EncoderSamples":
        """With the crank samples of a piece appended; each has the encoders' angles of the same message."""
        piece = of_crank(piece)
        if not len(piece):
            return self
        angles = piece["encoder_rad"][:, : len(self.samples)]
        return EncoderSamples(
            np.concatenate([self.crank, piece]),
            self.samples + np.isfinite(angles).sum(axis=0),
            self.absent + np.isnan(angles).sum(axis=0),
            self.no_angle + np.isinf(angles).sum(axis=0),
        )

    def after(self, stamp_ns: int) -> "EncoderSamples":
        """Without the samples before a stamp."""
        return attrs.evolve(self, crank=newest(self.crank, stamp_ns))


def no_encoder_samples(encoders: int) -> EncoderSamples:
    """Empty samples of a number of encoders."""
    none = np.zeros(encoders, np.int64)
    return EncoderSamples(np.zeros(0, GAIT_SAMPLE), none, none, none)


# State of the observer (below), and the faults of an encoder.


_LEAST_PHASES = PHASES // 4  # crank phases with samples that a cycle needs: at 60 rpm a rate of 32 Hz
# RMS deviation about its mean in a cycle: many times the effect of clearances and scale errors
_FAULTY_RAD = 0.1


@attrs.define
class EncoderState:
    """State of an `EncoderObserver` besides its regression and its reference.

    Attributes
    ----------
    samples : EncoderSamples
    errors : EncoderErrors
    due : tuple of (int, int)
        Begin and end [ns] of ended gait cycles that are not evaluated yet.
    present : tuple of bool
        True if the cycles of the estimate have each encoder; empty before the first cycle.
    changed_present : tuple of bool
        The same of the last cycles, if it differs from `present`; empty otherwise.
    changed_cycles : int
        Number of these cycles.
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
        forecast used it. Both are set by `monitor.cycle_report`.
    """

    samples: EncoderSamples
    errors: EncoderErrors
    due: tuple[tuple[int, int], ...] = ()
    present: tuple[bool, ...] = ()
    changed_present: tuple[bool, ...] = ()
    changed_cycles: int = 0
    faults: tuple[str, ...] = ()
    is_requested: bool = False
    since_reference: int = 0
    profiles: tuple[CrankProfile, ...] = ()
    found: Estimate | None = None
    updated_ns: int = 0
    other: tuple[bool, ...] = ()
    believed: tuple[bool, ...] = ()


def fault_of(raw: Floats, deviation: Floats, joint: str) -> str:
    """Fault of an encoder in a cycle; empty if there is none."""
    finite = deviation[np.isfinite(deviation)]
    if len(finite) < _LEAST_PHASES:
        return "gives no angle" if np.isinf(raw).any() else "is not in joint_states with the crank"
    if rms(finite - finite.mean()) > _FAULTY_RAD:
        return f"does not turn as joint {joint} does, look at encoders.joints and encoders.signs"
    return ""


def faults(names: Sequence[str], state: EncoderState) -> list[str]:
    """Faults of the encoders as text for operators."""
    return [f"{name} {fault}" for name, fault in zip(names, state.faults, strict=False) if fault]


# The observer: from samples to clearance estimates.
#
# Everything is computed at the end of an evaluation period; periods depend on the order of arrival only, so a
# replay gives the same results. A period evaluates the gait cycles that ended in it. The cycles are compared
# with a reference, a simulation of the leg as modelled.


_CHANGE_CYCLES = 20  # cycles in a row with other encoders until the change counts as permanent

_MODEL_M = 5.0e-6  # standard deviation of a modelled clearance apart from the error of the new one
_UNKNOWN_SIGMA_M = 1.0e-3  # prior standard deviation of a clearance without prior knowledge
_PROFILE_CYCLES = 10  # gait cycles whose crank motion is averaged for a reference
# A reference is renewed if an observable clearance, or the crank's speed as a fraction of its mean, differs
# from the reference's by more; and at the earliest this many cycles after the last reference.
_CLEARANCE_DEPARTURE_M, _SPEED_DEPARTURE, _LEAST_BETWEEN_REFERENCES = 1.0e-4, 0.015, 100


class EncoderObserver(KeepsSamples):
    """Estimates clearances from joint encoders, and the errors of encoders that are not commissioned yet.

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
        self._new_m = np.array(
            [mechanism.clearances[joint].radial_clearance for joint in mechanism.clearance_joints]
        )
        self._model = angle_model(mechanism, self._settings.joints)
        self._reference = AngleReferenceRun(mechanism, self._model)
        self._clearance_regression = ClearanceRegression(self._model)
        errors = errors_of(self._settings, known)
        self.state = EncoderState(no_encoder_samples(len(self._settings.names)), errors)

    @property
    def cycles(self) -> int:
        """Number of gait cycles in the estimate."""
        return self._clearance_regression.cycles

    @property
    def commissions(self) -> bool:
        """True if the errors of some available encoder are unknown."""
        return any(
            here and not known
            for here, known in zip(self.state.present, self.state.errors.known, strict=False)
        )

    @property
    def has_failed(self) -> bool:
        """True if there is no reference because the leg could not be simulated."""
        return (
            self.state.is_requested
            and not self._reference.is_busy
            and self._clearance_regression.reference is None
        )

    def go_live(self) -> None:
        """Never wait for simulations."""
        self._reference.may_be_late = True

    def leave(self) -> None:
        """Stop simulating ahead: the process is about to end."""
        self._reference.leave()

    def ended(self, statistics: CycleStatistics) -> None:
        """Queue an ended gait cycle for evaluation, if the leg walked steadily at the commanded cadence."""
        if statistics.is_steady and self.config.cadence.allows(statistics.cadence_rpm):
            self.state.due = (*self.state.due, (statistics.begin_ns, statistics.stamp_ns))

    def end_period(self, clearance_m: Floats, depth: Floats) -> Commissioned | None:
        """Evaluate the queued gait cycles, and continue the simulation of the reference.

        Parameters
        ----------
        clearance_m : (k,) array
            Modelled mean clearances.
        depth : (k, 2, N) array
            Modelled wear [m].

        Returns
        -------
        Commissioned or None
            Errors of the encoders, if this period completed their commissioning.
        """
        new: list[Commissioned] = []

        def evaluate(begin_ns: int, end_ns: int) -> None:
            self._add_cycle(begin_ns, end_ns)
            found = self._evaluate(end_ns)
            new.extend([found] if found else [])

        self.evaluate_due(evaluate)
        self._advance_reference(clearance_m, depth)
        return new[-1] if new else None

    def replaced(self) -> None:
        """Forget the estimate after the replacement of a part; the errors of the encoders stay."""
        self._clearance_regression.forget()
        self.state.found, self.state.is_requested, self.state.updated_ns = None, False, 0

    def estimates(self, modelled_m: Floats) -> tuple[ClearanceEstimate, ...]:
        """Clearance estimate of each joint, compared with the modelled clearances (k,) [m]."""
        found = self.state.found
        if found is None:
            observation = (
                ClearanceObservation.COMMISSIONING if self.commissions else ClearanceObservation.WAITING
            )
            return (ClearanceEstimate(observation=observation),) * len(modelled_m)
        return clearance_estimates(found, modelled_m)

    def _add_cycle(self, begin_ns: int, end_ns: int) -> None:
        """Add a gait cycle to the regression, unless other encoders are present than before."""
        state = self.state
        kept = within(state.samples.crank, begin_ns, end_ns)
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
        present = tuple(not fault for fault in state.faults)
        if present != state.present and not self._accept_change(present):
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

    def _accept_change(self, present: tuple[bool, ...]) -> bool:
        """Count a cycle with other encoders; if the change is permanent, start the estimate again with these.

        Returns whether the change was accepted. A change for a few cycles only (lost messages) is ignored.
        """
        state = self.state
        state.changed_cycles = state.changed_cycles + 1 if present == state.changed_present else 1
        state.changed_present = present
        if state.present and state.changed_cycles < _CHANGE_CYCLES:
            return False
        state.present, state.changed_present, state.changed_cycles = present, (), 0
        state.found = None
        self._clearance_regression.forget()
        self._evaluate_again()
        return True

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
        self._evaluate_again()
        return stored_errors(state.errors, self._settings, stamp_ns)

    def _advance_reference(self, clearance_m: Floats, depth: Floats) -> None:
        """Continue the simulation of a reference, or begin a new one if required."""
        state = self.state
        reference = self._reference.advance()
        if reference is not None:
            state.since_reference = 0
            self._clearance_regression.refer(reference, self._prior(reference.clearance_m))
        if self._reference.is_busy or not any(state.present):
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
        found, reference = self.state.found, self._clearance_regression.reference
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
        reference = self._clearance_regression.reference
        if reference is not None:
            self._clearance_regression.refer(reference, self._prior(reference.clearance_m))

    def _prior(self, clearance_m: Floats) -> Estimate:
        """Prior of the regression.

        While encoders are commissioned, the clearances are the modelled ones, with uncertain wear: the error
        of a new clearance stays in all estimates. Afterwards they are practically unknown, so that the
        encoders alone decide.
        """
        if not self.commissions:
            return prior_with(self.state.errors, clearance_m, _UNKNOWN_SIGMA_M)
        wear_sigma_m = self._coefficient_sigma * (clearance_m - self._new_m)
        return prior_with(self.state.errors, clearance_m, np.hypot(_MODEL_M, wear_sigma_m))
