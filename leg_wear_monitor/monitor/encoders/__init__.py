"""Clearance estimates from joint encoders."""
