"""Roots that are too many for memory: the design unknowns of each in a run file, the others recovered when asked for.

A mechanism has few unknowns that make the design and many that tell only where its links are in each pose. The latter
follow from the former, by linear equations mostly, so they are not worth storing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from solvers.legs import Leg
from solvers.store import RunFile

#: ``restore(kept, parameters)``: whole roots (n, unknowns) from stored columns (n, kept) at parameters (m,).
Restore = Callable[[np.ndarray, np.ndarray], np.ndarray]
#: Roots that are in memory at once: enough for all lanes of all workers many times over.
BATCH = 8192


class StoredRoots:
    """Roots at one place in parameter space, in a run file.

    Attributes
    ----------
    parameters : ndarray, shape (parameters,)
    keep : list of int
        The unknowns that are stored.
    complete : bool or None
        Whether the number of roots is the known one; None where none is known.
    evidence : str
    history : list of Leg
    """

    def __init__(
        self, run: RunFile, stage: str, parameters: np.ndarray, keep: Sequence[int], restore: Restore | None
    ) -> None:
        self.run, self.stage, self.parameters = run, stage, parameters
        self.keep, self.restore = list(keep), restore
        self.complete: bool | None = None
        self.evidence = ""
        self.history: list[Leg] = []
        self._numbers: list[int] = []
        self._ends = [0]

    def __len__(self) -> int:
        return self._ends[-1]

    def __repr__(self) -> str:
        return f"StoredRoots({len(self)} roots, {len(self.keep)} numbers each, in {str(self.run.path)!r})"

    def note(self, number: int, rows: int) -> None:
        """The next rows are in the run file's chunk of this number."""
        if rows:
            self._numbers.append(number)
            self._ends.append(self._ends[-1] + rows)

    def kept(self, start: int = 0, stop: int | None = None) -> np.ndarray:
        """The stored columns of some roots, shape (stop - start, kept)."""
        stop = len(self) if stop is None else min(stop, len(self))
        parts = [np.zeros((0, len(self.keep)), np.complex128)]
        for k in range(int(np.searchsorted(self._ends, start, side="right")) - 1, len(self._numbers)):
            first = self._ends[k]
            if first >= stop:
                break
            chunk = self.run.chunk(self.stage, self._numbers[k])["kept"]
            parts.append(chunk[max(start - first, 0) : stop - first])
        return np.concatenate(parts)

    def points(self, start: int = 0, stop: int | None = None) -> np.ndarray:
        """Some roots with all their unknowns, shape (stop - start, unknowns)."""
        kept = self.kept(start, stop)
        return kept if self.restore is None else np.asarray(self.restore(kept, self.parameters), np.complex128)

    def batches(self, size: int = BATCH) -> Iterator[np.ndarray]:
        """All roots, so many at a time."""
        for start in range(0, len(self), size):
            yield self.points(start, start + size)


def columns_of(keep: Sequence[Any] | None, unknowns: Sequence[Any]) -> list[int]:
    """Numbers of unknowns that are given as symbols, names or numbers; all of them, if None.

    Raises
    ------
    ValueError
        One is none of the unknowns.
    """
    if keep is None:
        return list(range(len(unknowns)))
    names = {str(name): k for k, name in enumerate(unknowns)}
    columns = []
    for given in keep:
        column = given if isinstance(given, int) else names.get(str(given), -1)
        if not 0 <= column < len(unknowns):
            raise ValueError(f"there is no unknown {given!r} to be kept; there are {', '.join(names)}")
        columns.append(column)
    return columns
