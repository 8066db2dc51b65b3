"""Wear over a life: many gait cycles by cycle jumps, one life or a batch of them."""
