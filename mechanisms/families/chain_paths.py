"""Coupled serial chains of given gear ratios whose tip passes 2N + 1 points: every one of them.

With rational ratios R_k = p_k/q the rotations enter Eq. (3) of V. Krovi, G. K. Ananthasuresh, V. Kumar,
Kinematic and kinetostatic synthesis of planar coupled serial chain mechanisms, through t_j = e^{iφ_j/q} alone:

    Σ_k Z_k (t_j^{p_k} − 1) = P_j − P_1,      Σ_k W_k (t_j^{−p_k} − 1) = conj(P_j − P_1),      j = 2 … 2N + 1,

where W_k stands for the conjugate of Z_k.  These are 4N polynomial equations for the 2N links and the 2N
rotations. Each t_j is an unknown of its own: links eliminated would bring in solutions that are none (equal
rotations, for which the determinants vanish).  The real chains are those with W = conj(Z) and |t_j| = 1.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from mechanisms.families.chain import SerialChain
from mechanisms.families.reality import Mirror, exchange, real_roots
from mechanisms.task import TaskError

if TYPE_CHECKING:
    from solvers import Solutions, System

__all__ = [
    "ROOT_COUNTS",
    "chains_of",
    "path_mirror",
    "path_parameters",
    "path_system",
    "real_chains",
    "root_count",
]

#: Finite roots with nonzero rotations of general points, by the whole exponents in order: neither the order of
#: the links nor the sign of all exponents changes the number.  Found with complex points by multihomogeneous
#: homotopies whose every path is accounted for (benchmarks/chain_counts.py).
ROOT_COUNTS: dict[tuple[int, ...], int] = {
    (-1, 1): 2,
    (1, 2): 20,
    (-2, 1): 60,
    (1, 3): 190,
    (-3, 1): 370,
    (-3, 2): 636,
    (2, 5): 1948,
    (-5, 2): 3708,
}
#: A rotation of this size is zero: clearing the denominators t_j^p brought it in.
NOT_A_ROTATION = 1e-6


@lru_cache(maxsize=32)
def path_system(exponents: tuple[int, ...]) -> System:
    """The polynomials for N links with the given whole exponents (the first is q).

    Unknowns Z1 … ZN, W1 … WN, t2 … tM; parameters the displacements d_j, then their conjugates e_j.

    Examples
    --------
    >>> path_system((1, 2)).size
    (8, 8)
    """
    from sympy import symbols

    from solvers import System

    links, moves = len(exponents), 2 * len(exponents)
    if 0 in exponents or len(set(exponents)) < links:
        raise TaskError("the ratios 0 and 1 and equal ratios leave a link without use; give N different ratios")
    z, w = symbols(f"Z1:{links + 1}"), symbols(f"W1:{links + 1}")
    t, d, e = symbols(f"t2:{moves + 2}"), symbols(f"d2:{moves + 2}"), symbols(f"e2:{moves + 2}")
    low, high = min(0, *exponents), max(0, *exponents)
    equations = []
    for j in range(moves):
        turned, back = t[j] ** -low, t[j] ** high
        equations.append(sum(z[k] * (t[j] ** (p - low) - turned) for k, p in enumerate(exponents)) - d[j] * turned)
        equations.append(sum(w[k] * (t[j] ** (high - p) - back) for k, p in enumerate(exponents)) - e[j] * back)
    return System(equations, [*z, *w, *t], [*d, *e], groups=[z, w, *([x] for x in t)])


def paths_to_track(exponents: Sequence[int]) -> int:
    """The multihomogeneous Bézout number: C(2N, N) times the 2N-th power of the degree in a rotation.

    >>> paths_to_track((1, 2)), paths_to_track((1, 2, 3))
    (96, 14580)
    """
    links, degree = len(exponents), max(0, *exponents) - min(0, *exponents)
    return math.comb(2 * links, links) * degree ** (2 * links)


def path_parameters(points: Sequence[complex] | NDArray[Any]) -> tuple[NDArray[np.complex128], float]:
    """Displacements and conjugates in units of the path's size, and that size."""
    moves = np.array(points[1:], dtype=complex) - points[0]
    size = float(np.abs(moves).max())
    scaled = moves / size
    return np.concatenate([scaled, scaled.conj()]), size


def path_mirror(links: int) -> Mirror:
    """What conjugation of a chain does to a root: Z and W are exchanged, t_j becomes 1/conj(t_j)."""
    return exchange([*range(links, 2 * links), *range(links)])


def is_rotation(points: NDArray[Any], links: int) -> NDArray[np.bool_]:
    """Roots whose rotations are none of them zero."""
    return np.abs(points[:, 2 * links :]).min(axis=1, initial=np.inf) > NOT_A_ROTATION


def chains_of(
    root: NDArray[Any], exponents: Sequence[int], base: complex, size: float
) -> tuple[SerialChain, NDArray[np.float64]]:
    """The chain of a real root and the input angles at its points, the first 0.

    φ_j = q·arg t_j, in (−qπ, qπ]: q turns of the input bring the chain back.
    """
    links, q = len(exponents), exponents[0]
    z = (root[:links] + np.conj(root[links : 2 * links])) / 2 * size
    phi = np.r_[0.0, q * np.angle(root[2 * links :])]
    ratios = tuple(p / q for p in exponents)
    return SerialChain(base - z.sum(), tuple(z), ratios), phi


def real_chains(
    solutions: Solutions, exponents: Sequence[int], points: Sequence[complex] | NDArray[Any]
) -> Iterator[tuple[int, SerialChain, NDArray[np.float64]]]:
    """Every real chain among the roots: (root, chain, input angles)."""
    links = len(exponents)
    _, size = path_parameters(points)
    real = real_roots(solutions.points, path_mirror(links)) & is_rotation(solutions.points, links)
    for root in np.flatnonzero(real):
        yield int(root), *chains_of(solutions.points[root], exponents, points[0], size)


def root_count(exponents: Sequence[int]) -> int | None:
    """The number of finite roots for general points, where it is known.

    >>> root_count((1, -1)), root_count((2, 1)), root_count((7, 3))
    (2, 20, None)
    """
    known = ROOT_COUNTS.get(tuple(sorted(exponents)))
    return ROOT_COUNTS.get(tuple(sorted(-p for p in exponents)), None) if known is None else known
