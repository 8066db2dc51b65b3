"""SQLite recordings (.db3)."""
