"""The rotatory trammel alone: every trammel that carries a body through five, six or seven poses, and what eight allow.

The trammel has two degrees of freedom: it is the part of the modified Wanzer linkage that decides which poses the body
can take.  See `mechanisms.families.trammel` for the equations, `mechanisms.families.wanzer_equations` for the proof
that seven poses is the most, and `mechanisms.families.eight_poses` for eight.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING

from mechanisms.families.base import BODY, Candidate, Family, Problem, Solved
from mechanisms.families.eight_poses import (
    EIGHT,
    MAX_ANGLE_ERROR,
    TOLERANCE,
    EightPoses,
    eight_pose_answer,
    seven_of,
    solve_eight,
)
from mechanisms.families.trammel_choices import FREE
from mechanisms.families.trammel_linkage import trammel_linkage, trammel_poses
from mechanisms.families.trammel_positions import Near
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
    pose_counts = (5, 6, 7, 8)
    too_many = "its six essential parameters meet one pose each beside pose 0"
    unknowns = "m, d, R and the disk's turns"
    roots = "560 for seven poses"
    free = (*FREE, MAX_ANGLE_ERROR)

    def check(self, task: Task) -> None:
        """Refuse choices that do not fit and pure translations."""
        seven_of(task).check()

    def system(self, task: Task) -> Problem | None:
        """The tracking form."""
        return seven_of(task).problem()

    def solve(self, task: Task, solver: Callable[[Problem], Solutions]) -> list[Solved]:
        """One problem for up to seven poses, eight for eight."""
        return solve_eight(task, solver) if len(task.poses[BODY]) == EIGHT else super().solve(task, solver)

    def designs_of(
        self, task: Task, solved: Sequence[Solved], progress: Callable[[str, float], None] | None = None
    ) -> Iterator[Candidate]:
        """Every root; for eight poses then the least-squares designs."""
        if len(task.poses[BODY]) != EIGHT:
            yield from super().designs_of(task, solved, progress)
            return
        answer = eight_pose_answer(task, solved, progress)
        yield from answer.rejected
        for near in answer.ranked:
            yield _near_candidate(task, near, answer)

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


def _near_candidate(task: Task, near: Near, answer: EightPoses) -> Candidate:
    """A trammel that carries P to all eight positions."""
    size_of_error = near.worst
    tolerance = float(task.free.get("max_angle_error", TOLERANCE))
    return Candidate(
        None if near.root < 0 else near.root,
        near.parameters(),
        trammel_linkage(near.trammel, task.poses[BODY][0].point, task.title, task.length_unit),
        trammel_poses(near.disk, near.coupler),
        reasons=() if size_of_error <= tolerance else ("inexact",),
        note=answer.note(near),
        angles=ANGLES,
        pose_error=0.0,
        angle_error=size_of_error,
        extra=answer.extra(near),
    )


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
