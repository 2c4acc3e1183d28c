"""Motions so special that dyads come in whole families, or that need no linkage: refused with the reason."""

from __future__ import annotations

from typing import Any

from mechanisms.families.motion_dyads import Poses, common_pole
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
        raise TaskError(
            f"{task.where}: poses: the body never turns; two crossed slides carry it, and no dyad of two pins "
            f"does unless all positions lie on one circle; turn it in one of its poses"
        )
    pole = common_pole(poses)
    if pole is not None:
        raise TaskError(
            f"{task.where}: poses: the body only turns about the point ({pole.real:g}, {pole.imag:g}); pin it "
            f"there, no linkage is needed"
        )
