"""Health of the node: input silence, clocks, node status, node alarms, log."""
