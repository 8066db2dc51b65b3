"""Why there is no estimate of the clearances yet, or why it is not sure, and the next step."""

import itertools
import math
from collections.abc import Sequence

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
    NotUsed,
    TorqueState,
)

_IRREGULAR = "the stamps of the drive torque are too irregular, or their rate has changed"
# in a ramp of 30 rpm per minute, two or three neighbouring cycles look alike
_CHANGING_CYCLES, _ALIKE_CYCLES = 5, 3


def missing(state: TorqueState, references: References, config: MonitorConfig) -> str:
    """Reason why there is no estimate."""
    if not math.isnan(state.off_cadence_rpm):
        own = config.cadence
        return (
            f"the cadence is {state.off_cadence_rpm:.3g} rpm, not the commanded "
            f"{own.commanded_rpm:.3g} ± {own.tolerance_rpm:.3g} rpm"
        )
    if state.unused[-1:] == (NotUsed.JITTER,):
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
    if state.unused[-1:] == (NotUsed.UNLIKE,):
        return _other_cadence(state, references)
    if not state.is_compared:
        return _not_compared(state)
    cycles = state.waiting if state.reference is None else state.cycles
    if state.reference is None or len(cycles) < FIRST_CYCLES:
        return f"gait cycles: {len(cycles)} of {FIRST_CYCLES}"
    return "the drive torque does not fit the mechanism file (late, filtered, loaded, or of a different leg)"


def doubt(state: TorqueState, references: References, models: LegModels) -> str:
    """Why an estimate is not sure; empty if it is."""
    if state.unused[-UNUSABLE_CYCLES:] == (NotUsed.UNLIKE,) * UNUSABLE_CYCLES:
        return _other_cadence(state, references)
    if state.unused[-UNUSABLE_CYCLES:] == (NotUsed.JITTER,) * UNUSABLE_CYCLES:
        return _IRREGULAR
    if not state.is_compared:
        return _not_compared(state)
    if models.is_sure(state):
        return _doubt_of_known_leg(state, models.explainer(state).joints)
    if state.sensor and state.is_narrow:
        hz = state.sensor.channel.bandwidth_hz
        return f"the drive passes only {hz:.0f} Hz of the torque: names are uncertain, no joint is corrected"
    known = "the model does not fit this leg, so the names of joints are uncertain: "
    if not state.changes:
        known = "the model does not fit this leg, but nothing has changed since it was commissioned: "
    if state.load and references.is_load_left_out(state):
        carried = f"about {state.load.peak_n:.0f} ± {state.load.peak_sigma_n:.0f} N in stance"
        return f"{known}the foot carries {carried}; set load.model to ground"
    if references.is_busy:
        return f"{known}{_simulated(state)} being simulated, {references.percent} %"
    if state.load and not state.load.is_sure and not math.isnan(state.load.other_n):
        sizes = f"{state.load.peak_n:.0f} N and {state.load.other_n:.0f} N explain its torque equally well"
        return f"{known}the force on the foot is not observable: {sizes}"
    return (
        f"{known}masses, lengths and friction near those of the file do not explain its drive torque; "
        "behind a belt or a soft coupling, declare drive.stiffness_nm_per_rad"
    )


def _doubt_of_known_leg(state: TorqueState, joints: Sequence[str]) -> str:
    """Why an estimate of a leg that matches its reference is not sure; empty if it is."""
    known = state.commissioned
    if state.fit is None or known is None or state.changes:
        return ""
    hidden = ", ".join(itertools.compress(joints, known.is_unknown))
    if hidden:
        return f"{hidden} may have opened with the joint that was corrected: measure them"
    if state.fit.explains:
        return ""
    return (
        "the drive torque does not fit the commissioned leg, and no clearance explains this; if the sensor "
        "was changed, reset a joint and undo the reset: the leg is then commissioned again"
    )


def other_sensor(state: TorqueState) -> str:
    """Message that a baseline is from a different sensor than the present one; empty otherwise."""
    sensor = state.sensor
    if sensor is None or state.commissioned is not None or all(one.is_of(sensor) for one in state.baselines):
        return ""
    return "the baseline has a torque sensor with a different rate or sampling: the leg is commissioned again"


def _not_compared(state: TorqueState) -> str:
    """Message on the gait cycles that are not tested for changes."""
    if state.is_load_other:
        return (
            "the load at the foot differs from the reference: no clearance is observable before the leg is "
            "commissioned under this load"
        )
    rpm = sorted(60.0 * abs(one.speed) / TURN for one in state.compared_at)
    at = ", ".join(f"{one:.3g}" for one in rpm)
    return f"changes at this cadence cannot be observed yet, but they can at {at} rpm"


def _is_changing(state: TorqueState) -> bool:
    """True if the cadence changes: only a few of the last gait cycles are alike."""
    last = (NotUsed.UNLIKE,) * _CHANGING_CYCLES
    return state.unused[-_CHANGING_CYCLES:] == last and len(state.waiting) <= _ALIKE_CYCLES


def _other_cadence(state: TorqueState, references: References) -> str:
    """Message on the use of gait cycles whose crank motion differs from the reference."""
    if _is_changing(state):
        now = f", now {abs(state.waiting[-1].profile.cadence_rpm):.3g} rpm" if state.waiting else ""
        return f"not observable while the cadence changes{now}"
    known = "not observable at this cadence before it has a reference"
    return f"{known}: {references.percent} % is simulated" if references.is_busy else known


def next_step(state: TorqueState, references: References, config: MonitorConfig) -> str:
    """Next result if the leg walks on as it does, and when; empty if walking adds nothing."""
    is_hopeless = state.has_failed or not (state.sensor and state.sensor.phases)
    if is_hopeless or not math.isnan(state.off_cadence_rpm):
        return ""
    commanded_s = 60.0 / abs(config.cadence.commanded_rpm)
    last = state.waiting[-1:] if state.is_elsewhere else state.cycles[-1:]
    cycle_s = TURN / abs(last[0].profile.speed) if last else commanded_s
    if references.is_late:
        return f"{_simulated(state)} being simulated, with a delay because this machine is too busy"
    if references.is_busy:
        left_s = references.cycles_left * commanded_s
        then = "; then a reference with these values is simulated" if state.is_identifying else ""
        return f"{_simulated(state)} ready after {_cycles(left_s / cycle_s, cycle_s)}{then}"
    if state.reference is None:
        return f"a reference will be chosen after {_cycles(FIRST_CYCLES - len(state.waiting), cycle_s)}"
    if state.is_elsewhere:
        left = UNLIKE_CYCLES - len(state.waiting)
        return "" if _is_changing(state) else f"its reference will be started after {_cycles(left, cycle_s)}"
    if state.commissioned is None and not state.changes:
        left = COMMISSIONING_CYCLES - len(state.cycles)
        return f"a baseline for smaller changes will be complete after {_cycles(left, cycle_s)}"
    return ""


def _simulated(state: TorqueState) -> str:
    """Subject and verb of a sentence on the running simulation."""
    if not state.is_identifying:
        return "a reference for the leg is"
    return "its masses, lengths and friction are" if state.rounds else "the leg under the ground's force is"


def _cycles(number: float, cycle_s: float) -> str:
    """A number of further gait cycles, and the time that they take."""
    whole = max(1, math.ceil(number))
    return f"{whole} more gait cycle{'s' if whole > 1 else ''} ({whole * cycle_s:.0f} s of walking)"
