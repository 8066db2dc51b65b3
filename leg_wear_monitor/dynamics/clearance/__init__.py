"""Clearance coordinates: the real-time formulation (physics.md section 7)."""
