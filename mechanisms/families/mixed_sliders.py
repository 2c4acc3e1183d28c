"""Sliders in tasks of poses and points: what the paths that go to infinity lead to.

A slider is a dyad with a pivot at infinity, and a task has one only if it is special; then a path of the homotopy
goes there.  In a task that is moved a little the same path ends at a four-bar with a pivot far away, which goes on to
infinity as the task is moved back, and its direction becomes that of the slider.  From there Newton's method finds
the slider of the task as given, if it has one: with the turns of the body at the points as unknowns, all
distances and all lines must agree.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mechanisms.families.base import Candidate
from mechanisms.families.dyad_pairs import pair_candidate
from mechanisms.families.mixed_motion import SEQUENCE, in_sequence
from mechanisms.families.motion_dyads import MotionDyad, Poses
from mechanisms.families.tolerance import Pair
from mechanisms.families.tolerance_mixed import MixedPositions, positions_of
from mechanisms.task import Task

__all__ = ["slider_candidates"]

#: Positions are moved by the first of these parts of their size in random directions, and then by the others. The
#: second row is for tasks so badly conditioned that the way from the first is not straight.
MOVED = ((1e-5, 1e-6, 1e-7), (1e-6, 1e-7))
#: Directions that are tried at most, and paths for all of them together.
DIRECTIONS, PATHS = 16, 20_000
#: Pivots beyond this many sizes, of that many four-bars, may be on their way to infinity …
FAR, MOST = 3.0, 40
#: … where each step brings them this much further; ten times is what it comes to.
GROWTH = 3.0
#: More paths than these at infinity are no single sliders, as when all points lie on one line.
MANY = 24
#: What is found misses the positions by less than this part of their size.
EXACT = 1e-9


def slider_candidates(task: Task, at_infinity: int) -> Iterator[Candidate]:
    """Slider-cranks, inverted ones and double sliders that are exact.

    Parameters
    ----------
    task : Task
        With points.
    at_infinity : int
        Paths that went to infinity, two for each linkage; the search ends when all have one.
    """
    if at_infinity > MANY:
        words = f"{at_infinity} paths go to infinity: in positions so special sliders come in whole families"
        yield Candidate(None, reasons=("degenerate",), note=words)
        return
    source, positions = MixedPositions(task), positions_of(task)
    rng = np.random.default_rng([task.seed, 12])
    found: list[tuple[tuple[MotionDyad, MotionDyad], Poses]] = []
    for direction in range(min(DIRECTIONS, max(2, PATHS // len(source.roots)))):
        way = rng.normal(size=len(positions)) + 1j * rng.normal(size=len(positions))
        for pair in _on_their_way(source, positions, way, MOVED[direction % 2]):
            if 2 * len(found) >= at_infinity:
                return
            guess = [_as_slider(dyad, positions) for dyad in pair.dyads]
            result = _polished(positions, source.count, guess, _in_list_order(task, pair.poses.angles))
            if result is None or any(_same(result[0], other, positions.size) for other, _ in found):
                continue
            found.append(result)
            everywhere = in_sequence(task, result[1])
            error = max(float(dyad.errors(everywhere).max()) for dyad in result[0])
            candidate = pair_candidate(everywhere, *result[0], task.title, task.length_unit)
            yield replace(candidate, pose_error=error, angle_error=0.0)


def _on_their_way(
    source: MixedPositions, positions: Poses, way: NDArray[np.complex128], parts: tuple[float, ...]
) -> Iterator[Pair]:
    """Four-bars of positions that are nearly those of the task, with pivots that go to infinity as they come there."""

    def moved(step: float) -> Poses:
        return replace(positions, points=positions.points + step * positions.size * way)

    def reach(pair: Pair) -> float:
        return max(abs(z - positions.points[0]) for dyad in pair.dyads for z in (dyad.fixed, dyad.moving))

    (pairs,) = source.pairs([moved(parts[0])])
    pairs = sorted((pair for pair in pairs if reach(pair) > FAR * positions.size), key=reach, reverse=True)
    for first in pairs[:MOST]:
        pair: Pair | None = first
        for part in parts[1:]:
            if pair is not None:
                there = source.follow(pair, moved(part))
                pair = there[0] if there and reach(there[0]) > GROWTH * reach(pair) else None
        if pair is not None:
            yield pair


def _in_list_order(task: Task, angles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Angles in the order of visit, put back into the order of the task."""
    order = [int(number) for number in task.free.get(SEQUENCE, range(len(angles)))]
    back = np.empty_like(angles)
    back[order] = angles
    return back


