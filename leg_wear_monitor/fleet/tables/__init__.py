"""The history of a fleet as tables."""
