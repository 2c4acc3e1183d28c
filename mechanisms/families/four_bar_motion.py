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
from typing import TYPE_CHECKING, Any

import numpy as np

from mechanisms.families import burmester
from mechanisms.families.base import BODY, Candidate, Family, Free, Problem
from mechanisms.families.circle_points import CircleCurve
from mechanisms.families.dyad_pairs import INPUTS, pair_candidates
from mechanisms.families.dyad_pools import DyadPool, Region, curve_pool, sampled_pool, sliders_of_circles
from mechanisms.families.mixed_motion import SEQUENCE, check_mixed, is_mixed, mixed_candidates, mixed_problem
from mechanisms.families.motion_dyads import Poses
from mechanisms.families.pair_search import search_candidates
from mechanisms.families.reality import real_roots
from mechanisms.families.special_motions import (
    refuse_free_translations,
    refuse_special_motions,
    refuse_whole_families,
)
from mechanisms.families.tolerance import TRIALS, Tolerances, check_tolerances, tolerance_candidates
from mechanisms.families.translations import Regions, translation_candidates
from mechanisms.families.two_sliders import slider_pairs
from mechanisms.task import Task, TaskError

if TYPE_CHECKING:
    from solvers import Solutions

__all__ = ["FourBarMotion"]

#: Points of the four-pose curve that are paired, and dyads sampled for each side with fewer poses. All their pairs
#: are judged in about a second.
STATIONS, SAMPLES = 240, 256

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
_TOLERANCES = (
    Free("tolerance_x", "length", "how far each pose may be missed in x", many=True),
    Free("tolerance_y", "length", "how far each pose may be missed in y", many=True),
    Free("tolerance_angle", "angle", "how far each pose may be missed in angle", many=True),
)


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
    free = (*_PIVOTS, *_NUMBERS, *_LENGTHS, *_TOLERANCES, _SEQUENCE)
    inputs = INPUTS

    def check(self, task: Task) -> None:
        """Refuse motions that need no four-bar, and choices that the poses do not leave."""
        if is_mixed(task) or BODY not in task.poses:
            check_mixed(task)
            refuse_free_translations(task)
            return
        if SEQUENCE in task.free:
            raise TaskError(f"{task.where}: free.{SEQUENCE}: poses are visited as they stand in the list; reorder it")
        poses = Poses.of(task.poses[BODY])
        if len(poses) == 1:
            raise TaskError(f"{task.where}: poses: one pose alone is no motion; give more poses, or points")
        refuse_special_motions(task, poses)
        check_tolerances(task, len(poses), _TOLERANCES)
        chosen = [name for name in task.free if name not in {item.name for item in _TOLERANCES}]
        if len(poses) == 5 and not poses.parallel:
            refuse_whole_families(task, poses)
        if len(poses) == 5 and not poses.parallel and chosen:
            raise TaskError(
                f"{task.where}: free.{chosen[0]}: five poses determine every pivot; leave it out, or leave out a pose"
            )
        for number in (1, 2):
            if f"dyad{number}" in task.free:
                _check_number(task, poses, number)
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
            return
        poses = Poses.of(task.poses[BODY])
        if solutions is not None:
            yield from _five(task, poses, solutions)
            return
        if progress is not None:
            progress("pairing dyads", 0.0)
        names = task.title, task.length_unit
        if len(poses) == 2 or not poses.parallel:
            yield from search_candidates(poses, *pools(task), task.constraints, *names)
        if poses.parallel:
            samples = int(task.solve.get("samples", SAMPLES))
            yield from translation_candidates(poses, _regions(task), task.constraints, samples, task.seed, *names)


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
        yield from search_candidates(poses, links, pool, task.constraints, *names)
        yield from slider_pairs(poses, circles, circles, task.constraints, *names)
    if (zones := tolerances(task)) is not None:
        trials = int(task.solve.get("samples", TRIALS))
        yield from tolerance_candidates(poses, zones, task.seed, task.constraints, *names, trials)


def tolerances(task: Task) -> Tolerances | None:
    """The tolerances of a task; None when every pose is to be met exactly."""
    if not any(item.name in task.free for item in _TOLERANCES):
        return None
    zero = (0.0,) * len(task.poses[BODY])
    return Tolerances(*(np.array(task.free.get(item.name, zero), dtype=float) for item in _TOLERANCES))


def pools(task: Task) -> tuple[DyadPool, DyadPool]:
    """The dyads that a task of two to four poses leaves for either side; one pool twice, if nothing is given."""
    poses, regions = Poses.of(task.poses[BODY]), _regions(task)
    if len(poses) == 4:
        try:
            curve = CircleCurve(poses)
        except ValueError as error:
            raise TaskError(f"{task.where}: poses: {error}") from None
        numbers = [task.free.get(f"dyad{k}") for k in (1, 2)]
        count = int(task.solve.get("samples", STATIONS))
        found = [_of_curve(curve, count, number, *pair) for number, pair in zip(numbers, regions)]
        if any(number is not None for number in numbers):
            return found[0], found[1]
    else:
        count = int(task.solve.get("samples", SAMPLES))
        found = [sampled_pool(poses, count, *pair, seed=task.seed + k) for k, pair in enumerate(regions)]
    if not any(region.given for pair in regions for region in pair):
        return found[0], found[0]
    return found[0], found[1]


def _check_number(task: Task, poses: Poses, number: int) -> None:
    """A dyad named by its number on the map needs four poses, that number on their curve, and nothing else."""
    place = f"{task.where}: free.dyad{number}"
    if len(poses) != 4:
        raise TaskError(f"{place}: {len(poses)} poses have no map; leave it out, or give four poses")
    if region_of(task, f"O{number}").given or region_of(task, f"A{number}").given:
        raise TaskError(f"{place}: a number determines both pivots of the dyad; leave out O{number} and A{number}")
    try:
        CircleCurve(poses).at_station(task.free[f"dyad{number}"])
    except ValueError as error:
        raise TaskError(f"{place}: {error}") from None


def _regions(task: Task) -> Regions:
    first, second = ((region_of(task, f"O{number}"), region_of(task, f"A{number}")) for number in (1, 2))
    return first, second


def region_of(task: Task, pivot: str) -> Region:
    """What a task asks of the pivot O1, A1, O2 or A2."""
    sides: list[Any] = []
    for axis in "xy":
        value = task.free.get(f"{pivot}_{axis}")
        sides.append(None if value is None else value if isinstance(value, tuple) else (value, value))
    return Region(*sides)


def _of_curve(curve: CircleCurve, count: int, number: float | None, fixed: Region, moving: Region) -> DyadPool:
    if number is not None:
        return DyadPool.of(*curve.at_station(number), dyad=np.array([number]))
    for region, which in ((moving, "moving"), (fixed, "fixed")):
        if (place := region.point) is not None and curve.circuits:
            circuit, phi, distance = curve.nearest(place, which)
            g, z = curve.dyads(circuit, phi)
            return DyadPool.of(g, z, distance_from_pick=np.array([distance]))
    return curve_pool(curve, count, fixed, moving)
