"""The drive torque in the monitor: from its samples to clearances, and to changes of the leg.

All evaluation takes place at the ends of evaluation periods, which depend on the order of arrival only. Each
period evaluates the gait cycles that ended, and goes on with the simulation of a reference, if one is needed.
"""

import logging
import math
from collections.abc import Sequence

import attrs
import numpy as np

from leg_wear_monitor.errors import LegWearError
from leg_wear_monitor.estimate.cause import CORRECTED_FROM, Cause, Change
from leg_wear_monitor.estimate.clearance_fit import ClearanceFit
from leg_wear_monitor.estimate.drive import DIRECT
from leg_wear_monitor.estimate.ground_load import stance_phases
from leg_wear_monitor.estimate.least_squares import DATA_ERRORS
from leg_wear_monitor.estimate.signature import CommissionedTorque
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.person import upwards
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor.config.settings import MonitorConfig, drive_figures
from leg_wear_monitor.monitor.diagnosis.evidence import Evidence, correction_of, find_sensor, signed_cycle
from leg_wear_monitor.monitor.diagnosis.reasons import doubt, missing, next_step, other_sensor
from leg_wear_monitor.monitor.diagnosis.references import (
    COMMISSIONING_CYCLES,
    LOAD_ROUNDS,
    PART_CYCLES,
    UNLIKE_CYCLES,
    LegModels,
    References,
)
from leg_wear_monitor.monitor.diagnosis.state import (
    FIRST_CYCLES,
    UNUSED_CYCLES,
    WINDOW_CYCLES,
    Diagnosis,
    DiagnosisState,
    NotUsed,
    SignedCycle,
    TorqueSamples,
    TorqueState,
)
from leg_wear_monitor.state import FootLoad
from leg_wear_monitor.twin.reference import LegParameters
from leg_wear_monitor.twin.references import TorqueReference
from leg_wear_monitor.twin.sample import GROUND, MEASURED, KeepsSamples
from leg_wear_monitor.twin.statistics import CycleStatistics

_LOG = logging.getLogger(__name__)

# relative change from which a load has changed: the twin's mean over twenty gait cycles is within 1 % of the
# foot's load, and up to 23 % above it where its shape was found under 100 N (2026-11-25)
_MOVED, _LEAST_LOAD_N = 0.3, 100.0
_ESTIMATED_M, _ESTIMATED = (
    1.0e-4,
    0.2,
)  # largest sigma of an observable clearance: absolute, fraction


def _joined(*reasons: str) -> str:
    return "; ".join(filter(None, reasons))


