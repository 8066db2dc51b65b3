"""The drive torque in the monitor: compared with the prediction, explained, and applied to the twin."""

import logging
import math
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import attrs

from leg_wear_monitor.estimate.cause import Cause, Change, NamedCause, TorqueExplanation
from leg_wear_monitor.estimate.drive import DIRECT
from leg_wear_monitor.estimate.gross_causes import Allowed, explanation
from leg_wear_monitor.estimate.least_squares import DATA_ERRORS
from leg_wear_monitor.files import or_nan
from leg_wear_monitor.monitor.alarm_specs import MISMATCH, QUANTITIES, TORQUE
from leg_wear_monitor.monitor.alarms import CAUSES_OF_ALARMS, DIAGNOSIS, WARN_FRACTION, worst_code
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.diagnosis.observer import TorqueObserver
from leg_wear_monitor.monitor.diagnosis.reference_file import read_references
from leg_wear_monitor.monitor.diagnosis.state import Body, Diagnosis, DiagnosisState, NotUsed, TorqueState
from leg_wear_monitor.monitor.evaluation import AlarmBoard
from leg_wear_monitor.monitor.gait_evidence import (
    MismatchWindow,
    offset_error_rad,
    torque_causes,
    torque_values,
)
from leg_wear_monitor.monitor.ledger.entry import SimulatedReference
from leg_wear_monitor.monitor.observer import Observer
from leg_wear_monitor.monitor.reports import CycleReport, Status
from leg_wear_monitor.monitor.verdict.rules import explanation as explanation_words
from leg_wear_monitor.monitor.verdict.rules import sentence
from leg_wear_monitor.monitor.verdict.situation import KnownClearance
from leg_wear_monitor.monitor.verdict.verdict import estimate, with_unit, words_of_cause
from leg_wear_monitor.monitor.wear_model import WearModel
from leg_wear_monitor.state import Drive, Estimate, Level, TorqueDiagnosis
from leg_wear_monitor.twin.reference import LegParameters
from leg_wear_monitor.twin.references import TorqueReference
from leg_wear_monitor.twin.sample import LOADS_N, Samples
from leg_wear_monitor.twin.statistics import CycleStatistics, NotCompared

_LOG = logging.getLogger(__name__)

WRONG_TORQUE = "the received drive torque is wrong; see the status `torque`"
ACCELERATED = "wear is accelerated, so clearances grow too fast to be estimated"
_CONTRADICTS = 3.0  # standard deviations between the torque estimate and a measurement by an operator
_FACTORS = (Cause.SCALE, Cause.SIGN)
_TORQUE = tuple(spec.name() for spec in TORQUE)
_SAME_NAMES = (
    "load_n", "load_sigma_n", "load_acting_n", "friction_nm", "friction_sigma_nm", "torque_lag_s",
    "torque_lag_sigma_s", "load_friction", "load_friction_sigma",
)  # fmt: skip
"""Values of a gait cycle that the status `torque` shows under their own names."""
_CODES = {name.upper(): cause.fault_code for name, cause in CAUSES_OF_ALARMS.items()}


