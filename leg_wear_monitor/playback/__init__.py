"""Replay of recordings through the monitor."""
