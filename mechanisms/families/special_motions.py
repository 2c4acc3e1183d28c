"""Motions so special that dyads come in whole families, or that have or need no linkage: refused with the reason."""

from __future__ import annotations

from typing import Any

import numpy as np

from mechanisms.families.base import BODY
from mechanisms.families.motion_dyads import SAME, Poses, common_pole
from mechanisms.families.tolerance import tolerances_of
from mechanisms.families.translation_fit import nearest_translation
from mechanisms.families.translations import circle_of, line_of
from mechanisms.task import Task, TaskError

__all__ = ["refuse_special_mixtures", "refuse_special_motions", "refuse_whole_families"]

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


def refuse_special_mixtures(task: Task) -> None:
    """Poses among points or numbers that are so special that dyads come in whole families."""
    poses = Poses.of(task.poses[BODY])
    points = task.points.get(BODY, ())
    for k, point in enumerate(points):
        near = np.flatnonzero(np.abs(poses.points - point) < SAME * task.size)
        if len(near):
            raise TaskError(
                f"{task.where}: points: point {k} is where pose {near[0]} is, which visits it already; leave it out, "
                f"or move it"
            )
    if poses.parallel and len(poses) > (3 if points else 2):
        raise TaskError(
            f"{task.where}: poses: the body never turns in them, so that they determine the length and the turns of "
            f"every crank and leave its place open; "
            + ("turn one of them" if points else "give pivots, by both coordinates or by ranges, and no lengths")
        )
    pole = common_pole(poses)
    if pole is not None and len(poses) > (3 if points else 2):
        raise TaskError(
            f"{task.where}: poses: they are turns about one point, ({pole.real:g}, {pole.imag:g}), so that dyads held "
            f"there come in whole families; give fewer of them, or move one"
        )


def refuse_special_motions(task: Task, poses: Poses) -> None:
    """Pure rotations need no linkage, and some translations have none; say what carries the body instead."""
    if len(poses) < 3:
        return
    if poses.parallel and circle_of(poses) is None and line_of(poses) is None:
        zones = tolerances_of(task, len(poses))
        if zones is None or nearest_translation(poses, zones) is None:
            remedy = "give tolerances" if zones is None else "widen the tolerances"
            raise TaskError(
                f"{task.where}: poses: the body never turns, and its positions lie on no circle and no line, so that "
                f"only two crossed slides with a drive for each carry it; turn it in one of its poses, leave out a "
                f"pose, or {remedy}"
            )
    pole = common_pole(poses)
    if pole is not None:
        raise TaskError(
            f"{task.where}: poses: the body only turns about the point ({pole.real:g}, {pole.imag:g}); pin it "
            f"there, no linkage is needed"
        )
