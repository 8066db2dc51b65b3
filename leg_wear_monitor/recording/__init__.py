"""Bags: read whole or damaged ones as gait samples, write MCAP, replay."""
