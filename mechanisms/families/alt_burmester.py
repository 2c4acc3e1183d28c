"""Poses mixed with points: the Alt–Burmester family.

A four-bar is two dyads, eight real numbers z₁, G₁, z₂, G₂.  Every pose after pose 0 imposes two conditions, one on
each dyad; a point imposes the same two, but leaves the body's turn open and so takes away only one.  M poses and N
points therefore determine finitely many four-bars when **2M + N = 10**: Burmester's problem at one end (5, 0),
Alt's nine points at the other (1, 8).

The turn at each point stays an unknown of its own, t_j = e^{iθ_j}, with its conjugate t̄_j:

    p p̄ − p Ḡ − p̄ G + p t̄ z̄ + p̄ t z + (1 − t) z Ḡ + (1 − t̄) z̄ G = 0   for each dyad,      t t̄ = 1,

where p is the displacement from pose 0 and z, G are measured from the body's reference point there.  A pose is the
same with e = u/v and ē = v/u, given, for t and t̄ (`mechanisms.families.burmester`).  The Jacobian is block-arrow.

Where 2M + N is less, as many numbers may be **given** as are missing: coordinates of pivots, O1_x … A2_y, which
are linear in the unknowns, and lengths of links, which are quadratic.

Pairs of one dyad with itself solve the equations of a task too, in families; what is counted and found are the
pairs with different moving pivots, which monodromy from a random four-bar does not leave.  Each four-bar is
counted twice, as its dyads can change places, unless what is given tells them apart.

Source of the family and its counts: D. A. Brake, J. D. Hauenstein, A. P. Murray, D. H. Myszka, C. W. Wampler, The
complete solution of Alt–Burmester synthesis problems for four-bar linkages, Journal of Mechanisms and Robotics
8(4), 2016.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from mechanisms.families.motion_dyads import MotionDyad, Poses
from mechanisms.families.reality import Mirror, exchange

if TYPE_CHECKING:
    from mechanisms.catalogue import Recipe
    from solvers import System

__all__ = [
    "COUNTS",
    "GIVEN",
    "SOURCES",
    "mixed_dyads",
    "mixed_instance",
    "mixed_mirror",
    "mixed_parameters",
    "mixed_poses",
    "mixed_recipe",
    "mixed_system",
    "swap",
]

#: Ordered pairs of dyads with different moving pivots, for M poses and N points.
COUNTS = {(5, 0): 12, (4, 2): 60, (3, 4): 402, (2, 6): 2224, (1, 8): 8652}
_BRAKE = "Brake, Hauenstein, Murray, Myszka, Wampler, Alt–Burmester synthesis problems"
#: Where each count comes from; that of (2, 6) was found here, by monodromy and by a polyhedral start alike.
SOURCES = dict.fromkeys(COUNTS, _BRAKE) | {(2, 6): "the regular ends of all 10632 paths of a polyhedral start"}
#: What may be given: coordinates of fixed (O) and moving (A) pivots in pose 0, and lengths of links.
COORDINATES = tuple(f"{pivot}{number}_{axis}" for number in (1, 2) for pivot in "OA" for axis in "xy")
LENGTHS = ("L_ground", "L_link1", "L_coupler", "L_link2")
GIVEN = COORDINATES + LENGTHS
#: With both fixed pivots given, one pose and four points: five points in the plane.
#: A. P. Morgan, C. W. Wampler, Solving a planar four-bar design problem using continuation, 1990.
FIVE_POINTS = ((1, 4, ("O1_x", "O1_y", "O2_x", "O2_y")), 36)
#: Unknowns of the two dyads: z, z̄, G, Ḡ of the first, then of the second.
DESIGN = 8


def _names() -> tuple[tuple[Any, ...], tuple[Any, ...]]:
    from sympy import symbols

    return symbols("z1 zc1 G1 Gc1"), symbols("z2 zc2 G2 Gc2")


@cache
def mixed_system(poses: int, points: int, given: tuple[str, ...] = ()) -> System:
    """The equations of M poses (pose 0 among them) and N points.

    Parameters
    ----------
    poses, points : int
    given : tuple of str
        Names in `GIVEN`; with 2M + N + len(given) = 10 there are as many equations as unknowns.

    Returns
    -------
    System
        Unknowns: z, z̄, G, Ḡ of either dyad, then t, t̄ for each point. Parameters: u, v, p, p̄ of each pose
        after the first, then p, p̄ of each point, then what is given (lengths squared).

    Examples
    --------
    >>> mixed_system(4, 2).size, mixed_system(1, 8).size
    ((12, 12), (24, 24))
    """
    from sympy import symbols

    from solvers import System

    dyads = _names()
    equations, unknowns, parameters = [], [*dyads[0], *dyads[1]], []
    for j in range(1, poses):
        u, v, p, pc = symbols(f"u{j} v{j} p{j} pc{j}")
        for z, zc, g, gc in dyads:
            turning = (u * v - u**2) * z * gc + (u * v - v**2) * zc * g
            equations.append(u * v * (p * pc - p * gc - pc * g) + v**2 * p * zc + u**2 * pc * z + turning)
        parameters += [u, v, p, pc]
    for j in range(1, points + 1):
        t, tc, p, pc = symbols(f"t{j} tc{j} q{j} qc{j}")
        for z, zc, g, gc in dyads:
            turning = (1 - t) * z * gc + (1 - tc) * zc * g
            equations.append(p * pc - p * gc - pc * g + p * tc * zc + pc * t * z + turning)
        equations.append(t * tc - 1)
        unknowns += [t, tc]
        parameters += [p, pc]
    for name in given:
        value = symbols(name)
        equations.append(_given_quantity(name, dyads) - value)
        parameters.append(value)
    return System(equations, unknowns, parameters)


def _given_quantity(name: str, dyads: Any) -> Any:
    """A coordinate, or the square of a length, in z, z̄, G, Ḡ of both dyads: numbers, arrays or symbols."""
    (z1, zc1, g1, gc1), (z2, zc2, g2, gc2) = dyads
    if name in LENGTHS:
        differences = {
            "L_ground": (g1 - g2, gc1 - gc2),
            "L_link1": (z1 - g1, zc1 - gc1),
            "L_coupler": (z1 - z2, zc1 - zc2),
            "L_link2": (z2 - g2, zc2 - gc2),
        }
        way, conjugate = differences[name]
        return way * conjugate
    here, conjugate = {"O1": (g1, gc1), "A1": (z1, zc1), "O2": (g2, gc2), "A2": (z2, zc2)}[name[:2]]
    if name.endswith("x"):
        return (here + conjugate) / 2
    from sympy import Expr, I

    unit = I if isinstance(here, Expr) else 1j
    return (here - conjugate) / (2 * unit)


def mixed_mirror(points: int) -> Mirror:
    """What conjugation of the linkage does to the unknowns."""
    return exchange([k ^ 1 for k in range(DESIGN + 2 * points)])


def swap(points: NDArray[Any]) -> NDArray[Any]:
    """The two dyads in each other's place."""
    return np.concatenate([points[:, 4:8], points[:, :4], points[:, 8:]], axis=1)


