"""Two sliders carry the body: elliptic trammel, its inversion, and a slide with a swinging block.

Both dyads are sliders, PR or RP, and the body's turn θ is a coordinate of the whole motion: each displacement is a
sum of sines of θ.  With u the direction of a slide on the frame, b that of a slide on the body and v the way from one
pin of the body to the other,

=========  ======  =======================================  ==================================================
dyads      driven  dead where                               transmission angle
=========  ======  =======================================  ==================================================
PR and PR  a PR    v stands across the other's slide        sin μ = cos ∠(v, u), u of the slide that is not driven
RP and RP  an RP   nowhere                                  that between the two slides of the body, always
RP and PR  the RP  the slides are parallel, at infinity     that between the slides, b and u
=========  ======  =======================================  ==================================================

Between two dead places θ goes on one way, so that the order of the poses is the order of their angles.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from mechanisms.families.base import Candidate
from mechanisms.families.dyad_pairs import pair_candidate
from mechanisms.families.motion_dyads import MotionDyad, Poses

__all__ = ["slider_pairs", "slider_verdict"]

#: Designs kept of two sliders, and when none is free of defects.
KEEP, KEEP_DEFECTIVE = 3, 1
#: Pairs whose angle is below this are no linkage, or a jammed one.
JAMMED = 1e-6
#: Pivots further than this many sizes from the middle of the poses are only kept for want of others.
LARGE = 2.5
#: Pivots nearer than this, in sizes of the task, are one choice.
SAME_CHOICE = 0.15


def slider_verdict(poses: Poses, driver: MotionDyad, other: MotionDyad) -> dict[str, Any]:
    """The verdict on two sliders, the first one driven; the keys are those of `mechanisms.motion.Verdict`.

    An RP drives a PR, not the other way round.

    Examples
    --------
    A trammel whose pins slide on the axes, its bar at 30, 45 and 60 degrees from the x axis:

    >>> rise = np.radians([30, 45, 60])
    >>> poses = Poses(-np.cos(rise) + 0j, rise - rise[0])
    >>> one, two = MotionDyad("PR", 1, complex(poses.points[0])), MotionDyad("PR", 1j, 0.5j)
    >>> verdict = slider_verdict(poses, one, two)
    >>> verdict["in_order"], round(verdict["min_transmission_deg"], 9)
    (True, 30.0)
    """
    turns = np.exp(1j * poses.angles)
    if driver.kind == other.kind == "RP":
        slant = abs((driver.moving * other.moving.conjugate()).imag)
        ways = [(way * poses.angles) % (2 * np.pi) for way in (1, -1)]
        return {
            "same_circuit": True,
            "same_branch": True,
            "in_order": any(bool(np.all(np.diff(way) > 0)) for way in ways),
            "full_rotation": True,
            "min_transmission_deg": float(np.degrees(np.arcsin(min(1.0, slant)))),
        }
    # the angle of the body from the place where it is dead: on one branch it lies within a half turn
    if driver.kind == "PR":
        way = other.moving - driver.moving
        seen = 1j * way / abs(way) * turns * other.fixed.conjugate()
    else:
        seen = driver.moving * turns * other.fixed.conjugate()
    sines = seen.imag
    alive = bool(np.all(sines > JAMMED) or np.all(sines < -JAMMED))
    steps = np.diff(np.angle(seen * (1 if sines[0] > 0 else -1)))
    least = float(np.degrees(np.arcsin(min(1.0, np.abs(sines).min()))))
    return {
        "same_circuit": alive or driver.kind == "PR",
        "same_branch": alive,
        "in_order": alive and bool(np.all(steps > 0) or np.all(steps < 0)),
        "full_rotation": False,
        "min_transmission_deg": least if alive else 0.0,
    }


def slider_pairs(
    poses: Poses,
    first: Sequence[MotionDyad],
    second: Sequence[MotionDyad],
    constraints: Mapping[str, Any],
    title: str = "",
    length_unit: str = "",
) -> Iterator[Candidate]:
    """The pairs of two sliders with the best transmission angle; one with a defect if there is no other.

    Parameters
    ----------
    first, second : sequences of MotionDyad
        PR and RP; they may be one sequence.
    """
    pairs = list(itertools.combinations(first, 2) if first is second else itertools.product(first, second))
    found = []
    for pair in pairs:
        if any(_outside(dyad, constraints) for dyad in pair):
            continue
        sides = [pair, pair[::-1]] if pair[0].kind == pair[1].kind == "PR" else [sorted(pair, key=_drives)]
        for driver, other in sides:
            if _do_not_hold(poses, driver, other):
                continue
            verdict = slider_verdict(poses, driver, other)
            steps = sum(verdict[key] for key in ("same_circuit", "same_branch", "in_order"))
            near = all(abs(pivot(dyad) - poses.points.mean()) < LARGE * poses.size for dyad in pair)
            found.append((steps, near, verdict["min_transmission_deg"], driver, other))
    good = [item for item in found if item[0] == 3]
    words = "best in transmission angle" if good else "no pair of two sliders is free of defects"
    taken: list[list[complex]] = []
    for *_, driver, other in sorted(good or found, key=lambda item: item[:3], reverse=True):
        spots = [pivot(driver), pivot(other)]
        if any(_near(poses, spots, known) for known in taken):
            continue
        if len(taken) >= (KEEP if good else KEEP_DEFECTIVE):
            break
        taken.append(spots)
        extra = {"pairs_of_sliders": len(pairs)}
        yield pair_candidate(poses, driver, other, title, length_unit, extra, words if len(found) > 1 else "")


def pivot(dyad: MotionDyad) -> complex:
    """The one pivot of a slider."""
    return dyad.moving if dyad.kind == "PR" else dyad.fixed


def _drives(dyad: MotionDyad) -> bool:
    return dyad.kind != "RP"


def _near(poses: Poses, spots: Sequence[complex], known: Sequence[complex]) -> bool:
    orders = (spots, spots[::-1])
    return min(max(abs(a - b) for a, b in zip(order, known)) for order in orders) < SAME_CHOICE * poses.size


def _do_not_hold(poses: Poses, one: MotionDyad, other: MotionDyad) -> bool:
    """Whether the two share their pivot, or their direction in a pose, so that they do not hold the body."""
    if one.kind != other.kind:  # one slides on the body, the other on the frame
        return bool(np.abs((one.moving * np.exp(1j * poses.angles) * other.fixed.conjugate()).imag).min() < JAMMED)
    lines = (one.fixed, other.fixed) if one.kind == "PR" else (one.moving, other.moving)
    parallel = abs((lines[0] * lines[1].conjugate()).imag) < JAMMED
    return parallel or abs(pivot(one) - pivot(other)) < JAMMED * poses.size


def _outside(dyad: MotionDyad, constraints: Mapping[str, Any]) -> bool:
    box = constraints.get("pivots_in", {}) if dyad.kind == "RP" else {}
    sides = {"x": dyad.fixed.real, "y": dyad.fixed.imag}
    return any(not low <= sides[axis] <= high for axis, (low, high) in box.items())
