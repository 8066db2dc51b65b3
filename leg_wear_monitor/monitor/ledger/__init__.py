"""Counted wear on disk: entries, log, checksums, recovery."""
