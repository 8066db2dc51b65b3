"""Remaining life: growth, wear coefficients, measurements, forecast."""
