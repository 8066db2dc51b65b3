"""Clearance coordinates: the real-time formulation."""
