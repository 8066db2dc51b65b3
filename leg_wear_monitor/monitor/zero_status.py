"""Status of the crank's zero."""

import math

from leg_wear_monitor.monitor.alarms.alarm import Level
from leg_wear_monitor.monitor.alarms.fault_codes import CRANK_ZERO
from leg_wear_monitor.monitor.crank_zero.crank_zero import CrankZero
from leg_wear_monitor.monitor.crank_zero.phase import LEAST_TURNS
from leg_wear_monitor.monitor.reports import Status
from leg_wear_monitor.monitor.verdict.words import estimate


def zero_status(crank_zero: CrankZero) -> Status:
    """The zero of the crank's encoder and its runner-up, or why it is not known."""
    state, zero = crank_zero.state, crank_zero.state.zero
    values = {
        "offset_rad": zero.offset_rad if zero else math.nan,
        "sigma_rad": zero.sigma_rad if zero else math.nan,
        "mismatch": zero.mismatch if zero else math.nan,
        "other_rad": zero.other_rad if zero else math.nan,
        "other_mismatch": zero.other_mismatch if zero else math.nan,
        "turns": float(zero.turns if zero else state.turns),
        "least_turns": float(LEAST_TURNS),
        "times_found": float(state.times_found),
        "not_monitored_s": crank_zero.unmonitored_s,
    }
    if zero is None:
        return Status("crank zero", Level.WARN, crank_zero.cause, values, CRANK_ZERO)
    found = estimate(zero.offset_rad, zero.sigma_rad, "rad")
    return Status("crank zero", Level.OK, f"crank angle at joint position 0: {found}", values)
