"""Sets of points that are known only approximately: merging, matching, orbits.

Points are compared through a random functional of their coordinates in units of their size: equal points have equal
values, and the values can be sorted.  A comparison of n points with N known ones costs (n + N) log N, and a few
points that are a million times larger than the others make it no dearer.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import lru_cache
from inspect import Parameter, signature
from typing import Any

import numpy as np

#: Two points nearer than this, relative to their size, are one. Tracked points agree to about 1e-12 times their
#: condition number; distinct roots of the largest systems met were 1e-5 apart.
SAME = 1e-7

#: Pairs that are looked at together.
_BLOCK = 1 << 17
#: Values of a functional are rounded by as much.
ROUNDED = 1e-15
#: Neighbours of a point in a line, above which they are looked for in a plane: of a million points at a distance of
#: 1e-4 there are hundreds, but hardly one in the same square.
CROWDED = 8.0

#: Maps points (n, k), or points and their parameters (m,) or (n, m), to points (n, k).
Symmetry = Callable[..., np.ndarray]


class PointSet:
    """Distinct points, in the order in which they were found.

    Parameters
    ----------
    size : int
        Number of coordinates.
    tolerance : float
        Two points nearer than this, relative, are one.
    seed : int
    floor : float
        Smaller points are compared as if they were of this size: relative to itself nothing equals zero.

    Examples
    --------
    >>> known = PointSet(2)
    >>> known.add(np.array([[1.0, 2.0], [3.0, 4.0], [1.0, 2.0 + 1e-12]])).tolist()
    [0, 1, 0]
    >>> len(known)
    2
    """

    def __init__(self, size: int, tolerance: float = SAME, seed: int = 0, floor: float = 1e-300) -> None:
        self._functional = functional(size, seed)
        self.tolerance, self.floor = tolerance, floor
        self.points = np.zeros((0, size), np.complex128)
        self._keys = np.zeros(0)
        self._order = np.zeros(0, np.int64)

    def __len__(self) -> int:
        return len(self.points)

    def find(self, points: np.ndarray) -> np.ndarray:
        """Numbers of the known points that equal these, shape (n,); -1 where there is none."""
        found = np.full(len(points), -1, np.int64)
        if not len(self.points) or not len(points):
            return found
        size, keys = keys_of(points, self._functional, self.floor)
        for rows, at in windows(self._keys, keys, 2 * self.tolerance):
            numbers = self._order[at]
            same = np.abs(points[rows] - self.points[numbers]).max(axis=1) <= self.tolerance * size[rows]
            found[rows[same][::-1]] = numbers[same][::-1]  # the first one is written last
        return found

    def add(self, points: np.ndarray) -> np.ndarray:
        """Add points that are not known yet; returns the number of each, shape (n,)."""
        numbers = self.find(points)
        new = np.flatnonzero(numbers < 0)
        if new.size:
            fresh = points[new]
            first = first_of_equals(fresh, self.tolerance, self.floor)
            own = first == np.arange(len(fresh))
            position = len(self.points) + np.cumsum(own) - 1
            numbers[new] = position[first]
            self.points = np.concatenate([self.points, fresh[own]])
            keys = np.concatenate([self._keys, keys_of(fresh[own], self._functional, self.floor)[1]])
            order = np.argsort(keys, kind="stable")  # two sorted runs, nearly
            self._order = np.concatenate([self._order, np.arange(len(self._order), len(keys))])[order]
            self._keys = keys[order]
        return numbers


def pairs_of_equals(
    points: np.ndarray, tolerance: np.ndarray | float, seed: int = 0, floor: float = 1e-300
) -> np.ndarray:
    """Pairs (i, j), i < j, of points that agree within a relative tolerance, shape (pairs, 2).

    Points smaller than `floor` are compared as if they were of that size: relative to itself nothing equals zero.
    """
    count, size = points.shape
    if count < 2:
        return np.zeros((0, 2), np.int64)
    relative = np.broadcast_to(np.asarray(tolerance, float), (count,))
    sizes, values = values_of(points, functional(size, seed), floor)
    allowed, reach = relative * sizes, 2 * relative.max() + ROUNDED
    order = np.argsort(values.real, kind="stable")
    if np.diff(values.real[order]).min() > reach:  # no two are neighbours
        return np.zeros((0, 2), np.int64)
    pairs = [np.zeros((0, 2), np.int64)]
    crowded = np.ndim(tolerance) == 0 and count * reach > CROWDED and np.isfinite(values).any()
    for i, j in _in_cells(values, reach) if crowded else _in_line(values.real, order, relative):
        close = np.abs(points[i] - points[j]).max(axis=1) <= np.maximum(allowed[i], allowed[j])
        pairs.append(np.sort(np.stack([i[close], j[close]], axis=1), axis=1))
    found = np.concatenate(pairs)
    return np.unique(found, axis=0) if len(found) else found


def _in_line(
    keys: np.ndarray, order: np.ndarray, relative: np.ndarray
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Pairs of points, block by block, of which the keys are neighbours."""
    for place, at in windows(keys[order], keys[order], 2 * relative[order]):
        other = place != at
        yield order[place[other]], order[at[other]]


