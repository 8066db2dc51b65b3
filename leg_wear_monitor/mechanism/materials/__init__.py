"""Material pairs of joints: bushing, journal and lubricant, every number with its source."""
