"""References for the clearance regression: joint angles of a leg with given clearances, by simulation."""
