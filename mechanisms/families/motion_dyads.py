"""The dyads of a body: what carries it between frame and coupler, and what two of them make.

A dyad is one moving link between the frame and the body, with a joint at either end.  **RR** is a link with two
pins.  **PR** is a slider on the frame, pinned to the body: its pin moves on a straight line.  **RP** is a block
pinned to the frame in which the body slides: the inversion of PR.  **PP**, a slider on a slider, keeps the body
parallel.  Two dyads make a linkage of four links: a four-bar, a slider-crank, one of its inversions, or a
double slider.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal, Self

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from mechanisms.task import Pose

__all__ = ["DyadKind", "MotionDyad", "Poses", "common_pole", "grashof_type"]

DyadKind = Literal["RR", "PR", "RP", "PP"]

#: Positions nearer than this part of the poses' size, and angles nearer than this, are the same.
SAME = 1e-9
#: Shortest + longest against the other two, relative: a change point within rounding of given lengths.
CHANGE_POINT = 1e-9


@dataclass(frozen=True, eq=False)
class Poses:
    """Poses of one body as arrays.

    Parameters
    ----------
    points : (n,) complex array
        Positions of the body's reference point, in the task's unit.
    angles : (n,) float array
        Rotations from pose 0, radians; the first is zero.

    Examples
    --------
    >>> poses = Poses.of([(1, 0, 30), (1, 2, 120)])
    >>> poses.moves.tolist(), float(np.degrees(poses.angles[1]).round(9)), poses.size
    ([0j, 2j], 90.0, 2.0)
    """

    points: NDArray[np.complex128]
    angles: NDArray[np.float64] = field(repr=False)

    @classmethod
    def of(cls, poses: Iterable[Sequence[float] | Pose]) -> Self:
        """From ``(x, y, angle_deg)`` triples, or from `mechanisms.task.Pose`."""
        points, angles = [], []
        for pose in poses:
            if isinstance(pose, Sequence):
                x, y, degrees = pose
                points.append(complex(x, y))
                angles.append(math.radians(degrees))
            else:
                points.append(pose.point)
                angles.append(pose.angle)
        turns = [math.remainder(angle - angles[0], 2 * math.pi) for angle in angles]
        return cls(np.array(points, dtype=complex), np.array(turns, dtype=float))

    def __len__(self) -> int:
        return len(self.points)

    @property
    def moves(self) -> NDArray[np.complex128]:
        """Displacements of the reference point from pose 0."""
        return self.points - self.points[0]

    @cached_property
    def size(self) -> float:
        """The largest distance between two positions; 1 when all coincide."""
        distances = np.abs(self.points[:, None] - self.points)
        return float(distances.max()) or 1.0

    def carry(self, place: Any) -> NDArray[np.complex128]:
        """Where points of the body, given by their places in pose 0, are in every pose; (…,) to (…, n)."""
        arm = np.asarray(place, dtype=complex)[..., None] - self.points[0]
        return self.points + np.exp(1j * self.angles) * arm

    @property
    def parallel(self) -> bool:
        """Whether the body never turns."""
        return bool(np.all(np.abs(np.sin(self.angles / 2)) < SAME))


def common_pole(poses: Poses) -> complex | None:
    """The one point about which the body turns in all of its displacements, or None.

    Examples
    --------
    >>> common_pole(Poses.of([(1, 0, 0), (0, 1, 90), (-1, 0, 180)]))
    0j
    """
    turns = np.exp(1j * poses.angles[1:]) - 1
    if len(turns) == 0 or np.any(np.abs(turns) < SAME):
        return None
    poles = poses.points[0] - poses.moves[1:] / turns
    if np.abs(poles - poles[0]).max() > SAME * max(poses.size, float(np.abs(poles - poses.points[0]).max())):
        return None
    return tidy(complex(poles[0]), poses.size)


def tidy(place: complex, size: float) -> complex:
    """A place for messages, without the dust of rounding."""
    return complex(np.round(place / size, 12) * size) + 0.0


@dataclass(frozen=True)
class MotionDyad:
    """A dyad that carries the body, in pose 0.

    Parameters
    ----------
    kind : {"RR", "PR", "RP", "PP"}
        The joint at the frame first, the joint at the body second.
    fixed : complex
        The fixed pivot; for PR and PP the direction in which the slider moves on the frame.
    moving : complex
        The moving pivot in pose 0; for RP and PP the direction, in pose 0, in which the body slides in the block.
    root : int or None
        The root it came from.

    Examples
    --------
    >>> poses = Poses.of([(0, 0, 0), (1, 1, 90)])
    >>> float(MotionDyad("RR", 0j, 1j).turns(poses)[1])  # the pivot goes from i to 1 + i + i·i = i
    0.0
    """

    kind: DyadKind
    fixed: complex
    moving: complex
    root: int | None = None

    def turns(self, poses: Poses) -> NDArray[np.float64]:
        """Rotation of the dyad's link to every pose, radians: zero for PR, the body's own for RP."""
        if self.kind == "RR":
            arms = poses.carry(self.moving) - self.fixed
            return np.angle(arms / arms[0])
        return np.zeros(len(poses)) if self.kind in ("PR", "PP") else poses.angles.copy()

    def errors(self, poses: Poses) -> NDArray[np.float64]:
        """By how much the dyad misses each pose: a length."""
        if self.kind == "RR":
            lengths = np.abs(poses.carry(self.moving) - self.fixed)
            return np.abs(lengths - lengths[0])
        if self.kind == "PR":
            places = poses.carry(self.moving)
            return np.abs(((places - places[0]) * np.conj(self.fixed)).imag) / abs(self.fixed)
        if self.kind == "RP":
            seen = poses.points[0] + (self.fixed - poses.points) * np.exp(-1j * poses.angles)
            return np.abs(((seen - seen[0]) * np.conj(self.moving)).imag) / abs(self.moving)
        return 2 * poses.size * np.abs(np.sin(poses.angles / 2))

    @property
    def length(self) -> float:
        """Distance of the two pivots of RR; infinite for the others."""
        return abs(self.fixed - self.moving) if self.kind == "RR" else math.inf


def grashof_type(ground: float, driver: float, coupler: float, follower: float) -> str:
    """What a four-bar can do when `driver` is driven, by Grashof's rule.

    Returns
    -------
    str
        "crank-rocker", "rocker-crank", "double-crank", "Grashof double-rocker", "triple-rocker" or
        "change point".

    Examples
    --------
    >>> grashof_type(4, 1, 3, 3.5), grashof_type(4, 3.5, 3, 1), grashof_type(1, 3, 3, 3)
    ('crank-rocker', 'rocker-crank', 'double-crank')
    >>> grashof_type(3, 3, 1, 3), grashof_type(5, 2, 3, 3), grashof_type(3, 1, 3, 1)
    ('Grashof double-rocker', 'triple-rocker', 'change point')
    """
    lengths = {"ground": ground, "driver": driver, "coupler": coupler, "follower": follower}
    shortest, *middle, longest = sorted(lengths.values())
    margin = sum(middle) - shortest - longest
    if abs(margin) <= CHANGE_POINT * sum(lengths.values()):
        return "change point"
    if margin < 0:
        return "triple-rocker"
    names = {
        "ground": "double-crank",
        "driver": "crank-rocker",
        "coupler": "Grashof double-rocker",
        "follower": "rocker-crank",
    }
    return names[min(lengths, key=lambda name: lengths[name])]
