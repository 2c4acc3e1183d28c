"""Two dyads make a linkage of four links: four-bar, slider-crank, inverted slider-crank, double slider, Scotch yoke.

The side that drives better is called the crank: fewer defects first, then a full turn, then the larger
transmission angle.  Both sides stay inputs, so that the other choice is judged too.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechanisms.families.base import BODY, Candidate
from mechanisms.families.motion_dyads import MotionDyad, Poses, grashof_type
from mechanisms.families.parallelograms import fold_note, is_parallelogram, parallelogram_verdicts
from mechanisms.fourbar import judge_four_bars
from mechanisms.linkage import GROUND, Input, Linkage, Slider

__all__ = ["INPUTS", "KINDS", "driver_first", "four_bar_verdicts", "pair_candidate", "pair_candidates", "pair_linkage"]

#: The links that may be driven.
INPUTS = ("crank", "follower")
#: What two dyads make, the crank's kind first.
KINDS = {
    ("RR", "RR"): "four-bar",
    ("RR", "PR"): "slider-crank",
    ("RR", "RP"): "inverted slider-crank",
    ("RR", "PP"): "Scotch yoke",
    ("RP", "RP"): "double inverted slider",
    ("RP", "PR"): "slide and swinging block",
    ("PR", "PR"): "double slider",
}
#: Pivots nearer than this part of the poses' size coincide: the linkage is a pendulum.
COINCIDE = 1e-9
#: A bar goes on beyond the poses by this part of its reach.
BAR = 0.2
#: Which kind of dyad is driven when the two differ.
_DRIVEN_FIRST = ("RR", "RP", "PR", "PP")


def pair_linkage(
    poses: Poses, crank: MotionDyad, follower: MotionDyad, title: str = "", length_unit: str = ""
) -> tuple[Linkage, list[dict[str, float]]]:
    """The linkage of two dyads in pose 0, and its configuration in every pose.

    Parameters
    ----------
    poses : Poses
    crank, follower : MotionDyad

    Returns
    -------
    linkage : Linkage
        Fixed pivots O1, O2, moving pivots A1, A2, body point P; links crank, coupler, follower. A point P in the
        only pin of the coupler is that pin. Bars that slide in a block go from B1 to C1, B2 to C2.
    configurations : list of {link: rotation}

    Examples
    --------
    >>> poses = Poses.of([(0, 1, 0), (1, 1, -30)])
    >>> pair_linkage(poses, MotionDyad("RR", 0j, 1j), MotionDyad("PR", 1 + 0j, 2 + 0j))[0]
    Linkage(4 links, 4 points, 3 revolute joints, 1 slider, 1 degree of freedom)
    """
    points: dict[str, complex] = {}
    links: dict[str, list[str]] = {GROUND: [], "crank": [], "coupler": [], "follower": []}
    sliders: list[Slider] = []
    inputs: dict[str, Input] = {}
    bars: list[str] = []
    turns: dict[str, NDArray[np.float64]] = {}
    for number, name, dyad in ((1, "crank", crank), (2, "follower", follower)):
        fixed, moving = f"O{number}", f"A{number}"
        if dyad.kind in ("RR", "RP"):
            points[fixed] = dyad.fixed
            links[GROUND].append(fixed)
            links[name].append(fixed)
        if dyad.kind in ("RR", "PR"):
            points[moving] = dyad.moving
            links[name].append(moving)
            links["coupler"].append(moving)
        if dyad.kind == "PR":
            sliders.append(Slider(GROUND, name, dyad.fixed, at=moving))
        bar = f"B{number}", f"C{number}"
        if dyad.kind == "RP":  # the body has a bar that slides in the block
            points |= dict(zip(bar, _bar(poses, dyad.fixed, dyad.moving, _seen(poses, dyad.fixed))))
            bars += bar
            sliders.append(Slider(name, "coupler", dyad.moving, at=fixed))
        if dyad.kind == "PP":  # the slider has one, guided at its first end, on which the body slides
            points |= dict(zip(bar, _bar(poses, crank.fixed, dyad.moving, poses.carry(crank.moving))))
            links[name] += bar
            sliders.append(Slider(GROUND, name, dyad.fixed, at=bar[0]))
            sliders.append(Slider(name, "coupler", dyad.moving, at="A1"))
        inputs[name] = Input(name, translation=dyad.kind[0] == "P")
        turns[name] = dyad.turns(poses)
    place = "A1" if links["coupler"] == ["A1"] and not bars and points["A1"] == poses.points[0] else "P"
    if place == "P":
        points["P"] = complex(poses.points[0])
        links["coupler"].append("P")
    links["coupler"] += bars
    linkage = Linkage(
        points=points,
        links=links,
        sliders=sliders,
        bodies={BODY: ("coupler", place)},
        inputs=inputs,
        title=title,
        length_unit=length_unit,
    )
    turns["coupler"] = poses.angles
    order = ("crank", "coupler", "follower")
    return linkage, [{name: float(turns[name][pose]) for name in order} for pose in range(len(poses))]


def _bar(poses: Poses, pivot: complex, along: complex, places: NDArray[np.complex128]) -> tuple[complex, complex]:
    """The ends of a bar in pose 0 on which something comes to some places; the first is nearer to a pivot."""
    reach = ((places - places[0]) * along.conjugate()).real
    more = BAR * float(max(np.ptp(reach), poses.size / 2))
    ends = [complex(places[0] + along * t) for t in (reach.min() - more, reach.max() + more)]
    first, second = sorted(ends, key=lambda z: abs(z - pivot))
    return first, second


def _seen(poses: Poses, fixed: complex) -> NDArray[np.complex128]:
    """Where a point of the frame is, seen from the body, in pose 0."""
    return poses.points[0] + (fixed - poses.points) * np.exp(-1j * poses.angles)


def four_bar_verdicts(
    poses: Poses, fixed: tuple[Any, Any], moving: tuple[Any, Any]
) -> tuple[dict[str, NDArray[Any]], dict[str, NDArray[Any]]]:
    """Verdicts on many four-bars at once, driven at the first dyad and at the second.

    Parameters
    ----------
    poses : Poses
    fixed, moving : pairs of (n,) complex arrays
        Fixed and moving pivots, in pose 0, of the first and of the second dyads.

    Returns
    -------
    pair of dict of str to (n,) array
        As `mechanisms.fourbar.judge_four_bars`.
    """
    o1, o2, a1, a2 = (np.atleast_1d(np.asarray(z, dtype=complex)) for z in (*fixed, *moving))
    joints = np.stack([o1, a1, a2, o2], axis=-1)
    rotations = np.empty((len(o1), len(poses), 3))
    for column, (pivot, tip) in ((0, (o1, a1)), (2, (o2, a2))):
        arms = poses.carry(tip) - pivot[:, None]
        rotations[:, :, column] = np.angle(arms / arms[:, :1])
    rotations[:, :, 1] = poses.angles
    first, second = judge_four_bars(joints, rotations, "crank"), judge_four_bars(joints, rotations, "follower")
    change = is_parallelogram(poses, (o1, o2), (a1, a2))
    if change.any():  # a linkage with a change point is not decided by those formulas
        better = parallelogram_verdicts(poses, (o1, o2), (a1, a2))
        for side in (first, second):
            side |= {key: np.where(change, better[key], side[key]) for key in side}
    return first, second


def score(verdict: Mapping[str, Any]) -> Any:
    """One number that puts verdicts in order: defects, then a full turn, then the transmission angle."""
    steps = [verdict[key] for key in ("same_circuit", "same_branch", "in_order", "full_rotation")]
    value: Any = 0.0
    for step in steps:
        value = 2 * value + np.asarray(step, dtype=float)
    return value + np.asarray(verdict["min_transmission_deg"]) / 180


def pair_candidates(
    poses: Poses, dyads: Sequence[MotionDyad], title: str = "", length_unit: str = ""
) -> Iterator[Candidate]:
    """A candidate for every pair of dyads: six for four of them."""
    for first, second in itertools.combinations(dyads, 2):
        yield pair_candidate(poses, first, second, title, length_unit)


def pair_candidate(
    poses: Poses,
    first: MotionDyad,
    second: MotionDyad,
    title: str = "",
    length_unit: str = "",
    extra: Mapping[str, Any] | None = None,
    note: str = "",
) -> Candidate:
    """Two dyads as a candidate, the better driver as the crank; `extra` and `note` are added to what it says."""
    crank, follower = driver_first(poses, first, second)
    parameters, angles = _parameters(crank, follower)
    roots = [dyad.root for dyad in (crank, follower) if dyad.root is not None]
    more: dict[str, Any] = {"roots": roots} if roots else {}
    root = min(roots, default=None)
    why = _degenerate(poses, crank, follower)
    if why:
        return Candidate(root, parameters, reasons=("degenerate",), note=why, angles=angles, extra=more)
    kind = KINDS[crank.kind, follower.kind]
    words = kind
    pivots = (crank.fixed, follower.fixed), (crank.moving, follower.moving)
    if kind == "four-bar" and is_parallelogram(poses, *pivots)[0]:
        kind = "parallelogram"
        words = f"parallelogram; {fold_note(poses, crank, follower)}"
    elif kind == "four-bar":
        lengths = (
            abs(crank.fixed - follower.fixed),
            crank.length,
            abs(crank.moving - follower.moving),
            follower.length,
        )
        words = grashof_type(*lengths)
        shortest, *middle, longest = sorted(lengths)
        more["grashof_margin"] = (sum(middle) - shortest - longest) / sum(lengths)
    linkage, configurations = pair_linkage(poses, crank, follower, title, length_unit)
    return Candidate(
        root,
        parameters,
        linkage,
        configurations,
        note=f"{words}; {note}" if note else words,
        angles=angles,
        extra={**more, "kind": kind, **(extra or {})},
    )


def driver_first(poses: Poses, first: MotionDyad, second: MotionDyad) -> tuple[MotionDyad, MotionDyad]:
    """Two dyads, the one first that drives better; of two kinds, the crank before the slider."""
    ranks = [_DRIVEN_FIRST.index(dyad.kind) for dyad in (first, second)]
    if ranks[0] != ranks[1]:
        return (first, second) if ranks[0] < ranks[1] else (second, first)
    if first.kind != "RR" or _degenerate(poses, first, second):  # of two sliders the first was chosen to drive
        return first, second
    verdicts = four_bar_verdicts(poses, (first.fixed, second.fixed), (first.moving, second.moving))
    return (first, second) if score(verdicts[0])[0] >= score(verdicts[1])[0] else (second, first)


def _degenerate(poses: Poses, crank: MotionDyad, follower: MotionDyad) -> str:
    """Why two dyads make no linkage of four links, or nothing."""
    near = COINCIDE * poses.size
    for dyad in (crank, follower):
        if dyad.length < near:
            return "a link without length: the body is pinned to the frame"
    if "PP" in (crank.kind, follower.kind) and (crank.kind, follower.kind) not in KINDS:
        return "crossed slides and another slide: no link turns, so that one slide would do"
    if crank.kind[0] == follower.kind[0] == "R" and abs(crank.fixed - follower.fixed) < near:
        return "both dyads turn about one fixed pivot, so that the linkage turns as a whole"
    if crank.kind[1] == follower.kind[1] == "R" and abs(crank.moving - follower.moving) < near:
        return "both dyads hold one point of the body, so that its angle is free"
    if crank.kind == follower.kind == "PR" and abs((crank.fixed * follower.fixed.conjugate()).imag) < COINCIDE:
        return "both sliders move in one direction, so that the body is only translated"
    if crank.kind == follower.kind == "RP" and abs((crank.moving * follower.moving.conjugate()).imag) < COINCIDE:
        return "the body slides in both blocks in one direction, so that it only slides"
    if (crank.kind, follower.kind) == ("RP", "PR") and abs((crank.moving * follower.fixed.conjugate()).imag) < COINCIDE:
        return "both slides point in one direction in pose 0, so that the body slides freely"
    return ""


def _parameters(crank: MotionDyad, follower: MotionDyad) -> tuple[dict[str, complex], frozenset[str]]:
    """Pivots by the names of the points; directions of slides as angles."""
    named: dict[str, complex] = {}
    angles = set()
    for number, dyad in ((1, crank), (2, follower)):
        for letter, joint, value in (("O", dyad.kind[0], dyad.fixed), ("A", dyad.kind[1], dyad.moving)):
            if joint == "R":
                named[f"{letter}{number}"] = complex(value)
            else:
                named[f"{letter}{number}_slide"] = float(np.angle(value * (1 if value.imag >= 0 else -1)))
                angles.add(f"{letter}{number}_slide")
    return named, frozenset(angles)


def both_sides(verdicts: Iterable[Mapping[str, NDArray[Any]]]) -> dict[str, NDArray[Any]]:
    """Of the verdicts on two driving sides, for each linkage the better one; ``side`` says which (0 or 1)."""
    first, second = verdicts
    side = (score(second) > score(first)).astype(int)
    chosen = {key: np.where(side == 0, first[key], second[key]) for key in first}
    return {**chosen, "side": side}
