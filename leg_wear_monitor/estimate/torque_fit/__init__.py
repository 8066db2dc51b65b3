"""Fit of a drive torque with that of the ideal leg: shared by commissioning and the monitor."""
