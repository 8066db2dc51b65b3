"""Causes of a torque mismatch: a wrong sign, factor, crank angle or lag, a load at the foot, another mass."""
