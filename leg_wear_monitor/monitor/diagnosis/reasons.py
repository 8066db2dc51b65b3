"""Why there is no estimate of the clearances yet, or why it is not sure, and the next step."""

import itertools
import math
from collections.abc import Sequence

import numpy as np

from leg_wear_monitor.estimate.signature import CommissionedTorque, TorqueSensor
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.diagnosis.references import (
    COMMISSIONING_CYCLES,
    UNLIKE_CYCLES,
    LegModels,
    References,
)
from leg_wear_monitor.monitor.diagnosis.state import (
    FIRST_CYCLES,
    UNUSABLE_CYCLES,
    AtCadence,
    NotUsed,
    TorqueState,
)

_IRREGULAR = (
    "the stamps of the drive torque are too irregular, or their rate has changed: the time of a step between "
    "two samples is not known"
)
_CHANGING_CYCLES, _ALIKE_CYCLES = 5, 3  # in a ramp of 30 rpm a minute, two or three in a row are alike


def missing(state: TorqueState, references: References, config: MonitorConfig) -> str:
    """Why there is no estimate."""
    if not math.isnan(state.off_cadence_rpm):
        own = config.cadence
        return (
            f"the cadence is {state.off_cadence_rpm:.3g} rpm, not the commanded "
            f"{own.commanded_rpm:.3g} ± {own.tolerance_rpm:.3g} rpm"
        )
    if state.unused and state.unused[-1] is NotUsed.JITTER:
        return _IRREGULAR
    if state.failure:
        return f"not observable, because no possible leg explains the drive torque ({state.failure})"
    if state.sensor is None or state.unused[-UNUSABLE_CYCLES:] == (NotUsed.GAP,) * UNUSABLE_CYCLES:
        return "no drive torque with enough samples in a gait cycle"
    if not state.sensor.phases:
        return "the drive torque has too few samples in a gait cycle"
    if state.reference is None and references.is_busy:
        return f"the reference for this leg is being simulated: {references.percent} %"
    if state.has_failed:
        return "the leg could not be simulated for a reference"
    if state.reference is None:
        return f"gait cycles: {len(state.waiting)} of {FIRST_CYCLES}"
    if state.unused and state.unused[-1] is NotUsed.UNLIKE:
        return _other_cadence(state, references)
    if len(state.cycles) < FIRST_CYCLES:
        return f"gait cycles: {len(state.cycles)} of {FIRST_CYCLES}"
    return "the drive torque does not fit the mechanism file (late, filtered, loaded, or of a different leg)"


def doubt(state: TorqueState, references: References, models: LegModels) -> str:
    """Why an estimate is not sure; empty if it is."""
    if _is_unlike(state):
        return _other_cadence(state, references)
    if state.unused[-UNUSABLE_CYCLES:] == (NotUsed.JITTER,) * UNUSABLE_CYCLES:
        return _IRREGULAR
    if not state.is_compared:
        return f"changes at this cadence are not observed yet; at {_cadences(state.set_aside)} they are"
    if state.is_load_other:
        return (
            "the load at the foot differs from the reference: no clearance is observable, and names of "
            "joints are not sure, until a reference under this load is ready"
        )
    if state.is_load_new and state.changes:
        names = ", ".join(one.subject for one in state.changes)
        return f"the load at the foot has changed, and {names} may have opened meanwhile: measure it"
    if state.interim_changes:
        return (
            "the leg has changed: its clearances are not known, but the monitor "
            "names a joint that opens from now on"
        )
    if models.is_sure(state):
        if state.fit is None or state.commissioned is None or state.changes:
            return ""
        is_unknown = state.commissioned.is_unknown.any()
        hidden = _hidden(state, state.commissioned, models.explainer(state).joints) if is_unknown else ""
        if hidden:
            return hidden
        if state.fit.explains:
            return ""
        return (
            "the drive torque does not fit the commissioned leg, and no clearance explains it; the estimate "
            "returns when noise, scale and lost samples are as before. If the sensor was "
            "changed, reset a joint and undo it: the leg is commissioned again"
        )
    if state.sensor and state.is_narrow:
        hz = state.sensor.channel.bandwidth_hz
        return f"the drive passes {hz:.0f} Hz of the torque: names of joints are not sure, none is corrected"
    known = "the model does not fit this leg, and the names of joints are not sure: "
    if not state.changes:
        known = "the model does not fit this leg, but nothing has changed since it was commissioned: "
    if state.load and references.is_load_left_out(state):
        carried = f"about {state.load.peak_n:.0f} ± {state.load.peak_sigma_n:.0f} N in stance"
        return f"{known}the foot carries {carried}; set load.model to ground"
    if references.is_busy:
        what = (
            "its masses, lengths and friction are" if state.rounds else "the leg under the ground's force is"
        )
        what = what if state.is_identifying else "a reference for it is"
        return f"{known}{what} being simulated, {references.percent} %"
    if state.load and not state.load.is_sure and not math.isnan(state.load.other_n):
        sizes = f"{state.load.peak_n:.0f} N and {state.load.other_n:.0f} N explain its drive torque as well"
        return f"{known}the force on the foot is not observable: {sizes}"
    return (
        f"{known}masses, lengths and friction near those of the file do not explain its drive torque; "
        "behind a belt or a soft coupling, declare drive.stiffness_nm_per_rad"
    )