def _in_cells(values: np.ndarray, reach: float) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Pairs of points, block by block, of which the values are in one square of this side or in adjacent ones."""
    column, row = (np.floor((part - np.nanmin(part)) / reach) for part in (values.real, values.imag))
    height = np.nanmax(row) + 3
    cells = column * height + row
    order = np.argsort(cells, kind="stable")
    cells = cells[order]
    for step in (0, 1, height - 1, height, height + 1):
        for place, at in windows(cells, cells + step, 0.25):
            other = (place < at) | (step > 0)
            yield order[place[other]], order[at[other]]


@lru_cache(maxsize=64)
def functional(size: int, seed: int = 0) -> np.ndarray:
    """A random functional, of which the real part is compared: points d apart have values at most d apart."""
    rng = np.random.default_rng([seed, 5])
    values = rng.normal(size=size) + 1j * rng.normal(size=size)
    return np.asarray(values / np.abs(values).sum())


def combined(points: np.ndarray, weights: Any) -> np.ndarray:
    """A combination of the coordinates of each point, shape (…, k) to (…).

    Not as a product of matrices: for a tall one BLAS wakes a second thread, which keeps a core busy for a tenth of a
    second afterwards, longer than most searches for equal points take.

    >>> combined(np.array([[1.0, 2.0], [3.0, 4.0]]), np.array([10.0, 1.0])).tolist()
    [12.0, 34.0]
    """
    return np.asarray(np.einsum("...j,j->...", points, weights))


def keys_of(
    points: np.ndarray, functional: np.ndarray, floor: float = 1e-300
) -> tuple[np.ndarray, np.ndarray]:
    """Sizes of points, at least `floor`, and real numbers that are nearly equal where points are, shape (n,) each."""
    size, values = values_of(points, functional, floor)
    return size, values.real


def values_of(
    points: np.ndarray, functional: np.ndarray, floor: float = 1e-300
) -> tuple[np.ndarray, np.ndarray]:
    """Sizes of points, at least `floor`, and a functional at the points in units of their own sizes, shape (n,) each.

    Of two points that are t apart, relative to either, the values are at most 2 t apart.
    """
    size = np.maximum(np.abs(points).max(axis=1, initial=0.0), floor)
    return size, combined(points, functional) / size


def windows(
    keys: np.ndarray, wanted: np.ndarray, reach: np.ndarray | float
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Which sorted keys are within reach of others, block by block: rows of `wanted`, places.

    Rows do not decrease, and each row's places are in order.
    """
    reach = np.broadcast_to(np.asarray(reach) + ROUNDED, wanted.shape)
    order = np.argsort(wanted)  # a million searches in order take a tenth of the time of searches here and there
    low, counts = np.empty((2, len(wanted)), np.int64)
    low[order] = np.searchsorted(keys, (wanted - reach)[order])
    counts[order] = np.searchsorted(keys, (wanted + reach)[order], side="right")
    counts -= low
    ends = np.cumsum(counts)
    first = 0
    while first < len(wanted):
        before = ends[first] - counts[first]
        last = max(int(np.searchsorted(ends, before + _BLOCK, side="right")), first + 1)
        rows = np.repeat(np.arange(first, last), counts[first:last])
        yield rows, np.arange(len(rows)) - (ends - counts - low)[rows] + before
        first = last


