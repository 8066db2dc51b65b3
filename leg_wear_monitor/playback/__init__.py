"""A recording through the monitor."""
