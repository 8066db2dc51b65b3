"""Verdict: the state of the leg in one word, its reason, and the next action."""