class TorqueWatch(Observer):
    """Compares the drive torque with the prediction, and corrects surely wrong modelled clearances.

    Parameters
    ----------
    leg : WearModel
    board : AlarmBoard

    Attributes
    ----------
    observer : TorqueObserver or None
        Estimates clearances; None if the diagnosis is disabled.
    mismatch : MismatchWindow
    unexplained : str
        Why a torque residual has no explanation; empty if it has one, or if the residual is small.
    """

    def __init__(self, leg: WearModel, board: AlarmBoard) -> None:
        self._leg, self._board = leg, board
        self._not_compared = Counter[str]()  # gait cycles of this run, by the values of `NotCompared`
        self.mismatch = MismatchWindow()
        self.unexplained = ""
        self._made: tuple[TorqueReference, ...] = ()  # simulated references that are in the ledger
        is_diagnosed = leg.config.diagnosis.enabled and leg.config.wear_acceleration == 1.0
        self.observer = self._new_observer() if is_diagnosed else None
        if self.observer and self.observer.state.parameters and leg.config.diagnosis.apply_corrections:
            leg.twin.set_parameters(self.observer.state.parameters)

    def _new_observer(self) -> TorqueObserver:
        """The estimator, with the data of files and ledger on this leg."""
        leg, ledger, path = self._leg, self._leg.ledger, self._leg.config.diagnosis.reference
        # after a change of the order of the bodies in the mechanism file, both are estimated again
        order = tuple(leg.mechanism.bodies)
        known = ledger.parameters if ledger else None
        kept = [one.reference for one in (ledger.references if ledger else ()) if one.bodies == order]
        return TorqueObserver(
            leg.mechanism,
            leg.config,
            leg.twin.torque_size_nm,
            leg.twin.clearance_mean_m,
            ledger.commissioned_torques if ledger else (),
            known.parameters if known and known.bodies == order else None,
            (*(read_references(Path(path), leg.mechanism) if path else ()), *kept),
        )

    def configure(self, config: MonitorConfig) -> None:
        """Use other parameters from now on."""
        if self.observer:
            self.observer.config = config

    def warm_up(self) -> None:
        """Compile, before the first sample."""
        if self.observer:
            self.observer.warm_up()

    def go_live(self) -> None:
        """Never wait for simulations."""
        if self.observer:
            self.observer.go_live()

    def close(self) -> None:
        """Store the simulated part of a reference: recordings are often shorter than its simulation."""
        part = self.observer.part_of_reference if self.observer else None
        if part is not None:
            stamp_ns = self._leg.twin.intake.followed_stamp_ns
            self._leg.accounting.note(SimulatedReference(stamp_ns, tuple(self._leg.mechanism.bodies), part))

    def leave(self) -> None:
        """Stop simulating ahead: the process is about to end."""
        if self.observer:
            self.observer.leave()

    def begin_epoch(self) -> None:
        """The stamps begin again at a new origin."""
        if self.observer:
            self.observer.begin_epoch()

    def add_samples(self, piece: Samples) -> None:
        """Add samples that the twin follows."""
        if self.observer:
            self.observer.add_samples(piece)

    def end_cycle(self, statistics: CycleStatistics, is_refused: bool) -> None:
        """Note a gait cycle that ended."""
        if self.observer:
            self.observer.ended(statistics, self.is_wrong or is_refused, statistics.load_peak_n)

    def alarm_values(self, report: CycleReport) -> Mapping[str, float]:
        """Torque residual, bias and lag of a gait cycle, by the names of their alarms."""
        values = torque_values(report, self._leg.twin.max_friction_nm)
        is_allowed = self._leg.config.cadence.allows(report.cadence_rpm)
        values[MISMATCH.kind] = report.torque_mismatch if is_allowed else math.nan
        return {spec.name(): spec.value(values) for spec in TORQUE}

    def judge(self, statistics: CycleStatistics, report: CycleReport) -> None:
        """Look for causes of a torque residual, and count gait cycles whose torque was not compared."""
        self._explain(statistics)
        is_allowed = self._leg.config.cadence.allows(statistics.cadence_rpm)
        why = statistics.not_compared if is_allowed else NotCompared.CADENCE
        if report.torque_samples and why is not None:
            self._not_compared[why.value] += 1

    def _explain(self, statistics: CycleStatistics) -> None:
        """Look for causes of a torque residual; a wrong torque says nothing about the leg."""
        was_wrong = self.is_wrong
        self.mismatch.add_cycle(
            statistics,
            self._board.alarms[MISMATCH.name()],
            self._explanation,
        )
        if not self.mismatch.cycles:
            self.unexplained = ""
        if self.observer and self.is_wrong and not was_wrong:
            # the alarm rose some gait cycles after the torque became wrong
            before = self._leg.config.alarms.on_delay_cycles + 1
            first = self.mismatch.cycles[0]
            self.observer.withdraw(first.begin_ns - before * (first.stamp_ns - first.begin_ns))

    def _explanation(self, cycles: Sequence[CycleStatistics]) -> TorqueExplanation | None:
        """Explanation of a torque residual; None if the data lead to no explanation, see `unexplained`."""
        before, self.unexplained = self.unexplained, ""
        try:
            return explanation(self._leg.mechanism, cycles, self._allowed)
        except DATA_ERRORS as error:
            self.unexplained = f"the torque mismatch could not be explained ({error or type(error).__name__})"
            if self.unexplained != before:
                _LOG.warning("%s", self.unexplained, exc_info=error)
            return None

    def end_period(self) -> None:
        """Compare measured and modelled torque, and correct modelled clearances that are surely wrong."""
        torque, leg = self.observer, self._leg
        if torque is None:
            return
        before = attrs.evolve(torque.state)
        correction = torque.end_period(leg.twin.clearance_mean_m, leg.twin.depth)
        if correction is not None and self._contradiction(correction):
            correction = None
        is_new, found = False, torque.parameters
        if not self.is_wrong:
            if found is not None and found != leg.twin.parameters and leg.config.diagnosis.apply_corrections:
                leg.take_parameters(found)
                is_new = True
            if correction is not None:
                leg.correct(correction)
                torque.corrected(correction, leg.twin.clearance_mean_m)
                is_new = True
        if self._note_new(torque, before) or is_new:
            leg.accounting.keep(self._board.alarms.values())

    def _note_new(self, torque: TorqueObserver, before: TorqueState) -> bool:
        """Store new baselines and references of the leg; return whether there is a new reference.

        To simulate a reference again takes a minute of walking.
        """
        leg, known = self._leg, before.all_commissioned
        for baseline in torque.state.all_commissioned:
            if all(baseline is not other for other in known):
                leg.accounting.note(baseline)
        made, self._made = self._made, torque.simulated_references
        new = [one for one in self._made if all(one is not other for other in made)]
        for reference in new:
            names, stamp_ns = tuple(leg.mechanism.bodies), leg.twin.intake.followed_stamp_ns
            leg.accounting.note(SimulatedReference(stamp_ns, names, reference))
        return bool(new)

    def replaced(self, k: int) -> None:
        """Commission the leg with a new part again."""
        del k
        if self.observer:
            self.observer.replaced(self._leg.twin.clearance_mean_m)

    @property
    def seen(self) -> Sequence[KnownClearance | None]:
        """Clearance that the drive torque shows of each joint, None where it shows none."""
        found = self.diagnosis
        return [
            KnownClearance("torque", *one, found.least_of_joint(k)) if (one := found.of_joint(k)) else None
            for k in range(len(found.clearance_m))
        ]

    @property
    def shows(self) -> str:
        """Source of the present estimates."""
        return "" if self.observer is None or self.is_wrong else "torque"

    # Present state of the torque.

    @property
    def diagnosis(self) -> Diagnosis:
        """Clearances estimated from the drive torque; empty while the received torque is wrong."""
        if self.observer is None:
            is_on = self._leg.config.diagnosis.enabled
            return Diagnosis(reason=ACCELERATED if is_on else "diagnosis.enabled is false")
        found = self.observer.diagnosis
        if self.is_wrong:
            return Diagnosis(
                state=DiagnosisState.WAITING,
                reason=WRONG_TORQUE,
                changes=tuple(change for change in found.changes if change.is_corrected),
                cycles_not_used=found.cycles_not_used,
            )
        own, contradictions = self._leg.twin.parameters, map(self._contradiction, found.changes)
        return attrs.evolve(
            found,
            tolerance_m=self._leg.tolerance_m,
            reason="; ".join(filter(None, (found.reason, self.unexplained, *contradictions))),
            bodies=self._counted_bodies(),
            friction=own.friction,
            compliance=own.compliance,
        )

    def _contradiction(self, change: Change) -> str:
        """A measurement of the changed leg that contradicts the change of a clearance, or empty."""
        if change.is_corrected or change.cause is not Cause.CLEARANCE:
            return ""
        k = self._leg.clearance_joints.index(change.subject)
        measured = self._leg.measured[k]
        if measured is None or measured.stamp_ns < change.since_ns:
            return ""
        apart_m = abs(measured.clearance_m - change.value)
        by_fit_m = self._leg.config.forecast.new_clearance_sigma * self._leg.new_m[k]
        if apart_m <= _CONTRADICTS * math.hypot(measured.sigma_m, change.sigma, by_fit_m):
            return ""
        return (
            f"the drive torque ({estimate(change.value, change.sigma, 'm')}) and a measurement "
            f"({estimate(measured.clearance_m, measured.sigma_m, 'm')}) of joint {change.subject} disagree, "
            "so the modelled clearance is not corrected: measure again"
        )

    def _counted_bodies(self) -> tuple[Body, ...]:
        """Bodies of the twin; none if its parameters equal the mechanism file's."""
        own, mechanism = self._leg.twin.parameters, self._leg.mechanism
        if attrs.evolve(own.in_air, compliance=0.0) == LegParameters.none(mechanism):
            return ()
        factors = zip(mechanism.bodies, own.mass.tolist(), own.length.tolist(), strict=True)
        return tuple(Body(*one) for one in factors)

    @property
    def is_wrong(self) -> bool:
        """True if the received drive torque is too wrong to show anything about the leg."""
        explained = self.mismatch.explanation
        return explained is not None and explained.hides_leg

    @property
    def has_input_fault(self) -> bool:
        """True if a wrong received drive torque or crank angle explains a torque residual."""
        explained = self.mismatch.explanation
        return explained is not None and explained.is_input_fault

    @property
    def explained(self) -> TorqueExplanation | None:
        """Gross causes of a torque residual; None if the diagnosis names different ones."""
        explained = self.mismatch.explanation
        return None if explained and self.diagnosis.replaces(explained) else explained

    @property
    def _allowed(self) -> Allowed:
        """Which torque a leg without a fault may have."""
        config = self._leg.config
        return Allowed(
            lag_s=config.drive.largest_lag_s,
            loads_n=LOADS_N,
            unexplained=WARN_FRACTION * config.limits.torque_mismatch,
        )

    @property
    def causes(self) -> dict[str, NamedCause]:
        """Causes of the torque's alarms whose values are beyond their limits now, by the alarm."""
        alarms, last = self._board.alarms, self._leg.last
        present = {name for name in _TORQUE if alarms[name].present is not Level.OK}
        return torque_causes(present, last, self._leg.twin.max_friction_nm) if last else {}

    @property
    def leg_fields(self) -> Mapping[str, Any]:
        """Drive and diagnosis, and the load that the torque shows."""
        diagnosis, load = self.diagnosis, {}
        if diagnosis.load is not None:
            load = {"load": attrs.evolve(diagnosis.load, cycles=diagnosis.cycles)}
        return {"drive": self._drive(diagnosis), "diagnosis": self._shown(diagnosis), **load}

    def _drive(self, diagnosis: Diagnosis) -> Drive:
        """The drive by the last gait cycle, by the explanation of a torque residual, and by the diagnosis."""
        last, explained = self._leg.last, self.explained
        named = explained.named if explained else None
        factor = named if named and named.cause in _FACTORS else None
        bandwidth_hz = diagnosis.channel.bandwidth_hz
        return Drive(
            scale=_estimate(factor.value, factor.sigma) if factor else None,
            lag_s=_estimate(last.torque_lag_s, last.torque_lag_sigma_s) if last else None,
            coulomb_nm=_estimate(last.friction_nm, last.friction_sigma_nm) if last else None,
            load_friction=_estimate(last.load_friction, last.load_friction_sigma) if last else None,
            bandwidth_hz=Estimate(value=bandwidth_hz) if math.isfinite(bandwidth_hz) else None,
            temperature_c=_estimate(or_nan(diagnosis.temperature_c), math.nan),
        )

    def _shown(self, diagnosis: Diagnosis) -> TorqueDiagnosis:
        cause = self._cause(diagnosis)
        return TorqueDiagnosis(
            state=diagnosis.state.value,
            reason=diagnosis.reason,
            cycles_used=diagnosis.cycles,
            cycles_not_used=dict(diagnosis.cycles_not_used),
            misfit=self._leg.last.torque_mismatch if self._leg.last else None,
            cause=cause.cause.name.lower() if cause else None,
            cause_subject=cause.subject if cause else "",
            cause_value=cause.value if cause else None,
            cause_sigma=cause.sigma if cause else None,
        )

    def _cause(self, diagnosis: Diagnosis) -> NamedCause | None:
        """Cause of the torque: an unsettled change of the leg, or else a torque residual's only cause."""
        if diagnosis.state is DiagnosisState.CHANGED and diagnosis.changes:
            return diagnosis.changes[-1]
        return self.explained.named if self.explained else None

    @property
    def statuses(self) -> Sequence[Status]:
        """Comparison of measured and predicted torque, and clearances by the torque."""
        diagnosis = self.diagnosis
        return self._torque_status(diagnosis), self._diagnosis_status(diagnosis)

    def _torque_status(self, diagnosis: Diagnosis) -> Status:
        """Comparison of measured and predicted torque, and the explanation of a torque residual."""
        alarms, last, explained = self._board.alarms, self._leg.last, self.explained
        causes = None if self.is_wrong else self.causes
        level, code = self._board.level(*_TORQUE), worst_code(alarms[name] for name in _TORQUE)
        code = _CODES.get(code, code)
        if last is None or not last.torque_samples:
            return Status("torque", level, "not compared: no drive torque in the last gait cycle", {}, code)
        values = {
            "measured_rms_nm": last.measured_torque_rms_nm,
            "predicted_rms_nm": last.predicted_torque_rms_nm,
            "residual_rms_nm": last.residual_torque_rms_nm,
            "mismatch": last.torque_mismatch,
            "samples": float(last.torque_samples),
            "crank_offset_error_rad": offset_error_rad(last),
            **{name: getattr(last, name) for name in _SAME_NAMES},
        }
        for why in NotCompared:
            values[f"not_compared_{why.value}_cycles"] = float(self._not_compared[why.value])
        raised = {name for name in _TORQUE if alarms[name].level is not Level.OK}
        messages = []
        if MISMATCH.name() in raised:
            by = f": {explanation_words(explained, diagnosis)}" if explained else ""
            messages = [f"the measured torque differs from the prediction{by}"]
            values |= _explained_values(explained) if explained else {}
            code = explained.named.cause.fault_code if explained and explained.named else code
        if causes is not None:  # those are estimates for the torque as received
            messages += [sentence(one, diagnosis) for one in causes.values()]
            past = [name for name in CAUSES_OF_ALARMS if name in raised and name not in causes]
            messages += [f"the {QUANTITIES[name]} was beyond its limit" for name in past]
        if not messages and math.isnan(last.torque_mismatch):
            messages = ["not enough gait cycles for a comparison yet"]
        return Status(
            "torque",
            level,
            "; ".join(messages or ["the measured torque agrees with the prediction"]),
            values,
            code,
        )

    def _diagnosis_status(self, diagnosis: Diagnosis) -> Status:
        """Clearances from the drive torque; NaN for joints that are not observable."""
        values = {"cycles": float(diagnosis.cycles)}
        for reason in NotUsed:
            values[f"not_used_{reason.value}"] = float(diagnosis.cycles_not_used.get(reason.value, 0))
        for k, joint in enumerate(self._leg.clearance_joints):
            unknown = (math.nan, math.nan)
            values[f"{joint}_clearance_m"], values[f"{joint}_sigma_m"] = diagnosis.of_joint(k) or unknown
            change = diagnosis.change_of_joint(k) or unknown
            values[f"{joint}_change_m"], values[f"{joint}_change_sigma_m"] = change
        for body in diagnosis.bodies:
            values[f"{body.name}_mass_factor"] = body.mass
            values[f"{body.name}_length_factor"] = body.length
        if diagnosis.bodies:
            values["joint_friction_factor"] = diagnosis.friction
        if diagnosis.channel != DIRECT:
            values["drive_delay_s"] = diagnosis.channel.delay_s
            values["drive_low_pass_s"] = diagnosis.channel.time_constant_s
            values["drive_load_friction"] = diagnosis.channel.load_friction
        if diagnosis.load:
            values["foot_load_peak_n"] = or_nan(diagnosis.load.peak_n)
            values["foot_load_sigma_n"] = or_nan(diagnosis.load.peak_sigma_n)
            values["heel_strike_phase"] = or_nan(diagnosis.load.heel_strike_phase)
            values["toe_off_phase"] = or_nan(diagnosis.load.toe_off_phase)
        if diagnosis.temperature_c is not None:
            values["drive_temperature_c"] = diagnosis.temperature_c
        if diagnosis.compliance:
            values["drive_stiffness_nm_per_rad"] = 1.0 / diagnosis.compliance
        words = _diagnosis_words(diagnosis, self._leg.clearance_joints)
        if diagnosis.state is DiagnosisState.CHANGED:
            return Status("diagnosis", Level.WARN, words, values, DIAGNOSIS)
        return Status("diagnosis", Level.OK, words, values)


