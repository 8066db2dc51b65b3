"""Numerical tasks of the studies: the computation of one point."""
