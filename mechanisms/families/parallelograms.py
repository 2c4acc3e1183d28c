"""Parallelograms: two equal cranks that stay parallel, and what their change points do to the poses.

A crank and the line of the fixed pivots make the angle ψ.  At ψ = 0 and ψ = π the linkage is folded flat, every joint
on one line; there it can go on as the parallelogram that it was or as a crossed linkage, and nothing in it decides
which.  So the poses must lie on one side, sin ψ of one sign; there |sin ψ| is the sine of the transmission angle.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechanisms.families.motion_dyads import MotionDyad, Poses

__all__ = ["fold_note", "is_parallelogram", "parallelogram_verdicts"]

#: Cranks that differ by less than this, in sizes of the poses, are equal.
EQUAL = 1e-9
#: A pose with |sin ψ| below this is folded flat.
FLAT = 1e-9


def is_parallelogram(poses: Poses, fixed: tuple[Any, Any], moving: tuple[Any, Any]) -> NDArray[np.bool_]:
    """Which pairs of dyads are parallelograms that carry the body through parallel poses, (n,)."""
    (o1, o2), (a1, a2) = ((np.atleast_1d(np.asarray(z, complex)) for z in pair) for pair in (fixed, moving))
    if not poses.parallel:
        return np.zeros(len(o1), dtype=bool)
    return np.abs((a1 - o1) - (a2 - o2)) < EQUAL * (poses.size + np.abs(a1 - o1))


def parallelogram_verdicts(poses: Poses, fixed: tuple[Any, Any], moving: tuple[Any, Any]) -> dict[str, NDArray[Any]]:
    """Verdicts on parallelograms, the same for either crank; the keys are those of `mechanisms.fourbar`.

    Poses on both sides of a change point count as a branch defect.

    Examples
    --------
    A crank at 30, 90 and 150 degrees from the line of pivots:

    >>> poses = Poses.of([(3**0.5 / 2, 0.5, 0), (0, 1, 0), (-3**0.5 / 2, 0.5, 0)])
    >>> verdict = parallelogram_verdicts(poses, (0j, 2), (poses.points[0], poses.points[0] + 2))
    >>> bool(verdict["in_order"][0]), round(float(verdict["min_transmission_deg"][0]), 9)
    (True, 30.0)
    """
    psi = _angles(poses, fixed, moving)
    one_side = np.all(np.sin(psi) > FLAT, axis=1) | np.all(np.sin(psi) < -FLAT, axis=1)
    step = np.diff(psi, axis=1)
    in_order = one_side & (np.all(step >= 0, axis=1) | np.all(step <= 0, axis=1))
    least = np.degrees(np.arcsin(np.abs(np.sin(psi)).min(axis=1)))
    return {
        "same_circuit": np.ones(len(psi), dtype=bool),
        "same_branch": one_side,
        "in_order": in_order,
        "full_rotation": np.zeros(len(psi), dtype=bool),
        "min_transmission_deg": np.where(one_side, least, 0.0),
    }


def fold_note(poses: Poses, crank: MotionDyad, follower: MotionDyad) -> str:
    """Where the parallelogram folds flat, beside the poses."""
    psi = _angles(poses, (crank.fixed, follower.fixed), (crank.moving, follower.moving))[0]
    side = np.sign(np.where(np.abs(np.sin(psi)) < FLAT, 0.0, np.sin(psi)))
    if not side.all():
        return f"folded flat in pose {int(np.flatnonzero(side == 0)[0])}: a change point, where it may cross over"
    changes = np.flatnonzero(np.diff(side))
    if len(changes):
        first = int(changes[0])
        return f"a change point between poses {first} and {first + 1}: a third parallel crank would lead it through"
    pose = int(np.abs(np.sin(psi)).argmin())
    return f"folds flat (a change point) {np.degrees(np.arcsin(abs(np.sin(psi[pose])))):.0f}° beyond pose {pose}"


def _angles(poses: Poses, fixed: tuple[Any, Any], moving: tuple[Any, Any]) -> NDArray[np.float64]:
    """The angle from the line of pivots to the crank in every pose, (n, poses)."""
    (o1, o2), (a1, _) = ((np.atleast_1d(np.asarray(z, complex)) for z in pair) for pair in (fixed, moving))
    return np.angle((poses.carry(a1) - o1[:, None]) * np.conj(o2 - o1)[:, None])
