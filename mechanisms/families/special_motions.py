"""Motions so special that dyads come in whole families, or that need no linkage: refused with the reason."""

from __future__ import annotations

import cmath
from typing import Any

from mechanisms.families.dyad_pools import third_point
from mechanisms.families.motion_dyads import Poses, common_pole, tidy
from mechanisms.task import Task, TaskError

__all__ = ["refuse_special_motions", "refuse_whole_families"]

#: Four places lie on a circle when the imaginary part of their cross ratio is below this, relative.
ON_CIRCLE = 1e-9


def refuse_whole_families(task: Task, poses: Poses) -> None:
    """Four of the five poses may be so special that dyads come in whole families; say which and why."""
    for left_out in range(5):
        keep = [k for k in range(5) if k != left_out]
        four = Poses(poses.points[keep], poses.angles[keep] - poses.angles[keep[0]])
        which = "poses " + ", ".join(map(str, keep))
        if (pole := common_pole(four)) is not None:
            raise TaskError(
                f"{task.where}: poses: {which} are turns about one point, ({pole.real:g}, {pole.imag:g}), so that "
                f"dyads held there come in whole families; give fewer of them, or move one"
            )
        if four.parallel and abs(_off_circle(four.points)) < ON_CIRCLE:
            raise TaskError(
                f"{task.where}: poses: {which} are parallel with positions on one circle, so that dyads come in "
                f"whole families; give fewer of them, or move one"
            )


def _off_circle(places: Any) -> float:
    """Imaginary part of the cross ratio of four places, relative: zero on a circle or a line."""
    a, b, c, d = places
    ratio = (a - c) * (b - d) / ((a - d) * (b - c))
    return float(ratio.imag / abs(ratio))


def refuse_special_motions(task: Task, poses: Poses) -> None:
    """Translations and pure rotations have whole families of dyads, or none; say what carries them instead."""
    if len(poses) < 3:
        return
    if poses.parallel:
        circle = _circle(poses)
        remedy = (
            "no two pins hold it"
            if circle is None
            else (
                f"so does a parallelogram whose links are parallel to the radius from ({circle[0].real:g}, "
                f"{circle[0].imag:g}) to the reference point, and {circle[1]:g} long"
            )
        )
        raise TaskError(
            f"{task.where}: poses: the body never turns; two crossed slides carry it, {remedy}; turn it in one of its "
            f"poses"
        )
    pole = common_pole(poses)
    if pole is not None:
        raise TaskError(
            f"{task.where}: poses: the body only turns about the point ({pole.real:g}, {pole.imag:g}); pin it "
            f"there, no linkage is needed"
        )


def _circle(poses: Poses) -> tuple[complex, float] | None:
    """Centre and radius of the circle through all positions; None if there is none."""
    centre = complex(third_point(Poses(poses.points[:3], poses.angles[:3]), poses.points[0])[0])
    radii = abs(poses.points - centre)
    if not cmath.isfinite(centre) or float(max(radii) - min(radii)) > ON_CIRCLE * float(max(radii)):
        return None
    return tidy(centre, poses.size), float(radii[0])
