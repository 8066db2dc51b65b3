"""Version of ``summary.json``; a module of its own, since reading one needs none of what writes it."""

SCHEMA_VERSION = 2
"""Counts up when a field is renamed, removed or means something else."""
