"""A synthetic leg for tests of the monitor: motion in full coordinates, and its sensors."""
