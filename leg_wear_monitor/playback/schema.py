"""Version of ``summary.json``, in a module of its own: readers need not import the writing code."""

SCHEMA_VERSION = 2
"""Counts up when a field is renamed, removed or means something else."""
