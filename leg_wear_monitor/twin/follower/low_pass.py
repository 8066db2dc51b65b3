"""Low-pass filter of measured and predicted drive torque, two first-order stages (physics.md section 9)."""

from leg_wear_monitor.kernel import kernel


@kernel
def pass_low(fraction, fresh, value, stages):
    """Output of the filter with ``stages`` (2,), ``fraction`` 1 - exp(-w dt); if fresh, it is the input."""
    for stage in range(2):
        if fresh:
            stages[stage] = value
        stages[stage] += fraction * (value - stages[stage])
        value = stages[stage]
    return value
