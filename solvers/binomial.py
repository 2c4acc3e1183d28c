"""Binomial systems: all their solutions, by number, with exact integers.

A mixed cell gives a system c_a x^a + c_b x^b = 0, one binomial for each equation. With coefficients of
modulus one its solutions lie on the unit torus, x_j = exp(2πi φ_j), and the angles (in turns) solve M φ = β
modulo the integers, where the rows of M are the exponents b - a. So φ = M⁻¹(β + k), and k runs over the
integer vectors modulo the lattice M Zⁿ. The Hermite normal form gives |det M| representatives; M⁻¹k modulo
one is a quotient of integers. No power is ever formed, so large exponents do no harm.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class Lattice:
    """What the solutions of x^M = exp(2πi β) have in common for all β.

    Attributes
    ----------
    count : int
        |det M|.
    adjugate : ndarray, shape (n, n), whole numbers
        ``count`` times the inverse of M.
    radices : tuple of int
        Diagonal of the Hermite form: the digits of a solution's number.
    """

    count: int
    adjugate: np.ndarray
    radices: tuple[int, ...]

    @property
    def inverse(self) -> np.ndarray:
        """M⁻¹, shape (n, n): its product with β are the angles of solution 0, in turns."""
        return self.adjugate.astype(np.float64) / self.count

    def turns(self, indices: np.ndarray) -> np.ndarray:
        """What the angles of solutions have beyond those of solution 0, in turns, shape (len(indices), n)."""
        return turns_of([self], np.zeros(len(indices), np.int64), indices)


def turns_of(lattices: Sequence[Lattice], which: np.ndarray, indices: np.ndarray) -> np.ndarray:
    """What the angles of solutions have beyond those of solution 0 of their lattice, in turns, shape (solutions, n).

    `which` are their lattices, `indices` their numbers there.
    """
    adjugates = np.array([lattice.adjugate for lattice in lattices])
    counts = [lattice.count for lattice in lattices]
    small = max(counts, default=1) < 2**31 and np.abs(adjugates).max(initial=0) < 2**31
    dtype = np.int64 if small else object
    radices = np.array([lattice.radices for lattice in lattices], dtype)[which]
    count = np.array(counts, dtype)[:, None]
    adjugates = (adjugates.astype(dtype) % count[:, :, None])[which]
    count, rest = count[which], np.array(indices).astype(dtype)
    turns = np.zeros(adjugates.shape[:2], dtype)
    for j in range(turns.shape[1]):
        turns = (turns + (rest % radices[:, j])[:, None] * adjugates[:, :, j]) % count
        rest = rest // radices[:, j]
    return np.asarray(turns.astype(np.float64) / count.astype(np.float64))


def binomial_lattices(exponents: np.ndarray, counts: np.ndarray) -> list[Lattice]:
    """The lattices of many systems; `counts` are their numbers of solutions, if they are known.

    Parameters
    ----------
    exponents : ndarray of int64, shape (systems, n, n)
    counts : ndarray, shape (systems,)

    Where numbers are small the adjugates are rounded from double precision, and checked.

    Examples
    --------
    >>> [lattice.adjugate.tolist() for lattice in binomial_lattices(np.array([[[2, 1], [1, 1]]]), np.array([1]))]
    [[[1, -1], [-1, 2]]]
    """
    n = exponents.shape[-1]
    sizes = counts.astype(np.float64)[:, None, None]
    adjugates = np.rint(np.linalg.inv(exponents.astype(np.float64)) * sizes)
    fits = n * np.abs(exponents).max(axis=(1, 2), initial=1) * np.abs(adjugates).max(axis=(1, 2), initial=1) < 2**52
    fits &= sizes[:, 0, 0] < 2**52
    whole = np.where(fits[:, None, None], adjugates, 0).astype(np.int64)
    fits &= (exponents @ whole == sizes * np.eye(n)).all(axis=(1, 2))
    return [
        Lattice(count, adjugate, (1,) * n if count == 1 else _radices(matrix)) if good else binomial_lattice(matrix)
        for matrix, adjugate, count, good in zip(exponents, whole, map(int, counts), fits.tolist())
    ]


def _radices(exponents: np.ndarray) -> tuple[int, ...]:
    """The diagonal of the Hermite form of the columns."""
    import flint

    hermite = flint.fmpz_mat(len(exponents), len(exponents), exponents.T.ravel().tolist()).hnf()
    return tuple(abs(int(hermite[i, i])) for i in range(len(exponents)))


def binomial_lattice(exponents: np.ndarray) -> Lattice:
    """The lattice of the system ∏_j x_j^{M_ij} = exp(2πi β_i).

    Parameters
    ----------
    exponents : ndarray of int, shape (n, n)
        The matrix M, not singular.

    Raises
    ------
    ZeroDivisionError
        M is singular.

    Examples
    --------
    >>> square = binomial_lattice(np.array([[2]]))  # x² = -1
    >>> np.exp(2j * np.pi * (square.inverse @ [0.5] + square.turns(np.arange(2)))).round(12).tolist()
    [[1j], [(-0-1j)]]
    """
    import flint

    n = len(exponents)
    matrix = flint.fmpz_mat(n, n, exponents.ravel().tolist())
    determinant = int(matrix.det())
    if determinant == 0:
        raise ZeroDivisionError("the exponents of the binomial system are dependent")
    count = abs(determinant)
    inverse = matrix.inv().tolist()
    adjugate = np.array([[int(v.p) * (count // int(v.q)) for v in row] for row in inverse], object).reshape(n, n)
    return Lattice(count, adjugate, _radices(exponents))
