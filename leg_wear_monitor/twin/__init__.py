"""Digital twin: samples, crank tracker, leg model, load from drive torque (physics.md section 9)."""