def _hidden(state: TorqueState, known: CommissionedTorque, joints: Sequence[str]) -> str:
    """Message that joints may have opened with a corrected joint, and were not measured since."""
    measured = state.measured or (False,) * len(joints)
    names = ", ".join(itertools.compress(joints, known.is_unknown & ~np.array(measured)))
    if not names:
        return ""
    compared = next((one for one in state.all_commissioned if one.before is not None), None)
    if compared is None:
        then = "the torque cannot show it, so measure them"
    elif compared is known:
        then = "a new reference will show it"
    else:
        then = f"a new reference will show it at {60.0 * abs(compared.speed) / TURN:.3g} rpm"
    return f"{names} may have opened with the joint that was corrected: {then}"


def other_sensor(state: TorqueState) -> str:
    """Message that a baseline is from a different sensor than the present one; empty otherwise."""
    sensor = state.sensor
    if sensor is None or state.commissioned is not None:
        return ""
    other = next((one for one in state.baselines if not one.is_of(sensor)), None)
    if other is None:
        return ""
    now = _sampled(sensor, sensor.phases)
    then = "unknown" if math.isnan(other.period_s) else _sampled(other, other.signatures.shape[1] // 2)
    return f"the baseline has a different torque sensor ({then}; now {now}): the leg is commissioned again"


def _sampled(one: TorqueSensor | CommissionedTorque, phases: int) -> str:
    """How a torque is sampled, such as ``1000 Hz, means, 5 averaged, 80 phases``."""
    together = f", {one.together} averaged" if one.together > 1 else ""
    kind = "instants" if one.is_instant else "means"
    return f"{1.0 / one.period_s:.0f} Hz, {kind}{together}, {phases} phases"


def _is_unlike(state: TorqueState) -> bool:
    """True if the crank motion differs from all references, and not only as it starts or stops."""
    return state.unused[-UNUSABLE_CYCLES:] == (NotUsed.UNLIKE,) * UNUSABLE_CYCLES


def _is_changing(state: TorqueState) -> bool:
    """True if the cadence changes: only a few of the last gait cycles are alike."""
    last = (NotUsed.UNLIKE,) * _CHANGING_CYCLES
    return state.unused[-_CHANGING_CYCLES:] == last and len(state.waiting) <= _ALIKE_CYCLES


def _other_cadence(state: TorqueState, references: References) -> str:
    """Message on the use of gait cycles whose crank motion differs from all references."""
    if _is_changing(state):
        now = f"now {abs(state.waiting[-1].profile.cadence_rpm):.3g} rpm" if state.waiting else "now"
        return f"the cadence changes, {now}; gait cycles are compared at {_cadences(state.known)}"
    known = f"the motion of the crank differs from the references ({_cadences(state.known)})"
    if state.waiting and references.is_for(state.waiting[-1].profile):
        return f"{known}; a new one is being simulated: {references.percent} %"
    return known


def next_step(state: TorqueState, references: References, config: MonitorConfig) -> str:
    """Next result if the leg walks on as it does, and when; empty if walking adds nothing."""
    is_hopeless = state.has_failed or not (state.sensor and state.sensor.phases)
    if is_hopeless or not math.isnan(state.off_cadence_rpm):
        return ""
    commanded_s = 60.0 / abs(config.cadence.commanded_rpm)
    is_unlike = state.reference is not None and _is_unlike(state)
    last = state.waiting[-1:] if is_unlike or state.reference is None else state.cycles[-1:]
    cycle_s = TURN / abs(last[0].profile.speed) if last else commanded_s
    if references.is_late:
        return f"{_simulated(state, references, is_unlike)} later than in a replay: this machine is too busy"
    if references.is_busy:
        left_s = references.cycles_left * commanded_s
        then = "; a reference with them follows" if state.is_identifying else ""
        return f"{_simulated(state, references, is_unlike)} in {_cycles(left_s / cycle_s, cycle_s)}{then}"
    if state.reference is None:
        return f"a reference is chosen in {_cycles(FIRST_CYCLES - len(state.waiting), cycle_s)}"
    if is_unlike:
        left = UNLIKE_CYCLES - len(state.waiting)
        return "" if _is_changing(state) else f"a reference for it is begun in {_cycles(left, cycle_s)}"
    if state.commissioned is None and not state.changes:
        left = COMMISSIONING_CYCLES - len(state.cycles)
        return f"a baseline for smaller changes is complete in {_cycles(left, cycle_s)}"
    return ""


def _simulated(state: TorqueState, references: References, is_unlike: bool) -> str:
    """Result once the running simulation is finished."""
    if state.is_identifying:
        return "masses, lengths and friction of this leg are identified"
    if state.reference is None:
        return "clearances are compared"
    if is_unlike and state.waiting and references.is_for(state.waiting[-1].profile):
        return "gait cycles at this cadence are compared"
    return "a reference that is nearer to this leg is in force"


def _cycles(number: float, cycle_s: float) -> str:
    """A number of gait cycles, and the time that they take."""
    whole = max(1, math.ceil(number))
    return f"{whole} gait cycle{'s' if whole > 1 else ''} ({whole * cycle_s:.0f} s)"


def _cadences(known: Sequence[AtCadence]) -> str:
    """Cadences in the order of their speeds."""
    speeds = sorted(abs(one.reference.profile.speed) for one in known)
    return f"{', '.join(f'{60.0 * speed / TURN:.3g}' for speed in speeds)} rpm"
