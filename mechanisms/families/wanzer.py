"""The original Wanzer linkage: a slotted disk, a coupler with two pins in it, and a third pin on a vertical guide.

Two kinds of conditions, which do not know of each other:

- Eq. (6), linear: the guided point A keeps its x in three poses, which determines it;
- Eq. (16) for two later poses, which leaves four of the trammel's six essential parameters to be chosen, and θ₀.

Three poses are the most, because Eq. (6) has two unknowns.  The trammel's part is solved as for more poses, with four
conditions in place of the poses that are missing.

Source: Suárez-Velásquez, Cervantes-Sánchez, Rico-Martínez, Synthesis of a novel planar linkage to visit up to eight
poses, Mech. Based Des. Struct. Mach. 46(6), 2018, Section 2.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

import numpy as np

from mechanisms.families.base import Candidate, Family, Problem
from mechanisms.families.trammel_choices import FREE
from mechanisms.families.trammel_linkage import guided_linkage, guided_poses
from mechanisms.families.trammel_task import ANGLES, Placed, TrammelTask
from mechanisms.task import Task, TaskError

if TYPE_CHECKING:
    from solvers import Solutions

__all__ = ["Wanzer", "guided_point"]

#: Eq. (6) for two poses is taken as singular when its determinant is below this.
SINGULAR = 1e-12


class Wanzer(Family):
    """One body through three poses by the original Wanzer linkage."""

    name = "wanzer"
    summary = "Wanzer linkage: slotted disk and a vertical guide"
    source = (
        "Suárez-Velásquez, Cervantes-Sánchez, Rico-Martínez, Synthesis of a novel planar linkage to visit up to "
        "eight poses"
    )
    pose_counts = (3,)
    too_many = "Eq. (6) has two unknowns, x_A and y_A; wanzer-modified takes more"
    unknowns = "m, d, R and the disk's turns"
    roots = "depends on what is chosen"
    free = FREE
    inputs = ("disk", "guide")

    def check(self, task: Task) -> None:
        """Refuse choices that do not fit, and poses that leave the guided point open."""
        part = TrammelTask(task)
        part.check()
        if guided_point(part) is None:
            raise TaskError(
                f"{task.where}: poses: two of the three have the same orientation, so that Eq. (6) asks for a guided "
                f"point that does not exist or is not determined; turn the body between all three"
            )

    def system(self, task: Task) -> Problem | None:
        """Eq. (16) for two poses, and the choices."""
        return TrammelTask(task).problem()

    def candidates(
        self,
        task: Task,
        solutions: Solutions | None,
        progress: Callable[[str, float], None] | None = None,
    ) -> Iterator[Candidate]:
        """Every root with the guided point, which is the same for all."""
        assert solutions is not None
        part = TrammelTask(task)
        a_point = guided_point(part)
        assert a_point is not None
        for found in part.trammels(solutions):
            if not isinstance(found, Placed):
                yield found
                continue
            yield Candidate(
                found.root,
                {**found.parameters(), "x_A": a_point.real, "y_A": a_point.imag},
                guided_linkage(found.trammel, a_point, part.origin, task.title, task.length_unit),
                guided_poses(found.disk, part.turns),
                angles=ANGLES,
            )


def guided_point(part: TrammelTask) -> complex | None:
    """A in pose 0, measured from P, by Eq. (6); None where it is not determined.

    The determinant is 4 sin(φ₁/2) sin(φ₂/2) sin((φ₁ − φ₂)/2), up to sign: it vanishes when two of the three
    orientations agree.
    """
    one, two = part.turns[1:]
    if abs(4 * math.sin(one / 2) * math.sin(two / 2) * math.sin((one - two) / 2)) < SINGULAR:
        return None
    rows = np.array([[math.cos(turn) - 1, -math.sin(turn)] for turn in (one, two)])
    x, y = np.linalg.solve(rows, -part.points[1:].real)
    return complex(x, y)
