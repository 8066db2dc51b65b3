"""Normal contact laws: a file for each form of force, `laws` the list of all by name."""
