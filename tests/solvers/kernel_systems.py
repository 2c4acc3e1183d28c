"""Small homotopies for the tests of the kernel, with ends that are known from elsewhere."""

from __future__ import annotations

import itertools

import numpy as np

from solvers.graph import Builder
from solvers.kernel.engine import Engine, make_engine

#: A generic complex number of modulus one.
GAMMA = np.exp(0.7j)


def katsura(n: int, unit: float = 1.0) -> tuple[Engine, np.ndarray, np.ndarray, np.ndarray]:
    """Katsura's magnetism equations in n + 1 unknowns, measured in any unit: engine, starts, base, direction."""
    b = Builder(n + 1, 2)
    u = [b.multiply(b.constant(1 / unit), b.unknown(k)) for k in range(n + 1)]

    def at(k):
        return u[abs(k)] if abs(k) <= n else b.zero

    equations = [b.sub(b.total(b.multiply(at(l), at(m - l)) for l in range(-n, n + 1)), at(m)) for m in range(n)]
    equations.append(b.sub(b.total([u[0], *(b.multiply(b.constant(2), v) for v in u[1:])]), b.one))
    starts = [b.sub(b.square(u[k]) if k < n else u[k], b.one) for k in range(n + 1)]
    mixed = [
        b.add(b.multiply(b.parameter(0), g), b.multiply(b.parameter(1), f)) for f, g in zip(equations, starts)
    ]
    points = unit * np.array(list(itertools.product(*[[1, -1]] * n, [1])), np.complex128)
    base, direction = np.array([0, 1], complex), np.array([GAMMA, -1])
    return make_engine(b, mixed, (points[:3], base + direction)), points, base, direction


def univariate(degree: int) -> Engine:
    """The polynomial with the parameters as coefficients, constant term first."""
    b = Builder(1, degree + 1)
    value = b.zero
    for k in range(degree, -1, -1):
        value = b.add(b.multiply(value, b.unknown(0)), b.parameter(k))
    return make_engine(b, [value], (np.array([[1.1 + 0.3j]]), np.arange(1, degree + 2)))


def roots(coefficients: np.ndarray) -> np.ndarray:
    """Roots of a polynomial by the eigenvalues of its companion matrix, shape (degree, 1)."""
    return np.roots(np.asarray(coefficients)[::-1])[:, None].astype(complex)


def difference(found: np.ndarray, known: np.ndarray) -> float:
    """Largest distance of a point of either set from the other set."""
    table = np.abs(found[:, None, :] - known[None, :, :]).max(axis=2)
    return float(max(table.min(axis=0).max(), table.min(axis=1).max()))
