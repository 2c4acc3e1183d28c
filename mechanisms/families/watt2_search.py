"""Searching the free dyads of a two-effector Watt II for designs without defects.

Once the ternary crank with its dyads (W1, Z1), (W2, Z2) is fixed, the rest is two separate choices: the dyad
(W3, Z3) closes P's loop and (W4, Z4) closes Q's.  Each is sampled by its own Sobol points over what the task
leaves open, every sample is tested exactly (`mechanisms.families.sweep`), and only the pairing of good
halves is left: the share of pairs without defects is known from the halves, and the best pairs are looked
for among the best halves.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechanisms.families.dyads import Dyads, three_pose_dyads, turn
from mechanisms.families.sweep import Sweep, loop_sweep
from mechanisms.task import Task

__all__ = ["SAMPLES", "Half", "Pick", "Side", "sample_side", "search"]

#: Samples of each half when the task does not say: the shares come out to about one per cent.
SAMPLES = 4096
#: How many of the best halves by each measure are tried in pairs.
SHORTLIST = 24
#: A loop that transmits less than this is hard to drive in practice (30° is the usual advice, 20° the least),
#: so that it is not called best at anything else while there are others; radians.
USABLE = math.radians(20.0)
#: Pivots of the free dyads are looked for this many task sizes around the effector when the task gives no
#: range.
REACH = 1.5


@dataclass(frozen=True)
class Half:
    """What is fixed about one loop before its free dyad is chosen.

    Parameters
    ----------
    link, body : str
        The names of the free vectors: ``"W3"``, ``"Z3"``.
    turns : tuple of str
        The names of the free rotations: ``("eta2", "eta3")``.
    effector : complex
        The effector in pose 0.
    moves, rotations : sequence
        Its displacements and rotations to the later poses.
    crank, crank_body : complex
        W1, Z1 (or W2, Z2).
    crank_turns : sequence of float
        β.
    """

    link: str
    body: str
    turns: tuple[str, ...]
    effector: complex
    moves: Sequence[complex]
    rotations: Sequence[float]
    crank: complex
    crank_body: complex
    crank_turns: Sequence[float]

    @property
    def coordinates(self) -> tuple[str, ...]:
        """The names of the coordinates that a two-pose task may choose."""
        return tuple(f"{vector}_{axis}" for vector in (self.link, self.body) for axis in "xy")


@dataclass(frozen=True)
class Side:
    """Samples of one half: n dyads, their rotations, and what the crank does to them."""

    turns: NDArray[np.float64]
    dyads: Dyads
    forward: Sweep
    backward: Sweep
    allowed: NDArray[np.bool_]

    def good(self, direction: int) -> NDArray[np.bool_]:
        """Which samples pass all poses in order when the crank turns this way, and meet the constraints."""
        return (self.forward if direction > 0 else self.backward).defect_free & self.allowed


@dataclass(frozen=True)
class Pick:
    """A pair of samples that is best at something.

    Attributes
    ----------
    best_at : str
        The measure, or "" when no pair is free of defects.
    p, q : int
        Indices of the samples.
    transmission : float
        Least transmission angle in radians.
    link_ratio : float
        Longest over shortest joint distance.
    extent : float
        Largest distance between two of the linkage's pivots in pose 0.
    """

    best_at: str
    p: int
    q: int
    transmission: float
    link_ratio: float
    extent: float


def sample_side(task: Task, half: Half, seed: int) -> Side:
    """Dyads for one half: the one that the task determines, or Sobol points over what it leaves open."""
    names = _chosen(task.free, half)
    given = {name: task.free.get(name) for name in names}
    boxes = [_box(name, value, task, half) for name, value in given.items()]
    count = 1 if all(low == high for low, high in boxes) else int(task.solve.get("samples", SAMPLES))
    columns = _sobol(boxes, count, seed)
    turns = columns[: len(half.turns)]
    if len(half.turns) == 2:
        dyads = three_pose_dyads([*turns], half.rotations, half.moves)
    else:
        dyads = _two_pose_dyads(half, turns[0], dict(zip(names[1:], columns[1:])))
    infinite = ~(np.isfinite(dyads.W) & np.isfinite(dyads.Z))
    dyads = Dyads(np.where(infinite, np.nan, dyads.W), np.where(infinite, np.nan, dyads.Z))
    pivot = half.effector - half.crank_body - half.crank
    with np.errstate(invalid="ignore", over="ignore"):
        feet = half.effector - dyads.Z - dyads.W
        sweeps = [
            loop_sweep(half.crank, pivot, half.crank_turns, dyads.W, feet, turns, direction)
            for direction in (1, -1)
        ]
        allowed = ~infinite & _meets(task.constraints, half, dyads, feet, pivot)
    return Side(turns, dyads, sweeps[0], sweeps[1], allowed)


def search(task: Task, halves: tuple[Half, Half], sides: tuple[Side, Side]) -> tuple[float, list[Pick]]:
    """The share of pairs of samples that are free of defects, and the best of them.

    Returns
    -------
    share : float
        From 0 to 1.
    picks : list of Pick
        Best by transmission angle, by link ratio, by compactness; one pair that is best at several stands
        once. When no pair is good: one pair that is not, so that the reasons can be told.
    """
    p, q = sides
    forward = [side.good(1) for side in sides]
    backward = [side.good(-1) for side in sides]
    both = [f & b for f, b in zip(forward, backward)]
    share = sum(
        sign * float(np.mean(pair[0])) * float(np.mean(pair[1]))
        for sign, pair in ((1, forward), (1, backward), (-1, both))
    )
    found: dict[str, tuple[tuple[int, float], Pick]] = {}
    needed = max(USABLE, math.radians(task.constraints.get("min_transmission_deg", 0.0)))
    limit = task.constraints.get("max_link_ratio", math.inf)
    for direction in (1, -1):
        lists = [_shortlist(half, side, direction) for half, side in zip(halves, sides)]
        sweeps = [side.forward if direction > 0 else side.backward for side in sides]
        for i in lists[0]:
            for j in lists[1]:
                angle = min(float(sweeps[0].transmission[i]), float(sweeps[1].transmission[j]))
                ratio, extent = _shape(halves, p, i, q, j)
                wrong = (angle < needed) + (ratio > limit)
                costs = {
                    "transmission": (int(ratio > limit), -angle),
                    "link ratio": (wrong, ratio),
                    "compactness": (wrong, extent),
                }
                for measure, cost in costs.items():
                    if measure not in found or cost < found[measure][0]:
                        found[measure] = cost, Pick(measure, i, j, angle, ratio, extent)
    picks: dict[tuple[int, int], list[Pick]] = {}
    for _, pick in found.values():
        picks.setdefault((pick.p, pick.q), []).append(pick)
    merged = [
        Pick(
            ", ".join(pick.best_at for pick in same),
            i,
            j,
            same[0].transmission,
            same[0].link_ratio,
            same[0].extent,
        )
        for (i, j), same in picks.items()
    ]
    return share, merged or [_least_bad(halves, sides)]


def _chosen(free: Mapping[str, Any], half: Half) -> list[str]:
    """The names of the choices that determine a dyad: its rotations and, for two poses, two coordinates."""
    if len(half.turns) == 2:
        return list(half.turns)
    # of a body that does not turn, Eq. (4) fixes W for a given rotation and leaves Z open
    names = half.coordinates if abs(turn(half.rotations[0])) > 1e-9 else half.coordinates[::-1]
    fixed = [name for name in half.coordinates if name in free]
    return [*half.turns, *(fixed + [name for name in names if name not in free])[:2]]


def _box(name: str, value: Any, task: Task, half: Half) -> tuple[float, float]:
    if isinstance(value, tuple):
        return value
    if value is not None:
        return float(value), float(value)
    if name in half.turns:
        return -math.pi, math.pi
    return -REACH * task.size, REACH * task.size


def _sobol(boxes: Sequence[tuple[float, float]], count: int, seed: int) -> NDArray[np.float64]:
    """`count` points of the box, shape (dimensions, count); the fixed dimensions take no part."""
    low, high = np.array(boxes).T
    open_ones = np.flatnonzero(high > low)
    columns = np.repeat(low[:, None], count, axis=1)
    if len(open_ones):
        from scipy.stats import qmc

        points = qmc.Sobol(len(open_ones), seed=seed).random_base2(max(0, math.ceil(math.log2(count))))[:count]
        columns[open_ones] = low[open_ones, None] + points.T * (high - low)[open_ones, None]
    return columns


def _two_pose_dyads(half: Half, turns: NDArray[Any], given: Mapping[str, NDArray[Any]]) -> Dyads:
    """The dyads of Eq. (4) or (5) for one displacement, from the link's rotation and two of the coordinates."""
    b, a = turn(turns), complex(turn(half.rotations[0]))
    rows = [_real_rows(b, a)[..., 0, :], _real_rows(b, a)[..., 1, :]]
    right = [np.full(len(turns), half.moves[0].real), np.full(len(turns), half.moves[0].imag)]
    for name, values in given.items():
        rows.append(np.broadcast_to(np.eye(4)[half.coordinates.index(name)], rows[0].shape))
        right.append(values)
    matrix = np.stack(rows, axis=-2)
    sound = np.abs(np.linalg.det(matrix)) > 1e-12
    matrix[~sound] = np.eye(4)
    solved = np.linalg.solve(matrix, np.stack(right, axis=-1)[..., None])[..., 0]
    solved[~sound] = np.nan
    return Dyads(solved[..., 0] + 1j * solved[..., 1], solved[..., 2] + 1j * solved[..., 3])


