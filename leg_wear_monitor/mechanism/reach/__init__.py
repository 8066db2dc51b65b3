"""How far a mechanism closes and its crank turns, whether or not it works."""
