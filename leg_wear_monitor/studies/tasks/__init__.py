"""What is computed for a point."""
