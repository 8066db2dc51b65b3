"""Sampled replay: which gait cycles are followed, and what the others wear (docs/explanation/sampling.md)."""
