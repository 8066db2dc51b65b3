"""Alarms: levels, limits, deadband and latch, and their words."""
