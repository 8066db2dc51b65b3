"""The fleet at a glance: what its page is made of."""
