"""What a simulation found: classes, how they come from run statistics, and how they go out."""
