"""Contact of a journal in a bushing: geometry, normal force, friction."""
