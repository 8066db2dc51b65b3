"""Hostile users by the hundred: each case in a process of its own, measured, and judged by what it said."""
