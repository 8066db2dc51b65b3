"""The reference cycle of a leg, computed before the first sample."""
