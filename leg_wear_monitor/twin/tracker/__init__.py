"""From samples to the motion of the crank: order, faults, filter, spline."""
