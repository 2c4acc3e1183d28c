"""Tolerance zones: five poses that may each be missed a little, searched for designs without defects.

When no exact design is free of defects, a designer moves the poses a little and tries again.  Here a thousand
tasks within the tolerances are solved in one sweep of parameter homotopies from the same four generic dyads, and
every pair of dyads is judged in closed form.  The good ones that move the poses least are then drawn back towards
the poses as given, as far as they stay good.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechanisms.families import burmester
from mechanisms.families.base import Candidate, Free
from mechanisms.families.dyad_pairs import pair_candidate
from mechanisms.families.motion_dyads import MotionDyad, Poses
from mechanisms.families.reality import real_roots
from mechanisms.fourbar import judge_four_bars
from mechanisms.task import Task, TaskError

__all__ = ["Tolerances", "check_tolerances", "dyads_of_many", "tolerance_candidates"]

#: Tasks tried within the tolerances.
TRIALS = 1024
#: Designs reported.
KEEP = 6
#: Halvings by which a design is drawn back towards the poses as given.
HALVINGS = 8
#: Designs whose pivots are all nearer than this, in sizes of the task, are one choice.
SAME_CHOICE = 0.1
#: Longest link over the shortest, beyond which a design is not taken.
LINK_RATIO = 20.0
#: A root whose residual stays above this after Newton's steps has been lost on its path.
ACCURATE = 1e-9


@dataclass(frozen=True)
class Tolerances:
    """How far each pose may be missed.

    Parameters
    ----------
    x, y : (n,) array, in the task's unit
    angle : (n,) array, radians
        None negative.

    Examples
    --------
    >>> zones = Tolerances(np.ones(2), np.ones(2), np.zeros(2))
    >>> moved = zones.moved(Poses.of([(0, 0, 0), (5, 5, 90)]), np.array([[0.0, 0.5], [0.0, -1.0], [1.0, 1.0]]))
    >>> moved.points.tolist(), float(np.degrees(moved.angles[1]))
    ([0j, (5.5+4j)], 90.0)
    """

    x: NDArray[np.float64]
    y: NDArray[np.float64]
    angle: NDArray[np.float64]

    def moved(self, poses: Poses, shares: NDArray[np.float64]) -> Poses:
        """Poses moved by shares of their tolerances, (3, n) numbers from −1 to 1 for x, y, angle."""
        points = poses.points + shares[0] * self.x + 1j * shares[1] * self.y
        angles = poses.angles + shares[2] * self.angle
        return Poses(points, angles - angles[0])

    def trials(self, count: int, seed: int) -> NDArray[np.float64]:
        """Evenly spread shares, (count, 3, n); the first are zero."""
        from scipy.stats import qmc

        sobol = qmc.Sobol(3 * len(self.x), seed=np.random.default_rng(seed))
        shares = 2 * sobol.random_base2(int(np.ceil(np.log2(count)))) - 1
        shares[0] = 0.0
        free = np.stack([self.x, self.y, self.angle]) > 0
        return shares.reshape(-1, 3, len(self.x)) * free


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


@dataclass(frozen=True, eq=False)
class _Find:
    """A four-bar without defects for moved poses."""

    shares: NDArray[np.float64]
    poses: Poses
    dyads: tuple[MotionDyad, MotionDyad]
    transmission: float

    @property
    def pivots(self) -> NDArray[np.complex128]:
        return np.array([z for dyad in self.dyads for z in (dyad.fixed, dyad.moving)])


def check_tolerances(task: Task, poses: int, names: Sequence[Free]) -> None:
    """Refuse tolerances that do not fit the poses: one number for each of five, none negative."""
    for item in names:
        values = task.free.get(item.name)
        if values is None:
            continue
        place = f"{task.where}: free.{item.key}"
        if poses != 5:
            raise TaskError(f"{place}: tolerances are for five poses, which leave no other choice; leave it out")
        if len(values) != poses:
            raise TaskError(f"{place}: {len(values)} values for {poses} poses; give one for each, 0 where it is exact")
        if min(values) < 0:
            raise TaskError(f"{place}: a tolerance is negative; give how far the pose may be missed, 0 or more")


def tolerance_candidates(
    poses: Poses,
    zones: Tolerances,
    seed: int,
    constraints: Mapping[str, Any],
    title: str = "",
    length_unit: str = "",
    trials: int = TRIALS,
) -> Iterator[Candidate]:
    """Designs without defects whose poses stay within the tolerances, those that need least of them first.

    Each says how far it moves each pose: ``moved`` lists (x, y, angle in degrees).
    """
    shares = zones.trials(trials, seed)
    many = [zones.moved(poses, share) for share in shares]
    finds = _good_pairs(shares, many, dyads_of_many(many), constraints)
    share_found = len({id(find.poses) for find in finds}) / len(many)
    chosen: list[_Find] = []
    for find in sorted(finds, key=lambda f: (float(np.abs(f.shares).max()), -f.transmission)):
        if len(chosen) >= KEEP:
            break
        if all(_distance(find, other) > SAME_CHOICE * poses.size for other in chosen):
            chosen.append(find)
    drawn = [_drawn_back(poses, zones, find, constraints) for find in chosen]
    for find in sorted(drawn, key=lambda f: float(np.abs(f.shares).max())):
        way = find.poses.points - poses.points
        turn = find.shares[2] * zones.angle
        moved = [[float(d.real), float(d.imag), float(np.degrees(a))] for d, a in zip(way, turn)]
        used = float(np.abs(find.shares).max())
        extra = {"moved": moved, "tolerance_used": used, "share_of_trials": share_found}
        words = f"poses moved by up to {100 * used:.0f} % of their tolerances"
        candidate = pair_candidate(find.poses, *find.dyads, title, length_unit, extra, words)
        yield Candidate(
            **{name: getattr(candidate, name) for name in Candidate.__dataclass_fields__}
            | {"pose_error": float(np.abs(way).max()), "angle_error": float(np.abs(turn).max())}
        )


def _good_pairs(
    shares: NDArray[np.float64], many: list[Poses], dyads: list[list[MotionDyad]], constraints: Mapping[str, Any]
) -> list[_Find]:
    """Every pair of dyads that is free of defects from one of its sides, and meets the constraints on it."""
    pairs = [(k, a, b) for k, group in enumerate(dyads) for a, b in combinations(group, 2)]
    pairs = [pair for pair in pairs if abs(pair[1].moving - pair[2].moving) > 1e-9 * many[pair[0]].size]
    if not pairs:
        return []
    joints = np.array([[a.fixed, a.moving, b.moving, b.fixed] for _, a, b in pairs])
    rotations = np.stack([np.stack([a.turns(many[k]), many[k].angles, b.turns(many[k])], axis=-1) for k, a, b in pairs])
    lengths = np.abs(np.roll(joints, -1, axis=1) - joints)
    usable = lengths.max(axis=1) <= constraints.get("max_link_ratio", LINK_RATIO) * lengths.min(axis=1)
    for axis, values in (("x", joints[:, [0, 3]].real), ("y", joints[:, [0, 3]].imag)):
        if axis in (box := constraints.get("pivots_in", {})):
            usable &= np.all((values >= box[axis][0]) & (values <= box[axis][1]), axis=1)
    best = np.full(len(pairs), -1.0)
    for side in ("crank", "follower"):
        verdict = judge_four_bars(joints, rotations, side)
        good = usable & verdict["in_order"]
        good &= verdict["full_rotation"] | (not constraints.get("full_rotation", False))
        good &= verdict["min_transmission_deg"] >= constraints.get("min_transmission_deg", 0.0)
        best = np.where(good, np.maximum(best, verdict["min_transmission_deg"]), best)
    return [_Find(shares[k], many[k], (a, b), float(angle)) for (k, a, b), angle in zip(pairs, best) if angle >= 0]


def _drawn_back(poses: Poses, zones: Tolerances, find: _Find, constraints: Mapping[str, Any]) -> _Find:
    """The same design with the smallest share of its tolerances, on the straight way, that keeps it good."""
    low, high, best = 0.0, 1.0, find
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        shares = middle * find.shares
        moved = zones.moved(poses, shares)
        near = _good_pairs(shares[None], [moved], dyads_of_many([moved]), constraints)
        near = [other for other in near if _distance(other, best) < 5 * SAME_CHOICE * poses.size]
        if near:
            best, high = min(near, key=lambda other: _distance(other, best)), middle
        else:
            low = middle
    return best


def _distance(one: _Find, other: _Find) -> float:
    straight = np.abs(one.pivots - other.pivots).max()
    return float(min(straight, np.abs(one.pivots - other.pivots[[2, 3, 0, 1]]).max()))
