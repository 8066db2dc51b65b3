"""Fit of a torque with the mechanism's, over gear ratio, offset, scale and friction."""