class TorqueObserver(KeepsSamples):
    """Estimates clearances from the drive torque, and detects changes.

    Parameters
    ----------
    mechanism : Mechanism
        With the parameters of the configuration applied.
    config : MonitorConfig
    size_nm : float
        RMS of the leg's drive torque at the commanded speed.
    modelled_m : (k,) array
        Modelled clearances.
    commissioned : sequence of CommissionedTorque, optional
        Baselines of the ledger, the last one first.
    parameters : LegParameters or None
        Identified parameters of the ledger.
    references : sequence of TorqueReference, optional
        References of files first, then of the ledger; one of them may be unfinished.

    Raises
    ------
    ConfigError, AssemblyError
    """

    def __init__(
        self,
        mechanism: Mechanism,
        config: MonitorConfig,
        size_nm: float,
        modelled_m: Floats,
        commissioned: Sequence[CommissionedTorque] = (),
        parameters: LegParameters | None = None,
        references: Sequence[TorqueReference] = (),
    ) -> None:
        self.config, self._size_nm, self._joints = config, size_nm, mechanism.clearance_joints
        figures = drive_figures(config.drive)
        self.models = LegModels(mechanism, figures)
        part = next((one for one in references if not one.is_whole), None)
        whole = [one for one in references if one.is_whole]
        # references of a measured load are also simulated under the mean load that the torque shows
        self._is_on_ground = config.load.model in (GROUND, MEASURED) and mechanism.toe is not None
        self._up = upwards(mechanism)
        self._references = References(mechanism, self.models, whole, part, self._is_on_ground)
        self._evidence = Evidence(self.models)
        modelled_m = np.asarray(modelled_m, float).copy()
        if parameters is None:  # those that files and unfinished references were made with
            own = LegParameters.none(mechanism)
            made = (one.parameters for one in references if not one.is_of_parameters)
            known = (one for one in made if self._is_on_ground or not one.load.size)
            parameters = next((one for one in known if one != own), None)
        if parameters is not None and not self._is_on_ground:  # load.model has changed
            parameters = parameters.in_air
        if parameters is not None or figures.compliance:
            whole_leg = parameters or LegParameters.none(mechanism)
            parameters = attrs.evolve(whole_leg, compliance=figures.compliance)
        self.state = TorqueState(
            modelled_m,
            baselines=tuple(commissioned),
            parameters=parameters,
            load_rounds=LOAD_ROUNDS if parameters is not None and parameters.load.size else 0,
        )

    def go_live(self) -> None:
        """Never wait for simulations."""
        self._references.may_be_late = True

    def warm_up(self) -> None:
        """Compute the values that depend only on the mechanism, before the first sample."""
        self.models.warm_up()

    def ended(
        self, statistics: CycleStatistics, is_torque_wrong: bool = False, load_n: float = math.nan
    ) -> None:
        """Note the end of a gait cycle, which is used if the leg walked as commanded with a right torque.

        Parameters
        ----------
        statistics : CycleStatistics
        is_torque_wrong : bool, optional
        load_n : float, optional
            Largest vertical force on the toe that the twin walked under; NaN if it is not known.
        """
        rpm = statistics.cadence_rpm
        is_allowed = self.config.cadence.allows(rpm)
        self.state.off_cadence_rpm = rpm if statistics.is_steady and not is_allowed else math.nan
        if is_torque_wrong:
            self.state.leave_out(NotUsed.TORQUE_CAUSE)
        elif not statistics.is_steady:
            self.state.leave_out(NotUsed.GAP if statistics.bridged_s else NotUsed.STANDSTILL)
        elif not is_allowed:
            self.state.leave_out(NotUsed.CADENCE)
        else:
            self.state.due = (*self.state.due, (statistics.begin_ns, statistics.stamp_ns))
            self.state.carried_n = (*self.state.carried_n, load_n)[-UNLIKE_CYCLES:]

    def withdraw(self, since_ns: int) -> None:
        """Forget the gait cycles from a stamp on: the torque that was received was wrong."""
        state = self.state
        before = (*state.due, *state.cycles, *state.waiting, *state.odd)
        state.due = tuple(span for span in state.due if span[0] < since_ns)
        state.forget_cycles(since_ns)
        number = len(before) - len((*state.due, *state.cycles, *state.waiting, *state.odd))
        if not number:
            return
        state.leave_out(NotUsed.TORQUE_CAUSE, number)
        state.forget_baselines(since_ns)
        if state.reference is not None:
            self._evidence.review(state, self.config)

    def end_period(self, modelled_m: Floats, depth: Floats) -> Change | None:
        """Evaluate the gait cycles that ended, and continue the simulation of the reference.

        Parameters
        ----------
        modelled_m : (k,) array
            Modelled mean clearances.
        depth : (k, 2, N) array
            Modelled wear [m].

        Returns
        -------
        Change or None
            Change of a modelled clearance that is surely wrong, and must be corrected before the next period.
        """
        before = attrs.evolve(self.state)
        try:
            return self._end_period(modelled_m, depth)
        except DATA_ERRORS as error:
            failure = str(error) or type(error).__name__
            if failure != before.failure:
                trace = None if isinstance(error, LegWearError) else error
                _LOG.warning("the diagnosis starts again: %s", failure, exc_info=trace)
            self._start_again(before, modelled_m, failure)
            return None

    def _start_again(self, before: TorqueState, modelled_m: Floats, failure: str) -> None:
        """Start again, because the torques so far lead to no estimate."""
        settled, not_used = before.corrections, before.not_used
        self.go_on_from(
            TorqueState(
                np.asarray(modelled_m, float).copy(), settled=settled, not_used=not_used, failure=failure
            )
        )

    def _end_period(self, modelled_m: Floats, depth: Floats) -> Change | None:
        state = self.state
        self._follow_counted(modelled_m)
        self._follow_load()
        ended = self.evaluate_due(self._evaluate)
        if self._references.advance(state, modelled_m, depth):
            self._evidence.review(state, self.config)
        if not ended or not self.config.diagnosis.apply_corrections or self._references.is_to_identify(state):
            return None
        if not self.models.is_sure(state):
            return None
        return correction_of(state, self._joints)

    def corrected(self, change: Change, modelled_m: Floats) -> None:
        """Compare with the corrected clearances (k,) [m] from now on."""
        modelled_m = np.asarray(modelled_m, float).copy()
        state = self.state
        state.settled = state.corrections
        self._evidence.settle(state, change, modelled_m)
        self._restart(modelled_m)

    def replaced(self, modelled_m: Floats) -> None:
        """Start again after the replacement of a part: the leg has to be commissioned again."""
        self.state.settled = ()
        self.state.fit, self.state.fit_cycles, self.state.fit_due = None, 0, 0  # it is of the former part
        self.state.forget_baselines()
        self._restart(modelled_m)

    @property
    def parameters(self) -> LegParameters | None:
        """Identified masses, lengths and friction that explain the drive torque; None without any."""
        own, reference = self.state.parameters, self.state.reference
        if own is None or reference is None or reference.parameters != own or self.state.is_load_other:
            return None
        is_near = self.models.fits if own.load.size else self.models.is_of_file
        return own if is_near(self.state) else None

    @property
    def simulated_references(self) -> tuple[TorqueReference, ...]:
        """The references that were simulated in this run, of all cadences."""
        return self._references.simulated

    @property
    def part_of_reference(self) -> TorqueReference | None:
        """The legs of a reference, or of an identification, that are simulated so far; None without any."""
        return self._references.part

    def leave(self) -> None:
        """Stop simulating ahead: the process is about to end."""
        self._references.leave()

    def begin_epoch(self) -> None:
        """Forget kept samples and gait cycles, because stamps start again."""
        self.state.samples, self.state.due = TorqueSamples(), ()
        self._restart(self.state.modelled_m)

    @property
    def _load(self) -> FootLoad | None:
        """Force of the ground by the commissioned gait cycles, or else the reference's; None without any.

        Only the reference knows the force in later runs.
        """
        found, reference = self.state.load, self.state.reference
        if found is not None and found.is_sure:
            peak_n, sigma_n, phases = found.peak_n, found.peak_sigma_n, (found.heel_strike, found.toe_off)
        elif found is None and self._is_on_ground and reference and reference.parameters.load.size:
            up = reference.parameters.load @ self._up
            peak_n, phases = float(up.max()), stance_phases(up, reference.profile.speed)
            sigma_n = reference.parameters.load_sigma * peak_n
        else:
            return None
        heel_strike, toe_off = (None if math.isnan(phase) else phase % 1.0 for phase in phases)
        return FootLoad(
            source="estimated",
            peak_n=peak_n,
            peak_sigma_n=sigma_n,
            heel_strike_phase=heel_strike,
            toe_off_phase=toe_off,
        )

    @property
    def diagnosis(self) -> Diagnosis:
        """Current results from the drive torque."""
        state, known = self.state, self.state.commissioned
        is_old = not state.cycles or len(state.unused) == UNUSED_CYCLES or state.detector is None
        found = Diagnosis(
            next_step=next_step(state, self._references, self.config),
            changes=state.settled,
            cycles_not_used=state.not_used,
            channel=state.sensor.channel if state.sensor else DIRECT,
            load=self._load,
            is_load_unknown=self._is_on_ground and self.config.load.model == GROUND and self._load is None,
            temperature_c=state.temperature_c,
            commissioned_c=known.temperature_c if known else None,
        )
        if state.fit is None or (is_old and not state.not_corrected):
            reason = _joined(missing(state, self._references, self.config), other_sensor(state))
            return attrs.evolve(found, state=DiagnosisState.WAITING, reason=reason)
        clearance_m, sigma_m = self._observed(state.fit)
        return attrs.evolve(
            found,
            state=DiagnosisState.CHANGED if state.not_corrected else DiagnosisState.AS_MODELLED,
            reason=_joined(doubt(state, self._references, self.models), other_sensor(state)),
            cycles=state.fit_cycles,
            clearance_m=tuple(clearance_m.tolist()),
            sigma_m=tuple(sigma_m.tolist()),
            least_m=state.surely_m(self.config.alarms.on_delay_cycles),
            baseline_m=tuple(known.clearance_m.tolist()) if known else (),
            changes=state.all_changes,
        )

    def _observed(self, fit: ClearanceFit) -> tuple[Floats, Floats]:
        """Observable clearances and their standard deviations, NaN for the others.

        A joint is not observable either if no test would detect it at the width of a correction. A joint that
        the fit of all joints does not show is known from its own change. If the reference does not match the
        leg, a change can have the name of a wrong joint, and no clearance is known.
        """
        if not self.models.fits(self.state):
            nothing = np.full(len(fit.clearance_m), math.nan)
            return nothing, nothing
        observable = fit.sigma_m <= np.maximum(_ESTIMATED_M, _ESTIMATED * fit.clearance_m)
        known = self.state.commissioned
        if known is not None and known.is_as_modelled:  # a corrected one is known from its correction
            unseen_m = self.models.detector(self.state, self.config).unseen_m(WINDOW_CYCLES)
            observable &= unseen_m <= CORRECTED_FROM * self.state.modelled_m
        clearance_m, sigma_m = (
            np.where(observable, each, math.nan) for each in (fit.clearance_m, fit.sigma_m)
        )
        for change in self.state.not_corrected:
            if change.cause is Cause.SEVERAL and not change.is_named:  # the joints are not known
                clearance_m[:] = sigma_m[:] = math.nan
                continue
            opened = (change,) if change.cause is Cause.CLEARANCE else change.joints
            for one in opened:
                k = self._joints.index(one.subject)
                if not observable[k] or change.joints:
                    clearance_m[k], sigma_m[k] = one.value, one.sigma
        return clearance_m, sigma_m

    def go_on_from(self, state: TorqueState) -> None:
        """Go on from a state of the same leg, without the simulation that goes on."""
        self._references.stop()
        self.state = attrs.evolve(state)

    def _evaluate(self, begin_ns: int, end_ns: int) -> None:
        """Add a gait cycle to the evidence."""
        state = self.state
        find_sensor(state, begin_ns, end_ns, self.config, self._size_nm)
        cycle = signed_cycle(state, begin_ns, end_ns)
        if isinstance(cycle, NotUsed):
            state.leave_out(cycle)
            return
        if state.reference is None:
            state.unused = ()
            state.wait_with(cycle)
            return
        if not cycle.profile.is_like(state.reference.profile):
            state.wait_with(cycle)
            state.leave_out(NotUsed.UNLIKE)
            return
        state.unused = ()
        state.cycles = (*state.cycles, cycle)[-WINDOW_CYCLES:]
        if state.sensor and state.sensor.noise_nm:
            self._evidence.add(state, cycle, self.config)
        elif len(state.cycles) >= FIRST_CYCLES:  # the noise of the sensor is not known yet
            self._evidence.review(state, self.config)
        self._commission()

    def _commission(self) -> None:
        """Store the signatures of a leg that is as modelled, and stays so while they are taken.

        A change within them ends the baseline, and is reported. A change in the first cycles, or without an
        explanation, moves its start.
        """
        state = self.state
        if state.commissioned is not None:
            return
        since_ns = state.changes[-1].since_ns if state.changes else 0
        if not since_ns and not len(state.cycles) % PART_CYCLES:
            since_ns = self.models.changed_within(state, state.cycles, self.config)
        if not since_ns:
            if len(state.cycles) >= COMMISSIONING_CYCLES:
                self._take_baseline(state.cycles)
            return
        before = tuple(cycle for cycle in state.cycles if cycle.begin_ns < since_ns)
        if len(before) >= PART_CYCLES:
            self._take_baseline(before)
        if not state.changes:  # the later cycles match neither the earlier leg nor this baseline
            state.commissioned, state.cycles = None, state.cycles[len(before) :]
            self._evidence.review(state, self.config)

    def _take_baseline(self, cycles: Sequence[SignedCycle]) -> None:
        """Use these gait cycles as the reference from now on."""
        state = self.state
        known = state.baseline(cycles, state.modelled_m)
        # a clearance that a correction left unknown is unknown at other cadences as well
        corrected = state.corrected
        if corrected is not None:
            sigma_m = np.where(corrected.is_unknown, state.modelled_m, corrected.sigma_m)
            known = attrs.evolve(known, sigma_m=sigma_m, channel=corrected.channel)
        state.commissioned, state.failure = known, ""
        self._evidence.review(state, self.config)

    def _restart(self, modelled_m: Floats) -> None:
        """Forget the stored cycles, because the leg or its wear model has changed."""
        state = self.state
        state.modelled_m = np.asarray(modelled_m, float).copy()
        state.forget_cycles()
        state.detector, state.has_failed = None, False
        state.changes, state.carried_n, state.least_m = (), (), ()

    def _follow_load(self) -> None:
        """Commission the leg anew if its load differs from the load of its reference.

        Once for each load: the load from the twin or a sensor may differ from the force of the reference. A
        joint that was surely named before the load changed stays reported. A joint named since then does not:
        a changed load looks like an open joint until the twin has found it.
        """
        state = self.state
        is_due = self._is_on_ground and len(state.carried_n) >= FIRST_CYCLES
        if state.reference is None or not (is_due and state.is_loaded):
            state.is_load_other = False
            return
        peak_n = float((state.reference.parameters.load @ self._up).max())
        was_other, state.is_load_other = state.is_load_other, self._has_moved(peak_n, FIRST_CYCLES)
        if state.is_load_other and not was_other:
            earlier_ns = max((one.begin_ns for one in state.cycles[:-UNLIKE_CYCLES]), default=0)
            state.changes = tuple(one for one in state.changes if one.since_ns <= earlier_ns)
            state.detector, state.least_m = None, ()
        is_long = len(state.carried_n) == UNLIKE_CYCLES and state.load_rounds >= LOAD_ROUNDS
        if is_long and self._has_moved(peak_n, UNLIKE_CYCLES):
            state.settled += state.not_by_load
            state.load, state.load_rounds, state.renewed_n = None, 0, float(np.mean(state.carried_n))
            state.forget_baselines()
            self._restart(state.modelled_m)

    def _has_moved(self, peak_n: float, cycles: int) -> bool:
        """True if the foot's load in the last gait cycles differed from the reference's load."""
        state, now_n = self.state, float(np.mean(self.state.carried_n[-cycles:]))
        is_found = state.load_rounds >= LOAD_ROUNDS
        is_renewed = is_found and abs(now_n - state.renewed_n) <= _MOVED * max(now_n, _LEAST_LOAD_N)
        return abs(now_n - peak_n) > _MOVED * max(peak_n, _LEAST_LOAD_N) and not is_renewed

    def _follow_counted(self, modelled_m: Floats) -> None:
        """Compare with the modelled clearances as they grow."""
        state = self.state
        if (np.abs(modelled_m / state.modelled_m - 1.0) > 0.005).any():
            state.modelled_m = np.asarray(modelled_m, float).copy()
