"""Joint positions and torques of recordings as time series, and each pair of them."""
