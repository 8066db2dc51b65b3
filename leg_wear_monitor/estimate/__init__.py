"""Estimates of a leg, its drive and its clearances from signals, with covariance and cause."""
