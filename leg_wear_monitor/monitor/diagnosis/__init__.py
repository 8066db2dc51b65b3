"""Diagnosis: the clearances that the drive torque shows, and changes of the leg."""
