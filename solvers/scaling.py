"""Scaling of unknowns and equations, so that coefficients come near to one.

With x_j = 10^c_j u_j and equation i multiplied by 10^e_i, the coefficient of the monomial x^a becomes
10^(e_i + ⟨a, c⟩) times what it was. The logarithms are made small, and equal within each equation, in the sense
of least squares (Meintjes and Morgan's SCLGEN; Morgan, Solving Polynomial Systems Using Continuation, 1987).
Units chosen by a user, metres or millimetres, then do not matter.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from solvers.supports import Terms, TooManyTerms, terms
from solvers.system import System

#: Equations with more terms than this together are not expanded for the sake of their scale.
MANY_TERMS = 20_000
#: Scales are powers of two within these bounds (about 1e±15), so that scaling itself rounds nothing.
LARGEST_EXPONENT = 50
#: Weight of a small unknown scale against small coefficients: decides only what the coefficients leave open.
INERTIA = 1e-3


@dataclass(frozen=True, eq=False)
class Scales:
    """Scales of the unknowns and of the equations.

    Attributes
    ----------
    unknowns : ndarray, shape (n,)
        The user's unknowns are these times the scaled ones.
    equations : ndarray, shape (equations,)
        Each equation is multiplied by its scale.
    """

    unknowns: np.ndarray
    equations: np.ndarray


def scales_of(system: System, values: Any = None) -> Scales:
    """Scales for a system at given parameter values; all one if it is too large to be multiplied out.

    Examples
    --------
    >>> from sympy import symbols
    >>> x, y = symbols("x y")
    >>> scales_of(System([1e-6 * x**2 - 1, x * y - 4000], [x, y])).unknowns.tolist()
    [1024.0, 4.0]
    """
    rows, columns = system.size
    try:
        expanded = terms(system, values, limit=MANY_TERMS)
    except TooManyTerms:
        return Scales(np.ones(columns), np.ones(rows))
    return scales_of_terms(expanded)


def scales_of_terms(expanded: Terms) -> Scales:
    """Scales by least squares on the logarithms of the coefficients."""
    rows = len(expanded.supports)
    columns = expanded.supports[0].shape[1] if rows else 0
    values = np.concatenate([np.zeros(0), *expanded.coefficients])
    keep = np.abs(values) > 0
    size = np.log2(np.abs(values[keep]))
    exponents = np.concatenate([np.zeros((0, columns)), *expanded.supports])[keep]
    own = np.repeat(np.eye(rows), [len(support) for support in expanded.supports], axis=0)[keep]
    # Small coefficients, weight by equation, so that an equation of many terms counts no more than another …
    counts = np.maximum(own.sum(axis=0), 1)
    weight = (own @ counts**-0.5)[:, None]
    small = weight * np.hstack([exponents, own, size[:, None]])
    # … and equal coefficients within the equation: deviations from their mean.
    mean = own.T @ np.hstack([exponents, size[:, None]]) / counts[:, None]
    equal = small - weight * np.hstack([own @ mean[:, :-1], own, own @ mean[:, -1:]])
    normal = small.T @ small + equal.T @ equal
    solution = np.linalg.solve(normal[:-1, :-1] + INERTIA**2 * np.eye(columns + rows), -normal[:-1, -1])
    powers = np.asarray(np.clip(np.round(solution), -LARGEST_EXPONENT, LARGEST_EXPONENT), np.float64)
    unknowns = np.exp2(powers[:columns])
    equations = np.exp2(powers[columns:])
    return Scales(unknowns, equations)
