"""Contact force and contact events of a clearance joint, for both formulations."""
