"""Newton steps at many points in one compiled loop: values, sizes of terms, elimination. See :mod:`solvers.local`."""

from __future__ import annotations

import numpy as np
from numba import njit

from solvers.kernel.sweep import BLOCK, run, run_sizes


@njit(nogil=True, cache=True, error_model="numpy")
def newton_steps(code, still, points, weights, F, J, pattern, phases, step, size, condition):
    """One Newton step at each point, in units of the unknowns and of the sizes of the terms.

    Parameters
    ----------
    code : ndarray, shape (instructions, 4)
    still : ndarray of complex, shape (inputs - unknowns,)
        Parameters, velocities and constants.
    points : ndarray of complex, shape (n, unknowns)
    weights : ndarray of float, shape (n, unknowns)
        Units of the unknowns.
    F, J : ndarray of int
        Slots of the equations and of the entries of the Jacobian.
    pattern : ndarray of int, shape (entries, 2)
    phases : ndarray of complex, shape (unknowns,)
        The right-hand side that the condition is estimated with.
    step : ndarray of complex, shape (n, unknowns)
    size, condition : ndarray of float, shape (n,)
        Written; infinite where the Jacobian is singular.
    """
    n, unknowns = points.shape
    inputs = unknowns + still.shape[0]
    slots = np.empty((inputs + code.shape[0], BLOCK), np.complex128)
    whole = np.empty((inputs + code.shape[0], BLOCK))
    for k in range(still.shape[0]):
        slots[unknowns + k, :] = still[k]
        whole[unknowns + k, :] = abs(still[k])
    matrix, right = np.empty((unknowns, unknowns), np.complex128), np.empty((2, unknowns), np.complex128)
    rows = np.empty(unknowns)
    for first in range(0, n, BLOCK):
        width = min(BLOCK, n - first)
        for j in range(width):
            for k in range(unknowns):
                slots[k, j] = points[first + j, k]
                whole[k, j] = weights[first + j, k]
        run(code, slots, inputs, width)
        run_sizes(code, whole, inputs, width)
        for j in range(width):
            for i in range(unknowns):
                rows[i] = 1 / max(whole[F[i], j], 1e-300)
                right[0, i] = slots[F[i], j] * rows[i]
                right[1, i] = phases[i]
            matrix[:] = 0
            for e in range(pattern.shape[0]):
                i, k = pattern[e, 0], pattern[e, 1]
                matrix[i, k] = slots[J[e], j] * (weights[first + j, k] * rows[i])
            norm = 1.0  # at a multiple root whole rows vanish: against one, the size of the terms, that shows
            for i in range(unknowns):
                total = 0.0
                for k in range(unknowns):
                    total += _modulus(matrix[i, k])
                norm = max(norm, total)
            if not _solve(matrix, right):
                right[:] = np.inf
            largest, estimate = 0.0, 0.0
            for i in range(unknowns):
                largest, estimate = max(largest, _modulus(right[0, i])), max(estimate, _modulus(right[1, i]))
                step[first + j, i] = right[0, i] * weights[first + j, i]
            size[first + j], condition[first + j] = largest, norm * estimate


@njit(inline="always")
def _modulus(z):
    """Ten times as fast as abs, which guards against overflow: these numbers are in their own units."""
    return np.sqrt(z.real * z.real + z.imag * z.imag)


@njit(nogil=True, error_model="numpy")
def _solve(matrix, right):
    """Solve for both right-hand sides in place, by elimination with pivoting; whether the solutions are finite."""
    n = matrix.shape[0]
    for k in range(n):
        pivot, best = k, 0.0
        for i in range(k, n):
            size = abs(matrix[i, k].real) + abs(matrix[i, k].imag)
            if size > best:
                pivot, best = i, size
        if not 0.0 < best < np.inf:
            return False
        if pivot != k:
            for c in range(k, n):
                matrix[k, c], matrix[pivot, c] = matrix[pivot, c], matrix[k, c]
            for s in range(2):
                right[s, k], right[s, pivot] = right[s, pivot], right[s, k]
        inverse = 1 / matrix[k, k]
        matrix[k, k] = inverse
        for i in range(k + 1, n):
            if matrix[i, k] != 0:
                factor = matrix[i, k] * inverse
                for c in range(k + 1, n):
                    matrix[i, c] -= factor * matrix[k, c]
                for s in range(2):
                    right[s, i] -= factor * right[s, k]
    finite = True
    for k in range(n - 1, -1, -1):
        for s in range(2):
            total = right[s, k]
            for c in range(k + 1, n):
                total -= matrix[k, c] * right[s, c]
            right[s, k] = total * matrix[k, k]
            finite &= np.isfinite(right[s, k].real) and np.isfinite(right[s, k].imag)
    return finite
