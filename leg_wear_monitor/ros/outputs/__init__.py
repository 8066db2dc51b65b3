"""Outputs of the node: publishers, markers, recording."""
