"""Homotopies: a system whose parameters move on a line.

Everything that is tracked in this package is a :class:`Homotopy`: its program H(x; q), the parameters q where the
known solutions lie, the parameters where solutions are wanted, and the known solutions, generated when asked for.
The path variable r runs from 1 (start) to 0 (target): q(r) = target + r·(start − target). Near the target r is
small, so floating point resolves the end of a path as finely as is needed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from solvers.graph import Builder
from solvers.tape import Program

#: Start points at which the order of elimination must be safe.
STARTS_SAMPLED = 4


class StartPoints(Protocol):
    """Start solutions by number: none is stored, so ten million cost nothing until they are tracked."""

    @property
    def count(self) -> int:
        """The number of start solutions."""
        ...

    def points(self, indices: np.ndarray) -> np.ndarray:
        """The solutions with these numbers, shape (len(indices), unknowns)."""
        ...


@dataclass(frozen=True)
class Listed:
    """Start solutions that are known one by one, for example the result of an earlier solve.

    They are `whole` if they are all there are, so that a path that winds m times round its end comes with m − 1 others.
    """

    array: np.ndarray
    whole: bool = False

    @property
    def count(self) -> int:
        return len(self.array)

    def points(self, indices: np.ndarray) -> np.ndarray:
        return self.array[indices]


@dataclass(frozen=True, eq=False)
class Homotopy:
    """A system whose parameters move from `start` to `target`.

    Attributes
    ----------
    program : Program
        Output "F": the equations H(x; q). If there are "J" and "Ft" as well, they need not be worked out.
    start, target : ndarray, shape (parameters,)
    starts : StartPoints
        Solutions at `start`.
    moving : sequence of int or None
        The parameters that differ between start and target (all, if None).
    unknown_scale : ndarray, shape (unknowns,)
        The user's unknowns are these times the homotopy's.
    name : str
        For the ledger: "total degree", "parameter homotopy", …
    seed : int
    smallest : float
        The smallest r at which the endgame still looks. Parameters that go to zero are as exact there as anywhere;
        others drown in their rounding at 1e-16.
    reason : str
        Why this start and no other, in words.
    """

    program: Program
    start: np.ndarray
    target: np.ndarray
    starts: StartPoints
    moving: Sequence[int] | None = None
    unknown_scale: np.ndarray | None = None
    name: str = "homotopy"
    seed: int = 0
    kind: str = field(default="line")
    smallest: float = 1e-13
    reason: str = ""

    @property
    def direction(self) -> np.ndarray:
        """dq/dr."""
        return self.start - self.target

    @property
    def complete(self) -> bool:
        """Whether there is a path to every root."""
        return not isinstance(self.starts, Listed) or self.starts.whole

    def builder(self) -> tuple[Builder, list[int]]:
        """A fresh graph that holds the equations."""
        builder = Builder(self.program.unknowns, self.program.parameters)
        unknowns = [builder.unknown(k) for k in range(self.program.unknowns)]
        parameters = [builder.parameter(k) for k in range(self.program.parameters)]
        return builder, self.program.embed(builder, unknowns, parameters)

    def samples(self, count: int = 3) -> tuple[np.ndarray, np.ndarray]:
        """Typical points and parameters, where pivots are tried: start points and random points on the way."""
        rng = np.random.default_rng(self.seed + 77)
        total = self.starts.count  # from first to last: lists are often put together of unlike parts
        known = self.starts.points(np.unique(np.linspace(0, total - 1, min(STARTS_SAMPLED, total)).astype(np.int64)))
        size = np.abs(known).max() if known.size else 1.0
        shape = (count, self.program.unknowns)
        random = size * (rng.normal(size=shape) + 1j * rng.normal(size=shape))
        r = np.concatenate([np.ones(len(known)), rng.uniform(0.2, 0.8, count)])
        return np.concatenate([known, random]), self.target + r[:, None] * self.direction

    def in_user_units(self, points: np.ndarray) -> np.ndarray:
        """Points of the homotopy as values of the user's unknowns."""
        return points if self.unknown_scale is None else points * self.unknown_scale

    def __repr__(self) -> str:
        return f"Homotopy({self.name}, {self.starts.count} paths, {self.program.unknowns} unknowns)"


def parameter_homotopy(
    program: Program,
    start: Any,
    target: Any,
    points: np.ndarray,
    seed: int = 0,
    name: str = "parameter homotopy",
    whole: bool = False,
) -> Homotopy:
    """A system carried in a straight line from parameters where `points` solve it, all there are if it is `whole`."""
    return Homotopy(
        program=program,
        start=np.asarray(start, np.complex128),
        target=np.asarray(target, np.complex128),
        starts=Listed(np.asarray(points, np.complex128), whole),
        name=name,
        seed=seed,
    )