def mixed_instance(
    poses: int, points: int, rng: np.random.Generator, given: tuple[str, ...] = ()
) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
    """A random complex four-bar with positions that it takes: a root, and parameters that it solves.

    Given the body's turn, the two conditions on p, p̄ have the same product p p̄ and differ by a linear equation.

    Examples
    --------
    >>> point, values = mixed_instance(3, 4, np.random.default_rng(1))
    >>> bool(np.abs(mixed_system(3, 4).evaluate([point], values)[0]).max() < 1e-10)
    True
    """
    design = _normal(rng, DESIGN).reshape(2, 4)
    parameters: list[complex] = []
    turns: list[complex] = []
    for j in range(1, poses + points):
        u, v = _normal(rng, 2) if j < poses else (_normal(rng, 1)[0], 1.0)
        e = u / v
        (a1, b1, c1), (a2, b2, c2) = ((zc / e - gc, e * z - g, (1 - e) * z * gc + (1 - 1 / e) * zc * g)
                                      for z, zc, g, gc in design)  # fmt: skip
        # p p̄ + a p + b p̄ + c = 0 for both: p̄ = −(Δa p + Δc)/Δb
        slope, offset = -(a1 - a2) / (b1 - b2), -(c1 - c2) / (b1 - b2)
        p = rng.choice(np.roots([slope, offset + a1 + b1 * slope, b1 * offset + c1]))
        parameters += [u, v, p, slope * p + offset] if j < poses else [p, slope * p + offset]
        turns += [] if j < poses else [e, 1 / e]
    parameters += [_given_quantity(name, design) for name in given]
    return np.array([*design.ravel(), *turns]), np.array(parameters)


