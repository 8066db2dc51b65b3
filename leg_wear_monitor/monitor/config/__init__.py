"""Parameters of the monitor: declaration, bounds, files, agreement with the mechanism."""
