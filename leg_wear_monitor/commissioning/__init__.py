"""Commissioning: the parameters of a robot from a recording of its healthy leg."""
