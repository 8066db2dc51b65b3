"""Common parts of all runs: drive, run statistics, numerical methods, the Run protocol."""
