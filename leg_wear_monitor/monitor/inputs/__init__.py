"""Input health: order, rates, gaps, units, and whether the gait is that of this leg."""
