"""Crank tracker: order and faults of samples, filter, smoother, spline (physics.md section 9)."""
