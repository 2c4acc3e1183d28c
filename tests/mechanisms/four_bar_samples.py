"""Poses sampled from linkages that are known, for tests of synthesis."""

from __future__ import annotations

import cmath
from functools import partial
from typing import Any

import numpy as np

from mechanisms import Task
from mechanisms.families.motion_dyads import MotionDyad, Poses


def _meet(tip: complex, side: int, radius: float, center: complex, other: float) -> complex | None:
    d = abs(center - tip)
    if not abs(radius - other) < d < radius + other:
        return None
    along = (radius**2 - other**2 + d**2) / (2 * d)
    return tip + (center - tip) / d * (along + 1j * side * np.sqrt(radius**2 - along**2))


def _slide(tip: complex, side: int, radius: float, place: complex, line: complex) -> complex | None:
    foot = place + line * ((tip - place) * line.conjugate()).real
    height = abs(tip - foot)
    return foot + side * line * np.sqrt(radius**2 - height**2) if height < radius else None


def _poses(rng, count, o1, a1, a2, place_of_a2, start=None):
    """Turn the crank at random; the body is a1, a2 with the point P."""
    p = complex(*rng.uniform(-1, 1, 2))
    points, angles = [p], [0.0]
    for _ in range(500):
        tip = o1 + (a1 - o1) * cmath.exp(2j * np.pi * rng.uniform())
        other = place_of_a2(tip, int(rng.choice([-1, 1])))
        if other is None:
            continue
        turn = (other - tip) / (a2 - a1)
        points.append(tip + turn * (p - a1))
        angles.append(cmath.phase(turn))
        if len(points) == count:
            return Poses(np.array(points), np.array(angles))
    return None


def four_bar_poses(rng, count=5):
    """Poses of a random four-bar, its dyads, first the crank's."""
    while True:
        o1, o2, a1, a2 = (complex(*rng.uniform(-1, 1, 2)) for _ in range(4))
        coupler, rocker = abs(a2 - a1), abs(a2 - o2)
        poses = _poses(rng, count, o1, a1, a2, partial(_meet, radius=coupler, center=o2, other=rocker))
        if poses is not None:
            return poses, [MotionDyad("RR", o1, a1), MotionDyad("RR", o2, a2)]


def slider_crank_poses(rng, count=5):
    """Poses of a random slider-crank."""
    while True:
        o1, a1, a2 = (complex(*rng.uniform(-1, 1, 2)) for _ in range(3))
        line = cmath.exp(1j * rng.uniform(0, np.pi))
        poses = _poses(rng, count, o1, a1, a2, partial(_slide, radius=abs(a2 - a1), place=a2, line=line))
        if poses is not None:
            return poses, [MotionDyad("RR", o1, a1), MotionDyad("PR", line, a2)]


def inverted_slider_crank_poses(rng, count=5):
    """Poses of a random inverted slider-crank: a line of the body passes a pivot at a constant distance."""
    o1, a1, o2, p = (complex(*rng.uniform(-1, 1, 2)) for _ in range(4))
    offset = rng.uniform(-0.5, 0.5) * abs(abs(a1 - o1) - abs(o2 - o1))  # always within reach
    heading, points, angles = None, [], []
    for k in range(count):
        tip = o1 + (a1 - o1) * (1 if k == 0 else cmath.exp(2j * np.pi * rng.uniform()))
        d = abs(o2 - tip)
        # the line through the moving pivot that leaves o2 at the distance `offset` on one side
        direction = (o2 - tip) / d * cmath.exp(1j * np.arcsin(offset / d))
        heading = direction if heading is None else heading
        turn = direction / heading
        points.append(tip + turn * (p - a1))
        angles.append(cmath.phase(turn))
    poses = Poses(np.array(points), np.array(angles))
    return poses, [MotionDyad("RR", o1, a1), MotionDyad("RP", o2, heading)]


def mixed_task(poses: Poses, count: int, **tables: Any) -> Task:
    """A task of the family four-bar-motion: the first positions as poses, the others as points."""
    rows = [
        {"x": z.real, "y": z.imag, "angle_deg": float(np.degrees(angle))}
        for z, angle in zip(poses.points, poses.angles)
    ]
    points = [{"x": row["x"], "y": row["y"]} for row in rows[count:]]
    return Task.from_dict({"mechanism": "four-bar-motion", "poses": rows[:count], "points": points, **tables})
