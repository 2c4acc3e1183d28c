"""Tolerance zones: positions that may each be missed a little, searched for designs without defects.

When no exact design is free of defects, a designer moves the poses a little and tries again.  Here many tasks within
the tolerances are solved and every pair of dyads is judged in closed form.  The good ones that move the poses
least are then drawn back towards the poses as given, as far as they stay good.

How the tasks are solved depends on how many positions there are (`mechanisms.families.tolerance_sources`).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from mechanisms.families.base import Candidate, Free
from mechanisms.families.dyad_pairs import pair_candidate
from mechanisms.families.motion_dyads import MotionDyad, Poses
from mechanisms.fourbar import judge_four_bars
from mechanisms.task import Task, TaskError

__all__ = [
    "TOLERANCES",
    "Pair",
    "Source",
    "Tolerances",
    "check_tolerances",
    "tolerance_candidates",
    "tolerances_of",
    "with_moves",
]

#: Free choices that give the tolerances.
TOLERANCES = (
    Free("tolerance_x", "length", "how far each position may be missed in x", many=True),
    Free("tolerance_y", "length", "how far each position may be missed in y", many=True),
    Free("tolerance_angle", "angle", "how far each pose may be missed in angle", many=True),
)
#: Designs reported.
KEEP = 6
#: Halvings by which a design is drawn back towards the poses as given.
HALVINGS = 8
#: Designs whose pivots are all nearer than this, in sizes of the task, are one choice.
SAME_CHOICE = 0.1
#: Longest link over the shortest, beyond which a design is not taken.
LINK_RATIO = 20.0


@dataclass(frozen=True)
class Tolerances:
    """How far each position may be missed.

    Parameters
    ----------
    x, y : (n,) array, in the task's unit
    angle : (n,) array, radians
        None negative; the angle of a point is free and has none.

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


@dataclass(frozen=True, eq=False)
class Pair:
    """A four-bar through some positions.

    Parameters
    ----------
    dyads : pair of MotionDyad
        Both RR.
    poses : Poses
        The positions in their order of visit; at path points the body is turned as it comes.
    state : Any
        What its source needs to follow it to other positions.
    """

    dyads: tuple[MotionDyad, MotionDyad]
    poses: Poses
    state: Any = None


class Source(Protocol):
    """Four-bars through positions near those of a task."""

    @property
    def always(self) -> bool:
        """Whether designs are wanted even where the positions as given have good ones."""

    @property
    def trials(self) -> int:
        """Tasks that are worth trying."""

    def pairs(self, many: list[Poses]) -> list[list[Pair]]:
        """The four-bars through each of many sets of positions."""

    def follow(self, pair: Pair, moved: Poses) -> list[Pair]:
        """The same four-bar through positions that have moved a little, or those that may be it."""


def tolerances_of(task: Task, positions: int) -> Tolerances | None:
    """The tolerances of a task; None when every position is to be met exactly."""
    if not any(item.name in task.free for item in TOLERANCES):
        return None
    columns = []
    for item in TOLERANCES:
        given = task.free.get(item.name, ())
        columns.append(np.array([*given, *[0.0] * (positions - len(given))], dtype=float))
    return Tolerances(*columns)


def check_tolerances(task: Task, poses: int, points: int = 0) -> None:
    """Refuse tolerances that do not fit: one number for each position, none negative, and no angle of a point.

    Raises
    ------
    TaskError
        One sentence: what is wrong, where, what to do.
    """
    for item in TOLERANCES:
        values = task.free.get(item.name)
        if values is None:
            continue
        place = f"{task.where}: free.{item.key}"
        count = poses if item.kind == "angle" else poses + points
        if len(values) != count:
            what = f"{poses} poses" + (f" and {points} points" if count > poses else "")
            raise TaskError(f"{place}: {len(values)} values for {what}; give one for each, 0 where it is exact")
        if min(values) < 0:
            raise TaskError(f"{place}: a tolerance is negative; give how far the pose may be missed, 0 or more")


@dataclass(frozen=True, eq=False)
class _Find:
    """A four-bar without defects for moved positions."""

    shares: NDArray[np.float64]
    moved: Poses
    pair: Pair
    transmission: float

    @property
    def used(self) -> float:
        return float(np.abs(self.shares).max())

    @property
    def pivots(self) -> NDArray[np.complex128]:
        return np.array([z for dyad in self.pair.dyads for z in (dyad.fixed, dyad.moving)])