def _estimate(value: float, sigma: float) -> Estimate | None:
    return Estimate(value=value, sigma=sigma) if math.isfinite(value) else None


def _explained_values(explained: TorqueExplanation) -> dict[str, float]:
    """Values of the first explanation of a torque residual, and the remaining residual."""
    values = {"unexplained": explained.after, "unexplained_sigma": explained.after_sigma}
    for one in explained.alternatives[:1]:
        row = words_of_cause(one.cause)
        name = f"{row.name}_{one.subject}".rstrip("_")
        values |= {with_unit(name, row.unit): one.value, with_unit(f"{name}_sigma", row.unit): one.sigma}
    return values


# State of the diagnosis in words, without the values that change in each gait cycle.


_STATES = {
    DiagnosisState.OFF: "off",
    DiagnosisState.WAITING: "waiting",
    DiagnosisState.AS_MODELLED: "the drive torque agrees with the modelled clearances",
    DiagnosisState.CHANGED: "the drive torque indicates a change",
}


def _diagnosis_words(diagnosis: Diagnosis, joints: Sequence[str]) -> str:
    """State, reason, and the joints (k,) that the drive torque does not show."""
    sentences = [_STATES[diagnosis.state]]
    if diagnosis.reason:
        sentences.append(diagnosis.reason)
    if diagnosis.next_step:
        sentences.append(diagnosis.next_step)
    sizes = zip(joints, diagnosis.clearance_m, strict=False)  # no sizes without estimates
    hidden = [joint for joint, size in sizes if math.isnan(size)]
    if hidden:
        sentences.append(f"not observable: {', '.join(hidden)}")
    if diagnosis.bodies:
        sentences.append("the model uses the masses, lengths and friction identified from the drive torque")
    return "; ".join(sentences)
