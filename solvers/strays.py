"""Roots that loops cannot reach: Newton's method from random points knows nothing of paths.

Loops permute the roots of one irreducible component of a family. Roots on another, where a factor of an equation
vanishes or an unknown is zero, say, are never met, and a trace test of the roots at hand passes without them. A few
dozen starts of Newton's method show most such components, and a root that was missed with some luck.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from solvers.local import CONFIRMED, newton, newton_step
from solvers.points import Group, PointSet
from solvers.system import System

#: Random starts, and Newton steps from each.
STARTS, STEPS = 128, 40
#: Roots with a larger condition number are none to begin loops with.
REGULAR = 1e8


def strays(
    system: System,
    parameters: np.ndarray,
    known: PointSet,
    rng: np.random.Generator,
    typical: float,
    group: Group | None = None,
    valid: Callable[[np.ndarray], np.ndarray] | None = None,
) -> np.ndarray:
    """Regular roots at these parameters that Newton's method finds and that are not known, shape (n, unknowns).

    `typical` is the typical size of the unknowns, where known roots do not say it.

    Examples
    --------
    >>> from sympy import symbols
    >>> x, a = symbols("x a")
    >>> known = PointSet(1)
    >>> _ = known.add(np.array([[2.0], [-2.0]]))
    >>> found = strays(System([x * (x**2 - a)], [x], [a]), np.array([4.0]), known, np.random.default_rng(0), 1.0)
    >>> bool(np.abs(found).max() < 1e-12), found.shape
    (True, (1, 1))
    """
    sizes = np.abs(known.points)
    typical = float(np.median(sizes.max(axis=1))) or typical
    usual = np.median(sizes, axis=0)
    scale = np.maximum(usual, 1e-3 * typical) if usual.any() else np.full(len(usual), typical)
    shape = (STARTS, len(scale))
    x = scale * 10.0 ** rng.uniform(-1.5, 1.5, (STARTS, 1)) * (rng.normal(size=shape) + 1j * rng.normal(size=shape))
    program = system.jacobian_program
    for _ in range(STEPS):
        step, size, _ = newton_step(program, x, parameters, typical)
        with np.errstate(all="ignore"):
            x = x - step * np.minimum(1.0, 1.0 / np.maximum(size, 1e-300))[:, None]
        x = x[np.isfinite(x).all(axis=1)]
        if not len(x):
            return x
    x, size, condition = newton(program, x, parameters, typical)
    x = x[(size < CONFIRMED) & (condition < REGULAR)]
    if valid is not None:
        x = x[valid(x)]
    if group is not None:
        x = group.representatives(x, parameters)
    new = PointSet(x.shape[1], known.tolerance, floor=known.floor)
    new.add(x[known.find(x) < 0])
    return new.points
