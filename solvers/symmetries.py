"""What maps the roots of a family to roots: at the same parameters, at conjugate ones, at exchanged ones."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from solvers.local import newton_step
from solvers.points import Group, Symmetry
from solvers.system import InvalidSystem, System

#: An image of a root under a symmetry is a root when the Newton step there is smaller than this, relative.
MAPPED = 1e-6


class Mirror(NamedTuple):
    """Complex conjugation, in the coordinates of a system: it maps roots at parameters to roots at their image.

    Both maps are antiholomorphic and their own inverses; that of the parameters is antilinear. Where parameters are
    their own image, those of real tasks are, every root comes with its image.

    Attributes
    ----------
    points : callable
        Unknowns (n, k) to unknowns (n, k).
    parameters : callable
        Parameters (m,) to parameters (m,).
    """

    points: Callable[[np.ndarray], np.ndarray]
    parameters: Callable[[np.ndarray], np.ndarray]


#: ``exchanges(rng)``: an exchange of unknowns and one of parameters, as index arrays, that together map roots to roots.
#: Poses may be numbered in any order, for instance. A leg may begin with any of them; to roots that are hard to reach
#: others lead, of the same kind.
Exchanges = Callable[[np.random.Generator], tuple[np.ndarray, np.ndarray]]


def checked_group(system: System, symmetry: Sequence[Symmetry], probe: np.ndarray, parameters: np.ndarray) -> Group:
    """The group that these symmetries generate.

    Raises
    ------
    InvalidSystem
        One of them makes something else of a root.
    """
    group = Group(symmetry, probe, parameters)
    images = group.orbits(probe, parameters)[:, 0]
    _, size, _ = newton_step(system.jacobian_program, images, parameters, float(np.abs(probe).max()))
    wrong = np.flatnonzero(size > MAPPED)
    if wrong.size:
        which = group.words[wrong[0]][-1]
        raise InvalidSystem(f"symmetry number {which} does not map solutions to solutions of the same parameters")
    return group
