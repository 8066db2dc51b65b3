"""All that knows numba: kernels, their cache, vectors."""
