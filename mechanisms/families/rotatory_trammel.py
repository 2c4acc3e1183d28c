"""The rotatory trammel alone: every trammel that carries a body through five, six or seven poses, and what eight allow.

The trammel has two degrees of freedom: it is the part of the modified Wanzer linkage that decides which poses the body
can take.  See `mechanisms.families.trammel` for the equations, `mechanisms.families.wanzer_equations` for the proof that
seven poses is the most, and `mechanisms.families.eight_poses` for eight.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

from mechanisms.families.base import Candidate, Family, Problem
from mechanisms.families.trammel_choices import FREE
from mechanisms.families.trammel_linkage import trammel_linkage, trammel_poses
from mechanisms.families.trammel_task import ANGLES, Placed, TrammelTask
from mechanisms.task import Task

if TYPE_CHECKING:
    from solvers import Solutions

__all__ = ["RotatoryTrammel"]


class RotatoryTrammel(Family):
    """A slotted disk and a coupler with two pins: five to seven poses exactly."""

    name = "rotatory-trammel"
    summary = "slotted disk with a coupler on two pins, two degrees of freedom"
    source = (
        "Suárez-Velásquez, Cervantes-Sánchez, Rico-Martínez, Synthesis of a novel planar linkage to visit up to "
        "eight poses"
    )
    pose_counts = (5, 6, 7)
    too_many = "its six essential parameters meet one pose each beside pose 0"
    unknowns = "m, d, R and the disk's turns"
    roots = "560 for seven poses"
    free = FREE

    def check(self, task: Task) -> None:
        """Refuse choices that do not fit and pure translations."""
        TrammelTask(task).check()

    def system(self, task: Task) -> Problem | None:
        """The tracking form."""
        return TrammelTask(task).problem()

    def candidates(
        self,
        task: Task,
        solutions: Solutions | None,
        progress: Callable[[str, float], None] | None = None,
    ) -> Iterator[Candidate]:
        """Every root as a trammel, in the gauge that the task chooses."""
        assert solutions is not None
        part = TrammelTask(task)
        for found in part.trammels(solutions):
            yield candidate(part, found) if isinstance(found, Placed) else found


def candidate(part: TrammelTask, found: Placed, note: str = "") -> Candidate:
    """A trammel that stands for itself."""
    task = part.task
    return Candidate(
        found.root,
        found.parameters(),
        trammel_linkage(found.trammel, part.origin, task.title, task.length_unit),
        trammel_poses(found.disk, part.turns),
        note=note,
        angles=ANGLES,
    )
