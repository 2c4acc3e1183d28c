"""Mixed cells and mixed volumes, by following cells while the lifting moves.

The mixed volume of the supports A_1, …, A_n bounds the number of isolated solutions with no zero coordinate
(Bernshtein 1975). It is the sum of the volumes of the mixed cells of a fine mixed subdivision, induced by a
generic lifting. A mixed cell is an edge (a_i, b_i) of each support; it belongs to the lifting w when, with
the inner normal η that makes each edge level, every other point γ of A_i lies above its edge: w(γ) + ⟨γ, η⟩ >
w(a_i) + ⟨a_i, η⟩.

While w moves on a line, a cell lives until such an inequality becomes an equality; then it is replaced by the
one or two cells that use γ instead of a_i or b_i (Jensen, "Tropical homotopy continuation", 2016). Here one
equation is brought in at a time: its support starts as a dilated simplex that holds it, its own points are
lowered from plus to minus infinity, and the simplex is left behind. Where two cells merge into one, a rule
says which of the two goes on, so that no list of visited cells is kept. All numbers are integers
(:mod:`solvers.mixed_cell_walk`).
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from solvers.mixed_cell_walk import TIED, TOO_LARGE, TOO_LONG, adjugate, push, walk

#: Bits of the random liftings. Two walls meet with probability about 2^-bits for each pair of walls compared.
_LIFTING_BITS = 26
#: Up to so many unknowns the plain version is faster than loading the compiled one: half a second in a fresh
#: process, ten milliseconds where the tracker's kernel has set numba to work already.
SMALL_SYSTEM, TINY_SYSTEM = 8, 2
#: Determinants of matrices so small, by Hadamard's bound, come out of an elimination in double precision with an error
#: below n² 2^(n-1) 2^-53 times the bound, a hundredth.
SMALL_MATRIX, SMALL_VOLUME = 12, 2**28
#: Liftings tried before giving up.
_ATTEMPTS = 20


class MixedCellError(ArithmeticError):
    """No generic lifting was found, or the cells lose volume: an internal check failed."""


class TooManyCells(ValueError):
    """There are more mixed cells on the way than the caller has patience for."""


@dataclass(frozen=True, eq=False)
class MixedCells:
    """The mixed cells of a fine mixed subdivision.

    Attributes
    ----------
    supports : tuple of ndarray, each of shape (points, n), int64
    liftings : tuple of ndarray, each of shape (points,), int64
    edges : ndarray, shape (cells, n, 2), int64
        For each cell and each support the numbers of the two points of its edge.
    volumes : ndarray, shape (cells,), object (Python integers)
    fade : float
        Toric paths end where a coefficient is exp(−fade·lifting) of its size: 0, except for stable cells
        (:mod:`solvers.stable_cells`), where constants that the equations do not have stay small.
    """

    supports: tuple[np.ndarray, ...]
    liftings: tuple[np.ndarray, ...]
    edges: np.ndarray
    volumes: np.ndarray
    fade: float = 0.0

    @property
    def steps(self) -> np.ndarray:
        """From the first to the second point of each edge, shape (cells, n, n)."""
        return _steps(self.supports, self.edges)

    @property
    def mixed_volume(self) -> int:
        """The sum of the volumes."""
        return int(sum(self.volumes.tolist()))

    def __len__(self) -> int:
        return len(self.edges)

    def __repr__(self) -> str:
        return f"MixedCells({len(self)} cells, mixed volume {self.mixed_volume})"


def mixed_volume(supports: Sequence[Any]) -> int:
    """The mixed volume of n supports in n unknowns.

    Parameters
    ----------
    supports : sequence of n integer arrays, each of shape (points, n)

    Examples
    --------
    >>> mixed_volume([[[0, 0], [2, 0], [0, 2]], [[0, 0], [1, 1]]])
    4
    """
    return mixed_cells(supports).mixed_volume


def mixed_cells(
    supports: Sequence[Any],
    seed: int = 0,
    compiled: bool | None = None,
    patience: int = 2**60,
    raised: Sequence[Any] | None = None,
) -> MixedCells:
    """The mixed cells for a random lifting.

    Parameters
    ----------
    supports : sequence of n integer arrays, each of shape (points, n)
    seed : int
        Seed of the lifting.
    compiled : bool, optional
        Whether to use the compiled version; by default for all but the smallest systems. The cells are the same.
    patience : int
        How many cells may be looked at in bringing in one equation.
    raised : sequence of n integer arrays, each of shape (points,), optional
        What is added to the random lifting of each point, of supports that are sorted and have no repetitions.
        Where numbers grow beyond 63 bits then, the compiled version gives up.

    Raises
    ------
    ValueError
        The supports are not n arrays with n columns.
    TooManyCells
        The patience is exhausted.
    OverflowError
        With raised liftings numbers beyond 63 bits are needed.
    MixedCellError
        Twenty liftings in a row were not generic: a mistake in this program.

    Examples
    --------
    >>> mixed_cells([[[0, 0], [1, 0], [0, 1], [1, 1]], [[0, 0], [1, 0], [0, 1], [1, 1]]]).mixed_volume
    2
    """
    points = _checked(supports)
    n = len(points)
    if compiled is None:
        compiled = _compiled.cache_info().currsize > 0 or n > (TINY_SYSTEM if _numba_is_warm() else SMALL_SYSTEM)
    order = _order(points)
    ordered = [points[k] for k in order]
    higher = None if raised is None else [np.asarray(raised[k], np.int64) for k in order]
    for attempt in range(_ATTEMPTS):
        rng = np.random.default_rng([seed, attempt])
        found = _follow(ordered, rng, compiled, patience, higher)
        if found is None:
            continue
        edges, liftings = found
        back = np.argsort(order)
        edges = edges[:, back]
        volumes = _volumes(points, edges)
        return MixedCells(tuple(points), tuple(liftings[k] for k in back), edges, volumes)
    raise MixedCellError(f"{_ATTEMPTS} random liftings of {n} supports were not generic")


def _checked(supports: Sequence[Any]) -> list[np.ndarray]:
    points = [np.asarray(s) for s in supports]
    n = len(points)
    for i, array in enumerate(points):
        if array.size == 0:
            array = points[i] = np.zeros((0, n), np.int64)
        if array.ndim != 2 or array.shape[1] != n:
            raise ValueError(f"support {i} has the shape {array.shape}; {n} supports need {n} columns each")
        if not np.issubdtype(array.dtype, np.integer):
            raise ValueError(f"support {i} holds numbers that are not integers")
    return [_sorted(array.astype(np.int64)) for array in points]


def _sorted(rows: np.ndarray) -> np.ndarray:
    """Distinct rows in increasing order."""
    rows = rows[np.lexsort(rows.T[::-1])]
    new = np.ones(len(rows), bool)
    new[1:] = (rows[1:] != rows[:-1]).any(axis=1)
    return rows[new]


def _order(points: list[np.ndarray]) -> list[int]:
    """Supports of low degree first, then those with few points: their cells are few, and stay few."""

    def size(k: int) -> tuple[int, int, int]:
        spread = (points[k] - points[k].min(axis=0)).sum(axis=1) if len(points[k]) else np.zeros(1)
        return int(spread.max()), len(points[k]), k

    return sorted(range(len(points)), key=size)


def _follow(
    points: list[np.ndarray],
    rng: np.random.Generator,
    compiled: bool,
    patience: int,
    raised: list[np.ndarray] | None = None,
) -> Any:
    """Edges of the cells and the liftings, or None if the lifting was not generic."""
    n = len(points)
    if n == 0 or any(len(p) < 2 for p in points):
        return np.zeros((0, n, 2), np.int64), [np.zeros(len(p), np.int64) for p in points]
    shifted = [p - p.min(axis=0) for p in points]
    degrees = [int(p.sum(axis=1).max()) for p in shifted]
    # Layout of all points: for each support n + 1 vertices of a simplex, then its own points.
    first = np.cumsum([0] + [n + 1 + len(p) for p in points])
    table = np.zeros((first[-1], n), np.int64)
    heights = rng.integers(0, 2**_LIFTING_BITS, size=first[-1])
    simplex = np.vstack([np.zeros((1, n), np.int64), np.eye(n, dtype=np.int64)])
    for k in range(n):
        table[first[k] : first[k] + n + 1] = simplex
        table[first[k] + n + 1 : first[k + 1]] = shifted[k]
        if raised is not None:
            heights[first[k] + n + 1 : first[k + 1]] += raised[k]
        # The one cell of n simplices: vertex 0 and vertex k + 1 low, the others far above.
        high = [j for j in range(1, n + 1) if j != k + 1]
        heights[first[k] + np.array(high, dtype=np.int64)] += 2 ** (_LIFTING_BITS + 3)
    cells = np.array([[first[k], first[k] + k + 1] for k in range(n)], np.int64).reshape(1, 2 * n)
    for stage in range(n):
        vertices = slice(first[stage], first[stage] + n + 1)
        table[vertices] = degrees[stage] * simplex
        heights[vertices] *= degrees[stage]
        moving = np.zeros(first[-1], np.int64)
        moving[first[stage] + n + 1 : first[stage + 1]] = -1
        low = np.array([first[k] + (n + 1 if k < stage else 0) for k in range(n)])
        high_end = np.array([first[k + 1] if k <= stage else first[k] + n + 1 for k in range(n)])
        outcome, cells = _stage(
            table, heights, moving, low, high_end, cells, stage, compiled, patience, raised is None
        )
        if outcome == TOO_LARGE:
            raise OverflowError(f"the raised liftings of {n} supports need numbers of more than 63 bits")
        if outcome == TOO_LONG:
            raise TooManyCells(f"more than {patience} cells are met on the way to the mixed cells of {n} supports")
        if outcome == TIED:
            return None
    edges = cells.reshape(-1, n, 2) - (first[:-1] + n + 1)[None, :, None]
    return edges, [heights[first[k] + n + 1 : first[k + 1]] for k in range(n)]


def _stage(
    table: Any,
    heights: Any,
    moving: Any,
    low: Any,
    high: Any,
    cells: Any,
    stage: int,
    compiled: bool,
    patience: int,
    exactly: bool,
) -> Any:
    if compiled:
        bounds = float(max(1, np.abs(table).max())), float(max(1, np.abs(heights).max()))
        outcome, found = _compiled()(table, heights, moving, low, high, cells.copy(), stage, *bounds, patience)
        if outcome != TOO_LARGE or not exactly:
            return outcome, found
    # Python integers do not overflow, and outside compiled code they are faster than NumPy's.
    exact = [array.astype(object) for array in (table, heights, moving)]
    return walk(exact[0], exact[1], exact[2], low, high, cells.copy(), stage, 0.0, 0.0, patience)


def _numba_is_warm() -> bool:
    return "solvers.kernel.tracker" in sys.modules


@cache
def _compiled() -> Any:
    import numba
    from numba.extending import register_jitable

    register_jitable(adjugate)
    register_jitable(push)
    return numba.njit(cache=True, error_model="numpy")(walk)


def _steps(points: Sequence[np.ndarray], edges: np.ndarray) -> np.ndarray:
    n = len(points)
    steps = [p[b] - p[a] for p, (a, b) in zip(points, edges.transpose(1, 2, 0))]
    return np.array(steps, np.int64).reshape(n, -1, n).transpose(1, 0, 2)


def _volumes(points: list[np.ndarray], edges: np.ndarray) -> np.ndarray:
    import flint

    n = len(points)
    steps = _steps(points, edges)
    volumes = np.empty(len(edges), object)
    if n <= SMALL_MATRIX and np.linalg.norm(steps, axis=2).prod(axis=1).max(initial=0) < SMALL_VOLUME:
        volumes[:] = [abs(round(v)) for v in np.linalg.det(steps).tolist()]
        return volumes
    for k, matrix in enumerate(steps.reshape(len(edges), n * n).tolist()):
        volumes[k] = abs(int(flint.fmpz_mat(n, n, matrix).det()))
    return volumes
