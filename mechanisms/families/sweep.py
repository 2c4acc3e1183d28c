"""How far a crank carries a four-bar loop: dead centres and transmission angle, for whole arrays of loops at once.

A loop of crank W (pivot O to moving pivot A), coupler of length c and rocker of length r (pivot R) closes
when the diagonal d = |A − R| satisfies |c − r| ≤ d ≤ c + r, and the dead centres for the crank are where d
reaches a limit. With θ the angle from the ground vector R − O to the crank, d² = |W|² + g² − 2|W|g·cos θ, so
that a crank that goes from one closed configuration to another can be stopped only where cos θ has an
extremum in between: at θ = 0 and θ = π.  That makes the test exact without any sampling.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["Sweep", "loop_sweep"]

#: Turning by a whole circle, less than which a working range must be.
CIRCLE = 2 * np.pi


class Sweep(NamedTuple):
    """What a crank does to loops on its way from pose 0 to the last pose.

    Attributes
    ----------
    same_assembly : (n,) bool array
        All poses are assembled with the coupler on the same side of the rocker.
    passes : (n,) bool array
        No dead centre lies on the way.
    transmission : (n,) float array
        Least transmission angle on the way, radians from 0 to π/2; meaningful where `passes`.
    """

    same_assembly: NDArray[np.bool_]
    passes: NDArray[np.bool_]
    transmission: NDArray[np.float64]

    @property
    def defect_free(self) -> NDArray[np.bool_]:
        """Loops that go through all poses in order, on one branch."""
        return self.same_assembly & self.passes


def loop_sweep(
    crank: complex,
    pivot: complex,
    crank_turns: ArrayLike,
    rockers: NDArray[np.complex128],
    rocker_pivots: NDArray[np.complex128],
    rocker_turns: NDArray[np.float64],
    direction: int,
) -> Sweep:
    """Drive n loops that share their crank through the poses, in one direction.

    Parameters
    ----------
    crank, pivot : complex
        W in pose 0, and its fixed pivot O.
    crank_turns : (m,) array_like, radians
        Rotation of the crank to poses 1 … m.
    rockers, rocker_pivots : (n,) complex arrays
        The rocker in pose 0, from its fixed pivot to the coupler, and that pivot R.
    rocker_turns : (m, n) float array, radians
        Rotations of the rockers to poses 1 … m.
    direction : {1, -1}
        Which way the crank turns, anticlockwise or clockwise.

    Returns
    -------
    Sweep
        ``passes`` is False everywhere when the poses do not come in order in this direction.

    Examples
    --------
    A parallelogram passes its flat position only by luck:

    >>> rocker, foot = np.array([1j]), np.array([2.0 + 0j])
    >>> turns = np.radians([[-60.0]])
    >>> loop_sweep(1j, 0, [-np.pi / 3], rocker, foot, turns, -1).defect_free.tolist()
    [True]
    >>> loop_sweep(1j, 0, [-np.pi / 3], rocker, foot, turns, 1).defect_free.tolist()
    [False]
    """
    turns = np.mod(direction * np.asarray(crank_turns, dtype=float), CIRCLE)
    in_order = bool(np.all(np.diff(turns, prepend=0.0) > 0))
    travel = float(turns[-1])
    coupler = np.abs(pivot + crank - rocker_pivots - rockers)
    rocker = np.abs(rockers)
    sides = [_side(pivot + crank, rocker_pivots, rockers)]
    for turn, rocker_turn in zip(np.asarray(crank_turns, dtype=float), rocker_turns):
        moved = rockers * np.exp(1j * rocker_turn)
        sides.append(_side(pivot + crank * np.exp(1j * turn), rocker_pivots, moved))
    same = np.all(np.array(sides) == sides[0], axis=0)

    ground = rocker_pivots - pivot
    start = np.mod(direction * np.angle(crank * np.conj(ground)), CIRCLE)
    inward = start + travel >= CIRCLE  # passes θ = 0, the shortest diagonal
    outward = ((start < np.pi) & (start + travel >= np.pi)) | (start + travel >= 3 * np.pi)  # θ = π, the longest
    shortest, longest = np.abs(np.abs(ground) - abs(crank)), np.abs(ground) + abs(crank)
    passes = (
        in_order & (~inward | (shortest > np.abs(coupler - rocker))) & (~outward | (longest < coupler + rocker))
    )

    ends = [np.abs(crank - ground), np.abs(crank * np.exp(1j * float(np.asarray(crank_turns)[-1])) - ground)]
    low = np.where(inward, shortest, np.minimum(*ends))
    high = np.where(outward, longest, np.maximum(*ends))
    with np.errstate(divide="ignore", invalid="ignore"):
        cosines = [(coupler**2 + rocker**2 - d**2) / (2 * coupler * rocker) for d in (low, high)]
        transmission = np.arccos(np.clip(np.fmax(*np.abs(cosines)), 0.0, 1.0))
    return Sweep(same, passes & np.isfinite(coupler), np.nan_to_num(transmission))


def _side(
    moving: complex | NDArray[np.complex128], pivots: NDArray[np.complex128], rockers: NDArray[np.complex128]
) -> NDArray[np.bool_]:
    """On which side of the rocker the coupler stands."""
    tips = pivots + rockers
    return np.imag(np.conj(tips - moving) * -rockers) > 0