def _real_rows(b: NDArray[Any], a: complex) -> NDArray[np.float64]:
    """(b W + a Z) as two real rows acting on (Wx, Wy, Zx, Zy)."""
    a_all = np.full(np.shape(b), a)
    real = [b.real, -b.imag, a_all.real, -a_all.imag]
    imag = [b.imag, b.real, a_all.imag, a_all.real]
    return np.stack([np.stack(real, axis=-1), np.stack(imag, axis=-1)], axis=-2)


def _meets(
    constraints: Mapping[str, Any], half: Half, dyads: Dyads, feet: NDArray[Any], pivot: complex
) -> NDArray[np.bool_]:
    """The constraints of the task that one half can be tested for."""
    good = np.ones(len(feet), dtype=bool)
    box = constraints.get("pivots_in", {})
    for axis, coordinate in (("x", feet.real), ("y", feet.imag)):
        if axis in box:
            good &= (coordinate >= box[axis][0]) & (coordinate <= box[axis][1])
    lengths = _lengths(half, dyads, feet, pivot)
    if "max_link_length" in constraints:
        good &= lengths.max(axis=0) <= constraints["max_link_length"]
    if "min_link_length" in constraints:
        good &= lengths.min(axis=0) >= constraints["min_link_length"]
    return good


def _lengths(half: Half, dyads: Dyads, feet: NDArray[Any], pivot: complex) -> NDArray[np.float64]:
    """Joint distances of one loop: crank, coupler, rocker, ground; shape (4, n)."""
    crank = np.full(len(feet), abs(half.crank))
    return np.stack([crank, np.abs(dyads.Z - half.crank_body), np.abs(dyads.W), np.abs(feet - pivot)])


