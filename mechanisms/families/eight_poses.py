"""What a rotatory trammel can do for eight poses.

**Exactly: seven poses.**  The trammel has six essential parameters (`mechanisms.families.wanzer_equations` proves that
the Jacobian of Eq. (17) has rank six at most, whatever the poses), and each pose beside pose 0 is one equation.  Seven
equations for six unknowns have no solution for eight poses in general, contrary to the paper's Table 1.

What can be said about eight particular poses, completely:

- *Exact designs* are among the roots of any seven of the poses.  All roots of the first seven are certified, and for
  each the eighth equation is evaluated in ball arithmetic over the box that holds the root: where it excludes zero at
  every root, no trammel, real or complex, meets all eight.
- *Seven poses and the eighth position.*  The trammel has two degrees of freedom: it carries P to the eighth position
  and leaves the orientation to the linkage.  All real designs of all eight choices of seven poses are ranked by the
  error of that orientation.
- *Least squares.*  From each of the best of these the sum of squared orientation errors over all eight poses is made as
  small as it gets, with P in every position exactly.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mechanisms.families.base import BODY, Candidate, Free, Problem, Solved
from mechanisms.families.eight_absence import Absence, absence
from mechanisms.families.eight_squares import best_polished
from mechanisms.families.trammel import Trammel
from mechanisms.families.trammel_positions import Near, configurations, same_trammel
from mechanisms.families.trammel_task import Placed, TrammelTask
from mechanisms.task import Task

if TYPE_CHECKING:
    from solvers import Solutions

__all__ = [
    "EIGHT",
    "MAX_ANGLE_ERROR",
    "TOLERANCE",
    "EightPoses",
    "distinct_exact",
    "eight_pose_answer",
    "near_designs",
    "seven_of",
    "solve_eight",
]

EIGHT = 8
#: Least-squares designs, and those of seven poses, count as designs when no orientation misses by more than this,
#: unless the task says otherwise: a degree is what a drawing shows.
TOLERANCE = math.radians(1.0)
MAX_ANGLE_ERROR = Free("max_angle_error", "angle", "largest orientation error that an eight-pose design may have")


def solve_eight(task: Task, solver: Callable[[Problem], Solutions]) -> list[Solved]:
    """All roots of the eight choices of seven poses; the k-th leaves out pose 7 − k."""
    parts = [TrammelTask(task, _without(omitted)) for omitted in reversed(range(EIGHT))]
    problems = [part.problem() for part in parts]
    return [Solved(problem, solver(problem)) for problem in problems]


def seven_of(task: Task) -> TrammelTask:
    """The task itself, or its first seven poses if there are eight."""
    return TrammelTask(task, _without(EIGHT - 1) if len(task.poses[BODY]) == EIGHT else ())


@dataclass(frozen=True, eq=False)
class EightPoses:
    """The answer to an eight-pose task.

    Attributes
    ----------
    rejected : list of Candidate
        Roots that are no trammel, or that cannot reach the eighth position.
    ranked : list of Near
        Exact designs, then least-squares ones and those of seven poses, by their largest orientation error.
    absence : Absence
        The proof that there is no exact design, if there is none.
    """

    rejected: list[Candidate]
    ranked: list[Near]
    absence: Absence

    def note(self, near: Near) -> str:
        """What a design is, in a few words."""
        if near.exact:
            return "meets all eight poses: these poses are special, as general ones allow seven"
        if near.omitted is None:
            return "least squares over all eight orientations, every position exact"
        return f"seven poses and the position of pose {near.omitted} exact"

    def extra(self, near: Near) -> dict[str, float]:
        """Numbers for tables."""
        rms = float(np.sqrt(np.mean(near.errors**2)))
        found: dict[str, float] = {"rms_angle_error_deg": math.degrees(rms)}
        if near.omitted is not None:
            found["omitted_pose"] = near.omitted
        return found


def eight_pose_answer(
    task: Task, solved: Sequence[Solved], progress: Callable[[str, float], None] | None = None
) -> EightPoses:
    """All that a trammel can do for eight poses.

    Parameters
    ----------
    solved : sequence of Solved
        By `solve_eight`.
    """
    found = list(near_designs(task, solved))
    rejected = [each for each in found if isinstance(each, Candidate)]
    near = [each for each in found if isinstance(each, Near)]
    exact = distinct_exact(near, task.size)
    if progress is not None:
        progress("least squares over eight poses", 0.5)
    rest = [each for each in near if not each.exact]
    squares = [] if exact else best_polished(task, rest)
    again = [each for each in near if each.exact and each not in exact]
    rejected += [
        Candidate(each.root, reasons=("degenerate",), note="exact, found by another choice of seven poses too")
        for each in again
    ]
    return EightPoses(rejected, exact + sorted(squares + rest, key=lambda n: n.worst), absence(task, solved[0]))


def near_designs(task: Task, solved: Sequence[Solved]) -> Iterator[Candidate | Near]:
    """Every root of every choice: a trammel with its eighth position, or why there is none."""
    first = 0
    for k, each in enumerate(solved):
        omitted = EIGHT - 1 - k
        part = TrammelTask(task, _without(omitted))
        for found in part.trammels(each.solutions, first):
            yield _with_eighth(task, part, found, omitted) if isinstance(found, Placed) else found
        first += len(each.solutions.points)


def _without(omitted: int) -> tuple[int, ...]:
    return tuple(k for k in range(EIGHT) if k != omitted)


def _with_eighth(task: Task, part: TrammelTask, found: Placed, omitted: int) -> Candidate | Near:
    """The configuration with P in the eighth position that is nearest to its orientation."""
    poses = task.poses[BODY]
    wanted = math.remainder(poses[omitted].angle - poses[part.poses[0]].angle, math.tau)
    disk, coupler = configurations(found.trammel, poses[omitted].point - part.origin)
    if not len(disk):
        note = f"the trammel cannot carry P to the position of pose {omitted}"
        return Candidate(found.root, found.parameters(), reasons=("inexact",), note=note)
    error = np.angle(np.exp(1j * (coupler - wanted)))
    best = int(np.argmin(np.abs(error)))
    turned = np.insert(part.turns, omitted, wanted + error[best])
    disks = np.insert(found.disk, omitted, disk[best])
    errors = np.zeros(EIGHT)
    errors[omitted] = error[best]
    return _from_pose_0(task, found, part, omitted, disks, turned, errors)


def _from_pose_0(
    task: Task,
    found: Placed,
    part: TrammelTask,
    omitted: int | None,
    disk: NDArray[np.float64],
    coupler: NDArray[np.float64],
    errors: NDArray[np.float64],
) -> Near:
    """The trammel as it stands in pose 0, which is the first that was used unless that is the one left out."""
    t = found.trammel
    turn = np.exp(1j * coupler[0])
    pivot = part.origin + t.Q - task.poses[BODY][0].point
    moved = Trammel(turn * t.B, turn * t.C, pivot, t.theta0 + float(disk[0]))
    if omitted == 0:  # the gauge was chosen for pose 0
        moved = Trammel.from_essential(*moved.essential(), t.theta0)
    return Near(found.root, omitted, moved, disk - disk[0], coupler - coupler[0], errors)


def distinct_exact(near: Sequence[Near], size: float) -> list[Near]:
    """Exact designs are found by every choice of seven: each once."""
    found: list[Near] = []
    for each in near:
        if each.exact and not any(same_trammel(each, other, size) for other in found):
            found.append(each)
    return found
