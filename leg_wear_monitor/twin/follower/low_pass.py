"""The low-pass that measured and predicted drive torque both go through."""

from leg_wear_monitor.kernel import kernel


@kernel
def pass_low(fraction, fresh, low_pass, i, value):
    """Value of channel i after the two stages of the low-pass; a fresh filter starts at its first value."""
    for stage in range(2):
        if fresh:
            low_pass[stage, i] = value
        low_pass[stage, i] += fraction * (value - low_pass[stage, i])
        value = low_pass[stage, i]
    return value
