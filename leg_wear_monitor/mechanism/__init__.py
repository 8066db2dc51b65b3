"""What the leg is: its description, its compiled arrays, its ideal motion."""
