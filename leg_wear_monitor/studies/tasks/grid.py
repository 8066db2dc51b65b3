"""Sampling grid of the studies."""

SAMPLES = 512  # samples per gait cycle: equal crank steps from angle 0, at whole intervals of the stepper
