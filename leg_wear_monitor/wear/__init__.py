"""Wear: Archard's law on worn surfaces, cycle jumps."""
