"""The estimate: what signals say of a leg, its drive and its clearances, with covariance and cause."""