def _shortlist(half: Half, side: Side, direction: int) -> NDArray[np.int64]:
    """Indices of the good samples that are among the best by one of the measures."""
    good = np.flatnonzero(side.good(direction))
    if not len(good):
        return good
    pivot = half.effector - half.crank_body - half.crank
    dyads = Dyads(side.dyads.W[good], side.dyads.Z[good])
    feet = half.effector - dyads.Z - dyads.W
    lengths = _lengths(half, dyads, feet, pivot)
    sweep = side.forward if direction > 0 else side.backward
    jams = sweep.transmission[good] < USABLE
    with np.errstate(divide="ignore"):
        costs = [-sweep.transmission[good], lengths.max(axis=0) / lengths.min(axis=0), lengths.max(axis=0)]
    costs += [np.where(jams, np.inf, cost) for cost in costs[1:]]
    return good[np.unique(np.concatenate([np.argsort(cost, kind="stable")[:SHORTLIST] for cost in costs]))]


def _shape(halves: tuple[Half, Half], p: Side, i: int, q: Side, j: int) -> tuple[float, float]:
    """Link ratio and extent of a pair."""
    places: list[complex] = []
    lengths: list[float] = []
    for half, side, k in ((halves[0], p, i), (halves[1], q, j)):
        w, z = complex(side.dyads.W[k]), complex(side.dyads.Z[k])
        tip, foot = half.effector - z, half.effector - z - w
        crank_tip = half.effector - half.crank_body
        pivot = crank_tip - half.crank
        places += [pivot, crank_tip, tip, foot]
        lengths += [abs(half.crank), abs(w), abs(tip - crank_tip), abs(foot - pivot)]
    lengths += [abs(places[1] - places[5]), abs(places[3] - places[7])]
    shortest = min(lengths)
    return (max(lengths) / shortest if shortest else math.inf), max(abs(a - b) for a in places for b in places)


def _least_bad(halves: tuple[Half, Half], sides: tuple[Side, Side]) -> Pick:
    """A pair to show what is wrong: with the mildest link ratio of those that keep one assembly, if any."""
    chosen = []
    for half, side in zip(halves, sides):
        pivot = half.effector - half.crank_body - half.crank
        feet = half.effector - side.dyads.Z - side.dyads.W
        with np.errstate(divide="ignore", invalid="ignore"):
            lengths = _lengths(half, side.dyads, feet, pivot)
            ratio = lengths.max(axis=0) / lengths.min(axis=0)
        either = side.forward.defect_free | side.backward.defect_free
        cost = np.where(np.isfinite(ratio), ratio, 1e200) * np.where(either, 1.0, 1e6)
        cost = cost * np.where(side.allowed, 1.0, 1e3)
        chosen.append(int(np.argmin(cost)))
    ratio_of_pair, extent = _shape(halves, sides[0], chosen[0], sides[1], chosen[1])
    return Pick("", chosen[0], chosen[1], 0.0, ratio_of_pair, extent)
