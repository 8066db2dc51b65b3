"""The paper's claims as inequalities between statistics of a leg, and in how many legs they hold."""
