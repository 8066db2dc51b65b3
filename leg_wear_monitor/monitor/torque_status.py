"""Statuses of the drive torque and of the diagnosis."""

import math
from collections.abc import Mapping, Sequence

from leg_wear_monitor.estimate.cause import NamedCause, TorqueExplanation
from leg_wear_monitor.estimate.drive import DIRECT
from leg_wear_monitor.files import or_nan
from leg_wear_monitor.monitor import alarm_specs
from leg_wear_monitor.monitor.alarms import CAUSES_OF_ALARMS, DIAGNOSIS, worst_code
from leg_wear_monitor.monitor.diagnosis.state import Diagnosis, DiagnosisState, NotUsed
from leg_wear_monitor.monitor.evaluation import AlarmBoard
from leg_wear_monitor.monitor.gait_evidence import TorqueRecord, offset_error_rad
from leg_wear_monitor.monitor.reports import CycleReport, Status
from leg_wear_monitor.monitor.verdict.rules import explanation, sentence
from leg_wear_monitor.monitor.verdict.verdict import with_unit, words_of_cause
from leg_wear_monitor.state import Level
from leg_wear_monitor.twin.statistics import NotCompared

_TORQUE = tuple(spec.name() for spec in alarm_specs.TORQUE)
_CODES = {name.upper(): cause.fault_code for name, cause in CAUSES_OF_ALARMS.items()}


def torque_status(
    board: AlarmBoard,
    last: CycleReport | None,
    record: TorqueRecord,
    explained: TorqueExplanation | None,
    causes: Mapping[str, NamedCause] | None,
    diagnosis: Diagnosis,
) -> Status:
    """Comparison of measured and predicted torque, and the explanation of a torque residual.

    Parameters
    ----------
    board : AlarmBoard
    last : CycleReport or None
        The last gait cycle.
    record : TorqueRecord
    explained : TorqueExplanation or None
    causes : mapping of str to NamedCause or None
        Causes of the alarms that are present, by the alarm; None where the torque is wrong as received.
    diagnosis : Diagnosis
    """
    alarms = board.alarms
    level, code = board.level(*_TORQUE), worst_code(alarms[name] for name in _TORQUE)
    code = _CODES.get(code, code)
    if last is None or not last.torque_samples:
        return Status("torque", level, "not compared: no drive torque in the last gait cycle", {}, code)
    values = {
        "measured_rms_nm": last.measured_torque_rms_nm,
        "predicted_rms_nm": last.predicted_torque_rms_nm,
        "residual_rms_nm": last.residual_torque_rms_nm,
        "mismatch": last.torque_mismatch,
        "load_n": last.load_n,
        "load_sigma_n": last.load_sigma_n,
        "load_acting_n": last.load_acting_n,
        "friction_nm": last.friction_nm,
        "torque_lag_s": last.torque_lag_s,
        "samples": float(last.torque_samples),
        "friction_sigma_nm": last.friction_sigma_nm,
        "friction_commissioned_nm": record.commissioned.value,
        "torque_lag_sigma_s": last.torque_lag_sigma_s,
        "load_friction": last.load_friction,
        "load_friction_sigma": last.load_friction_sigma,
        "crank_offset_error_rad": offset_error_rad(last),
    }
    for why in NotCompared:
        values[f"not_compared_{why.value}_cycles"] = float(record.not_compared[why.value])
    raised = {name for name in _TORQUE if alarms[name].level is not Level.OK}
    messages = []
    if alarm_specs.MISMATCH.name() in raised:
        by = f": {explanation(explained, diagnosis)}" if explained else ""
        messages = [f"the measured torque differs from the prediction{by}"]
        values |= _explained_values(explained) if explained else {}
        code = explained.named[0].cause.fault_code if explained and explained.named else code
    if causes is not None:  # those are estimates for the torque as received
        messages += [sentence(one, diagnosis) for one in causes.values()]
        past = [name for name in CAUSES_OF_ALARMS if name in raised and name not in causes]
        messages += [f"the {alarm_specs.QUANTITIES[name]} was beyond its limit" for name in past]
    if not messages and math.isnan(last.torque_mismatch):
        messages = ["not enough gait cycles for a comparison yet"]
    return Status(
        "torque",
        level,
        "; ".join(messages or [("the measured torque agrees with the prediction")]),
        values,
        code,
    )


def diagnosis_status(joints: Sequence[str], diagnosis: Diagnosis) -> Status:
    """Clearances from the drive torque; NaN for joints that are not observable."""
    values = {"cycles": float(diagnosis.cycles)}
    for reason in NotUsed:
        values[f"not_used_{reason.value}"] = float(diagnosis.cycles_not_used.get(reason.value, 0))
    for k, joint in enumerate(joints):
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
    if diagnosis.state is DiagnosisState.CHANGED:
        return Status("diagnosis", Level.WARN, diagnosis_words(diagnosis, joints), values, DIAGNOSIS)
    return Status("diagnosis", Level.OK, diagnosis_words(diagnosis, joints), values)


def _explained_values(explained: TorqueExplanation) -> dict[str, float]:
    """Values of the first explanation of a torque residual, and the remaining residual."""
    values = {"unexplained": explained.after, "unexplained_sigma": explained.after_sigma}
    for one in explained.alternatives[0] if explained.alternatives else ():
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


def diagnosis_words(diagnosis: Diagnosis, joints: Sequence[str]) -> str:
    """State, reason, and the joints (k,) that the drive torque does not show."""
    sentences = [_STATES[diagnosis.state]]
    if diagnosis.reason:
        sentences.append(diagnosis.reason)
    if diagnosis.next_step:
        sentences.append(diagnosis.next_step)
    hidden = unseen(diagnosis, joints)
    if diagnosis.clearance_m and hidden:
        sentences.append(f"not observable: {', '.join(hidden)}")
    if diagnosis.bodies:
        sentences.append("the model uses the masses, lengths and friction identified from the drive torque")
    return "; ".join(sentences)


def unseen(diagnosis: Diagnosis, joints: Sequence[str]) -> tuple[str, ...]:
    """Joints whose clearance cannot be estimated from the drive torque."""
    if not diagnosis.clearance_m:
        return tuple(joints)
    return tuple(
        joint for joint, value in zip(joints, diagnosis.clearance_m, strict=True) if math.isnan(value)
    )
