"""Further encoders in the monitor: from their samples to clearance estimates.

All evaluation takes place at the ends of evaluation periods, which depend on the order of arrival only. Each
period evaluates the gait cycles that ended, and simulates at most one cycle for the reference.
"""

from collections.abc import Sequence
from typing import NamedTuple

import attrs
import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ideal import TURN
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.encoders.angle_regression import Estimate, binned
from leg_wear_monitor.monitor.encoders.clearance_estimate import (
    ESTIMATED_M,
    ClearanceEstimate,
    ClearanceObservation,
    clearance_estimates,
)
from leg_wear_monitor.monitor.encoders.clearance_regression import (
    ClearanceRegression,
    ClearanceRegressionSnapshot,
)
from leg_wear_monitor.monitor.encoders.commissioning import commissioned, errors_of, held, known_with
from leg_wear_monitor.monitor.encoders.samples import no_encoder_samples, within
from leg_wear_monitor.monitor.encoders.state import LEAST_PHASES, EncoderState, fault_of
from leg_wear_monitor.monitor.kept_samples import KeepsSamples
from leg_wear_monitor.monitor.ledger.entry import Commissioned
from leg_wear_monitor.twin.reference.crank_profile import cycle_profile, mean_profile
from leg_wear_monitor.twin.reference.joint_angles import angle_model
from leg_wear_monitor.twin.reference.reference import ReferenceRun, ReferenceSnapshot
from leg_wear_monitor.twin.statistics import CycleStatistics

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
