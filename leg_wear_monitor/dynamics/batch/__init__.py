"""Many clearance runs of one mechanism, in parallel."""
