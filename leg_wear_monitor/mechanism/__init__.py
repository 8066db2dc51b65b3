"""The mechanism: its description, its arrays for the kernels, its ideal motion."""
