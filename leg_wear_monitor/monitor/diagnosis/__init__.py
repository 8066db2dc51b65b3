"""Diagnosis: the clearances that the drive torque shows, and what has changed in the leg."""
