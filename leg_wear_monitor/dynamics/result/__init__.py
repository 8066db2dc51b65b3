"""Results of a simulation: classes, their computation from run statistics, JSON and tables."""
