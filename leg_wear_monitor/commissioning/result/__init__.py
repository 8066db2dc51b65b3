"""What commissioning found, as classes, as JSON, as a table, and as a parameter file."""
