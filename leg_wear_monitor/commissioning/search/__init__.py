"""All joints and torques tried, the best chosen, and its rivals."""
