"""The meaning of the estimates: growth, alarms, and the ledger that stores the wear of months."""
