"""Every path in exactly one class, and a second look at every path that gives reason for doubt.

Two paths that end on one regular root cannot both be right: in a homotopy with random γ distinct paths have
distinct regular ends. Nor can two paths be at one point half way: the endgame notes where each path that goes to a
singular end or to infinity has been at its first radius, since these may rightly end together. Such a clash betrays
a jump from one path to another, the only way in which a root can go missing without a failure being seen. Clashing
and failed paths climb a ladder: tighter steps, tighter still, double-double arithmetic. What fails on the last rung
is reported, path by path, never dropped.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from solvers.endgame import FAILED, REGULAR, Ends
from solvers.local import ORIGIN
from solvers.points import pairs_of_equals

#: Two regular ends nearer than this, relative, or than their own uncertainty, are one root.
SAME_ROOT = 1e-9
#: The uncertainty of an end is about the rounding unit times its condition number; ten times that is kept.
UNCERTAINTY = 2e-15
#: Marks of two paths that agree to this precision, relative, are of one path.
SAME_PATH = 1e-8


def doubtful(ends: Ends) -> np.ndarray:
    """Rows to be tracked again: failed ones, and all members of a clash."""
    failed = np.flatnonzero(ends.kind == FAILED)
    return np.union1d(failed, clashing(ends))


def clashing(ends: Ends) -> np.ndarray:
    """Rows of regular ends that are not alone at their root, and of paths that are not alone on their way."""
    return np.unique(_clashes(ends))


def _clashes(ends: Ends) -> np.ndarray:
    """Pairs of rows (i, j), i < j, that clash, shape (pairs, 2)."""
    rows = np.flatnonzero(ends.kind == REGULAR)
    tolerance = np.maximum(SAME_ROOT, UNCERTAINTY * ends.condition[rows])
    pairs = rows[pairs_of_equals(ends.x[rows], tolerance, floor=max(ORIGIN * ends.typical, 1e-300))]
    marked = np.flatnonzero(np.isfinite(ends.mark) & (ends.kind != FAILED))
    crossed = marked[pairs_of_equals(ends.mark[marked, None], SAME_PATH, floor=1.0)]
    return np.concatenate([pairs, crossed])


def settle(ends: Ends) -> None:
    """Mark all but the first member of each clash as failed: one of them is right, the others have lost their own."""
    for row in np.unique(_clashes(ends)[:, 1]).tolist():
        ends.kind[row] = FAILED
        ends.why[row] = "ends on the same root as another path, or runs with it, on every rung of the ladder"


def climb(
    ends: Ends,
    rungs: Iterator[tuple[str, Callable[[np.ndarray], Ends]]],
    report: Callable[[str, int], Any] | None = None,
) -> dict[str, int]:
    """Track doubtful paths again, one rung after the other, until nothing is doubtful.

    A path that has found its own way again may meet another there which had taken its place: that one is tracked
    again on the same rung, and so on.

    Parameters
    ----------
    ends : Ends
        Changed in place.
    rungs : iterator of (name, function)
        The function tracks the rows it is given and returns their ends.

    Returns
    -------
    dict of str to int
        How many paths each rung was asked to track.
    """
    used: dict[str, int] = {}
    for name, track in rungs:
        rows = tried = doubtful(ends)
        if not rows.size:
            break
        while rows.size:
            used[name] = used.get(name, 0) + len(rows)
            if report is not None:
                report(name, len(rows))
            ends.replace(rows, track(rows))
            rows = np.setdiff1d(doubtful(ends), tried)
            tried = np.union1d(tried, rows)
    settle(ends)
    return used
