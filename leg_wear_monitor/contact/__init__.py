"""A journal in a bushing: geometry, normal force, friction."""
