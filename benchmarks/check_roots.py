"""An independent judge of roots: Newton's method in mpmath on SymPy's own equations, and clustering.

Nothing of the solver is used here, so that it judges every program alike, this one included.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

#: Decimal digits of the arithmetic.
DIGITS = 40
#: A returned point must move less than this, relative, to be a root that was found rather than one nearby.
MOVED = 1e-4
#: The last Newton step of a nonsingular root, relative; steps are at least squared once they are small.
CONVERGED = 1e-22
ITERATIONS = 6
#: A Jacobian whose inverse is larger than this, beside its own size, is singular: the point is no isolated simple
#: root. Forty digits leave it far above at the points of a curve, and far below at ill-conditioned roots.
SINGULAR = 1e19
#: Refined roots nearer than this, relative, are one.
SAME = 1e-14


@dataclass
class Verdict:
    """What the judge found in a list of points.

    Attributes
    ----------
    roots : ndarray, shape (distinct, unknowns)
        The distinct nonsingular roots, refined.
    returned, accepted : int
        Points given, and points that are nonsingular roots.
    """

    roots: np.ndarray
    returned: int
    accepted: int

    @property
    def distinct(self) -> int:
        """The number of distinct roots."""
        return len(self.roots)

    @property
    def duplicates(self) -> int:
        """Accepted points that repeat others."""
        return self.accepted - self.distinct


class Judge:
    """Checks points against the equations of one system.

    >>> from sympy import symbols
    >>> from solvers.system import System
    >>> x, y = symbols("x y")
    >>> judge = Judge(System([x**2 - 2, x * y - 1], [x, y]))
    >>> verdict = judge([[1.41421356, 0.70710678], [1.4142135, 0.7071068], [1.0, 1.0]])
    >>> verdict.accepted, verdict.distinct
    (2, 1)
    """

    def __init__(self, system: Any) -> None:
        import sympy

        unknowns = list(system.unknowns)
        jacobian = [[sympy.diff(e, v) for v in unknowns] for e in system.equations]
        self._size = len(unknowns)
        self._both = sympy.lambdify(unknowns, [list(system.equations), jacobian], "mpmath", cse=True)

    def __call__(self, points: Any) -> Verdict:
        points = np.asarray(points, np.complex128).reshape(-1, self._size)
        refined = [root for root in map(self._refine, points) if root is not None]
        return Verdict(_distinct(np.array(refined).reshape(-1, self._size)), len(points), len(refined))

    def _refine(self, point: np.ndarray) -> np.ndarray | None:
        import mpmath

        if not np.all(np.isfinite(point)):
            return None
        with mpmath.workdps(DIGITS):
            x = [mpmath.mpc(v.real, v.imag) for v in point.tolist()]
            start = list(x)
            size = max(abs(v) for v in x) or mpmath.mpf(1)
            for _ in range(ITERATIONS):
                values, jacobian = self._both(*x)
                try:
                    step = mpmath.lu_solve(mpmath.matrix(jacobian), mpmath.matrix(values))
                except ZeroDivisionError:
                    return None
                x = [v - s for v, s in zip(x, step)]
                size = max(max(abs(v) for v in x), mpmath.mpf(10) ** -30)
                length = max(abs(s) for s in step) / size
                if length > 1:
                    return None
                if length < CONVERGED:
                    break
            else:
                return None
            if self._singular(jacobian):
                return None
            moved = max(abs(a - b) for a, b in zip(x, start)) / max(size, mpmath.mpf(10) ** -8)
            return np.array([complex(v) for v in x]) if moved < MOVED else None

    def _singular(self, jacobian: Any) -> bool:
        """Whether the inverse, applied to one fixed vector without pattern, is enormous."""
        import mpmath

        rows = [max(abs(v) for v in row) for row in jacobian]
        if min(rows) == 0:
            return True
        scaled = mpmath.matrix([[v / size for v in row] for row, size in zip(jacobian, rows)])
        right = mpmath.matrix([mpmath.mpf(k * k % 7 + 1) / 3 for k in range(1, len(rows) + 1)])
        try:
            return bool(mpmath.mnorm(mpmath.lu_solve(scaled, right)) > SINGULAR)
        except ZeroDivisionError:
            return True


def _distinct(points: np.ndarray) -> np.ndarray:
    if len(points) < 2:
        return points
    rng = np.random.default_rng(3)
    weights = rng.normal(size=(2, points.shape[1]))
    key = points.real @ weights[0] + points.imag @ weights[1]
    points = points[np.argsort(key)]
    key = np.sort(key)
    kept: list[int] = []
    for k in range(len(points)):
        size = max(np.abs(points[k]).max(), 1e-8)
        reach = 20 * SAME * size * points.shape[1]
        near = [j for j in kept[-64:] if key[k] - key[j] <= reach]
        if not any(np.abs(points[k] - points[j]).max() <= SAME * size for j in near):
            kept.append(k)
    return points[kept]
