"""Stable names of what is wrong, one with each status: those of alarms, and those of the parts of a monitor.

A status of the verdict has the code of its rule (`verdict.rules`), which is that of a cause
(`estimate.cause`) where one is found.
"""

from collections.abc import Iterable

from leg_wear_monitor.estimate.cause import Cause
from leg_wear_monitor.monitor.alarms.alarm import Alarm, Level

NO_FAULT = "NONE"
INPUT_SILENCE, NOT_FOLLOWED, CRANK_ZERO = "INPUT_SILENCE", "NOT_FOLLOWED", "CRANK_ZERO"
ENCODERS, DIAGNOSIS = "ENCODERS", "DIAGNOSIS"
LEDGER_NOT_WRITTEN, LEDGER_INTERRUPTED = "LEDGER_NOT_WRITTEN", "LEDGER_INTERRUPTED"
SAMPLES_DROPPED, SAMPLES_NOT_PUBLISHED = "SAMPLES_DROPPED", "SAMPLES_NOT_PUBLISHED"
TOPICS, RECORDING_STOPPED = "TOPICS", "RECORDING_STOPPED"
CLOCK_MISSING, CLOCK_STOPPED, CLOCK_SET_BACK = "CLOCK_MISSING", "CLOCK_STOPPED", "CLOCK_SET_BACK"
STAMPS_AHEAD, ALREADY_COUNTED = "STAMPS_AHEAD", "ALREADY_COUNTED"

GAPS, STUCK, ZERO, SCALE, EXCHANGED, SIGN = (
    "input_gaps", "foot_load_stuck", "foot_load_zero", "foot_load_scale", "foot_load_exchanged",
    "foot_load_sign",
)  # fmt: skip
"""Kinds of the alarms of the foot load's sensor, by which their values are named."""
FOOT_LOAD_LIMITS = {GAPS: 0.05, STUCK: 0.9, ZERO: 0.1, SCALE: 3.0, EXCHANGED: 0.5, SIGN: 0.5}

FOOT_LOAD_WORDS = {
    STUCK: "the foot load does not change between stance and swing: its sensor is stuck, or the leg walks in "
    "the air",
    ZERO: "the foot load is not 0 in swing: the zero of its sensor has drifted",
    SCALE: "the size of the foot load does not fit the drive torque: its unit or scale is wrong",
    EXCHANGED: "the foot load is there while this foot is in the air: it is that of the other leg",
    SIGN: "the foot load pulls: its sign is reversed",
}
"""What is wrong, by the kind of the alarm."""

FAULT_CODES = {
    NO_FAULT: "nothing is wrong",
    INPUT_SILENCE: "no samples come; each status that has no current data then has this code",
    NOT_FOLLOWED: "the samples of the crank cannot be followed, see `input`",
    CRANK_ZERO: "the zero of the crank's encoder is not found yet, see `crank zero`",
    ENCODERS: "a further encoder gives no usable angles",
    DIAGNOSIS: "the drive torque shows a change; the code of the verdict names it",
    LEDGER_NOT_WRITTEN: "the ledger cannot be written",
    LEDGER_INTERRUPTED: "the previous run was interrupted",
    SAMPLES_DROPPED: "the node is overloaded: samples were dropped",
    SAMPLES_NOT_PUBLISHED: "the node is overloaded: values of samples are not published",
    TOPICS: "an input topic has no publisher, several, another type, not the crank, a torque about another "
    "axis, or messages are lost",
    RECORDING_STOPPED: "the recording of the node has stopped",
    CLOCK_MISSING: "`use_sim_time` is set and nobody publishes `/clock`",
    CLOCK_STOPPED: "`/clock` has stopped",
    CLOCK_SET_BACK: "the clock was set back",
    STAMPS_AHEAD: "the stamps of an input are ahead of the clock of the node",
    ALREADY_COUNTED: "samples of a time that is in the ledger are skipped",
}
"""Codes that are not the name of an alarm, and their meaning."""

CAUSES_OF_ALARMS = {
    "torque_bias": Cause.BIAS,
    "torque_drift": Cause.FRICTION,
    "torque_lag": Cause.TIMING,
}
"""Causes that have a limit of their own, by the alarm."""


def code_of(alarm: Alarm) -> str:
    """Code of a raised alarm, such as ``CLEARANCE_A``; NONE for another."""
    return alarm.name.upper().replace(" ", "_") if alarm.level is not Level.OK else NO_FAULT


def worst_code(alarms: Iterable[Alarm]) -> str:
    """Code of the first of the most severe alarms; NONE if none is raised."""
    found = sorted(alarms, key=lambda alarm: -alarm.level)
    return code_of(found[0]) if found else NO_FAULT
