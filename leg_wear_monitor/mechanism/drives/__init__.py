"""Drives by name: their lag, bandwidth, friction and stiffness, with sources."""
