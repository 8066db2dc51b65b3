"""Points of a study computed by workers, and each result stored immediately."""
