"""The directory that a fleet is kept in."""
