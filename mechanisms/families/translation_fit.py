"""Parallel poses within tolerances: the circle or the line that moves their positions least."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechanisms.families.motion_dyads import Poses
from mechanisms.families.tolerance import Tolerances
from mechanisms.families.translations import circle_of, line_of

__all__ = ["nearest_translation"]

#: Shares of a tolerance beyond one that are rounding of the optimiser.
SLACK = 1e-6
#: A circle this many sizes large is no better than a line.
LARGEST = 1e3


def nearest_translation(poses: Poses, zones: Tolerances) -> tuple[Poses, float] | None:
    """The positions moved within their tolerances onto a circle, or onto a line, by the least largest share.

    Parameters
    ----------
    poses : Poses
        Three to five parallel ones.
    zones : Tolerances

    Returns
    -------
    (Poses, float) or None
        The moved poses and the share of the tolerances that they need; None when the tolerances do not suffice.

    Examples
    --------
    >>> poses = Poses.of([(1, 0, 0), (0, 1.02, 0), (-1, 0, 0), (0, -1, 0)])
    >>> moved, share = nearest_translation(poses, Tolerances(*np.full((2, 4), 0.1), np.zeros(4)))
    >>> circle_of(moved) is not None, 0 < share < 0.1
    (True, True)
    """
    best: tuple[Poses, float] | None = None
    for guess, condition, holds in _curves(poses):
        found = _moved(poses, zones, guess, condition)
        if found is not None and holds(found[0]) and (best is None or found[1] < best[1]):
            best = found
    return best


def _curves(poses: Poses) -> list[tuple[list[float], Callable[[Any, Any], Any], Callable[[Poses], Any]]]:
    """For a circle and a line: their first guess, by how much scaled positions miss them, and the exact test."""
    z = (poses.points - poses.points.mean()) / poses.size
    rows = np.column_stack([z.real, z.imag, np.ones(len(z))])
    (x, y, c), *_ = np.linalg.lstsq(rows, np.abs(z) ** 2, rcond=None)
    centre = complex(x, y) / 2
    circle = [centre.real, centre.imag, float(np.sqrt(abs(c + abs(centre) ** 2)))]
    _, _, axes = np.linalg.svd(np.column_stack([z.real, z.imag]))
    line = [float(np.arctan2(axes[0, 1], axes[0, 0])), 0.0]
    found: list[Any] = [(line, lambda v, p: (np.exp(-1j * v[0]) * p).imag - v[1], line_of)]
    if max(map(abs, circle)) < LARGEST:
        found.append((circle, lambda v, p: np.abs(p - complex(v[0], v[1])) - v[2], circle_of))
    return found


def _moved(
    poses: Poses, zones: Tolerances, guess: list[float], condition: Callable[[Any, Any], Any]
) -> tuple[Poses, float] | None:
    """The least t with shares within ±t that put every position on the curve, by sequential quadratic programming."""
    from scipy.optimize import minimize

    count, more = len(poses), len(guess)
    middle = poses.points.mean()
    reach = np.stack([zones.x, zones.y]) / poses.size
    z = (poses.points - middle) / poses.size

    def places(v: NDArray[np.float64]) -> NDArray[np.complex128]:
        shares = v[more:-1].reshape(2, count) * reach
        return np.asarray(z + shares[0] + 1j * shares[1])

    def sides(v: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.concatenate([v[-1] - v[more:-1], v[-1] + v[more:-1]])

    found = minimize(
        lambda v: v[-1],
        np.concatenate([guess, np.zeros(2 * count), [0.5]]),
        method="SLSQP",
        constraints=[
            {"type": "eq", "fun": lambda v: condition(v, places(v))},
            {"type": "ineq", "fun": sides},
        ],
        options={"ftol": 1e-14, "maxiter": 300},
    )
    share = float(np.abs(found.x[more:-1]).max())
    if np.abs(condition(found.x, places(found.x))).max() > 1e-10 or share > 1 + SLACK:
        return None
    return Poses(np.asarray(middle + poses.size * places(found.x)), poses.angles), share
