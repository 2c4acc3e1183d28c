"""Burmester's five poses: every dyad that carries a body exactly through five given poses.

A dyad holds a point z of the moving body at a constant distance from a point G of the frame.  With the body's
displacement from pose 0 to pose j written as z ↦ p_j + e_j z, e_j = e^{iθ_j}, this says for j = 1 … 4

    |p_j + e_j z − G|² − |z − G|² = 0.

Written with z, z̄, G, Ḡ as four independent unknowns the equations are quadrics: Bézout's number is 16, and
because |z|² and |G|² cancel they are bilinear in (z, z̄) and (G, Ḡ), so that only 6 roots lie in the product of
two projective planes.  Two of these are the isotropic points (1 : 0 : 0), (0 : 1 : 0) of both planes, which
satisfy any such equations; the **four** others are Burmester's.

The equations are solved in that product of planes, (z : z̄ : w) and (G : Ḡ : g), on the patches

    w = 1 − αz − ᾱz̄,        g = 1 − βG − β̄Ḡ.

A point at infinity is a point like any other there, and it is a slider: g = 0 is a dyad **PR** (a point of the
body moves on a straight line of the frame, whose normal is G), w = 0 is a dyad **RP** (a line of the body, with
normal z, keeps its distance from a point of the frame).  Both at once would be **PP**, which needs poses that
are all parallel.

e_j enters as u_j/v_j with u_j = e^{iθ_j/2}, v_j = ū_j, so that e_j·ē_j = 1 holds for complex parameters and the
equations of a real task are conjugates of themselves to the last bit.

Source: L. Burmester, Lehrbuch der Kinematik, 1888; in this form J. M. McCarthy and G. S. Soh, Geometric Design of
Linkages, 2nd edition, Springer 2011, chapter 5.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from mechanisms.families.motion_dyads import MotionDyad, Poses
from mechanisms.families.reality import exchange

if TYPE_CHECKING:
    from solvers import Solutions, System

__all__ = [
    "MIRROR",
    "affine_system",
    "dyad_of_root",
    "dyad_parameters",
    "five_pose_dyads",
    "generic_dyads",
    "is_isotropic",
    "projective_system",
]

#: The lines αz + ᾱz̄ + w = 0 and βG + β̄Ḡ + g = 0 that the patches leave out pass the origin at five times the
#: task's size, in two directions without meaning; a pivot there would only have large coordinates.
ALPHA = 0.0825 + 0.0565j
BETA = -0.0345 + 0.0939j
#: |w| or |g| below this part of the root's other coordinates is a point at infinity: it lies a thousand million
#: sizes of the task away.
INFINITE = 1e-9
#: A root is one of the two isotropic ones when its other coordinates are below this; generic ones have 1e-2.
ISOTROPIC = 1e-7
#: Newton steps that bring a real root from the solver's accuracy to rounding.
POLISH = 4

#: What conjugation does to the unknowns z, z̄, G, Ḡ.
MIRROR = exchange([1, 0, 3, 2])


def _unknowns() -> tuple[Any, ...]:
    from sympy import symbols

    return symbols("z zc G Gc")


def _equation(pose: int, w: Any, g: Any) -> tuple[Any, tuple[Any, ...]]:
    """The condition of one pose, bihomogeneous in (z, z̄, w) and (G, Ḡ, g), times u·v; and its parameters."""
    from sympy import expand, symbols

    z, zc, big, bigc = _unknowns()
    u, v, p, pc = parameters = symbols(f"u{pose} v{pose} p{pose} pc{pose}")
    weight, other = symbols("w g")
    here = (p * weight * other + u / v * z * other - big * weight) * (
        pc * weight * other + v / u * zc * other - bigc * weight
    )
    there = (z * other - big * weight) * (zc * other - bigc * weight)
    cleared = expand(expand(here - there) * u * v / (weight * other))
    return cleared.subs({weight: w, other: g}), parameters


@cache
def affine_system() -> System:
    """The four quadrics in z, z̄, G, Ḡ: Bézout's number 16, four finite roots.

    Examples
    --------
    >>> affine_system()
    System(4 equations, 4 unknowns, 16 parameters, degrees 2·2·2·2)
    """
    from solvers import System

    rows = [_equation(pose, 1, 1) for pose in range(1, 5)]
    return System([row for row, _ in rows], _unknowns(), [name for _, names in rows for name in names])


@cache
def projective_system() -> System:
    """The same on the patches, where sliders are roots like the others: six roots, two of them isotropic."""
    from solvers import System

    z, zc, big, bigc = _unknowns()
    w = 1 - ALPHA * z - ALPHA.conjugate() * zc
    g = 1 - BETA * big - BETA.conjugate() * bigc
    rows = [_equation(pose, w, g) for pose in range(1, 5)]
    names = [name for _, row in rows for name in row]
    return System([row for row, _ in rows], _unknowns(), names, groups=[(z, zc), (big, bigc)])


def dyad_parameters(poses: Poses) -> list[complex]:
    """Values of the systems' parameters for five poses, lengths in units of the poses' size."""
    values: list[complex] = []
    for angle, move in zip(poses.angles[1:], poses.moves[1:]):
        half, p = complex(np.exp(0.5j * angle)), complex(move) / poses.size
        values += [half, half.conjugate(), p, p.conjugate()]
    return values


def weights(points: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
    """The homogenizing coordinates w and g of roots on the patches, (n, 4) to (n,) and (n,)."""
    z, zc, big, bigc = np.atleast_2d(points).T
    return 1 - ALPHA * z - ALPHA.conjugate() * zc, 1 - BETA * big - BETA.conjugate() * bigc


def is_isotropic(point: NDArray[Any]) -> bool:
    """Whether a root on the patches is one of the two that every task has."""
    w, g = weights(point)
    size = np.abs(point).max()
    for small in ((1, 3), (0, 2)):
        if max(abs(point[small[0]]), abs(point[small[1]]), abs(w[0]), abs(g[0])) < ISOTROPIC * size:
            return True
    return False


@cache
def generic_dyads(seed: int = 0) -> Solutions:
    """The four roots on the patches at complex parameters without meaning, from which any task's are reached.

    All six roots are found from a total-degree start, and the two isotropic ones are left out.

    Raises
    ------
    ArithmeticError
        When not all four are found.

    Examples
    --------
    >>> generic_dyads().points.shape
    (4, 4)
    """
    from solvers.solve import solve

    rng = np.random.default_rng([2010, seed])
    values = rng.normal(size=16) + 1j * rng.normal(size=16)
    found = solve(projective_system(), values, "total-degree", seed=seed, certificates=False)
    keep = np.array([not is_isotropic(point) for point in found.points], dtype=bool)
    if keep.sum() != 4:
        raise ArithmeticError(f"{keep.sum()} of the four generic dyads were found ({found.ledger})")
    return replace(found, points=found.points[keep], paths=found.paths[keep])


def five_pose_dyads(poses: Poses, seed: int = 0) -> list[MotionDyad]:
    """The real dyads of five poses: none, two or four for general data.

    Parameters
    ----------
    poses : Poses
        Five of them.
    seed : int
        Of the generic start.

    Returns
    -------
    list of MotionDyad
        In the order of the roots; ``.root`` is their number.

    Examples
    --------
    >>> poses = Poses.of([(0, 0, 0), (-0.5, -1.9, 90), (1.7, 0, 45), (-1.6, 0.4, 35), (-1.5, 0.1, 25)])
    >>> dyads = five_pose_dyads(poses)
    >>> min(abs(dyad.fixed - (1.6942280402 - 5.3955878374j)) for dyad in dyads) < 1e-9
    True
    """
    from mechanisms.families.reality import real_roots
    from solvers.solve import solve

    found = solve(projective_system(), dyad_parameters(poses), generic_dyads(seed), certificates=False)
    real = real_roots(found.points, MIRROR)
    dyads = [dyad_of_root(poses, point, root) for root, point in enumerate(found.points) if real[root]]
    return [dyad for dyad in dyads if dyad is not None]


def dyad_of_root(poses: Poses, point: NDArray[Any], root: int | None = None) -> MotionDyad | None:
    """A real root on the patches as a dyad in the task's units; None for the isotropic roots."""
    if is_isotropic(point):
        return None
    (w,), (g,) = weights(point)
    z = (point[0] + np.conj(point[1])) / 2
    big = (point[2] + np.conj(point[3])) / 2
    w, g = w.real, g.real
    moving_infinite, fixed_infinite = abs(w) < INFINITE * abs(z), abs(g) < INFINITE * abs(big)
    if moving_infinite and fixed_infinite:
        return MotionDyad("PP", complex(big / abs(big)), complex(z / abs(z)), root)
    if fixed_infinite:
        moving = poses.points[0] + poses.size * z / w
        return MotionDyad("PR", complex(1j * big / abs(big)), complex(moving), root)
    if moving_infinite:
        fixed = poses.points[0] + poses.size * big / g
        return MotionDyad("RP", complex(fixed), complex(1j * z / abs(z)), root)
    z, big = _polished(poses, z / w, big / g)
    return MotionDyad(
        "RR", complex(poses.points[0] + poses.size * big), complex(poses.points[0] + poses.size * z), root
    )


def _polished(poses: Poses, z: complex, big: complex) -> tuple[complex, complex]:
    """Newton's method on the real equations, scaled by the lengths that cancel in them."""
    e = np.exp(1j * poses.angles[1:])
    p = poses.moves[1:] / poses.size
    for _ in range(POLISH):
        arm, first = p + e * z - big, z - big
        value = np.abs(arm) ** 2 - abs(first) ** 2
        by_z, by_big = np.conj(arm) * e - np.conj(first), -np.conj(arm) + np.conj(first)
        jacobian = 2 * np.column_stack([by_z.real, -by_z.imag, by_big.real, -by_big.imag])
        try:
            step = np.linalg.solve(jacobian, value)
        except np.linalg.LinAlgError:
            break
        z, big = z - complex(step[0], step[1]), big - complex(step[2], step[3])
    return z, big