def mixed_recipe(name: str, poses: str, points: str, names: str = "") -> Recipe:
    """The catalogue's recipe for ``alt-burmester:M:N``, or ``alt-burmester:M:N:O1_x,O1_y`` with pivots given."""
    from mechanisms.catalogue.recipes import Recipe

    m, n, given = int(poses), int(points), tuple(names.split(",")) if names else ()
    if 2 * m + n + len(given) != 10 or m < 1 or not set(given) <= set(GIVEN):
        raise ValueError(f"{m} poses, {n} points, {len(given)} numbers do not determine four-bars: 2M + N + k = 10")
    count, source = (COUNTS.get((m, n)), SOURCES.get((m, n), "")) if not given else (None, "")
    if (m, n, given) == FIVE_POINTS[0]:
        count, source = (
            FIVE_POINTS[1],
            "Morgan, Wampler, Solving a planar four-bar design problem",
        )
    return Recipe(
        name=name,
        title=f"four-bar through {m} poses and {n} points" + (f", {', '.join(given)} given" if given else ""),
        system=mixed_system(m, n, given),
        start=lambda rng: mixed_instance(m, n, rng, given),
        symmetry=() if given else (swap,),
        kept=DESIGN,
        restore=lambda kept, values: _with_turns(kept, values, m, n),
        orbit=None if given else _cognates if m == 1 else lambda found, values: np.stack([found, swap(found)]),
        count=count,
        source=source if count else "",
    )


def _cognates(found: NDArray[np.complex128], values: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """One pose and eight points are the nine-point problem: three four-bars draw each curve, in two orders each.

    Its unknowns are a = −G and z, and the turns are the same (`mechanisms.families.four_bar_curve`).
    """
    from mechanisms.families.four_bar_curve import cognate

    def other(points: NDArray[np.complex128]) -> NDArray[np.complex128]:
        return cognate(points[:, order] * sign, values)[:, back] * sign[back]

    order = np.array([2, 3, 0, 1, 6, 7, 4, 5, *range(DESIGN, found.shape[1])])
    sign = np.where(np.isin(np.arange(found.shape[1]), (0, 1, 4, 5)), -1.0, 1.0)
    back = np.argsort(order)
    second = other(swap(found))
    third = other(swap(second))
    return np.stack([image for points in (found, second, third) for image in (points, swap(points))])


def _with_turns(
    kept: NDArray[np.complex128], values: NDArray[np.complex128], poses: int, points: int
) -> NDArray[np.complex128]:
    """The turns at the points from the dyads: the two conditions are linear in t and t̄."""
    columns = [kept]
    dyads = kept.reshape(len(kept), 2, 4)
    z, zc, g, gc = np.moveaxis(dyads, -1, 0)
    for j in range(points):
        p, pc = values[4 * (poses - 1) + 2 * j :][:2]
        by_t, by_tc = pc * z - z * gc, p * zc - zc * g
        constant = p * pc - p * gc - pc * g + z * gc + zc * g
        turn = np.linalg.solve(np.stack([by_t, by_tc], axis=-1), -constant[..., None])[..., 0]
        columns.append(turn)
    return np.concatenate(columns, axis=1)


def mixed_parameters(
    poses: Poses, points: NDArray[np.complex128], size: float, given: Mapping[str, float] | None = None
) -> list[complex]:
    """Values of the system's parameters: exact conjugates of each other, lengths in units of `size`."""
    values: list[complex] = []
    for angle, move in zip(poses.angles[1:], poses.moves[1:]):
        half, p = complex(np.exp(0.5j * angle)), complex(move) / size
        values += [half, half.conjugate(), p, p.conjugate()]
    for place in points:
        p = complex(place - poses.points[0]) / size
        values += [p, p.conjugate()]
    origin = {"x": poses.points[0].real, "y": poses.points[0].imag}
    for name, value in (given or {}).items():
        values.append(complex((value / size) ** 2 if name in LENGTHS else (value - origin[name[-1]]) / size))
    return values


def mixed_dyads(root: NDArray[np.complex128], origin: complex, size: float) -> tuple[MotionDyad, MotionDyad]:
    """The two dyads of a real root, in the task's units."""
    found = []
    for z, zc, g, gc in root[:DESIGN].reshape(2, 4):
        moving, fixed = (z + np.conj(zc)) / 2, (g + np.conj(gc)) / 2
        found.append(MotionDyad("RR", complex(origin + size * fixed), complex(origin + size * moving)))
    return found[0], found[1]


def mixed_poses(poses: Poses, points: NDArray[np.complex128], root: NDArray[np.complex128]) -> Poses:
    """All positions as poses: at the points the body is turned as the root says."""
    turns = np.angle(root[DESIGN::2] / np.abs(root[DESIGN::2]))
    return Poses(np.concatenate([poses.points, points]), np.concatenate([poses.angles, turns]))


def _normal(rng: np.random.Generator, count: int) -> NDArray[np.complex128]:
    return rng.normal(size=count) + 1j * rng.normal(size=count)
