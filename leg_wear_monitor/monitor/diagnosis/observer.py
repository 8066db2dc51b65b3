"""The drive torque in the monitor: from its samples to clearances, and to what has changed.

All evaluation takes place at the ends of evaluation periods, which depend on the order of arrival only. Each
period evaluates the gait cycles that ended; each second one simulates a cycle for the reference, if needed.
"""

import math
from typing import NamedTuple

import attrs
import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.diagnosis.change_detector import ChangeDetector
from leg_wear_monitor.monitor.diagnosis.clearance_fit import ClearanceFit
from leg_wear_monitor.monitor.diagnosis.diagnosis import Cause, Change, Diagnosis, DiagnosisState
from leg_wear_monitor.monitor.diagnosis.explanations import Explainer
from leg_wear_monitor.monitor.diagnosis.identification import UNLIKE_FILE, identified_bodies, misfit
from leg_wear_monitor.monitor.diagnosis.leg_model import (
    best_fit,
    change_of,
    explainer_of,
    first_changed,
    start_of,
)
from leg_wear_monitor.monitor.diagnosis.reference_file import shipped_reference
from leg_wear_monitor.monitor.diagnosis.signature import TorqueSensor, signatures
from leg_wear_monitor.monitor.diagnosis.signature_model import with_noise_of
from leg_wear_monitor.monitor.diagnosis.state import SignedCycle, TorqueState
from leg_wear_monitor.monitor.diagnosis.torque_samples import (
    NO_TORQUE_SAMPLES,
    after,
    cycle_torque,
    extended,
    sensor_period_s,
)
from leg_wear_monitor.monitor.ledger.entry import CommissionedTorque
from leg_wear_monitor.twin.reference.crank_profile import CrankProfile, mean_profile
from leg_wear_monitor.twin.reference.torque_reference import (
    TorqueReference,
    TorqueReferenceRun,
    TorqueReferenceSnapshot,
)
from leg_wear_monitor.twin.sample import Samples
from leg_wear_monitor.twin.settings import INSTANT
from leg_wear_monitor.twin.statistics import CycleStatistics

COMMISSIONING_CYCLES = 60
# of the counted clearance: smaller openings are named wrongly where masses are 5 % off (diagnosis.md)
CORRECTED_FROM = 1.3
WINDOW_CYCLES = 60  # that clearances are estimated from
SETTLING_CYCLES = 10  # since a change, before the counted clearances are corrected by it

_FIRST_CYCLES = 5  # before a reference is chosen
_LEAST_CYCLES = 2  # since a change, before it is explained: the first contains the change itself
_UNLIKE = 0.015  # of the mean speed: a crank that turns otherwise than in the reference by more
_UNLIKE_CYCLES = 20  # in a row, until a new reference is made
_FAR = 0.1  # of a counted clearance: the reference is renewed where it was made for another one
_ESTIMATED_M, _ESTIMATED = 1.0e-4, 0.2  # largest standard deviation of an observable clearance; of it
_UNUSABLE_CYCLES = 3
_FIT_EVERY = 10  # gait cycles, while nothing changes


class TorqueObserverSnapshot(NamedTuple):
    """Whole state of a `TorqueObserver`."""

    state: TorqueState
    reference: TorqueReferenceSnapshot | None


class Correction(NamedTuple):
    """A counted clearance that is surely wrong: joint index, its clearance [m], and the change behind it."""

    joint: int
    clearance_m: float
    change: Change


