"""Full coordinates: the reference formulation."""