def _as_slider(dyad: MotionDyad, poses: Poses) -> MotionDyad:
    """A dyad with a pivot far away as the slider that it nearly is."""
    far = [abs(z - poses.points[0]) > GROWTH * FAR * poses.size for z in (dyad.fixed, dyad.moving)]
    if all(far) or not any(far):
        return dyad
    line = 1j * (dyad.fixed - dyad.moving)
    line /= abs(line)
    return MotionDyad("PR", line, dyad.moving) if far[0] else MotionDyad("RP", dyad.fixed, line)


def _polished(
    positions: Poses, count: int, dyads: list[MotionDyad], angles: NDArray[np.float64]
) -> tuple[tuple[MotionDyad, MotionDyad], Poses] | None:
    """The dyads next to a guess that meet all positions, the body turned as it comes after the first `count`."""
    from scipy.optimize import least_squares

    size, origin = positions.size, complex(positions.points[0])

    def read(v: NDArray[np.float64]) -> tuple[list[MotionDyad], Poses]:
        made = []
        for dyad, (a, b, c, d) in zip(dyads, v[:8].reshape(2, 4)):
            places = [origin + size * complex(a, b), origin + size * complex(c, d)]
            lines = [np.exp(1j * a), np.exp(1j * c)]
            fixed = lines[0] if dyad.kind == "PR" else places[0]
            moving = lines[1] if dyad.kind == "RP" else places[1]
            made.append(MotionDyad(dyad.kind, complex(fixed), complex(moving)))
        turns = np.concatenate([positions.angles[:count], v[8:]])
        return made, Poses(positions.points, turns)

    def residuals(v: NDArray[np.float64]) -> NDArray[np.float64]:
        made, poses = read(v)
        return np.concatenate([_misses(dyad, poses) for dyad in made]) / size

    start: list[float] = []
    for dyad in dyads:
        for joint, value in ((dyad.kind[0], dyad.fixed), (dyad.kind[1], dyad.moving)):
            place = (value - origin) / size
            start += [float(np.angle(value)), 0.0] if joint == "P" else [place.real, place.imag]
    # a line has one number, so that the second one stands idle: the least step leaves it where it is
    found = least_squares(
        residuals, [*start, *angles[count:]], method="trf", xtol=1e-15, ftol=1e-15, gtol=1e-15, max_nfev=60
    )
    made, poses = read(found.x)
    if max(float(dyad.errors(poses).max()) for dyad in made) > EXACT * size:
        return None
    return (made[0], made[1]), poses


def _misses(dyad: MotionDyad, poses: Poses) -> NDArray[np.float64]:
    """What `MotionDyad.errors` measures, with its sign."""
    if dyad.kind == "RR":
        lengths = np.abs(poses.carry(dyad.moving) - dyad.fixed)
        return lengths[1:] - lengths[0]
    if dyad.kind == "PR":
        places = poses.carry(dyad.moving)
        return ((places[1:] - places[0]) * np.conj(dyad.fixed)).imag
    seen = poses.points[0] + (dyad.fixed - poses.points) * np.exp(-1j * poses.angles)
    return ((seen[1:] - seen[0]) * np.conj(dyad.moving)).imag


def _same(one: tuple[MotionDyad, MotionDyad], other: tuple[MotionDyad, MotionDyad], size: float) -> bool:
    """Whether two pairs are the same dyads, in either order."""

    def alike(a: MotionDyad, b: MotionDyad) -> bool:
        if a.kind != b.kind:
            return False
        fixed = abs(a.fixed - b.fixed) if a.kind != "PR" else abs((a.fixed * b.fixed.conjugate()).imag) * size
        moving = abs(a.moving - b.moving) if a.kind != "RP" else abs((a.moving * b.moving.conjugate()).imag) * size
        return max(fixed, moving) < 1e-6 * size

    return any(all(map(alike, one, pair)) for pair in (other, other[::-1]))
