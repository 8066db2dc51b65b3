"""Why there is no estimate of the clearances yet, or why it is not sure, and the next step.

The sentences are in config/verdict.yaml, by their codes.
"""

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
from leg_wear_monitor.monitor.sentences import verdict_document


def _words(code: str, **values: object) -> str:
    return str(verdict_document()["reasons"][code]).format(**values)


def missing(state: TorqueState, references: References, config: MonitorConfig) -> str:
    """Reason why there is no estimate."""
    last, own, percent = state.unused[-UNUSABLE_CYCLES:], config.cadence, references.percent
    if not math.isnan(state.off_cadence_rpm):
        rpm = (state.off_cadence_rpm, own.commanded_rpm, own.tolerance_rpm)
        return _words("off_cadence", **dict(zip(("now", "commanded", "tolerance"), rpm, strict=True)))
    if last[-1:] == (NotUsed.JITTER,):
        return _words("irregular")
    if state.failure:
        return _words("impossible", why=state.failure)
    if state.sensor is None or last == (NotUsed.GAP,) * UNUSABLE_CYCLES:
        return _words("no_torque")
    if not state.sensor.phases:
        return _words("few_samples")
    if state.reference is None and references.is_busy:
        return _words("simulated", percent=percent)
    if state.has_failed:
        return _words("not_simulated")
    if last[-1:] == (NotUsed.UNLIKE,) or not state.is_compared:
        return _not_compared(state, references)
    cycles = state.waiting if state.reference is None else state.cycles
    if state.reference is None or len(cycles) < FIRST_CYCLES:
        return _words("few_cycles", number=len(cycles), of=FIRST_CYCLES)
    return _words("unlike")


def doubt(state: TorqueState, references: References, models: LegModels) -> str:
    """Why an estimate is not sure; empty if it is."""
    last = state.unused[-UNUSABLE_CYCLES:]
    if last == (NotUsed.UNLIKE,) * UNUSABLE_CYCLES or not state.is_compared:
        return _not_compared(state, references)
    if last == (NotUsed.JITTER,) * UNUSABLE_CYCLES:
        return _words("irregular")
    if models.is_sure(state):
        return _doubt_of_known_leg(state, models.explainer(state).joints)
    if state.sensor and state.is_narrow:
        return _words("narrow", hz=state.sensor.channel.bandwidth_hz)
    known, load = _words("uncertain" if state.changes else "unchanged"), state.load
    if load and references.is_load_left_out(state):
        return known + _words("load", peak_n=load.peak_n, sigma_n=load.peak_sigma_n)
    if references.is_busy:
        return known + _words("simulated", percent=references.percent)
    if load and not load.is_sure and not math.isnan(load.other_n):
        return known + _words("two_loads", peak_n=load.peak_n, other_n=load.other_n)
    return known + _words("other_leg")


def _doubt_of_known_leg(state: TorqueState, joints: Sequence[str]) -> str:
    """Why an estimate of a leg that matches its reference is not sure; empty if it is."""
    known = state.commissioned
    if state.fit is None or known is None or state.changes:
        return ""
    if known.is_unknown.any():
        return _words("hidden", joints=", ".join(itertools.compress(joints, known.is_unknown)))
    return "" if state.fit.explains else _words("other_torque")


def other_sensor(state: TorqueState) -> str:
    """Message that a baseline is from a different sensor than the present one; empty otherwise."""
    sensor = state.sensor
    if sensor is None or state.commissioned is not None or all(one.is_of(sensor) for one in state.baselines):
        return ""
    return _words("other_sensor")


def _not_compared(state: TorqueState, references: References) -> str:
    """Message on gait cycles that are not tested for changes."""
    if state.is_load_other:
        return _words("other_load")
    return _words("at_cadence_soon" if references.is_busy else "at_cadence", percent=references.percent)


def next_step(state: TorqueState, references: References, config: MonitorConfig) -> str:
    """Next result if the leg walks on as it does, and when; empty if walking adds nothing."""
    is_hopeless = state.has_failed or not (state.sensor and state.sensor.phases)
    if is_hopeless or not math.isnan(state.off_cadence_rpm):
        return ""
    if references.is_late:
        return _words("late")
    commanded_s = 60.0 / abs(config.cadence.commanded_rpm)
    last = state.waiting[-1:] if state.is_elsewhere else state.cycles[-1:]
    cycle_s = TURN / abs(last[0].profile.speed) if last else commanded_s
    if references.is_busy:
        code = "identified" if state.is_identifying else "reference"
        left = references.cycles_left * commanded_s / cycle_s
    elif state.is_elsewhere:
        most = UNLIKE_CYCLES if state.reference else FIRST_CYCLES
        code, left = "begun", float(most - len(state.waiting))
    elif state.commissioned is None and not state.changes:
        code, left = "baseline", float(COMMISSIONING_CYCLES - len(state.cycles))
    else:
        return ""
    cycles = max(1, math.ceil(left))
    return _words(f"after_{code}", cycles=cycles, seconds=cycles * cycle_s)
