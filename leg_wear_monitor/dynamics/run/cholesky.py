"""Symmetric positive definite systems with a known envelope."""

import math

from leg_wear_monitor.kernel import kernel


@kernel
def factorise(first, matrix):
    """Cholesky factor L of a matrix (m, m), in place in its lower triangle.

    ``first`` (m,) is the first column of each row's envelope. The diagonal then contains 1 / L_ii.
    Returns False if the matrix is not positive definite.
    """
    for i in range(matrix.shape[0]):
        for j in range(first[i], i):
            total = matrix[i, j]
            for k in range(max(first[i], first[j]), j):
                total -= matrix[i, k] * matrix[j, k]
            matrix[i, j] = total * matrix[j, j]
        pivot = matrix[i, i]
        for k in range(first[i], i):
            pivot -= matrix[i, k] * matrix[i, k]
        if not pivot > 0.0:
            return False
        matrix[i, i] = 1.0 / math.sqrt(pivot)
    return True


@kernel
def substitute(first, factor, out_x):
    """Solve L L^T x = b (m,) in place, with the factor (m, m) of `factorise`."""
    m = factor.shape[0]
    for i in range(m):
        total = out_x[i]
        for k in range(first[i], i):
            total -= factor[i, k] * out_x[k]
        out_x[i] = total * factor[i, i]
    for i in range(m - 1, -1, -1):
        out_x[i] *= factor[i, i]
        for k in range(first[i], i):
            out_x[k] -= factor[i, k] * out_x[i]
