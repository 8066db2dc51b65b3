"""Wear coefficients learned across legs: from measured clearances to the priors of lots and parts."""
