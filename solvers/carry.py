"""Roots carried from one place in parameter space to another, along a line or an arc.

The paths of monodromy and of the trace test run between generic parameters: there is no endgame, and a path that is
lost can be sent again. What is asked of an end is only that it is a good root.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from solvers import parallel
from solvers.kernel.engine import Engine
from solvers.kernel.reference import REACHED, Settings, Tracked
from solvers.points import SAME, pairs_of_equals

#: An end is a root when the last Newton step there is below this, relative …
LAST_STEP = 1e-8
#: … and no unknown is larger than this, in units of the typical size: a relative test alone accepts diverging
#: paths. With 32 digits a step as small as the second number cannot come from one; roots of chains of three links
#: are as large as 3e14.
LARGEST = 1e8
SURE, LARGEST_SURE = 1e-12, 1e20
#: The ladder for paths that are lost: tighter steps with pivoting, then 32 digits, then both.
_RUNGS: tuple[Callable[[], tuple[Settings, dict[str, Any]]], ...] = (
    lambda: (Settings().tighter(), {"pivoted": True}),
    lambda: (Settings().tighter(), {"arithmetic": "double-double"}),
    lambda: (Settings().tighter().tighter(), {"arithmetic": "double-double"}),
)


def random_bend(rng: np.random.Generator) -> complex:
    """The bend of a random arc: of modulus one, and neither straight nor through infinity."""
    return complex(np.exp(1j * rng.uniform(0.3, np.pi - 0.3) * rng.choice([-1, 1])))


def carry(
    engine: Engine,
    points: np.ndarray,
    start: np.ndarray,
    end: np.ndarray,
    bend: complex,
    jobs: int = 1,
    backend: str = "threads",
    typical: float = 1.0,
    ladder: bool = False,
) -> np.ndarray:
    """Roots at `start` carried to `end` along an arc; those that arrive at a good root, in order.

    Parameters
    ----------
    points : ndarray, shape (n, unknowns)
    start, end : ndarray, shape (parameters,)
    bend : complex
        Which arc; 1 is the straight line.
    typical : float
        Typical size of the unknowns.
    ladder : bool
        Whether paths that are lost, or end together, are tracked again with more care.

    Returns
    -------
    ndarray, shape (at most n, unknowns)
    """
    x, good = carry_each(engine, points, start, end, bend, jobs, backend, typical, ladder)
    return x[good]


def carry_each(
    engine: Engine,
    points: np.ndarray,
    start: np.ndarray,
    end: np.ndarray,
    bend: complex = 1.0,
    jobs: int = 1,
    backend: str = "threads",
    typical: float = 1.0,
    ladder: bool = True,
) -> tuple[np.ndarray, np.ndarray]:
    """As :func:`carry`, but row by row: the ends, and which of them are good; shapes (n, unknowns) and (n,)."""

    def track(rows: np.ndarray, settings: Settings, **options: Any) -> Tracked:
        return engine.track(points[rows], end, start - end, kind="arc", bend=bend, settings=settings, **options)

    def chunk(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        done = track(rows, Settings())
        return done.x, _arrived(done, typical)

    chunks = parallel.cut(len(points))
    results = dict(parallel.run(chunk, [(k, (rows,)) for k, rows in enumerate(chunks)], jobs, backend))
    if not results:
        return points.copy(), np.zeros(0, bool)
    x = np.concatenate([results[k][0] for k in range(len(chunks))])
    good = np.concatenate([results[k][1] for k in range(len(chunks))])
    for rung in _RUNGS if ladder else ():
        again = np.union1d(np.flatnonzero(~good), _together(x, good))
        if not again.size:
            break
        settings, options = rung()
        done = track(again, settings, **options)
        x[again], good[again] = done.x, _arrived(done, typical, "arithmetic" in options)
    if ladder:  # what still ends together has been mistaken for one another; one of them is right
        rows = np.flatnonzero(good)
        good[rows[np.unique(pairs_of_equals(x[rows], SAME)[:, 1])]] = False
    return x, good


def _arrived(done: Tracked, typical: float, precise: bool = False) -> np.ndarray:
    size = np.abs(done.x).max(axis=1) / typical
    good = (done.quality < LAST_STEP) & (size < LARGEST)
    if precise:
        good |= (done.quality < SURE) & (size < LARGEST_SURE)
    return np.asarray((done.status == REACHED) & good)


def _together(x: np.ndarray, good: np.ndarray) -> np.ndarray:
    """Rows of good ends that are not alone."""
    rows = np.flatnonzero(good)
    return np.asarray(rows[np.unique(pairs_of_equals(x[rows], SAME))])
