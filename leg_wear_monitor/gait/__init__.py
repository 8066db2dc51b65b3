"""A made-up leg to be monitored: its motion in full coordinates, and the sensors on it."""
