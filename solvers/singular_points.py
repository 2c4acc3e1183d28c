"""Singular ends of paths that agree, as points with multiplicities.

Ends are compared beside the largest unknown: one that goes to zero is known no better. Where another unknown is ten
thousand times larger, simple roots that a mere scaling would set apart look like one, and singular. So what agrees is
one point only if the mean of the ends is as good a root as they are, in every equation, and they are not all proved to
be simple.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from solvers.ledger import BESIDE_ZERO, SAME_SINGULAR, groups_of_singular
from solvers.local import in_own_units
from solvers.replay import sizes
from solvers.replay import values as replayed
from solvers.simple_ends import simple_ends
from solvers.solutions import Singular
from solvers.system import System

__all__ = ["singular_points"]

#: Singular values of the scaled Jacobian below this count towards its kernel at a singular end.
KERNEL = 1e-6
#: The mean of ends is no root where an equation is so many times farther from zero than at any of them …
WORSE = 1e3
#: … and than this, beside its terms. The mean of roots d apart leaves d² of what their own sizes are, 1e-10 or more.
ROUNDING = 1e-15
#: Ends that agree and are not one are compared again, so much closer, down to where doubles end.
CLOSER, CLOSEST = 0.1, 1e-15


def singular_points(
    system: System,
    values: np.ndarray,
    points: np.ndarray,
    winding: np.ndarray,
    typical: float = 0.0,
    scale: np.ndarray | None = None,
) -> Singular:
    """Singular ends that agree, each as one point with a multiplicity.

    Parameters
    ----------
    points : ndarray, shape (n, unknowns)
    winding : ndarray of int, shape (n,)
    typical : float
        Typical size of the unknowns of the homotopy, in which ends are compared.
    scale : ndarray, shape (unknowns,), optional
        The user's unknowns are these times the homotopy's.

    Examples
    --------
    >>> from sympy import symbols
    >>> x, y = symbols("x y")
    >>> ends = np.array([[1e-9, 5e9], [-1e-9, 5e9]], complex)
    >>> singular_points(System([x**2, y - 5 * 10**9], [x, y]), np.zeros(0), ends, np.array([2, 2]), 1.0)
    Singular(1 points, multiplicities [2])
    >>> singular_points(System([x**2 + 1, y - 5 * 10**9], [x, y]), np.zeros(0), ends * [1e9j, 1], np.array([1, 1]), 1.0)
    Singular(2 points, multiplicities [1, 1])
    """
    unit = np.ones(points.shape[1]) if scale is None else scale
    floor = np.maximum(BESIDE_ZERO * typical * np.abs(unit), 1e-300)
    groups = list(_groups(system, values, points, points / unit, winding, typical, floor))
    means = np.array([points[g].mean(axis=0) for g in groups]).reshape(-1, points.shape[1])
    return Singular(
        points=means,
        multiplicity=np.array([len(g) for g in groups], np.int64),
        winding=np.array([winding[g].max() for g in groups], np.int64),
        dimension=_kernel_dimension(system, values, means),
    )


def _groups(
    system: System,
    values: np.ndarray,
    points: np.ndarray,
    scaled: np.ndarray,
    winding: np.ndarray,
    typical: float,
    floor: np.ndarray,
) -> Iterator[np.ndarray]:
    """Rows of ends that are one point."""
    waiting = [(g, SAME_SINGULAR) for g in groups_of_singular(scaled, typical)]
    while waiting:
        group, tolerance = waiting.pop(0)
        if len(group) == 1 or _is_one(system, values, points[group], winding[group], floor):
            yield group
        elif tolerance < CLOSEST:
            yield from group[:, None]
        else:
            closer = groups_of_singular(scaled[group], typical, tolerance * CLOSER)
            waiting = [(group[g], tolerance * CLOSER) for g in closer] + waiting


def _is_one(system: System, values: np.ndarray, points: np.ndarray, winding: np.ndarray, floor: np.ndarray) -> bool:
    """Whether ends that agree beside their largest unknown are one multiple root."""
    mean = points.mean(axis=0)
    own = np.maximum(np.abs(points).max(axis=0), floor)
    if np.all(np.abs(points - mean).max(axis=0) <= SAME_SINGULAR * own):
        return True
    residual = np.abs(replayed(system.program, np.vstack([mean, points]), values))
    rounding = ROUNDING * sizes(system.program, own[None], np.abs(values))[0]
    if np.any(residual[0] > WORSE * np.maximum(residual[1:].max(axis=0), rounding)):
        return False
    rows, unknowns = system.size
    # The mean of several roots can be one, too.
    return rows != unknowns or winding.max() > 1 or not simple_ends(system, points, values)[0].all()


def _kernel_dimension(system: System, values: np.ndarray, points: np.ndarray) -> np.ndarray:
    if not len(points):
        return np.zeros(0, np.int64)
    scaled = in_own_units(system.jacobian_program, points, values)[1]
    return (np.linalg.svd(scaled, compute_uv=False) < KERNEL).sum(axis=1)
