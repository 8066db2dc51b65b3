"""Modelled wear on disk: entries, log, checksums, recovery."""
