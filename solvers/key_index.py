"""Which of many points are known, by four numbers for each: an index that fits into memory when the points do not.

A point is known by the values of two random complex functionals. Of a million points some ten thousand pairs agree in
the first real number to a tolerance of 1e-7; that two different ones agree in all four has a chance of about 1e-16.
"""

from __future__ import annotations

import numpy as np

from solvers.points import SAME, combined

#: Sorted runs are merged when the next is not this many times larger: few runs to search, few copies of each key.
GROWTH = 4


class KeyIndex:
    """A set of points, of which only 32 bytes each are kept.

    Parameters
    ----------
    size : int
        Coordinates of a point.
    tolerance : float
        Points nearer than this, relative to their largest coordinate, are one.

    Examples
    --------
    >>> known = KeyIndex(2)
    >>> known.add(np.array([[1.0, 2.0], [3.0, 4.0], [1.0, 2.0 + 1e-12]])).tolist()
    [True, True, False]
    >>> len(known), known.find(np.array([[3.0, 4.0], [5.0, 6.0]])).tolist()
    (2, [1, -1])
    """

    def __init__(self, size: int, tolerance: float = SAME, seed: int = 0) -> None:
        rng = np.random.default_rng([seed, 8])
        functionals = rng.normal(size=(size, 2)) + 1j * rng.normal(size=(size, 2))
        self._functionals = functionals / np.abs(functionals).sum(axis=0)
        self.tolerance = tolerance
        self._runs: list[np.ndarray] = []

    def __len__(self) -> int:
        return sum(run.shape[1] for run in self._runs)

    @property
    def nbytes(self) -> int:
        """Memory that the keys take."""
        return sum(run.nbytes for run in self._runs)

    def find(self, points: np.ndarray) -> np.ndarray:
        """A number for each point, shape (n,): equal for equal points, -1 for unknown ones; good until the next add."""
        keys, reach = self._keys(points)
        found, offset = np.full(len(points), -1, np.int64), 0
        for run in self._runs:
            left = np.flatnonzero(found < 0)
            place = _look_up(run, keys[:, left], reach[left])
            found[left[place >= 0]] = offset + place[place >= 0]
            offset += run.shape[1]
        return found

    def add(self, points: np.ndarray) -> np.ndarray:
        """Add points; True for each that was not known, and is not equal to one before it in the array."""
        fresh = self.find(points) < 0
        rows = np.flatnonzero(fresh)
        if not rows.size:
            return fresh
        keys, reach = self._keys(points[rows])
        order = np.argsort(keys[0], kind="stable")
        run, reach, rows = keys[:, order], reach[order], rows[order]
        repeated = _repeated(run, reach, rows)
        fresh[rows[repeated]] = False
        self._runs.append(np.ascontiguousarray(run[:, ~repeated]))
        while len(self._runs) > 1 and self._runs[-2].shape[1] < GROWTH * self._runs[-1].shape[1]:
            last = self._runs.pop()
            merged = np.concatenate([self._runs.pop(), last], axis=1)
            self._runs.append(merged[:, np.argsort(merged[0], kind="stable")])
        return fresh

    def _keys(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        values = [combined(points, functional) for functional in self._functionals.T]
        keys = np.stack([part for value in values for part in (value.real, value.imag)])
        return keys, self.tolerance * np.abs(points).max(axis=1, initial=0.0)


def _look_up(run: np.ndarray, keys: np.ndarray, reach: np.ndarray) -> np.ndarray:
    """Positions in a sorted run of keys that agree, shape (n,); -1 where there is none."""
    found = np.full(keys.shape[1], -1, np.int64)
    at = np.searchsorted(run[0], keys[0] - reach)
    high = np.searchsorted(run[0], keys[0] + reach, side="right")
    open_ = np.flatnonzero(at < high)
    while open_.size:
        same = (np.abs(run[:, at[open_]] - keys[:, open_]) <= reach[open_]).all(axis=0)
        found[open_[same]] = at[open_[same]]
        at[open_] += 1
        open_ = open_[~same & (at[open_] < high[open_])]
    return found


def _repeated(run: np.ndarray, reach: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Which keys of a sorted run equal that of an earlier row."""
    repeated = np.zeros(run.shape[1], bool)
    for shift in range(1, run.shape[1]):
        first, second = run[:, :-shift], run[:, shift:]
        limit = np.maximum(reach[:-shift], reach[shift:])
        near = second[0] - first[0] <= limit
        if not near.any():
            break
        same = near & (np.abs(second - first) <= limit).all(axis=0)
        later = np.where(rows[shift:] > rows[:-shift], np.arange(shift, run.shape[1]), np.arange(run.shape[1] - shift))
        repeated[later[same]] = True
    return repeated
