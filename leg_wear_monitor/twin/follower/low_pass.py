"""The low-pass that measured and predicted drive torque both go through."""

from leg_wear_monitor.kernel import kernel


@kernel
def pass_low(fraction, fresh, value, stages):
    """Value after the two stages (2,) of the low-pass; a fresh filter starts at its first value."""
    for stage in range(2):
        if fresh:
            stages[stage] = value
        stages[stage] += fraction * (value - stages[stage])
        value = stages[stage]
    return value
