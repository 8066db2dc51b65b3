"""What it means: growth, alarms, and the ledger that keeps the wear of months."""
