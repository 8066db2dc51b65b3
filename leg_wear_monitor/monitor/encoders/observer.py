"""Further encoders in the monitor: from their samples to the clearances that they show.

All of it happens at the ends of evaluation periods, which follow from the order of arrival alone. A cycle
is evaluated when it is over; one more is simulated for the reference, and no period does more than that.
"""

from typing import NamedTuple

import attrs
import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats
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
from leg_wear_monitor.monitor.encoders.samples import after, extended, no_encoder_samples, within
from leg_wear_monitor.monitor.encoders.state import LEAST_PHASES, EncoderState, fault_of
from leg_wear_monitor.monitor.ledger.entry import Commissioned
from leg_wear_monitor.twin.reference.joint_angles import angle_model
from leg_wear_monitor.twin.reference.reference import ReferenceRun, ReferenceSnapshot
from leg_wear_monitor.twin.sample import Samples
from leg_wear_monitor.twin.statistics import CycleStatistics

OTHERWISE_CYCLES = 20  # in a row with other encoders than before, until those are believed to be the ones

_UNKNOWN_M = 1.0e-3  # standard deviation of a clearance of which nothing is to be supposed
_FAR_M = 1.0e-4  # from the reference: then it is made again
_LONGEST = 1.5  # of a cycle's time in motion: with more standing in it, it is none of a steady gait
_AGAIN_CYCLES = 100  # between two references


class EncoderSnapshot(NamedTuple):
    """All of an `EncoderObserver`."""

    state: EncoderState
    hidden: ClearanceRegressionSnapshot
    reference: ReferenceSnapshot


