"""Every path in exactly one class, and a second look at every path that gives reason for doubt.

Two paths that end on one regular root cannot both be right: in a homotopy with random γ distinct paths have
distinct regular ends. Nor can two paths be at one point half way: the endgame notes where each path that goes to a
singular end or to infinity has been at its first radius, since these may rightly end together. Such a clash betrays
a jump from one path to another, the only way in which a root can go missing without a failure being seen. Clashing
and failed paths climb a ladder: tighter steps, double-double arithmetic, tighter steps in it, 64 digits for a few.
What fails on the last rung is reported, path by path, never dropped.

Where every path of a complete start is tracked, those that wind m times round a singular end come m at a time: a
number that is no multiple of m betrays a loop that was taken round too many roots, and its paths climb too.
What no rung mends is no failure, but is said beside the result.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from solvers.ends import FAILED, PRECISE, REGULAR, SINGULAR, Ends
from solvers.local import ORIGIN
from solvers.points import pairs_of_equals

#: Two regular ends nearer than this, relative, or than their own uncertainty, are one root.
SAME_ROOT = 1e-9
#: The uncertainty of an end is about the rounding unit times its condition number; ten times that is kept.
UNCERTAINTY = 2e-15
#: Ends that were led there and refined in more than double precision are known to its rounding, whatever the condition.
KNOWN = 1e-14
#: No more failed paths than this, or this part of all, are few.
FEW, FEW_SHARE = 8, 0.25
#: Marks of two paths that agree to this precision, relative, are of one path.
SAME_PATH = 1e-8
#: Singular endpoints nearer than this, relative, are one point: a root of multiplicity μ is only known to the
#: μ-th root of the rounding error from any one path, and to about 1e-10 from the mean over its loops.
SAME_SINGULAR = 1e-5
#: Singular endpoints smaller than this part of the typical size are compared as if they were of that size: means
#: over the loops round the origin are only known beside the loops.
BESIDE_ZERO = 1e-4


def are_few(failed: int, tracked: int) -> bool:
    """Whether so many failures may be mended one by one: of many the reason is the system, and they come again.

    >>> are_few(8, 10), are_few(20, 100), are_few(40, 100)
    (True, True, False)
    """
    return failed <= max(FEW, tracked * FEW_SHARE)


def doubtful(ends: Ends, complete: bool = False) -> np.ndarray:
    """Rows to be tracked again: failed ones, all members of a clash, and cycles that are not whole.

    The last only if the ends are `complete`: those of all paths of a start that has one for each root.
    """
    failed = np.flatnonzero(ends.kind == FAILED)
    rows = np.union1d(failed, clashing(ends))
    return np.union1d(rows, broken_cycles(ends)) if complete else rows


def groups_of_singular(x: np.ndarray, typical: float, tolerance: float = SAME_SINGULAR) -> list[np.ndarray]:
    """Singular ends that agree, as arrays of rows; `typical` is the size of the unknowns of the homotopy."""
    label = np.arange(len(x))
    for i, j in pairs_of_equals(x, tolerance, floor=max(BESIDE_ZERO * typical, 1e-300)).tolist():
        label[label == label[j]] = label[i]
    return [np.flatnonzero(label == name) for name in dict.fromkeys(label.tolist())]


def broken_cycles(ends: Ends) -> np.ndarray:
    """Rows of singular ends with winding number m whose number is no multiple of m, or that end beside a regular root.

    A single path leads to no multiple root; it may lead to a curve of roots, but none of these is beside a regular one.
    """
    rows = np.flatnonzero(ends.kind == SINGULAR)
    broken = [np.zeros(0, np.int64)]
    groups = groups_of_singular(ends.x[rows], ends.typical)
    single = rows[np.array([group[0] for group in groups if len(group) == 1], np.int64)]
    if single.size:
        both = np.concatenate([single, np.flatnonzero(ends.kind == REGULAR)])
        pairs = pairs_of_equals(ends.x[both], SAME_SINGULAR, floor=max(BESIDE_ZERO * ends.typical, 1e-300))
        broken.append(np.unique(both[pairs[(pairs[:, 0] < len(single)) & (pairs[:, 1] >= len(single)), 0]]))
    for group in groups:
        turns, counts = np.unique(ends.winding[rows[group]], return_counts=True)
        for m, count in zip(turns.tolist(), counts.tolist()):
            if m and count % m:
                broken.append(rows[group[ends.winding[rows[group]] == m]])
    return np.concatenate(broken)


def clashing(ends: Ends) -> np.ndarray:
    """Rows of regular ends that are not alone at their root, and of paths that are not alone on their way."""
    return np.unique(_clashes(ends))


def _clashes(ends: Ends) -> np.ndarray:
    """Pairs of rows (i, j), i < j, that clash, shape (pairs, 2)."""
    rows = np.flatnonzero(ends.kind == REGULAR)
    condition = ends.condition[rows]
    tolerance = np.where(condition == PRECISE, KNOWN, np.maximum(SAME_ROOT, UNCERTAINTY * condition))
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
    complete: bool = False,
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
    report : callable (name, rows), optional
    complete : bool
        Whether these are all the paths of a start with one for each root.

    Returns
    -------
    dict of str to int
        How many paths each rung was asked to track.
    """
    used: dict[str, int] = {}
    for name, track in rungs:
        rows = tried = doubtful(ends, complete)
        if not rows.size:
            return used
        while rows.size:
            used[name] = used.get(name, 0) + len(rows)
            if report is not None:
                report(name, len(rows))
            ends.replace(rows, track(rows))
            rows = np.setdiff1d(doubtful(ends, complete), tried)
            tried = np.union1d(tried, rows)
    settle(ends)
    return used