def first_of_equals(points: np.ndarray, tolerance: float, floor: float = 1e-300) -> np.ndarray:
    """For each point the number of the first one equal to it, shape (n,)."""
    first = np.arange(len(points))
    for a, b in pairs_of_equals(points, tolerance, floor=floor).tolist():
        first[a] = first[b] = min(first[a], first[b])
    return first


_POSITIONAL = (Parameter.POSITIONAL_ONLY, Parameter.POSITIONAL_OR_KEYWORD)


def _with_parameters(symmetry: Symmetry) -> Symmetry:
    """A symmetry as a function of points and parameters, whether it looks at the latter or not."""
    needed = [p for p in signature(symmetry).parameters.values() if p.default is p.empty and p.kind in _POSITIONAL]
    if len(needed) >= 2:
        return symmetry
    return lambda points, parameters: symmetry(points)


class Group:
    """A finite group that acts on the roots, from generators given as functions on arrays of points.

    Parameters
    ----------
    generators : sequence of functions
        Each maps points (n, k), or points and parameters, to points (n, k): solutions to solutions at the same
        parameters.
    probe : ndarray, shape (1, k)
        A generic solution; its orbit tells the order of the group.
    parameters : ndarray, shape (m,)
        Where it is a solution.

    Raises
    ------
    ValueError
        The images of the probe do not close up: the generators do not generate a small finite group.
    """

    #: Larger groups are not met in kinematics, and would make every comparison slow.
    LARGEST = 1000

    def __init__(
        self, generators: Sequence[Symmetry], probe: np.ndarray, parameters: np.ndarray, tolerance: float = SAME
    ) -> None:
        self.generators = tuple(_with_parameters(generator) for generator in generators)
        self.words: list[tuple[int, ...]] = [()]
        orbit = PointSet(probe.shape[1], tolerance)
        orbit.add(probe)
        waiting: list[tuple[tuple[int, ...], np.ndarray]] = [((), probe)]
        while waiting:
            word, point = waiting.pop(0)
            for k, generator in enumerate(self.generators):
                image = generator(point, parameters)
                if not np.isfinite(image).all():
                    raise ValueError(f"symmetry number {k} is not finite at a solution")
                if orbit.find(image)[0] < 0:
                    orbit.add(image)
                    self.words.append((*word, k))
                    waiting.append((self.words[-1], image))
                if len(self.words) > self.LARGEST:
                    raise ValueError("the symmetries do not close up to a finite group")
        rng = np.random.default_rng(6)
        self._functional = rng.normal(size=probe.shape[1]) + 1j * rng.normal(size=probe.shape[1])

    @property
    def order(self) -> int:
        """Number of elements."""
        return len(self.words)

    def orbits(self, points: np.ndarray, parameters: np.ndarray) -> np.ndarray:
        """All images of solutions at `parameters`, shape (order, n, k)."""
        images: dict[tuple[int, ...], np.ndarray] = {(): points}
        with np.errstate(all="ignore"):
            for word in self.words[1:]:
                images[word] = self.generators[word[-1]](images[word[:-1]], parameters)
        return np.array([images[word] for word in self.words])

    def members(self, points: np.ndarray, parameters: np.ndarray) -> np.ndarray:
        """All distinct members of the orbits of solutions, orbit by orbit, shape (N, k)."""
        everything = PointSet(points.shape[1])
        everything.add(self.orbits(points, parameters).transpose(1, 0, 2).reshape(-1, points.shape[1]))
        return everything.points

    def representatives(self, points: np.ndarray, parameters: np.ndarray) -> np.ndarray:
        """One member of each point's orbit, always the same one, shape (n, k)."""
        if self.order == 1 or not len(points):
            return points
        images = self.orbits(points, parameters)
        keys = combined(images, self._functional).real
        keys[~np.isfinite(images).all(axis=2)] = np.inf
        return images[np.argmin(keys, axis=0), np.arange(len(points))]
