"""Ends that look singular and are not: proved to be simple roots, they join the others.

A root whose unknowns differ by ten orders of magnitude can have a Jacobian that double precision, and a scaling of
rows and columns by typical sizes, takes for singular.  A path that ends there does not wind round its end, and no
other path ends there.  Rows and columns scaled until the largest entry of each is one (D. Ruiz, *A scaling algorithm to
equilibrate both rows and columns norms in matrices*, RAL-TR-2001-034) tell most of the others apart at little cost;
Krawczyk's test with Arb's numbers decides: what it certifies is a simple root.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from solvers.certify import certify
from solvers.local import balanced_condition
from solvers.solutions import Singular, Solutions
from solvers.system import System

__all__ = ["with_simple_ends"]

#: Bits at which Arb gives up on an end: those that were simple needed 128, and a multiple root is not certified with
#: any number.
BITS = 256
#: An end whose balanced Jacobian has a larger condition number is singular: simple roots of nine-point problems had up
#: to 8e12, ends on curves and surfaces of roots 3e15 and more.
SINGULAR_FOR_SURE = 1e14
#: A coordinate beside this part of the largest one is the rounding error of a zero: ends on curves where some unknowns
#: vanish have such, and balancing would make rows of nothing but them as good as any.
NOTHING = 1e-19
TWICE = "a singular end is proved to be a simple root that another path has found: one of the two has lost its own"


def with_simple_ends(system: System, solutions: Solutions) -> Solutions:
    """The same solutions, with the singular ends that are proved to be simple roots among the roots.

    Parameters
    ----------
    system : System
        A square one; solutions of others are given back as they are.
    solutions : Solutions

    Returns
    -------
    Solutions
        ``paths`` holds −1 for a root that has been a singular end.  The certificate is made anew if there was one.

    Examples
    --------
    >>> from sympy import symbols
    >>> from solvers import solve
    >>> x, y = symbols("x y")
    >>> system = System([x**2 - y, y**2], [x, y])
    >>> with_simple_ends(system, solve(system, start="total-degree"))  # one root of multiplicity four
    Solutions(0 roots, 0 real, 1 singular, 0 failed of 4 paths)
    """
    ends = solutions.singular
    rows, unknowns = system.size
    single = np.flatnonzero((ends.multiplicity == 1) & (ends.winding <= 1))
    if rows != unknowns or not single.size:
        return solutions
    simple, midpoints = simple_ends(system, ends.points[single], solutions.parameters)
    if not simple.any():
        return solutions
    kept = np.setdiff1d(np.arange(len(ends)), single[simple])
    left = Singular(*(part[kept] for part in (ends.points, ends.multiplicity, ends.winding, ends.dimension)))
    return with_roots_added(system, solutions, midpoints, left)


def with_roots_added(system: System, solutions: Solutions, roots: np.ndarray, singular: Singular) -> Solutions:
    """The same solutions, with roots that singular ends have turned out to be, and the singular ends that are left.

    Where one of these roots is another path's, all stay as they are but the verdict: to a simple root leads one path,
    and the other has lost its own.
    """
    points = np.concatenate([solutions.points, roots])
    whole = certify(system, points, solutions.parameters)
    new = np.arange(len(solutions.points), len(points))
    if np.any(whole.representative[new] != new):
        return replace(solutions, complete=False, evidence="; ".join(filter(None, (solutions.evidence, TWICE))))
    account = solutions.ledger
    return replace(
        solutions,
        points=points,
        singular=singular,
        paths=np.concatenate([solutions.paths, np.full(len(roots), -1)]),
        ledger=replace(account, finite=account.finite + len(roots), singular=account.singular - len(roots)),
        certificate=whole if solutions.certificate is not None else None,
        orbit=None,
    )


def simple_ends(system: System, points: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Which of some points are proved to be simple roots, (n,), and these roots, (k, unknowns)."""
    likely = np.zeros(len(points), bool)
    if len(points):
        size = np.abs(points)
        cleaned = np.where(size > NOTHING * size.max(axis=1, keepdims=True), points, 0.0)
        likely = balanced_condition(system.evaluate(cleaned, values)[1]) < SINGULAR_FOR_SURE
    if not likely.any():
        return likely, points[:0]
    proof = certify(system, points[likely], values, max_bits=BITS)
    likely[likely] = proof.certified
    return likely, proof.boxes.midpoints[proof.certified]
