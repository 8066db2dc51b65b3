"""Play of a joint, measured by rocking it: angles and the load that reverses in, play out."""
