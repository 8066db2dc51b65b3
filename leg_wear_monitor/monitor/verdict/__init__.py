"""Verdict: the state of the leg in one word, its reason, and what a person does next."""
