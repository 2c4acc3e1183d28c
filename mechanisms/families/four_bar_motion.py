"""Four-bars that carry a body through two to five poses, and through poses mixed with points.

What the poses leave free decides the way:

===========  ======================  =========================================================================
poses        dyads                   designs
===========  ======================  =========================================================================
five         four, real or not       every pair of real ones (`mechanisms.families.burmester`)
four         a curve of them         the best pairs of points of the curve, or of the points next to given
                                     pivots (`mechanisms.families.circle_points`)
three, two   two or three free       the best pairs with pivots that are given, lie in given ranges, or
             numbers for each dyad   anywhere near the poses (`mechanisms.families.dyad_pools`)
parallel     cranks of one vector    parallelograms, a Scotch yoke, or a slide and its crank
             and crossed slides      (`mechanisms.families.translations`)
with points  both together           all of them, when 2M + N numbers and those given make ten
                                     (`mechanisms.families.alt_burmester`)
===========  ======================  =========================================================================

Slider-cranks and their inversions are among them: a slider is a dyad with a pivot at infinity.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

import numpy as np

from mechanisms.families import burmester
from mechanisms.families.base import BODY, Candidate, Family, Free, Problem
from mechanisms.families.dyad_pairs import INPUTS, pair_candidates
from mechanisms.families.dyad_pools import DyadPool, sliders_of_circles
from mechanisms.families.mixed_motion import SEQUENCE, check_mixed, is_mixed, mixed_candidates, mixed_problem
from mechanisms.families.mixed_sliders import slider_candidates
from mechanisms.families.motion_choices import SAMPLES, STATIONS, check_number, pools, region_of, regions_of
from mechanisms.families.motion_dyads import Poses
from mechanisms.families.pair_search import search_candidates
from mechanisms.families.reality import real_roots
from mechanisms.families.special_motions import (
    refuse_special_mixtures,
    refuse_special_motions,
    refuse_whole_families,
)
from mechanisms.families.tolerance import (
    TOLERANCES,
    Source,
    check_tolerances,
    tolerance_candidates,
    tolerances_of,
    with_moves,
)
from mechanisms.families.tolerance_mixed import MixedPositions, positions_of
from mechanisms.families.tolerance_sources import FewerPoses, FivePoses
from mechanisms.families.translation_fit import nearest_translation
from mechanisms.families.translations import circle_of, line_of, translation_candidates
from mechanisms.families.two_sliders import slider_pairs
from mechanisms.task import Task, TaskError

if TYPE_CHECKING:
    from solvers import Solutions

__all__ = ["FourBarMotion"]

_PIVOTS = tuple(
    Free(f"{pivot}{number}_{axis}", "length", f"{axis} of the {word} pivot of dyad {number}", range=True)
    for number in (1, 2)
    for pivot, word in (("O", "fixed"), ("A", "moving"))
    for axis in "xy"
)
_LENGTHS = tuple(
    Free(name, "length", f"length of {words}")
    for name, words in (
        ("L_ground", "the frame, between the fixed pivots"),
        ("L_link1", "the link of dyad 1"),
        ("L_coupler", "the coupler, between the moving pivots"),
        ("L_link2", "the link of dyad 2"),
    )
)
_NUMBERS = tuple(Free(f"dyad{k}", "number", f"number of dyad {k} on the map of four poses") for k in (1, 2))
_SEQUENCE = Free(SEQUENCE, "number", "order of visit by number, poses counted first, then points", many=True)


class FourBarMotion(Family):
    """One body through given poses by two dyads."""

    name = "four-bar-motion"
    summary = "four-bar or slider-crank that carries a body"
    source = "Burmester, Lehrbuch der Kinematik; McCarthy and Soh, Geometric Design of Linkages"
    pose_counts = (1, 2, 3, 4, 5)
    point_counts = (1, 2, 3, 4, 5, 6, 7, 8)
    too_many = "five poses leave four dyads and no choice"
    unknowns = "pivots of a dyad: z, zc, G, Gc"
    roots = "4 dyads; 60, 402, 2224, 8652 pairs with points"
    free = (*_PIVOTS, *_NUMBERS, *_LENGTHS, *TOLERANCES, _SEQUENCE)
    inputs = INPUTS

    def check(self, task: Task) -> None:
        """Refuse motions that need no four-bar, and choices that the poses do not leave."""
        if is_mixed(task) or BODY not in task.poses:
            check_mixed(task)
            refuse_special_mixtures(task)
            return
        if SEQUENCE in task.free:
            raise TaskError(f"{task.where}: free.{SEQUENCE}: poses are visited as they stand in the list; reorder it")
        poses = Poses.of(task.poses[BODY])
        if len(poses) == 1:
            raise TaskError(f"{task.where}: poses: one pose alone is no motion; give more poses, or points")
        check_tolerances(task, len(poses))
        refuse_special_motions(task, poses)
        chosen = [name for name in task.free if name not in {item.name for item in TOLERANCES}]
        if len(poses) == 5 and not poses.parallel:
            refuse_whole_families(task, poses)
        if len(poses) == 5 and not poses.parallel and chosen:
            raise TaskError(
                f"{task.where}: free.{chosen[0]}: five poses determine every pivot; leave it out, or leave out a pose"
            )
        for number in (1, 2):
            if f"dyad{number}" in task.free:
                check_number(task, poses, number)
            if all(region_of(task, f"{pivot}{number}").point is not None for pivot in "OA"):
                raise TaskError(
                    f"{task.where}: free.A{number}: either pivot of a dyad determines what the other can be; "
                    f"give one as a point and the other, if at all, as a range"
                )

    def system(self, task: Task) -> Problem | None:
        """The conditions of five poses on a dyad; None for fewer poses, which leave a choice."""
        if is_mixed(task):
            return mixed_problem(task)
        poses = Poses.of(task.poses[BODY])
        if len(poses) < 5 or poses.parallel:
            return None
        return Problem(
            burmester.projective_system(),
            burmester.dyad_parameters(poses),
            finite=4,
            start=burmester.generic_dyads(),
            evidence="Burmester; two-homogeneous number 6 less the two isotropic roots",
            mirror=burmester.MIRROR,
        )

    def freedom(self, task: Task) -> str:
        """What the poses leave open."""
        poses = len(task.poses[BODY])
        count = task.solve.get("samples", STATIONS if poses == 4 else SAMPLES)
        if Poses.of(task.poses[BODY]).parallel and poses > 2:
            return f"the body never turns: every crank has one vector, and its place is free; up to {count} were paired"
        left = {
            4: f"four poses leave a curve of dyads; up to {count} points of it were paired",
            3: f"three poses leave a plane of dyads; up to {count} for each side were paired",
            2: f"two poses leave three free numbers for each dyad; up to {count} for each side were paired",
        }
        return left.get(poses, "")

    def candidates(
        self,
        task: Task,
        solutions: Solutions | None,
        progress: Callable[[str, float], None] | None = None,
    ) -> Iterator[Candidate]:
        """Every pair of real dyads of five poses; the best pairs found for fewer."""
        if solutions is not None and is_mixed(task):
            yield from mixed_candidates(task, solutions)
            if solutions.ledger.at_infinity and task.points.get(BODY):
                yield from slider_candidates(task, solutions.ledger.at_infinity)
            yield from _within_tolerances(task, progress)
            return
        poses = Poses.of(task.poses[BODY])
        if solutions is not None:
            yield from _five(task, poses, solutions)
            yield from _within_tolerances(task, progress)
            return
        if progress is not None:
            progress("pairing dyads", 0.0)
        names = task.title, task.length_unit
        if len(poses) == 2 or not poses.parallel:
            count = int(task.solve.get("samples", STATIONS if len(poses) == 4 else SAMPLES))
            yield from search_candidates(poses, *pools(task, poses, count), task.constraints, *names)
            yield from _within_tolerances(task, progress)
        if poses.parallel:
            yield from _translations(task, poses)


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
    circles = sliders_of_circles(poses)
    if len(dyads) == 1 and not circles:
        yield Candidate(dyads[0].root, reasons=("degenerate",), note="the only real dyad has no partner")
    if len(solutions.singular):
        count = int(solutions.singular.multiplicity.sum())
        words = f"{count} paths end where dyads are double or fill a whole curve"
        yield Candidate(None, reasons=("degenerate",), note=words)
    names = task.title, task.length_unit
    yield from pair_candidates(poses, dyads, *names)
    if circles:
        links = DyadPool.of([d.fixed for d in dyads if d.kind == "RR"], [d.moving for d in dyads if d.kind == "RR"])
        pool = DyadPool.of([], []).with_sliders(circles, poses.size)
        if len(links):
            yield from search_candidates(poses, links, pool, task.constraints, *names)
        yield from slider_pairs(poses, circles, circles, task.constraints, *names)


def _translations(task: Task, poses: Poses) -> Iterator[Candidate]:
    """Linkages for parallel poses, or for those within the tolerances that need least of them."""
    zones = tolerances_of(task, len(poses))
    samples = int(task.solve.get("samples", SAMPLES))
    rest = regions_of(task), task.constraints, samples, task.seed, task.title, task.length_unit
    if zones is None or len(poses) == 2 or circle_of(poses) is not None or line_of(poses) is not None:
        yield from translation_candidates(poses, *rest)
    elif (found := nearest_translation(poses, zones)) is not None:
        moved, used = found
        for candidate in translation_candidates(moved, *rest):
            yield with_moves(candidate, poses, moved, np.zeros(len(poses)), used)


def _within_tolerances(task: Task, progress: Callable[[str, float], None] | None) -> Iterator[Candidate]:
    """Designs without defects for poses that are missed a little; nothing where a task gives no tolerances."""
    positions = positions_of(task)
    zones = tolerances_of(task, len(positions))
    if zones is None:
        return
    if progress is not None:
        progress("searching within the tolerances", 0.0)
    source: Source = FivePoses() if len(positions) == 5 else FewerPoses(task)
    trials = int(task.solve["samples"]) if len(positions) == 5 and "samples" in task.solve else None
    if is_mixed(task):
        source, trials = MixedPositions(task), None
    names = task.title, task.length_unit
    yield from tolerance_candidates(source, positions, zones, task.seed, task.constraints, *names, trials)
