"""One leg: its recordings, in the order of time, through its ledger."""