class EncoderObserver:
    """Estimates clearances from further encoders, and the encoders' errors while they are new.

    Parameters
    ----------
    mechanism : Mechanism
        As the configuration wants it.
    config : MonitorConfig
    known : Commissioned or None
        Of the ledger.

    Raises
    ------
    ConfigError, AssemblyError
    """

    def __init__(self, mechanism: Mechanism, config: MonitorConfig, known: Commissioned | None) -> None:
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
        """Gait cycles that the estimate is of."""
        return self._clearance_regression.cycles

    @property
    def commissions(self) -> bool:
        """Whether encoders are there whose errors are not known."""
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

    def see(self, piece: Samples) -> None:
        """Take in samples as they arrive."""
        self.state.samples = extended(self.state.samples, piece)

    def ended(self, statistics: CycleStatistics) -> None:
        """A gait cycle is over; it counts if the leg walked as commanded."""
        cadence = self.config.cadence
        rpm = 60.0 * statistics.direction / statistics.moving_s
        steady = statistics.bridged_s == 0.0 and statistics.duration_s <= _LONGEST * statistics.moving_s
        if steady and abs(rpm - cadence.commanded_rpm) <= cadence.tolerance_rpm:
            self.state.due = (*self.state.due, (statistics.begin_ns, statistics.stamp_ns))

    def end_period(self, clearance_m: Floats, depth: Floats) -> Commissioned | None:
        """Look at the gait cycles that are over, and simulate one more for the reference.

        Parameters
        ----------
        clearance_m : (k,) array
            Mean clearances as they are counted.
        depth : (k, 2, N) array
            Wear as it is counted [m].

        Returns
        -------
        Commissioned or None
            If the encoders' errors are known from now on.
        """
        state, new = self.state, None
        for begin_ns, end_ns in state.due:
            self._look(begin_ns, end_ns)
            new = self._evaluate(end_ns) or new
        state.samples = after(state.samples, state.due[-1][1] if state.due else 0)
        state.due = ()
        self._refer(clearance_m, depth)
        return new

    def replaced(self) -> None:
        """A part is new: the leg is another one."""
        self._clearance_regression.forget()
        self.state.found, self.state.asked, self.state.updated_ns = None, False, 0

    def seen(self, counted_m: Floats) -> tuple[ClearanceEstimate, ...]:
        """What the encoders show of each joint, beside the clearances (k,) that are counted [m]."""
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
        """Go back to a snapshot of a watch of the same mechanism and parameters; it goes on bit for bit."""
        self.state = attrs.evolve(snapshot.state)
        self._clearance_regression.restore(snapshot.hidden)
        self._reference.restore(snapshot.reference)

    def _look(self, begin_ns: int, end_ns: int) -> None:
        """Take in a gait cycle, if its encoders are those of the cycles before."""
        state = self.state
        crank, raw = within(state.samples, begin_ns, end_ns)
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
        """Whether the encoders are others now, and not for a moment only."""
        state = self.state
        state.otherwise_cycles = state.otherwise_cycles + 1 if present == state.otherwise else 1
        state.otherwise = present
        if state.present and state.otherwise_cycles < OTHERWISE_CYCLES:
            return False
        state.present, state.otherwise, state.otherwise_cycles = present, (), 0
        state.found = None
        self._clearance_regression.forget()
        self._look_anew()
        return True

    def _centre(self, crank: Floats, angles: Floats) -> None:
        """Find the angle that an encoder counts from, in its first cycle."""
        errors = self.state.errors
        if not np.isnan(errors.centre_rad).any() or not len(crank):
            return
        deviation = self._model.deviation(crank, angles)
        there = np.isfinite(deviation).sum(axis=0) >= LEAST_PHASES
        mean = np.angle(np.nansum(np.exp(1j * deviation), axis=0))
        first = np.isnan(errors.centre_rad) & there
        self.state.errors = attrs.evolve(errors, centre_rad=np.where(first, mean, errors.centre_rad))

    def _evaluate(self, stamp_ns: int) -> Commissioned | None:
        """Estimate anew; hold the encoders' errors if there are cycles enough."""
        state, hidden = self.state, self._clearance_regression
        if hidden.reference is None or not any(state.present):
            return None
        if not self.commissions:
            state.found = hidden.fused()
            return None
        found = hidden.fused() if hidden.cycles >= self._settings.commissioning_cycles else None
        if found is None:
            return None
        state.errors = commissioned(state.errors, found, state.present)
        self._look_anew()
        return held(state.errors, self._settings, stamp_ns)

    def _refer(self, clearance_m: Floats, depth: Floats) -> None:
        """Simulate for a reference, and begin one where it is wanted."""
        state = self.state
        reference = self._reference.advance()
        if reference is not None:
            state.since_reference = 0
            self._clearance_regression.refer(reference, self._before(reference.clearance_m))
        if self._reference.is_busy or not any(state.present):
            return
        if not state.asked:
            state.asked = True
            self._reference.begin(clearance_m, depth)
        elif self._is_far():
            state.since_reference = 0
            self._reference.begin(self._best(clearance_m), depth)

    def _is_far(self) -> bool:
        found, reference = self.state.found, self._clearance_regression.reference
        if found is None or reference is None or self.state.since_reference < _AGAIN_CYCLES:
            return False
        off = np.abs(found.clearance_m - reference.clearance_m)
        return bool((off[found.sigma_m <= ESTIMATED_M] > _FAR_M).any())

    def _best(self, counted_m: Floats) -> Floats:
        """Clearances as seen, where they are; else as counted."""
        found = self.state.found
        if found is None:
            return counted_m
        return np.where(found.sigma_m <= ESTIMATED_M, found.clearance_m, counted_m)

    def _look_anew(self) -> None:
        """Look at the kept cycles with what is known of the encoders now."""
        reference = self._clearance_regression.reference
        if reference is not None:
            self._clearance_regression.refer(reference, self._before(reference.clearance_m))

    def _before(self, clearance_m: Floats) -> Estimate:
        """What is known without the cycles; of the clearances only while they commission the encoders."""
        forecast = self.config.forecast
        if not self.commissions:
            return known_with(self.state.errors, clearance_m, _UNKNOWN_M)
        worn = forecast.wear_coefficient_sigma * (clearance_m - self._fresh)
        return known_with(self.state.errors, clearance_m, np.hypot(forecast.clearance_sigma_m, worn))
