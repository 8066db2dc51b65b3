"""The leg model along the tracked crank motion, and its torque compared with the measured one."""
