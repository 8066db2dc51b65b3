"""The leg, in step with its gait: samples, crank tracker, digital twin, load from drive torque."""
