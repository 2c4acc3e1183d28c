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
from dataclasses import replace
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
    "generic_chains",
    "kind_of",
    "path_mirror",
    "path_parameters",
    "path_system",
    "real_chains",
    "root_bound",
    "root_count",
    "united",
]

#: Finite roots with nonzero rotations of general points, by the kind of exponents (`kind_of`).  Found with complex
#: points by two monodromy runs that agree, and at three tasks each where the mirror image of every root is a root;
#: those of two links also by multihomogeneous homotopies whose every path is accounted for
#: (benchmarks/chain_counts.py, which has counted larger kinds, too, by one run).
ROOT_COUNTS: dict[tuple[int, ...], int] = {
    (-1, 1): 2,
    (1, 2): 20,
    (-1, 2): 60,
    (2, 3): 172,
    (1, 3): 190,
    (-1, 3): 370,
    (-2, 3): 636,
    (2, 5): 1948,
    (-2, 5): 3708,
    (-1, 1, 2): 158,
    (1, 2, 3): 1314,
    (-2, 1, 2): 1360,
    (-1, 1, 3): 3432,
    (-1, 2, 3): 4128,
    (-2, 1, 3): 4674,
    (2, 3, 4): 13008,
    (1, 2, 4): 13648,
    (-2, -1, 3): 14502,
    (-2, 2, 3): 23244,
    (-3, 1, 3): 27752,
    (-1, 2, 4): 35992,
    (-2, 1, 4): 39268,
    (2, 3, 5): 44734,
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


@lru_cache(maxsize=2)
def generic_chains(exponents: tuple[int, ...], seed: int = 0, known: int | None = None, jobs: int = 1) -> Solutions:
    """All chains at random displacements of general real points, from one random chain by monodromy.

    Every chain comes with its mirror image.

    Parameters
    ----------
    exponents : tuple of int
    seed : int
    known : int, optional
        The number of chains, where it is known.

    Examples
    --------
    >>> len(generic_chains((1, -2), known=60))
    60
    """
    from solvers import Mirror, monodromy

    system, links = path_system(exponents), len(exponents)
    mirror = Mirror(path_mirror(links).image, lambda d: np.conj(np.roll(d, 2 * links)))
    start = _random_chain(exponents, np.random.default_rng(seed))
    return monodromy(
        system,
        seed,
        start=start,
        jobs=jobs,
        count=known,
        valid=lambda x: is_rotation(x, links),
        mirror=mirror,
        exchanges=lambda rng: _other_order(links, rng),
        trace=False,
    )


def united(one: Solutions, other: Solutions, system: System) -> tuple[Solutions, float]:
    """What two independent searches have found, at the displacements of the first, and how many there should be.

    The estimate is that of capture and recapture: of the roots of the other that arrive at these displacements, the
    first has found the share of all that it has of all.
    """
    from solvers.carry import carry, random_bend
    from solvers.homotopy import parameter_homotopy
    from solvers.points import PointSet
    from solvers.tracking import engine_of

    here, there = one.parameters, other.parameters
    engine = engine_of(parameter_homotopy(system.program, there, here, other.points[:1]))
    moved = carry(engine, other.points, there, here, random_bend(np.random.default_rng(len(one))), ladder=True)
    roots = PointSet(one.points.shape[1])
    roots.add(one.points)
    both = int((roots.find(moved) >= 0).sum())
    roots.add(moved)
    count = np.arange(len(roots))
    return replace(one, points=roots.points, paths=count, orbit=count), len(one) * len(moved) / max(both, 1)


def _other_order(links: int, rng: np.random.Generator) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The points after the first in another order: how unknowns and parameters are exchanged."""
    order = rng.permutation(2 * links)
    return np.r_[: 2 * links, 2 * links + order], np.r_[order, 2 * links + order]


def _random_chain(exponents: tuple[int, ...], rng: np.random.Generator) -> tuple[NDArray[Any], NDArray[Any]]:
    """A root with its displacements: random links and rotations none of which is zero."""
    links = len(exponents)
    z, w = (rng.normal(size=(2, links, 2)) @ [1, 1j])
    t = np.exp(rng.normal(scale=0.3, size=2 * links) + 1j * rng.uniform(-np.pi, np.pi, 2 * links))
    powers = t[:, None] ** np.array(exponents)
    return np.concatenate([z, w, t]), np.concatenate([(powers - 1) @ z, (1 / powers - 1) @ w])


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


def kind_of(exponents: Sequence[int]) -> tuple[int, ...]:
    """The exponents up to what changes neither curves nor counts: order, a common factor, the sign of all.

    The order of the links does not move the tip, and t may be replaced by any power of it, 1/t too: any link may
    be called the input.

    >>> kind_of((2, -4)), kind_of((1, -2)), kind_of((-2, -1))
    ((-1, 2), (-1, 2), (1, 2))
    """
    common = math.gcd(*exponents)
    ordered = sorted(p // common for p in exponents)
    return max(tuple(ordered), tuple(-p for p in reversed(ordered)))


def root_count(exponents: Sequence[int]) -> int | None:
    """The number of finite roots for general points, where it is known.

    >>> root_count((1, -1)), root_count((2, 1)), root_count((7, 3))
    (2, 20, None)
    """
    return ROOT_COUNTS.get(kind_of(exponents))


def root_bound(exponents: Sequence[int]) -> int:
    """A proved bound of the number of roots: the mixed volume of equations with few terms.

    Z0 and its partner are kept as unknowns, Z0 + Σ_k Z_k t_j^{p_k} = P_j for all 2N + 1 points, and t_1 = 1 takes
    the place of their difference to the first point, which `path_system` forms: 4N + 2 equations that bound the
    isolated roots (D. N. Bernshtein, The number of roots of a system of equations, Funct. Anal. Appl. 9, 1975).
    Every design is such a root: chains with fewer links pass fewer points, so that no Z vanishes for general ones.

    >>> root_bound((1, 2)), root_bound((1, 2, 3))
    (74, 9470)
    """
    from solvers.mixed_cells import mixed_volume

    rates = [0, *exponents]
    links, points = len(rates), 2 * len(rates) - 1
    unknowns = 2 * links + points - 1
    supports = []
    for j in range(points):
        for first, sign in ((0, 1), (links, -1)):
            terms = np.zeros((links + 1, unknowns), np.int64)  # the last row is the constant P_j
            terms[range(links), range(first, first + links)] = 1
            if j:
                terms[:links, 2 * links + j - 1] = [sign * rate for rate in rates]
            supports.append(terms)
    return mixed_volume(supports)
