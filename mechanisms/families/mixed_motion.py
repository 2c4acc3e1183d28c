"""Tasks of poses and points, and of poses with numbers given, as polynomials: from a task to candidates.

The equations are those of `mechanisms.families.alt_burmester`.  With points the start is a catalogue entry or,
where none is shipped, monodromy; without points the two dyads have equations of their own, for which sixteen or
sixty-four paths of total degree are enough.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from mechanisms.designs import EXACT
from mechanisms.families.alt_burmester import (
    COORDINATES,
    COUNTS,
    FIVE_POINTS,
    GIVEN,
    LENGTHS,
    SOURCES,
    mixed_dyads,
    mixed_mirror,
    mixed_parameters,
    mixed_poses,
    mixed_system,
    swap,
)
from mechanisms.families.base import BODY, Candidate, Problem
from mechanisms.families.dyad_pairs import pair_candidate
from mechanisms.families.motion_dyads import Poses
from mechanisms.families.tolerance import TOLERANCES, check_tolerances
from mechanisms.task import Task, TaskError

if TYPE_CHECKING:
    from solvers import Solutions

__all__ = [
    "SEQUENCE",
    "check_mixed",
    "entry_name",
    "in_sequence",
    "is_mixed",
    "mixed_candidates",
    "mixed_problem",
    "numbers_given",
    "partners",
]

#: The free choice that says in which order positions are visited.
SEQUENCE = "sequence"
#: Two roots are each other's swap when they differ by less than this, relative.
SAME_ROOT = 1e-6


def numbers_given(task: Task) -> dict[str, float]:
    """The coordinates and lengths that a task gives as numbers, in the order of `GIVEN`."""
    return {name: task.free[name] for name in GIVEN if isinstance(task.free.get(name), (int, float))}


def is_mixed(task: Task) -> bool:
    """Whether a task needs the equations of both dyads: points, lengths, or a single coordinate of a pivot.

    A number beside a range is no single coordinate: it puts the pivot on a line.
    """
    if task.points.get(BODY) or any(name in task.free for name in LENGTHS):
        return True
    given = numbers_given(task)
    pivots = {name[:2] for name in given}
    return any(f"{pivot}_{axis}" not in task.free for pivot in pivots for axis in "xy")


def _counts(task: Task) -> tuple[int, int]:
    return len(task.poses.get(BODY, ())), len(task.points.get(BODY, ()))


def check_mixed(task: Task) -> None:
    """Refuse a task whose numbers do not add up to a finite number of designs.

    Raises
    ------
    TaskError
        One sentence: what is wrong, where, what to do.
    """
    poses, points = _counts(task)
    given = numbers_given(task)
    if not poses:
        raise TaskError(
            f"{task.where}: poses: missing; give the first position of the body as a pose, or use four-bar-path"
        )
    for name in task.free:
        if name not in (*GIVEN, SEQUENCE, *(item.name for item in TOLERANCES)):
            raise TaskError(
                f"{task.where}: free.{name}: the other data determine the linkage; leave it out, or leave out the "
                f"points and single numbers"
            )
        if name in COORDINATES and name not in given:
            raise TaskError(
                f"{task.where}: free.{name}: a range where the other data are to determine the linkage; "
                f"give a number, or leave it out"
            )
    have = 2 * poses + points + len(given)
    if have != 10:
        what = f"{poses} pose{'s' * (poses != 1)} and {points} point{'s' * (points != 1)}"
        what += f" with {len(given)} numbers given" if given else ""
        missing, extra = 10 - have, have - 10
        remedy = (
            f"leave {missing} free; give {missing} more of {', '.join(GIVEN)}, or more positions (a pose counts "
            f"for two, a point for one)" + ("" if points else "; or only whole pivots, or ranges of them")
            if have < 10
            else f"are {extra} too many (a pose counts for two, a point and a number for one, and ten determine a "
            f"four-bar); leave some out"
        )
        raise TaskError(f"{task.where}: {what} {remedy}")
    _check_sequence(task, poses + points)
    check_tolerances(task, poses, points)
    for number in (1, 2):
        own = [name for name in given if name[:2] in (f"O{number}", f"A{number}") or name == f"L_link{number}"]
        if len(own) + poses - 1 > 4:
            raise TaskError(
                f"{task.where}: free.{own[-1]}: {poses} poses leave {5 - poses} numbers of dyad {number} "
                f"free, and {len(own)} are given; give those of the other dyad instead"
            )


def _check_sequence(task: Task, count: int) -> None:
    """The order of visit names every position once, the first pose first."""
    order = task.free.get(SEQUENCE)
    if order is not None and (sorted(order) != list(range(count)) or order[0] != 0):
        raise TaskError(
            f"{task.where}: free.{SEQUENCE}: give the numbers 0 to {count - 1} in the order of visit, each once and 0 "
            f"first: the poses are numbered first, then the points"
        )


def in_sequence(task: Task, poses: Poses) -> Poses:
    """Positions in their order of visit."""
    order = [int(number) for number in task.free.get(SEQUENCE, range(len(poses)))]
    return Poses(poses.points[order], poses.angles[order])


def entry_name(task: Task) -> str:
    """The name of the generic solutions in the catalogue."""
    poses, points = _counts(task)
    given = ",".join(numbers_given(task))
    return f"alt-burmester:{poses}:{points}" + (f":{given}" if given else "")


def mixed_problem(task: Task) -> Problem:
    """The polynomials of the task."""
    poses, points = _counts(task)
    given = numbers_given(task)
    finite, evidence = None, ""
    if not given and (poses, points) in COUNTS:
        finite, evidence = COUNTS[poses, points], SOURCES[poses, points]
    elif (poses, points, tuple(given)) == FIVE_POINTS[0]:
        finite, evidence = FIVE_POINTS[1], "Morgan, Wampler, Solving a planar four-bar design problem"
    return Problem(
        mixed_system(poses, points, tuple(given)),
        mixed_parameters(Poses.of(task.poses[BODY]), _points(task), task.size, given),
        finite=finite,
        start="auto" if points else "total-degree",
        catalogue=entry_name(task) if points else None,
        evidence=evidence,
        mirror=mixed_mirror(points),
    )


def _points(task: Task) -> NDArray[np.complex128]:
    return np.array(task.points.get(BODY, ()), dtype=complex)


def mixed_candidates(task: Task, solutions: Solutions) -> Iterator[Candidate]:
    """A candidate for every four-bar: two roots that differ by the names of the dyads are one."""
    poses = Poses.of(task.poses[BODY])
    problem = mixed_problem(task)
    roots = solutions.points
    real = problem.real(roots)
    partner = partners(roots) if not numbers_given(task) else np.full(len(roots), -1)
    for root, point in enumerate(roots):
        other = int(partner[root])
        if 0 <= other < root:
            continue
        members = [root] if other < 0 else [root, other]
        extra: dict[str, Any] = {"roots": members}
        if not real[root]:
            yield Candidate(root, reasons=("complex",), note="complex pivots or turns", extra=extra)
            continue
        dyads = mixed_dyads(point, complex(poses.points[0]), task.size)
        everywhere = mixed_poses(poses, _points(task), point)
        if SEQUENCE not in task.free:
            yield pair_candidate(everywhere, *dyads, task.title, task.length_unit, extra)
            continue
        everywhere = in_sequence(task, everywhere)
        candidate = pair_candidate(everywhere, *dyads, task.title, task.length_unit, extra)
        # the positions are no longer in the task's order, so that the error is measured here: it is in the links
        error = max(float(dyad.errors(everywhere).max()) for dyad in dyads)
        reasons = candidate.reasons + (("inexact",) if error > EXACT * task.size else ())
        yield replace(candidate, pose_error=error, angle_error=0.0, reasons=reasons)


def partners(roots: NDArray[np.complex128]) -> NDArray[np.int64]:
    """For each root the number of the one in which the dyads have changed places; −1 if it is missing."""
    from solvers.points import PointSet

    known = PointSet(roots.shape[1], tolerance=SAME_ROOT)
    numbers = known.add(roots)
    if len(known) != len(roots):  # two roots within the tolerance: no partners can be told apart
        return np.full(len(roots), -1, np.int64)
    found = known.find(swap(roots))
    back = np.full(len(known), -1, np.int64)
    back[numbers] = np.arange(len(roots))
    return np.where(found >= 0, back[found], -1)
