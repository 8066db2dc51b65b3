"""One clearance joint: its contact force and its contact events, for both formulations."""
