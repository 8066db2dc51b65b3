"""Many legs, many recordings: ledgers brought up to date, tables of their history, an overview."""