def tolerance_candidates(
    source: Source,
    poses: Poses,
    zones: Tolerances,
    seed: int,
    constraints: Mapping[str, Any],
    title: str = "",
    length_unit: str = "",
    trials: int | None = None,
) -> Iterator[Candidate]:
    """Designs without defects whose positions stay within the tolerances, those that need least of them first.

    Each says how far it moves each position: ``moved`` lists (x, y, angle in degrees).

    Parameters
    ----------
    source : Source
        How positions are solved.
    poses : Poses
        The positions as given; points have the angle zero.
    """
    shares = zones.trials(trials or source.trials, seed)
    many = [zones.moved(poses, share) for share in shares]
    if not source.always and _good(shares[:1], many[:1], source.pairs(many[:1]), constraints):
        return
    finds = _good(shares, many, source.pairs(many), constraints)
    share_found = len({id(find.moved) for find in finds}) / len(many)
    chosen: list[_Find] = []
    for find in sorted(finds, key=lambda f: (f.used, -f.transmission)):
        if len(chosen) >= KEEP:
            break
        if all(_distance(find, other) > SAME_CHOICE * poses.size for other in chosen):
            chosen.append(find)
    drawn = [_drawn_back(source, poses, zones, find, constraints) for find in chosen]
    for find in sorted(drawn, key=lambda f: f.used):
        extra = {"share_of_trials": share_found}
        candidate = pair_candidate(find.pair.poses, *find.pair.dyads, title, length_unit, extra)
        yield with_moves(candidate, poses, find.moved, find.shares[2] * zones.angle, find.used)
    if not drawn and not source.always:
        words = f"none of {len(many)} tasks within the tolerances has a four-bar that meets everything asked for"
        yield Candidate(None, reasons=("degenerate",), note=words)


def with_moves(candidate: Candidate, poses: Poses, moved: Poses, turns: NDArray[np.float64], used: float) -> Candidate:
    """A design for moved positions, with what it misses of those that were asked for.

    Parameters
    ----------
    turns : (n,) float array
        By how much each pose was turned, radians.
    used : float
        The largest share of a tolerance.
    """
    way = moved.points - poses.points
    moves = [[float(d.real), float(d.imag), float(np.degrees(a))] for d, a in zip(way, turns)]
    words = f"poses moved by up to {100 * used:.0f} % of their tolerances"
    return replace(
        candidate,
        note=f"{candidate.note}; {words}" if candidate.note else words,
        extra={**candidate.extra, "moved": moves, "tolerance_used": used},
        pose_error=float(np.abs(way).max()),
        angle_error=float(np.abs(turns).max()),
    )


def _good(
    shares: NDArray[np.float64], many: list[Poses], found: list[list[Pair]], constraints: Mapping[str, Any]
) -> list[_Find]:
    """The four-bars that are free of defects from one of their sides, and meet the constraints on it."""
    pairs = [(k, pair) for k, group in enumerate(found) for pair in group]
    pairs = [(k, p) for k, p in pairs if abs(p.dyads[0].moving - p.dyads[1].moving) > 1e-9 * many[k].size]
    if not pairs:
        return []
    joints = np.array([[a.fixed, a.moving, b.moving, b.fixed] for a, b in (pair.dyads for _, pair in pairs)])
    rotations = np.stack(
        [np.stack([p.dyads[0].turns(p.poses), p.poses.angles, p.dyads[1].turns(p.poses)], axis=-1) for _, p in pairs]
    )
    lengths = np.abs(np.roll(joints, -1, axis=1) - joints)
    usable = lengths.max(axis=1) <= constraints.get("max_link_ratio", LINK_RATIO) * lengths.min(axis=1)
    usable &= lengths.min(axis=1) > 0
    joints = np.where(usable[:, None], joints, np.array([0, 1j, 2 + 1j, 3]))  # any other keeps the formulas quiet
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
    return [_Find(shares[k], many[k], pair, float(angle)) for (k, pair), angle in zip(pairs, best) if angle >= 0]


def _drawn_back(source: Source, poses: Poses, zones: Tolerances, find: _Find, constraints: Mapping[str, Any]) -> _Find:
    """The same design with the smallest share of its tolerances, on the straight way, that keeps it good."""
    low, high, best = 0.0, 1.0, find
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        shares = middle * find.shares
        moved = zones.moved(poses, shares)
        near = _good(shares[None], [moved], [source.follow(best.pair, moved)], constraints)
        near = [other for other in near if _distance(other, best) < 5 * SAME_CHOICE * poses.size]
        if near:
            best, high = min(near, key=lambda other: _distance(other, best)), middle
        else:
            low = middle
    return best


def _distance(one: _Find, other: _Find) -> float:
    straight = np.abs(one.pivots - other.pivots).max()
    return float(min(straight, np.abs(one.pivots - other.pivots[[2, 3, 0, 1]]).max()))
