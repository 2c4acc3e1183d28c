"""Dyads to choose from, when two, three or four poses leave a choice.

- **Four poses** leave a curve of dyads: its points at equal steps, and the two sliders.
- **Three poses** leave the moving pivot free, or the fixed one; either determines the other by two linear
  equations, and Ball's points become a circle, as do the pivots of inverted sliders.
- **Two poses** leave the moving pivot free and the fixed one on the perpendicular bisector of its two places; every
  point may be that of a slider.

Poses of an elliptic trammel, however many, have a circle of sliders too (Cardan), and those of its inversion.

A pool is arrays; a slider stands in it as a very long link, which is how closed formulas can judge it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechanisms.families.circle_points import CircleCurve, inverse_poses
from mechanisms.families.motion_dyads import MotionDyad, Poses
from mechanisms.families.regions import Region

__all__ = ["DyadPool", "curve_pool", "sampled_pool", "sliders_of_circles", "third_point"]

#: A slider's pivot is put this many sizes away: straight to 1e-4 of the size, rounded to 1e-8 of it.
FAR = 1e4
#: Without a region, pivots are looked for within this many sizes of the middle of the poses.
REACH = 1.5
#: Samples for each that is wanted, where many fall outside their region.
MORE = 16
#: Points on the circle of sliders of three poses, and sliders of two poses.
SLIDERS = 24
#: Coefficients of the circle of sliders, of unit size, that are rounding.
STRAIGHT = 1e-12
#: A slider that misses its poses by more than this, in sizes of the task, is none.
SLIDES = 1e-9

@dataclass(frozen=True, eq=False)
class DyadPool:
    """Dyads as arrays.

    Attributes
    ----------
    fixed, moving : (n,) complex arrays
        Pivots in pose 0; a slider's infinite pivot stands far away.
    kinds : (n,) array of str
    lines : (n,) complex array
        Directions of the slides; zero for RR.
    marks : mapping of str to (n,) array
        Numbers that say which dyad it is: ``dyad``, its number on a curve.
    """

    fixed: NDArray[np.complex128]
    moving: NDArray[np.complex128]
    kinds: NDArray[Any]
    lines: NDArray[np.complex128]
    marks: Mapping[str, NDArray[np.float64]]

    def __len__(self) -> int:
        return len(self.fixed)

    @classmethod
    def of(cls, fixed: ArrayLike, moving: ArrayLike, **marks: NDArray[np.float64]) -> DyadPool:
        """A pool of RR dyads."""
        g, z = np.atleast_1d(np.asarray(fixed, complex)), np.atleast_1d(np.asarray(moving, complex))
        return cls(g, z, np.full(len(g), "RR"), np.zeros(len(g), complex), marks)

    def where(self, keep: NDArray[Any]) -> DyadPool:
        """Some of them."""
        marks = {name: values[keep] for name, values in self.marks.items()}
        return DyadPool(self.fixed[keep], self.moving[keep], self.kinds[keep], self.lines[keep], marks)

    def with_sliders(self, sliders: list[MotionDyad], size: float) -> DyadPool:
        """These and some sliders, whose marks are not a number."""
        fixed, moving = [], []
        for dyad in sliders:
            away = FAR * size * 1j
            fixed.append(dyad.moving + away * dyad.fixed if dyad.kind == "PR" else dyad.fixed)
            moving.append(dyad.fixed + away * dyad.moving if dyad.kind == "RP" else dyad.moving)
        lines = [dyad.fixed if dyad.kind == "PR" else dyad.moving for dyad in sliders]
        blank = np.full(len(sliders), np.nan)
        return DyadPool(
            np.append(self.fixed, fixed),
            np.append(self.moving, moving),
            np.append(self.kinds, [dyad.kind for dyad in sliders]),
            np.append(self.lines, lines),
            {name: np.append(values, blank) for name, values in self.marks.items()},
        )

    def dyad(self, index: int) -> MotionDyad:
        """One of them."""
        kind = str(self.kinds[index])
        fixed, moving, line = complex(self.fixed[index]), complex(self.moving[index]), complex(self.lines[index])
        if kind == "PR":
            return MotionDyad("PR", line, moving)
        return MotionDyad("RP", fixed, line) if kind == "RP" else MotionDyad("RR", fixed, moving)


def curve_pool(curve: CircleCurve, count: int, fixed: Region, moving: Region) -> DyadPool:
    """Dyads of four poses: `count` points of the curve at equal steps, and the sliders.

    The mark ``dyad`` of a point is 100·k + its percentage of the way round circuit k, as in the map.
    """
    parts: list[tuple[Any, ...]] = []
    for number, circuit in enumerate(curve.circuits):
        share = max(8, count // len(curve.circuits))
        g, z = curve.dyads(circuit, circuit.stations(share))
        parts.append((g, z, 100.0 * (number + np.arange(share) / share)))
    g, z, station = (np.concatenate(column) for column in zip(*parts)) if parts else (np.zeros(0),) * 3
    finite = np.maximum(np.abs(g - curve.poses.points[0]), np.abs(z - curve.poses.points[0])) < FAR * curve.poses.size
    pool = DyadPool.of(g[finite], z[finite], dyad=station[finite])
    sliders = sliders_of_circles(curve.poses)
    sliders += [dyad for dyad in curve.sliders() if dyad.kind not in {slider.kind for slider in sliders}]
    return _inside(pool.with_sliders(sliders, curve.poses.size), fixed, moving)


def third_point(poses: Poses, moving: ArrayLike) -> NDArray[np.complex128]:
    """Three poses: the centre of the circle through the three places of points of the body.

    Parameters
    ----------
    poses : Poses
        Three of them. With ``inverse_poses(poses)`` the circle points of given centre points are found.
    moving : (n,) complex array_like
        Points of the body in pose 0.

    Returns
    -------
    (n,) complex array
        Not finite where the three places lie on a line.

    Examples
    --------
    >>> poses = Poses.of([(1, 0, 0), (0, 1, 90), (-1, 0, 180)])  # a rotation about the origin
    >>> bool(abs(third_point(poses, [2 + 1j])[0]) < 1e-12)
    True
    """
    places = poses.carry(np.atleast_1d(np.asarray(moving, dtype=complex)))
    d1, d2 = places[:, 1] - places[:, 0], places[:, 2] - places[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        # |d1|² = 2 Re(c̄ d1), |d2|² = 2 Re(c̄ d2) for the centre c from the first place
        area = (np.conj(d1) * d2).imag
        centre = 1j * (d1 * np.abs(d2) ** 2 - d2 * np.abs(d1) ** 2) / (2 * area)
        return places[:, 0] + np.where(area == 0, np.inf, centre)


def sampled_pool(poses: Poses, count: int, fixed: Region, moving: Region, seed: int) -> DyadPool:
    """Dyads of two or three poses, spread over regions for their pivots.

    The pivot that is a point, or else the one whose region is given, is chosen, and the other follows.
    """
    from scipy.stats import qmc

    choose_fixed = fixed.point is not None or (fixed.given and not moving.given)
    region, other_region = (fixed, moving) if choose_fixed else (moving, fixed)
    # of three poses the other pivot is where it is, so that it takes many trials to have it in a region
    tried = count * (MORE if len(poses) == 3 and other_region.given and region.point is None else 1)
    unit = qmc.Sobol(3, seed=np.random.default_rng(seed)).random_base2(max(1, math.ceil(math.log2(tried))))
    middle = complex(poses.points.mean())
    motion = inverse_poses(poses) if choose_fixed else poses
    chosen = region.sample(unit, middle, REACH * poses.size)
    if len(poses) == 3 and region.point is not None:
        chosen = chosen[:1]
    if len(poses) == 3:
        other = third_point(motion, chosen)
    else:
        places = motion.carry(chosen)
        way = places[:, 1] - places[:, 0]
        with np.errstate(divide="ignore", invalid="ignore"):
            across = 1j * way / np.abs(way)
        other = other_region.along(places.mean(axis=1), across, unit[: len(chosen), 2], poses.size)
    g, z = (chosen, other) if choose_fixed else (other, chosen)
    finite = np.isfinite(g) & np.isfinite(z)
    pool = _inside(DyadPool.of(g[finite], z[finite]), fixed, moving)
    pool = pool.where(np.arange(len(pool)) < max(count, 1))
    sliders = []
    for place, far, inverse in ((moving, fixed, False), (fixed, moving, True)):
        if far.point is not None:  # that pivot of a slider is at infinity
            continue
        if place.point is not None:
            spots = np.array([place.point])
        elif len(poses) == 2:
            spots = place.sample(unit[:SLIDERS], middle, REACH * poses.size)
        else:
            spots = _line_points(inverse_poses(poses) if inverse else poses, SLIDERS)
        sliders += _sliders(poses, spots, inverse)
    return _inside(pool.with_sliders(sliders, poses.size), fixed, moving)


def sliders_of_circles(poses: Poses) -> list[MotionDyad]:
    """Sliders of three or more poses that come in whole circles, `SLIDERS` of each circle.

    Three poses have a circle of PR and one of RP; more have the former when an elliptic trammel takes them, the
    latter when its inversion does.

    Examples
    --------
    >>> len(sliders_of_circles(Poses.of([(0, 0, 0), (1, 0.5, 20), (2, 0.6, 60), (2.5, 0, 100)])))
    0
    """
    found = []
    for motion, inverse in ((poses, False), (inverse_poses(poses), True)):
        three = Poses(motion.points[:3], motion.angles[:3])
        spots = _line_points(three, SLIDERS)
        sliders = _sliders(poses, spots, inverse)
        found += sliders if len(sliders) == len(spots) else []
    return found


def _sliders(poses: Poses, spots: NDArray[np.complex128], inverse: bool) -> list[MotionDyad]:
    """PR dyads of moving pivots, or RP dyads of fixed ones, as far as there are any."""
    places = (inverse_poses(poses) if inverse else poses).carry(spots)
    found = []
    for pivot, ways in zip(spots, places - places[:, :1]):
        line = ways[int(np.abs(ways).argmax())]
        if abs(line) < SLIDES * poses.size:
            continue
        unit = complex(line / abs(line))
        dyad = MotionDyad("RP", complex(pivot), unit) if inverse else MotionDyad("PR", unit, complex(pivot))
        if dyad.errors(poses).max() < SLIDES * (poses.size + abs(pivot - poses.points[0])):
            found.append(dyad)
    return found


def _line_points(poses: Poses, count: int) -> NDArray[np.complex128]:
    """Points of the body whose three places lie on a line: a circle, or a line when two poses are parallel."""
    (p1, p2), (a1, a2) = poses.moves[1:] / poses.size, np.exp(1j * poses.angles[1:]) - 1
    # Im(conj(p1 + a1 z)(p2 + a2 z)) = A|z|² + Re(B̄ z) + C = 0
    a = (np.conj(a1) * a2).imag
    b = 1j * (p1 * np.conj(a2)) - 1j * (np.conj(p2) * a1).conjugate()
    c = (np.conj(p1) * p2).imag
    steps = (np.arange(count) + 0.5) / count
    if abs(a) < STRAIGHT:
        if abs(b) < STRAIGHT:
            return np.zeros(0, complex)
        # a line: its points at equal steps of the angle seen from the size of the poses
        spots = -c * b / abs(b) ** 2 + 1j * b / abs(b) * np.tan(np.pi * (steps - 0.5))
    else:
        centre = -b / (2 * a)
        square = abs(centre) ** 2 - c / a
        if square <= 0:
            return np.zeros(0, complex)
        spots = centre + math.sqrt(square) * np.exp(2j * np.pi * steps)
    return np.asarray(poses.points[0] + poses.size * spots)


def _inside(pool: DyadPool, fixed: Region, moving: Region) -> DyadPool:
    keep = np.ones(len(pool), dtype=bool)
    for region, places in ((fixed, pool.fixed), (moving, pool.moving)):
        if region.point is None and region.given:
            keep &= region.holds(places)
    return pool.where(keep)
