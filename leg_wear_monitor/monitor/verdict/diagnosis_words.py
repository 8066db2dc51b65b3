"""State of the diagnosis in words, without the values that change in each gait cycle."""

import math
from collections.abc import Sequence

from leg_wear_monitor.monitor.diagnosis.diagnosis import Diagnosis, DiagnosisState

_STATES = {
    DiagnosisState.OFF: "off",
    DiagnosisState.WAITING: "waiting",
    DiagnosisState.AS_COUNTED: "the drive torque shows the counted clearances",
    DiagnosisState.CHANGED: "the drive torque shows a change",
}


def diagnosis_words(diagnosis: Diagnosis, joints: Sequence[str]) -> str:
    """State, reason, and the joints (k,) that the drive torque does not show."""
    told = [_STATES[diagnosis.state]]
    if diagnosis.reason:
        told.append(diagnosis.reason)
    if diagnosis.next_step:
        told.append(diagnosis.next_step)
    hidden = unseen(diagnosis, joints)
    if diagnosis.clearance_m and hidden:
        told.append(f"not observable: {', '.join(hidden)}")
    if diagnosis.bodies:
        told.append("wear is counted with the masses, lengths and friction that the drive torque shows")
    return "; ".join(told)


def unseen(diagnosis: Diagnosis, joints: Sequence[str]) -> tuple[str, ...]:
    """Joints whose clearance the drive torque does not show."""
    if not diagnosis.clearance_m:
        return tuple(joints)
    return tuple(
        joint for joint, value in zip(joints, diagnosis.clearance_m, strict=True) if math.isnan(value)
    )
