"""Which of thousands of boxes are not proved disjoint, in n log n.

Boxes are projected on a line by a random real functional and sorted; only boxes whose shadows overlap are
compared in full. Two boxes that are not reported are disjoint, rounding included.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from solvers.arithmetic.discs import TINY_SIZE, UP, U, gamma, magnitude

#: Pairs compared at once: a few tens of megabytes for a couple of dozen unknowns.
BLOCK = 100_000


def overlapping_pairs(midpoints: np.ndarray, radii: np.ndarray, seed: int = 0) -> np.ndarray:
    """Pairs (i, j), i != j, of polydiscs that are not proved disjoint.

    Parameters
    ----------
    midpoints : ndarray of complex, shape (n, k)
    radii : ndarray of float, shape (n, k)
    seed : int
        For the random functional. It changes the time, never the answer.

    Returns
    -------
    ndarray of int, shape (pairs, 2)
        Each pair once.

    Examples
    --------
    >>> overlapping_pairs(np.array([[0j], [1], [1 + 1e-9j]]), np.full((3, 1), 1e-8)).tolist()
    [[1, 2]]
    """
    n = len(midpoints)
    if n < 2:
        return np.zeros((0, 2), np.intp)
    low, high = _shadows(midpoints, radii, seed)
    order = np.argsort(low, kind="stable")
    low, high = low[order], high[order]
    # The shadows that begin before the shadow of i ends, among those that begin no earlier than it.
    last = np.searchsorted(low, high, side="right")
    pairs = [
        pair[~_disjoint(midpoints, radii, pair)]
        for first, second in _candidates(last, np.arange(n))
        for pair in [np.column_stack([order[first], order[second]])]
    ]
    return np.concatenate([np.zeros((0, 2), np.intp), *pairs])


def _shadows(midpoints: np.ndarray, radii: np.ndarray, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Intervals that hold the real part of a random linear functional on each box."""
    k = midpoints.shape[1]
    rng = np.random.default_rng(seed)
    typical = np.median(np.abs(midpoints), axis=0)
    # Unknowns in other units count alike.
    weight = np.exp(2j * np.pi * rng.random(k)) * rng.uniform(0.5, 1.0, k) / np.where(typical > 0, typical, 1)
    size = np.abs(weight) * UP
    centre = (midpoints @ weight).real
    rounding = gamma(2 * k + 4) * (magnitude(midpoints) @ size) + 4 * U * np.abs(centre)
    half = (radii @ size + rounding) * (1 + 2 * gamma(k + 8)) + TINY_SIZE
    return centre - half, centre + half


def _candidates(last: np.ndarray, first: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Blocks of index pairs (i, j) with i < j < last[i]."""
    count = np.maximum(last - first - 1, 0)
    start = 0
    while start < len(count):
        total = np.cumsum(count[start:])
        stop = start + max(1, int(np.searchsorted(total, BLOCK, side="right")))
        block = count[start:stop]
        i = np.repeat(first[start:stop], block)
        ends = np.cumsum(block)
        j = i + 1 + np.arange(len(i)) - np.repeat(ends - block, block)
        if len(i):
            yield i, j
        start = stop


def _disjoint(midpoints: np.ndarray, radii: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """Whether some coordinate proves two boxes disjoint; the factor covers the roundings of both sides."""
    i, j = pairs[:, 0], pairs[:, 1]
    with np.errstate(over="ignore"):
        distance = np.abs(midpoints[i] - midpoints[j])
    return (distance * (1 - 1e-14) > (radii[i] + radii[j]) * UP + TINY_SIZE).any(axis=1)


def representatives(count: int, pairs: Iterable[tuple[int, int]]) -> np.ndarray:
    """The smallest member of the class of each of `count` items, when the pairs are equal; shape (count,).

    Examples
    --------
    >>> representatives(5, [(1, 3), (3, 4)]).tolist()
    [0, 1, 2, 1, 1]
    """
    parent = np.arange(count)

    def root(item: int) -> int:
        while parent[item] != item:
            parent[item] = parent[parent[item]]
            item = int(parent[item])
        return item

    for a, b in pairs:
        a, b = root(int(a)), root(int(b))
        parent[max(a, b)] = min(a, b)
    return np.array([root(item) for item in range(count)], dtype=np.intp)
