"""The instants at which a leg is looked at."""

SAMPLES = 512  # of a gait cycle, equal steps of the crank from angle 0, at whole intervals of the stepper
