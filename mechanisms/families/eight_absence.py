"""The proof that no trammel meets eight poses: the eighth equation over the boxes of all roots of the first seven."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mechanisms.families.base import Problem, Solved
from mechanisms.families.trammel_task import TrammelTask
from mechanisms.task import Task

__all__ = ["Absence", "absence"]

#: Bits for roots so large that the eighth equation cancels in double precision.
SHARP = 256


class Absence(NamedTuple):
    """What the eighth equation says at the roots of the first seven poses.

    Attributes
    ----------
    roots : int
        Roots of the seven poses that were looked at.
    excluded : int
        Those at which it is proved not to hold.
    least : float
        Smallest |eighth equation| among the lower bounds, lengths in units of the task's size.
    """

    roots: int
    excluded: int
    least: float

    @property
    def proved(self) -> bool:
        """Whether none of the roots meets the eighth pose."""
        return self.excluded == self.roots


def absence(task: Task, first: Solved) -> Absence:
    """Evaluate the equation of pose 7 in ball arithmetic over the certified boxes of the roots of poses 0 … 6.

    The equation is the resultant of `mechanisms.families.trammel`, a polynomial in m, m̄, d, d̄, R, R̄.

    Parameters
    ----------
    first : Solved
        The problem that leaves out pose 7, with its certificate.
    """
    from flint import acb, arb

    part = TrammelTask(task)
    place, half = complex(part.points[-1] / task.size), complex(np.exp(0.5j * part.turns[-1]))
    eighth = tuple(acb(z.real, z.imag) for z in (place, place.conjugate(), half, half.conjugate()))
    certificate = first.solutions.certificate
    middle, radii = certificate.boxes.midpoints, certificate.boxes.radii
    excluded, least = 0, math.inf
    for k, root in enumerate(first.solutions.points):
        bound = 0.0
        if certificate.certified[k]:
            box = [acb(arb(z.real, float(r)), arb(z.imag, float(r))) for z, r in zip(middle[k].tolist(), radii[k])]
            bound = _least_eighth(box, eighth)
        if not bound > 0:  # a large root: twice the digits, and more
            sharp = _sharp_box(first.problem, root)
            bound = 0.0 if sharp is None else _least_eighth(sharp, eighth)
        excluded += bound > 0
        least = min(least, bound)
    return Absence(len(first.solutions.points), excluded, least)


def _least_eighth(box: Sequence[Any], pose: tuple[Any, ...]) -> float:
    """A lower bound of the modulus of the equation of one pose over a box of m, m̄, d, d̄, R, R̄."""
    m, mc, d, dc, R, Rc = box[:6]
    p, pc, c, cc = pose
    low, high = (m - d - R - p) * cc - m * c, (mc - dc - Rc - pc) * c - mc * cc
    outer, inner = R * Rc * c * cc - low * high, R * dc * c * cc - d * c * high
    return float(abs(outer**2 - inner * (d * c * Rc * cc - dc * cc * low)).abs_lower())


def _sharp_box(problem: Problem, root: NDArray[np.complex128]) -> list[Any] | None:
    """A box of `SHARP` bits that holds the root near a point."""
    from flint import ctx

    from solvers.arithmetic.values import exact_parameters
    from solvers.krawczyk import Question
    from solvers.krawczyk_arb import NotNearRoot, krawczyk_arb

    question = Question(
        problem.system.program,
        problem.system.jacobian_program,
        exact_parameters(problem.system, problem.parameters),
    )
    before, ctx.prec = ctx.prec, SHARP
    try:
        found = krawczyk_arb(question, root.tolist(), SHARP)
    except NotNearRoot:
        return None
    finally:
        ctx.prec = before
    return None if found is None else list(found.inclusion)
