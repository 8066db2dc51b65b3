"""Settings of a study and the points to compute."""
