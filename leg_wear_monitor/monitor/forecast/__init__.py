"""Remaining life: growth law, wear coefficients, measurements, forecast."""