class TorqueObserver:
    """Estimates clearances from the drive torque, and detects what changes.

    Parameters
    ----------
    mechanism : Mechanism
        With the parameters of the configuration applied.
    config : MonitorConfig
    size_nm : float
        RMS of the leg's drive torque at the commanded speed.
    counted_m : (k,) array
        Counted clearances.
    commissioned : CommissionedTorque or None
        That of the ledger.

    Raises
    ------
    ConfigError, AssemblyError
    """

    def __init__(
        self,
        mechanism: Mechanism,
        config: MonitorConfig,
        size_nm: float,
        counted_m: Floats,
        commissioned: CommissionedTorque | None = None,
    ) -> None:
        self._mechanism, self.config, self._size_nm = mechanism, config, size_nm
        self._shipped = shipped_reference(mechanism)
        self._run: TorqueReferenceRun | None = None
        self._explainer: Explainer | None = None
        self._detector: ChangeDetector | None = None
        self._misfit: float | None = None
        self.state = TorqueState(np.asarray(counted_m, float).copy(), commissioned=commissioned)

    def add_samples(self, piece: Samples) -> None:
        """Add samples in the order of arrival."""
        self.state.samples = extended(self.state.samples, piece)

    def ended(self, statistics: CycleStatistics) -> None:
        """Note the end of a gait cycle, which is used if the leg walked as commanded."""
        if statistics.is_steady and self.config.cadence.allows(statistics.cadence_rpm):
            self.state.due = (*self.state.due, (statistics.begin_ns, statistics.stamp_ns))

    def end_period(self, counted_m: Floats, depth: Floats) -> Correction | None:
        """Evaluate the gait cycles that ended, and simulate one more for the reference.

        Parameters
        ----------
        counted_m : (k,) array
            Counted mean clearances.
        depth : (k, 2, N) array
            Counted wear [m].

        Returns
        -------
        Correction or None
            A counted clearance that is surely wrong, and shall be corrected before the next period.
        """
        state = self.state
        self._follow_counted(counted_m)
        for begin_ns, end_ns in state.due:
            self._evaluate(begin_ns, end_ns)
        state.samples = after(state.samples, state.due[-1][1] if state.due else 0)
        ended, state.due = bool(state.due), ()
        self._refer(counted_m, depth)
        return self._correction() if ended else None

    def corrected(self, correction: Correction, counted_m: Floats) -> None:
        """Compare with the corrected clearances (k,) [m] from now on.

        The gait cycles since the change become those of the commissioned leg: what the correction is off does
        not look like a further change.
        """
        state, change = self.state, correction.change
        cycles = [cycle for cycle in state.cycles if cycle.begin_ns >= change.since_ns]
        counted_m = np.asarray(counted_m, float).copy()
        signatures = np.array([cycle.signature for cycle in cycles])
        state.commissioned = CommissionedTorque(cycles[-1].end_ns, counted_m, signatures)
        state.settled = (*state.settled, attrs.evolve(change, is_corrected=True))
        self._restart(counted_m)
        self._forget_legs()

    def replaced(self, counted_m: Floats) -> None:
        """Start again after the replacement of a part: the leg has to be commissioned again."""
        self.state.settled, self.state.commissioned = (), None
        self._restart(counted_m)
        self._forget_legs()

    def begin_epoch(self) -> None:
        """Forget kept samples and gait cycles, because stamps start again."""
        self.state.samples, self.state.due = NO_TORQUE_SAMPLES, ()
        self._restart(self.state.counted_m)

    @property
    def diagnosis(self) -> Diagnosis:
        """What the drive torque shows now."""
        state = self.state
        if state.fit is None or state.detector is None:
            return Diagnosis(state=DiagnosisState.WAITING, reason=self._missing(), changes=state.settled)
        clearance_m, sigma_m = self._observed(state.fit)
        return Diagnosis(
            state=DiagnosisState.CHANGED if state.changes else DiagnosisState.AS_COUNTED,
            reason=self._doubt(),
            cycles=state.fit_cycles,
            clearance_m=tuple(clearance_m.tolist()),
            sigma_m=tuple(sigma_m.tolist()),
            changes=state.settled + state.changes,
        )

    def _observed(self, fit: ClearanceFit) -> tuple[Floats, Floats]:
        """Observable clearances and their standard deviations, NaN for the others.

        A joint that the fit of all joints does not show is known from its own change.
        """
        observable = fit.sigma_m <= np.maximum(_ESTIMATED_M, _ESTIMATED * fit.clearance_m)
        clearance_m, sigma_m = (
            np.where(observable, each, math.nan) for each in (fit.clearance_m, fit.sigma_m)
        )
        for change in self.state.changes:
            if change.cause is Cause.CLEARANCE:
                k = self._mechanism.clearance_joints.index(change.subject)
                if not observable[k]:
                    clearance_m[k], sigma_m[k] = change.value, change.sigma
        return clearance_m, sigma_m

    def snapshot(self) -> TorqueObserverSnapshot:
        """A copy of the whole state."""
        return TorqueObserverSnapshot(attrs.evolve(self.state), self._run.snapshot() if self._run else None)

    def restore(self, snapshot: TorqueObserverSnapshot) -> None:
        """Restore a snapshot of the same mechanism and parameters; results are then bit for bit the same."""
        self.state = attrs.evolve(snapshot.state)
        self._run = None
        if snapshot.reference is not None:
            self._run = TorqueReferenceRun(self._mechanism)
            self._run.restore(snapshot.reference)
        self._forget_legs()

    def _doubt(self) -> str:
        """Why an estimate is not sure."""
        if self.state.unlike >= _UNLIKE_CYCLES:
            return "the crank turns otherwise than it did before; a new reference is being simulated"
        if self._is_of_file:
            return ""
        known = "the leg is not that of its mechanism file, and the names of joints are not sure: "
        if self._run is not None and self._run.is_busy:
            what = "its masses and lengths are" if self.state.is_identifying else "a reference for it is"
            return f"{known}{what} being simulated, {math.floor(100.0 * self._run.progress)} %"
        return f"{known}masses and lengths near those of the file do not explain its drive torque"

    def _missing(self) -> str:
        """Why there is no estimate."""
        state = self.state
        if state.sensor is None or state.unusable >= _UNUSABLE_CYCLES:
            return "no drive torque with enough samples in a gait cycle"
        if not state.sensor.phases:
            return "the drive torque has too few samples in a gait cycle"
        if state.reference is None and self._run is not None and self._run.is_busy:
            done = math.floor(100.0 * self._run.progress)
            return f"the reference for this leg is being simulated: {done} %"
        if state.has_failed:
            return "the leg could not be simulated for a reference"
        return f"gait cycles: {len(state.cycles)} of {_FIRST_CYCLES}"

    def _evaluate(self, begin_ns: int, end_ns: int) -> None:
        """Add a gait cycle to the evidence."""
        state = self.state
        cycle = self._signed(begin_ns, end_ns)
        if cycle is None:
            state.unusable += 1
            return
        state.unusable = 0
        if state.reference is not None:
            if cycle.profile.departure(state.reference.profile) > _UNLIKE:
                state.unlike += 1
                return
            state.unlike = 0
        state.cycles = (*state.cycles, cycle)[-WINDOW_CYCLES:]
        if state.reference is not None:
            self._take(cycle)
            self._explain()
            self._commission()

    def _signed(self, begin_ns: int, end_ns: int) -> SignedCycle | None:
        """A gait cycle with its signature; None where samples are too few."""
        state = self.state
        if state.sensor is None:
            period_s = sensor_period_s(state.samples, begin_ns, end_ns)
            if math.isnan(period_s):
                return None
            # as commanded: a reference, and all of its signatures, are for one cadence
            cycle_s = 60.0 / abs(self.config.cadence.commanded_rpm)
            instant = self.config.drive_torque.sampling == INSTANT
            state.sensor = TorqueSensor(float(f"{period_s:.2g}"), cycle_s, self._size_nm, instant)
            if state.commissioned and state.commissioned.signatures.shape[1] != 2 * state.sensor.phases:
                state.commissioned = None  # of a sensor with another rate: the leg is commissioned anew
        if not state.sensor.phases:
            return None
        torque = cycle_torque(state.samples, begin_ns, end_ns, state.sensor)
        if torque is None:
            return None
        signature = signatures(
            np.zeros(len(torque.angle), np.int64), torque.angle, torque.torque, torque.step, state.sensor
        )[0]
        if not np.isfinite(signature).all():
            return None
        return SignedCycle(begin_ns, end_ns, signature, torque.profile)

    def _take(self, cycle: SignedCycle) -> None:
        """Continue the test for changes."""
        state, detector = self.state, self._tests
        before = state.detector or detector.fresh()
        state.detector = detector.with_cycle(before, cycle.signature, cycle.begin_ns)

    def _explain(self) -> None:
        """Renew the clearances, and the change if there is one."""
        state, explainer = self.state, self._legs
        found = self._tests.detection(state.detector) if state.detector else None
        since_ns = state.changes[-1].since_ns if state.changes else found.since_ns if found else 0
        cycles = [cycle for cycle in state.cycles if cycle.begin_ns >= since_ns]
        if len(cycles) < _LEAST_CYCLES or not (since_ns or state.fit is None or state.fit_due <= 0):
            state.fit_due -= 1
            return
        state.fit_due = _FIT_EVERY - 1
        mean, counted_m = np.mean([cycle.signature for cycle in cycles], axis=0), state.counted_m
        change = None
        if since_ns and not _is_due(len(cycles)):
            return
        if since_ns:
            change = change_of(explainer.explanations(mean, len(cycles), counted_m), since_ns)
            if change is not None:
                state.changes = (self._dated(change),)
            elif len(cycles) >= SETTLING_CYCLES:  # what was detected does not last
                state.changes, state.detector = (), self._tests.fresh()
        starts = [counted_m, start_of(change, explainer.joints, counted_m)]
        starts += [state.fit.clearance_m] if state.fit else []
        state.fit = best_fit(explainer, mean, len(cycles), counted_m, starts)
        state.fit_cycles = len(cycles)

    def _dated(self, change: Change) -> Change:
        """The change with its most probable begin; what is no clearance keeps that of its detection."""
        if change.cause is not Cause.CLEARANCE:
            return change
        state, explainer = self.state, self._legs
        signatures = self._signatures()
        changed_m = start_of(change, explainer.joints, state.counted_m)
        first = first_changed(explainer, signatures, state.counted_m, changed_m)
        return attrs.evolve(change, since_ns=state.cycles[first].begin_ns)

    def _commission(self) -> None:
        """Keep the mean signature of a leg that is as counted."""
        state = self.state
        if state.commissioned is not None or state.changes or len(state.cycles) < COMMISSIONING_CYCLES:
            return
        state.commissioned = CommissionedTorque(state.cycles[-1].end_ns, state.counted_m, self._signatures())
        self._review()

    def _correction(self) -> Correction | None:
        """A settled change of one clearance."""
        state = self.state
        if not self.config.diagnosis.correct or not state.changes or state.fit_cycles < SETTLING_CYCLES:
            return None
        if not self._is_of_file:
            return None
        change, joints = state.changes[-1], self._mechanism.clearance_joints
        is_wide = change.value >= CORRECTED_FROM * change.counted
        if change.subject not in joints or not change.is_sure or not is_wide:
            return None
        return Correction(joints.index(change.subject), change.value, change)

    def _refer(self, counted_m: Floats, depth: Floats) -> None:
        """Choose a reference, continue its simulation, or begin a new one if required."""
        state = self.state
        if self._run is not None and self._run.is_busy:
            state.pause = not state.pause
            found = None if state.pause else self._run.advance()
            if found is not None and state.is_identifying:
                self._identify(found, counted_m, depth)
            elif found is not None:
                self._install(found)
            elif not self._run.is_busy:
                self._give_up()
            return
        if len(state.cycles) < _FIRST_CYCLES or state.has_failed:
            return
        if state.reference is None:
            profile = mean_profile([cycle.profile for cycle in state.cycles])
            shipped = self._shipped
            if shipped is not None and profile.departure(shipped.profile) <= _UNLIKE:
                self._install(shipped)
            else:
                self._begin(counted_m, depth, profile)
        elif state.unlike >= _UNLIKE_CYCLES:
            state.cycles, state.reference, state.fit, state.unlike = (), None, None, 0
            self._forget_legs()
        elif (np.abs(state.reference.clearance_m[0] / counted_m - 1.0) > _FAR).any():
            self._begin(counted_m, depth, mean_profile([cycle.profile for cycle in state.cycles]))
        elif state.commissioned is not None and state.bodies is None and not self._is_of_file:
            run, state.is_identifying = self._begun(), True
            run.begin_bodies(
                state.commissioned.clearance_m, depth, state.reference.profile, state.reference.bodies
            )

    def _begun(self) -> TorqueReferenceRun:
        """The run, made when it is needed first."""
        if self._run is None:
            self._run = TorqueReferenceRun(self._mechanism)
        return self._run

    def _begin(self, counted_m: Floats, depth: Floats, profile: CrankProfile) -> None:
        """Begin the simulation of a reference."""
        self._begun().begin(counted_m, depth, profile, self.state.bodies)

    def _identify(self, legs: TorqueReference, counted_m: Floats, depth: Floats) -> None:
        """Begin a reference with the bodies that explain the commissioned leg."""
        state, explainer = self.state, self._legs
        state.is_identifying = False
        if state.commissioned is not None:
            state.bodies = identified_bodies(legs, explainer.model, explainer.nuisances, state.commissioned)
            self._begin(counted_m, depth, legs.profile)

    def _give_up(self) -> None:
        """Go on without what could not be simulated."""
        state = self.state
        if state.reference is None:
            state.has_failed = True
        else:
            state.is_identifying, state.bodies = False, state.reference.bodies

    def _install(self, reference: TorqueReference) -> None:
        """Evaluate the kept cycles with a new reference.

        One with identified bodies must explain the leg better than the one with those of the file.
        """
        state, before, off = self.state, self.state.reference, self._file_misfit
        state.reference = reference
        self._forget_legs()
        is_first = before is not None and state.bodies not in (None, before.bodies)
        if before is not None and is_first and self._file_misfit > off:
            state.reference, state.bodies = before, before.bodies
        self._review()

    def _review(self) -> None:
        """Evaluate the kept cycles again."""
        state = self.state
        self._forget_legs()
        if state.reference is not None and state.sensor is not None:
            measured = state.commissioned.mean if state.commissioned else self._signatures().mean(axis=0)
            state.sensor = with_noise_of(state.reference, state.sensor, measured)
        state.detector, state.changes = None, ()
        for cycle in state.cycles:
            self._take(cycle)
        self._explain()

    def _forget_legs(self) -> None:
        """Make legs, tests and the misfit anew, because what they depend on has changed."""
        self._explainer, self._detector, self._misfit = None, None, None

    @property
    def _file_misfit(self) -> float:
        """Of the commissioned leg, from that of the reference; 0 where that is not known.

        The baseline after a correction holds fewer cycles, and clearances that are not sure.
        """
        commissioned = self.state.commissioned
        if self.state.reference is None or commissioned is None:
            return 0.0
        if commissioned.cycles < COMMISSIONING_CYCLES:
            return 0.0
        if self._misfit is None:
            legs = self._legs
            self._misfit = misfit(legs.model, legs.nuisances, commissioned)
        return self._misfit

    @property
    def _is_of_file(self) -> bool:
        """Whether the commissioned leg is that of the reference."""
        return self._file_misfit < UNLIKE_FILE

    def _restart(self, counted_m: Floats) -> None:
        """Forget the kept cycles, because the leg, or what is counted of it, has changed."""
        state = self.state
        state.counted_m = np.asarray(counted_m, float).copy()
        state.cycles, state.detector, state.changes, self._detector = (), None, (), None
        state.has_failed = False

    def _follow_counted(self, counted_m: Floats) -> None:
        """Compare with the counted clearances as they grow."""
        state = self.state
        if (np.abs(counted_m / state.counted_m - 1.0) > 0.005).any():
            state.counted_m, self._detector = np.asarray(counted_m, float).copy(), None

    def _signatures(self) -> Floats:
        """Signatures (n, F) of the kept cycles."""
        return np.array([cycle.signature for cycle in self.state.cycles])

    @property
    def _legs(self) -> Explainer:
        """Legs that may be the measured one; made anew where reference, sensor or baseline have changed."""
        state = self.state
        if self._explainer is None:
            if state.reference is None or state.sensor is None:
                raise RuntimeError("there is no reference yet")
            self._explainer = explainer_of(self._mechanism, state.reference, state.sensor, state.commissioned)
        return self._explainer

    @property
    def _false_alarm_cycles(self) -> float:
        """Gait cycles between two false findings."""
        return 60.0 * abs(self.config.cadence.commanded_rpm) * self.config.diagnosis.false_alarm_hours

    @property
    def _tests(self) -> ChangeDetector:
        """Tests against the counted leg."""
        if self._detector is None:
            self._detector = ChangeDetector(self._legs, self.state.counted_m, self._false_alarm_cycles)
        return self._detector


def _is_due(cycles: int) -> bool:
    """Whether a change is explained again after so many gait cycles: often at first."""
    return cycles <= SETTLING_CYCLES or cycles % _FIT_EVERY == 0
