"""The leg model in step with the crank, and its comparison with the measured torque."""
