"""The ends of paths: where each has gone, and what is known of it."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from solvers.points import combined

# Classes of a finished path.
REGULAR, SINGULAR, INFINITE, FAILED = range(4)
#: In place of a condition number: the end is known to all digits of a double.
PRECISE = 0.0
NAMES = ("finite", "singular", "at infinity", "failed")


@dataclass
class Ends:
    """Endpoints of paths, one row each.

    Attributes
    ----------
    x : ndarray, shape (paths, unknowns)
        The endpoint; for an infinite one the direction, scaled to its largest coordinate.
    kind : ndarray of int8
        REGULAR, SINGULAR, INFINITE or FAILED.
    winding : ndarray of int
        0 where no loop was needed.
    condition : ndarray
        Scaled condition number of the Jacobian at a finite end, as far as it makes it uncertain which root that
        is: `PRECISE` for paths that were led there in more than double precision.
    ticks : ndarray of int
    why : dict of int to str
        Row to what happened, for the failed.
    mark : ndarray, complex
        A fingerprint of where a path was at the first radius; not a number for one that has gone straight to its
        end, or was lost before. Two paths with one mark are one path.
    leaving : ndarray of bool
        The path was growing when it was seen last.
    typical : float
        Typical size of the unknowns, which tells what is near the origin.
    """

    x: np.ndarray
    kind: np.ndarray
    winding: np.ndarray
    condition: np.ndarray
    ticks: np.ndarray
    why: dict[int, str] = field(default_factory=dict)
    mark: np.ndarray = None  # type: ignore[assignment]
    leaving: np.ndarray = None  # type: ignore[assignment]
    typical: float = 0.0

    def __post_init__(self) -> None:
        if self.mark is None:
            self.mark = np.full(len(self.x), np.nan, np.complex128)
        if self.leaving is None:
            self.leaving = np.zeros(len(self.x), bool)

    def replace(self, rows: np.ndarray, other: Ends) -> None:
        """Put the results of tracking `rows` again in place of the old ones."""
        for name in ("x", "kind", "winding", "condition", "mark", "leaving"):
            getattr(self, name)[rows] = getattr(other, name)
        self.ticks[rows] += other.ticks
        for row in rows.tolist():
            self.why.pop(row, None)
        self.why.update({int(rows[k]): text for k, text in other.why.items()})


def fingerprints(x: np.ndarray, floor: float) -> np.ndarray:
    """One complex number for each point, made of the logarithms and the directions of its coordinates.

    Each coordinate counts with its own relative error, so that on the way to infinity a large one does not hide
    the small ones in which two paths differ. Coordinates below `floor` count as zero.
    """
    rng = np.random.default_rng(1991)
    first, second = rng.normal(size=(2, x.shape[1])) + 1j * rng.normal(size=(2, x.shape[1]))
    size = np.abs(x) + max(floor, 1e-300)
    return combined(np.log(size), first) + combined(x / size, second)
