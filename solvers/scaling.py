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
    blocks, sides = [], []
    for i, (support, values) in enumerate(zip(expanded.supports, expanded.coefficients)):
        keep = np.abs(values) > 0
        exponents, size = support[keep].astype(float), np.log2(np.abs(values[keep]))
        if not len(size):
            continue
        own = np.zeros((len(size), rows))
        own[:, i] = 1.0
        # Small coefficients, weight by equation, so that an equation of many terms counts no more than another.
        weight = 1 / np.sqrt(len(size))
        blocks.append(weight * np.hstack([exponents, own]))
        sides.append(-weight * size)
        # Equal coefficients within the equation: deviations from their mean.
        spread = exponents - exponents.mean(axis=0)
        blocks.append(weight * np.hstack([spread, np.zeros_like(own)]))
        sides.append(-weight * (size - size.mean()))
    blocks.append(INERTIA * np.eye(columns + rows))
    sides.append(np.zeros(columns + rows))
    solution = np.linalg.lstsq(np.vstack(blocks), np.concatenate(sides), rcond=None)[0]
    powers = np.asarray(np.clip(np.round(solution), -LARGEST_EXPONENT, LARGEST_EXPONENT), np.float64)
    unknowns = np.exp2(powers[:columns])
    equations = np.exp2(powers[columns:])
    return Scales(unknowns, equations)
