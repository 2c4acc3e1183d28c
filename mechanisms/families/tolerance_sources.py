"""Four-bars through many sets of poses near those of a task, for the search within tolerances.

- **Five poses**: a thousand tasks in one sweep of parameter homotopies from the same four generic dyads.
- **Four, three, two poses**: pools of dyads for each of a hundred tasks, of which the best pairs are kept.

Poses mixed with points are in `mechanisms.families.tolerance_mixed`.
"""

from __future__ import annotations

from functools import cache
from itertools import combinations
from typing import Any

import numpy as np

from mechanisms.families import burmester
from mechanisms.families.circle_points import CircleCurve, inverse_poses
from mechanisms.families.dyad_pools import third_point
from mechanisms.families.motion_choices import SAMPLES, STATIONS, pools, regions_of
from mechanisms.families.motion_dyads import MotionDyad, Poses
from mechanisms.families.pair_search import judge_pairs
from mechanisms.families.reality import real_roots
from mechanisms.families.tolerance import LINK_RATIO, Pair
from mechanisms.task import Task, TaskError

__all__ = ["FewerPoses", "FivePoses", "dyads_of_many"]

#: A root whose residual stays above this after Newton's steps has been lost on its path.
ACCURATE = 1e-9
#: Dyads of each side in a trial of two to four poses, and pairs of them that are kept.
POOL, PAIRS = 64, 4


@cache
def _engine() -> Any:
    from solvers.homotopy import parameter_homotopy
    from solvers.tracking import engine_of

    start = burmester.generic_dyads()
    system = burmester.projective_system()
    return engine_of(parameter_homotopy(system.program, start.parameters, start.parameters, start.points))


def dyads_of_many(many: list[Poses]) -> list[list[MotionDyad]]:
    """The real RR dyads of many sets of five poses, all paths tracked together.

    Paths that are lost leave a dyad out: this is for searching, `burmester.five_pose_dyads` is for answers.

    Examples
    --------
    >>> poses = Poses.of([(0, 0, 0), (-0.5, -1.9, 90), (1.7, 0, 45), (-1.6, 0.4, 35), (-1.5, 0.1, 25)])
    >>> [len(dyads) for dyads in dyads_of_many([poses, poses])]
    [4, 4]
    """
    start = burmester.generic_dyads()
    targets = np.array([burmester.dyad_parameters(poses) for poses in many])
    per_path = np.repeat(targets, len(start.points), axis=0)
    points = np.tile(start.points, (len(many), 1))
    ends = _engine().track(points, per_path, start.parameters - per_path).x.reshape(len(many), -1, 4)
    found = []
    for poses, roots in zip(many, ends):
        roots = roots[np.all(np.isfinite(roots), axis=1)]
        dyads = []
        for root in roots[real_roots(roots, burmester.MIRROR)]:
            dyad = burmester.dyad_of_root(poses, root)
            if dyad is not None and dyad.kind == "RR" and dyad.errors(poses).max() < ACCURATE * poses.size:
                dyads.append(dyad)
        found.append(dyads)
    return found


class FivePoses:
    """Five poses leave four dyads; the exact ones stand beside those found here."""

    always = True
    trials = 1024

    def pairs(self, many: list[Poses]) -> list[list[Pair]]:
        """Every pair of real dyads."""
        swept = zip(many, dyads_of_many(many))
        return [[Pair(pair, poses) for pair in combinations(dyads, 2)] for poses, dyads in swept]

    def follow(self, pair: Pair, moved: Poses) -> list[Pair]:
        """All pairs of dyads of the moved poses."""
        return self.pairs([moved])[0]


class FewerPoses:
    """Four, three or two poses, with what the task gives of the pivots."""

    always = False
    trials = 128

    def __init__(self, task: Task) -> None:
        self.task = task

    def pairs(self, many: list[Poses]) -> list[list[Pair]]:
        """The best pairs of each; a single set of poses is looked at as closely as the exact ones are."""
        fine = STATIONS if len(many[0]) == 4 else SAMPLES
        return [self._best(poses, fine if len(many) == 1 else POOL) for poses in many]

    def _best(self, poses: Poses, count: int) -> list[Pair]:
        """Pairs without defects first, by transmission angle."""
        try:
            first, second = pools(self.task, poses, count)
        except TaskError:  # poses moved into a special place
            return []
        links = [pool.where(pool.kinds == "RR") for pool in (first, second)]
        if not all(map(len, links)):
            return []
        table = judge_pairs(poses, *links)
        limits, box = self.task.constraints, self.task.constraints.get("pivots_in", {})
        value = np.full(table.link_ratio.shape, -np.inf)
        fits = table.link_ratio <= limits.get("max_link_ratio", LINK_RATIO)
        for pool, shape in zip(links, ((-1, 1), (1, -1))):
            for axis, (low, high) in box.items():
                place = pool.fixed.real if axis == "x" else pool.fixed.imag
                fits &= ((place >= low) & (place <= high)).reshape(shape)
        for side in (table.driven_first, table.driven_second):
            good = fits & side["in_order"] & (side["full_rotation"] | (not limits.get("full_rotation", False)))
            value = np.where(good, np.maximum(value, side["min_transmission_deg"]), value)
        best = np.argsort(-value, axis=None, kind="stable")[:PAIRS]
        spots = [np.unravel_index(int(flat), value.shape) for flat in best]
        return [
            Pair((links[0].dyad(int(i)), links[1].dyad(int(j))), poses) for i, j in spots if np.isfinite(value[i, j])
        ]

    def follow(self, pair: Pair, moved: Poses) -> list[Pair]:
        """Given pivots stay; of the others the moving one does, and the fixed one gives way."""
        dyads = []
        for dyad, regions in zip(pair.dyads, regions_of(self.task)):
            near = _followed(dyad, moved, regions[0].point is not None)
            if near is None:
                return []
            dyads.append(near)
        return [Pair((dyads[0], dyads[1]), moved)]


def _followed(dyad: MotionDyad, poses: Poses, hold_fixed: bool) -> MotionDyad | None:
    """The dyad of two to four poses that is next to a given one, one of its pivots held where that is possible."""
    held, other = (dyad.fixed, dyad.moving) if hold_fixed else (dyad.moving, dyad.fixed)
    if len(poses) == 4:
        try:
            curve = CircleCurve(poses)
            circuit, phi, _ = curve.nearest(held, "fixed" if hold_fixed else "moving")
        except ValueError:
            return None
        fixed, moving = (complex(z[0]) for z in curve.dyads(circuit, phi))
    else:
        motion = inverse_poses(poses) if hold_fixed else poses
        if len(poses) == 3:
            other = complex(third_point(motion, held)[0])
        else:
            one, two = motion.carry(held)
            across = 1j * (two - one) / abs(two - one)
            middle = (one + two) / 2
            other = complex(middle + across * ((other - middle) * across.conjugate()).real)
        fixed, moving = (held, other) if hold_fixed else (other, held)
    return MotionDyad("RR", fixed, moving) if np.isfinite(fixed) and np.isfinite(moving) else None
