"""The inner loop of the mixed cells: follow every cell from wall to wall while one support is lowered.

Plain Python, written so that numba compiles it as it stands. With int64 arrays it stops when a number might not
fit; with arrays of Python integers it runs uncompiled, and nothing overflows.
"""

from __future__ import annotations

from typing import Any

import numpy as np

DONE, TIED, TOO_LARGE, TOO_LONG = range(4)
#: Walls whose times differ by less than this (relative) count as a tie. A time is the quotient of two exact
#: integers, with a rounding error of a few 1e-16; a tie costs no more than another random lifting.
TIE = 1e-13
#: Largest minor for which the products of the elimination fit into 63 bits.
LARGEST_MINOR = 2**30
#: Largest bound of a height for which sums of a few products still fit into 63 bits.
LARGEST_HEIGHT = 2.0**61


def adjugate(matrix: Any, work: Any, bounded: bool) -> Any:
    """Fraction-free elimination: ``work[:, n:]`` becomes |det| times the inverse; returns |det|.

    Returns -1 if a minor is too large (only asked for if `bounded`), 0 for a singular matrix.
    Bareiss, Mathematics of Computation 22, 565-578, 1968.
    """
    n = matrix.shape[0]
    for i in range(n):
        for j in range(n):
            work[i, j] = matrix[i, j]
            work[i, n + j] = 0
        work[i, n + i] = 1
    previous = work[0, n]  # one, in the arithmetic of the array
    for k in range(n):
        pivot = k
        while pivot < n and work[pivot, k] == 0:
            pivot += 1
        if pivot == n:
            return work[0, n] * 0
        if pivot != k:
            for j in range(2 * n):
                work[k, j], work[pivot, j] = work[pivot, j], work[k, j]
        lead = work[k, k]
        for i in range(n):
            factor = work[i, k]
            if i == k or (factor == 0 and lead == previous):
                continue
            for j in range(2 * n):
                entry = (lead * work[i, j] - factor * work[k, j]) // previous
                if bounded and abs(entry) > LARGEST_MINOR:
                    return -abs(lead) // abs(lead)
                work[i, j] = entry
        previous = lead
    if previous < 0:
        for i in range(n):
            for j in range(n, 2 * n):
                work[i, j] = -work[i, j]
        previous = -previous
    return previous


def push(rows: Any, count: int, row: Any) -> Any:
    """Write a row behind the first `count` rows, into a larger array if this one is full."""
    if count >= len(rows):
        larger = np.empty((2 * count + 16, rows.shape[1]), np.int64)
        for i in range(count):
            for j in range(rows.shape[1]):
                larger[i, j] = rows[i, j]
        rows = larger
    for j in range(rows.shape[1]):
        rows[count, j] = row[j]
    return rows


def walk(
    table: Any,
    heights: Any,
    moving: Any,
    low: Any,
    high: Any,
    cells: Any,
    stage: int,
    largest_exponent: float,
    largest_lifting: float,
    patience: int,
) -> tuple[int, Any]:
    """Lower the moving points of one support from plus to minus infinity and follow the mixed cells.

    Parameters
    ----------
    table : ndarray, shape (points, n)
        All points of all supports.
    heights, moving : ndarray, shape (points,)
        The lifting is ``heights + t * moving``; moving is -1 for the lowered points, else 0.
    low, high : ndarray, shape (n,)
        Support k holds the points low[k] … high[k] - 1.
    cells : ndarray, shape (cells, 2 n)
        Cells for t = -infinity: a_0, b_0, a_1, b_1, … The array is overwritten.
    stage : int
        The support that moves.
    largest_exponent, largest_lifting : float
        Bounds that say when a number might not fit into an int64; both are 0 for Python integers.
    patience : int
        How many cells may be looked at.

    Returns
    -------
    outcome : int
        DONE, TIED (two walls at one time: the lifting is not generic), TOO_LARGE or TOO_LONG.
    cells : ndarray, shape (cells, 2 n)
        The cells for t = +infinity whose edges hold no vertex left behind.
    """
    n = table.shape[1]
    bounded = largest_exponent > 0
    stack = cells
    waiting = len(cells)
    found = np.empty((16, 2 * n), np.int64)
    done = 0
    matrix = np.empty((n, n), table.dtype)
    work = np.empty((n, 2 * n), table.dtype)
    normal = np.empty(n, table.dtype)
    drift = np.empty(n, table.dtype)
    cell = np.empty(2 * n, np.int64)
    while waiting:
        waiting -= 1
        patience -= 1
        if patience < 0:
            return TOO_LONG, found[:done]
        for j in range(2 * n):
            cell[j] = stack[waiting, j]
        for j in range(n):
            for k in range(n):
                matrix[j, k] = table[cell[2 * j + 1], k] - table[cell[2 * j], k]
        volume = adjugate(matrix, work, bounded)
        if volume < 0:
            return TOO_LARGE, found[:done]
        # The normal times the volume, and how it changes with t.
        change = moving[cell[2 * stage + 1]] - moving[cell[2 * stage]]
        if change == 0 and moving[cell[2 * stage]] != 0:
            found = push(found, done, cell)
            done += 1
            continue
        bound = 0.0
        for k in range(n):
            normal[k] = -work[k, n] * (heights[cell[1]] - heights[cell[0]])
            for j in range(1, n):
                normal[k] -= work[k, n + j] * (heights[cell[2 * j + 1]] - heights[cell[2 * j]])
            drift[k] = -work[k, n + stage] * change
            if bounded:
                row = 0.0
                for j in range(n):
                    row += abs(float(work[k, n + j]))
                bound += 2.0 * row * largest_lifting * largest_exponent
        if bounded and 2.0 * (bound + float(volume) * largest_lifting) > LARGEST_HEIGHT:
            return TOO_LARGE, found[:done]
        # The first wall.
        best = second = np.inf
        wall = where = -1
        for k in range(n):
            level = volume * heights[cell[2 * k]]
            speed = volume * moving[cell[2 * k]]
            for j in range(n):
                level += normal[j] * table[cell[2 * k], j]
                speed += drift[j] * table[cell[2 * k], j]
            for point in range(low[k], high[k]):
                if point == cell[2 * k] or point == cell[2 * k + 1]:
                    continue
                slope = volume * moving[point] - speed
                for j in range(n):
                    slope += drift[j] * table[point, j]
                if slope >= 0:
                    continue
                above = volume * heights[point] - level
                for j in range(n):
                    above += normal[j] * table[point, j]
                time = -float(above) / float(slope)
                if time < best:
                    second = best
                    best = time
                    wall = point
                    where = k
                elif time < second:
                    second = time
        if wall < 0:
            continue  # a vertex of the simplex stays in the cell for ever
        if second < np.inf and second - best <= TIE * max(abs(best), abs(second)):
            return TIED, found[:done]
        a, b = cell[2 * where], cell[2 * where + 1]
        share = volume * 0  # of the new point along the edge: 0 at a, volume at b
        for j in range(n):
            share += (table[wall, j] - table[a, j]) * work[j, n + where]
        # Where two cells merge, (a, b) and (a, new) into (new, b), each of the two comes to this wall; the one
        # goes on that lacks the point with the smaller number.
        if share < volume and (share >= 0 or wall < b):
            stack = push(stack, waiting, cell)
            stack[waiting, 2 * where] = wall
            waiting += 1
        if share > 0 and (share <= volume or wall < a):
            stack = push(stack, waiting, cell)
            stack[waiting, 2 * where + 1] = wall
            waiting += 1
    return DONE, found[:done]
