"""Silence, clocks, node status, node alarms, the log."""
