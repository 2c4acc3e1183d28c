"""Circuits of linkages with double points: parallelograms, kites, and other change points.

Where the closure's Jacobian loses rank, two arcs of the configuration curve cross. A trace ends there (its
tubes shrink to nothing), but the linkage can go on along either arc, so that all pieces that meet belong to
one circuit. At the double point x* with left null vector λ and null space N of the Jacobian, the directions
of the arcs are the roots of the quadratic form u ↦ λ·f''(x*)[Nu, Nu].
"""

from __future__ import annotations

import math

import numpy as np

from mechanisms.closure import Closure
from mechanisms.curve import ENDS, Circuit, settle, trace, wrap

#: How far from a double point its arcs are entered, radians; traces end about 1e-6 before it.
ENTER = 1e-3
#: Double points nearer than this are one.
SAME = 1e-4
#: Pieces of one circuit; a six-bar can have a few, more than this is a mistake.
MOST_PIECES = 64


def connected(closure: Closure, x: np.ndarray | None = None) -> list[Circuit]:
    """Return the pieces of the whole circuit through a configuration, cut at its double points.

    Parameters
    ----------
    closure : Closure
        Of a linkage with one degree of freedom.
    x : (n,) float array, optional
        A configuration that closes the loops; the reference if not given.

    Returns
    -------
    list of Circuit
        The piece through x first; just one, closed, for nearly every linkage.

    Examples
    --------
    A parallelogram has one circuit of four pieces: it may turn over at each of its two folded positions.

    >>> from mechanisms.linkage import Linkage
    >>> parallelogram = Linkage({"A": 0, "B": 1j, "C": 4 + 1j, "D": 4},
    ...                         {"ground": "AD", "crank": "AB", "coupler": "BC", "follower": "CD"})
    >>> len(connected(Closure.of(parallelogram)))
    4
    """
    pieces = [trace(closure, x)]
    points: list[np.ndarray] = []
    for piece in pieces:  # grows while it is walked
        for end, name in zip((piece.x[0], piece.x[-1]), piece.ends):
            if name != ENDS[2] or len(pieces) > MOST_PIECES:
                continue
            found = double_point(closure, end)
            if found is None or any(np.abs(wrap(closure, found - point)).max() < SAME for point in points):
                continue
            points.append(found)
            for direction in directions(closure, found):
                start, moved = settle(closure, found + ENTER * direction)
                known = any(other.locate(start) is not None for other in pieces)
                if math.isfinite(moved) and not known:
                    pieces.append(trace(closure, start))
    return pieces


def double_point(closure: Closure, x: np.ndarray) -> np.ndarray | None:
    """Return the double point near a configuration (Gauss–Newton on f = 0 and λ f' = 0), or None."""
    x = np.array(x, dtype=float)
    left = np.linalg.svd(closure.jacobian(x))[0][:, -1]
    n, m = closure.size, closure.equations
    for _ in range(30):
        jacobian = closure.jacobian(x)
        rows = np.zeros((m + n + 1, n + m))
        rows[:m, :n] = jacobian
        for j, unit in enumerate(np.eye(n)):  # derivative of λ f' in direction j, from f''[v, w] by polarization
            for k, other in enumerate(np.eye(n)):
                second = closure.curvature(x, unit + other) - closure.curvature(x, unit - other)
                rows[m + k, j] = left @ second / 4
        rows[m : m + n, n:] = jacobian.T
        rows[-1, n:] = 2 * left
        value = np.concatenate([closure.residual(x), jacobian.T @ left, [left @ left - 1]])
        step = np.linalg.lstsq(rows, -value, rcond=1e-12)[0]
        x, left = x + step[:n], left + step[n:]
        if np.abs(step).max() < 1e-13:
            break
    singular = np.linalg.svd(closure.jacobian(x), compute_uv=False)
    closes = np.abs(closure.residual(x)).max() < 1e-9
    return x if closes and singular[-1] < 1e-7 * singular[0] else None


def directions(closure: Closure, x: np.ndarray) -> list[np.ndarray]:
    """Return the unit directions (both senses) in which arcs leave a double point."""
    u, _, vh = np.linalg.svd(closure.jacobian(x))
    left, null = u[:, -1], vh[-2:]
    a, c = (left @ closure.curvature(x, v) for v in null)
    b = left @ (closure.curvature(x, null[0] + null[1]) - closure.curvature(x, null[0] - null[1])) / 4
    # a p² + 2 b p q + c q² = 0 for p null[0] + q null[1]
    square = b * b - a * c
    if square <= 0:
        return []  # an isolated point
    root = math.sqrt(square)
    # Two forms of each root; the larger one is free of cancellation.
    pairs = [max([(-b + s * root, a), (c, -b - s * root)], key=lambda pair: math.hypot(*pair)) for s in (1, -1)]
    lines = [p * null[0] + q * null[1] for p, q in pairs]
    units = [line / np.linalg.norm(line) for line in lines]
    return [sense * unit for unit in units for sense in (1.0, -1.0)]
