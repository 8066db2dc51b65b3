"""What a replay found: classes, and how they go out as JSON and tables and come back from a file."""
