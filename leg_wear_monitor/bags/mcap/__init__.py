"""MCAP files: read, salvaged, written."""
