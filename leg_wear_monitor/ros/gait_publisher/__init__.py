"""The synthetic leg as a node."""
