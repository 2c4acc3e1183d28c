"""Four-bars that carry a body through two to five poses, and through poses mixed with points.

What is free decides the way:

===========  =====================================================================================
five poses   finitely many dyads, at most four real ones: `mechanisms.families.burmester`
===========  =====================================================================================
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

from mechanisms.families import burmester
from mechanisms.families.base import BODY, Candidate, Family, Problem
from mechanisms.families.dyad_pairs import INPUTS, pair_candidates
from mechanisms.families.motion_dyads import Poses, common_pole
from mechanisms.families.reality import real_roots
from mechanisms.task import Task, TaskError

if TYPE_CHECKING:
    from solvers import Solutions

__all__ = ["FourBarMotion"]


class FourBarMotion(Family):
    """One body through given poses by two dyads."""

    name = "four-bar-motion"
    summary = "four-bar or slider-crank that carries a body"
    source = "Burmester, Lehrbuch der Kinematik; McCarthy and Soh, Geometric Design of Linkages"
    pose_counts = (5,)
    too_many = "five poses leave four dyads and no choice"
    unknowns = "pivots of a dyad: z, zc, G, Gc"
    roots = "4 dyads"
    inputs = INPUTS

    def check(self, task: Task) -> None:
        """Refuse motions that need no four-bar, or that none can perform."""
        refuse_special_motions(task)

    def system(self, task: Task) -> Problem | None:
        """The conditions of five poses on a dyad."""
        poses = Poses.of(task.poses[BODY])
        return Problem(
            burmester.projective_system(),
            burmester.dyad_parameters(poses),
            finite=4,
            start=burmester.generic_dyads(),
            evidence="Burmester; two-homogeneous number 6 less the two isotropic roots",
            mirror=burmester.MIRROR,
        )

    def candidates(
        self,
        task: Task,
        solutions: Solutions | None,
        progress: Callable[[str, float], None] | None = None,
    ) -> Iterator[Candidate]:
        """Every pair of real dyads as a linkage; complex dyads by themselves."""
        assert solutions is not None
        poses = Poses.of(task.poses[BODY])
        yield from _five(task, poses, solutions)


def _five(task: Task, poses: Poses, solutions: Solutions) -> Iterator[Candidate]:
    real = real_roots(solutions.points, burmester.MIRROR)
    dyads = []
    for root, point in enumerate(solutions.points):
        if burmester.is_isotropic(point):
            yield Candidate(root, reasons=("degenerate",), note="isotropic: a root of every task, no dyad")
        elif not real[root]:
            yield Candidate(root, reasons=("complex",), note="a dyad with complex pivots")
        elif (dyad := burmester.dyad_of_root(poses, point, root)) is not None:
            dyads.append(dyad)
    if len(dyads) == 1:
        yield Candidate(dyads[0].root, reasons=("degenerate",), note="the only real dyad has no partner")
    yield from pair_candidates(poses, dyads, task.title, task.length_unit)


def refuse_special_motions(task: Task) -> None:
    """Translations and pure rotations have whole families of dyads, or none; say what carries them instead."""
    poses = Poses.of(task.poses[BODY])
    if len(poses) < 3:
        return
    if poses.parallel:
        raise TaskError(
            f"{task.where}: poses: the body never turns; two crossed slides carry it, and no dyad of two pins "
            f"does unless all positions lie on one circle; turn it in one of its poses"
        )
    pole = common_pole(poses)
    if pole is not None:
        raise TaskError(
            f"{task.where}: poses: the body only turns about the point ({pole.real:g}, {pole.imag:g}); pin it "
            f"there, no linkage is needed"
        )
