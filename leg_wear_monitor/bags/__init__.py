"""Recordings on disk: MCAP and SQLite readers with salvage, MCAP writer."""
