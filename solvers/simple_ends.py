"""Ends that look singular and are not: proved to be simple roots, they join the others.

A root whose unknowns differ by ten orders of magnitude can have a Jacobian that double precision, and every scaling
of rows and columns by typical sizes, takes for singular.  A path that ends there does not wind round its end, and no
other path ends there.  Krawczyk's test with Arb's numbers decides: what it certifies is a simple root.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from solvers.certify import certify
from solvers.solutions import Singular, Solutions
from solvers.system import System

__all__ = ["with_simple_ends"]

#: Bits at which Arb gives up on an end: those that were simple needed 128, and a multiple root is not certified with
#: any number.
BITS = 256


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
    proof = certify(system, ends.points[single], solutions.parameters, max_bits=BITS)
    if not proof.count:
        return solutions
    points = np.concatenate([solutions.points, proof.boxes.midpoints[proof.certified]])
    whole = certify(system, points, solutions.parameters)
    new = np.arange(len(solutions.points), len(points))
    if np.any(whole.representative[new] != new):
        return solutions  # some of them are roots that other paths have found: nothing is settled
    simple = single[proof.certified]
    kept = np.setdiff1d(np.arange(len(ends)), simple)
    account = solutions.ledger
    return replace(
        solutions,
        points=points,
        singular=Singular(*(part[kept] for part in (ends.points, ends.multiplicity, ends.winding, ends.dimension))),
        paths=np.concatenate([solutions.paths, np.full(len(simple), -1)]),
        ledger=replace(account, finite=account.finite + len(simple), singular=account.singular - len(simple)),
        certificate=whole if solutions.certificate is not None else None,
        orbit=None,
    )
