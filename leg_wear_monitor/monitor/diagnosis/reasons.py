"""Why there is no estimate of the clearances yet, or why it is not sure, and what comes next."""

import math
from collections.abc import Sequence

import numpy as np

from leg_wear_monitor.mechanism.ideal import TURN
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.diagnosis.diagnosis import NotUsed
from leg_wear_monitor.monitor.diagnosis.leg_models import COMMISSIONING_CYCLES, LegModels
from leg_wear_monitor.monitor.diagnosis.references import FIRST_CYCLES, UNLIKE_CYCLES, References
from leg_wear_monitor.monitor.diagnosis.state import AtCadence, TorqueState

_UNUSABLE_CYCLES = 3  # in a row: a start has two that are unlike
_CHANGING_CYCLES, _ALIKE_CYCLES = 5, 3  # in a ramp of 30 rpm a minute, two or three in a row are alike

_ENOUGH_CYCLES, _LOCKED = 20, 0.9  # gait cycles, and the length of their mean phase: 1 if samples never drift


LOCKED_SAMPLES = (
    "the torque samples come at the same crank angles in each gait cycle; after a restart they may come at "
    "others, which can look like a small change"
)


def missing(state: TorqueState, references: References, config: MonitorConfig) -> str:
    """Why there is no estimate."""
    if not math.isnan(state.off_cadence_rpm):
        own = config.cadence
        return (
            f"the cadence is {state.off_cadence_rpm:.3g} rpm, not the commanded "
            f"{own.commanded_rpm:.3g} ± {own.tolerance_rpm:.3g} rpm"
        )
    if state.unused and state.unused[-1] is NotUsed.JITTER:
        return (
            "the stamps of the drive torque are too irregular: a step between two samples has no known time"
        )
    if state.sensor is None or state.unused[-_UNUSABLE_CYCLES:] == (NotUsed.GAP,) * _UNUSABLE_CYCLES:
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
    return "the drive torque is not that of the mechanism file (late, filtered, loaded, or of another leg)"


def doubt(state: TorqueState, references: References, models: LegModels) -> str:
    """Why an estimate is not sure; empty if it is."""
    if _is_unlike(state):
        return _other_cadence(state, references)
    if not state.is_compared:
        return f"changes at this cadence are not observed yet; at {_cadences(state.set_aside)} they are"
    if models.is_of_file(state):
        return LOCKED_SAMPLES if _are_locked(state) else ""
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
    return f"{known}masses, lengths and friction near those of the file do not explain its drive torque"


def _is_unlike(state: TorqueState) -> bool:
    """Whether the crank turns otherwise than in all references, and not only as it starts or stops."""
    return state.unused[-_UNUSABLE_CYCLES:] == (NotUsed.UNLIKE,) * _UNUSABLE_CYCLES


def _is_changing(state: TorqueState) -> bool:
    """Whether the cadence changes: of the last gait cycles only a few are alike."""
    last = (NotUsed.UNLIKE,) * _CHANGING_CYCLES
    return state.unused[-_CHANGING_CYCLES:] == last and len(state.waiting) <= _ALIKE_CYCLES


def _other_cadence(state: TorqueState, references: References) -> str:
    """What becomes of gait cycles whose crank turns otherwise than in all references."""
    if _is_changing(state):
        now = f"now {abs(state.waiting[-1].profile.cadence_rpm):.3g} rpm" if state.waiting else "now"
        return f"the cadence changes, {now}; gait cycles are compared at {_cadences(state.known)}"
    known = f"the crank turns otherwise than in the references ({_cadences(state.known)})"
    if state.waiting and references.is_for(state.waiting[-1].profile):
        return f"{known}; another one is being simulated: {references.percent} %"
    return known


def next_step(state: TorqueState, references: References, config: MonitorConfig) -> str:
    """What is known next if the leg walks on as it does, and when; empty where walking adds nothing."""
    is_hopeless = state.has_failed or not (state.sensor and state.sensor.phases)
    if is_hopeless or not math.isnan(state.off_cadence_rpm):
        return ""
    commanded_s = 60.0 / abs(config.cadence.commanded_rpm)
    is_unlike = state.reference is not None and _is_unlike(state)
    last = state.waiting[-1:] if is_unlike or state.reference is None else state.cycles[-1:]
    cycle_s = TURN / abs(last[0].profile.speed) if last else commanded_s
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
        return f"the baseline, with which smaller changes are found, is complete in {_cycles(left, cycle_s)}"
    return ""


def _simulated(state: TorqueState, references: References, is_unlike: bool) -> str:
    """What is known when that which is being simulated is there."""
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


def _are_locked(state: TorqueState) -> bool:
    """Whether samples come at the same crank angles in each gait cycle.

    Where several are averaged, their first one is the first of the gait cycle, so none of this matters.
    """
    if state.sensor is None or state.sensor.together > 1 or len(state.cycles) < _ENOUGH_CYCLES:
        return False
    phases = np.exp(2j * np.pi * np.array([cycle.late for cycle in state.cycles]))
    return bool(abs(phases.mean()) > _LOCKED)
