"""The coupler curve through given points once more, in a form with as few paths as possible: to count from nothing.

Monodromy counts the roots of `mechanisms.families.four_bar_curve.curve_system` from one of them.  A polyhedral start
needs none, and counts all that there are; how many paths it has depends on the unknowns.  Three changes leave a
tenth of them.  With M = x + iy, ζ = −e − ig and X = A − M a dyad's equation is

    X X̄ + X ζ̄ T̄ + X̄ ζ T = k.

* k = h + M M̄: then X X̄ − k = A Ā − A M̄ − Ā M − h is linear in the unknowns.
* T = c + is, T̄ = c − is: U c + V s + X X̄ − k = 0, where U = 2 Re X ζ̄ has lost the product of g and y in V and V =
  2 Im X ζ̄ that of x and e, so that neither holds all four monomials of (A − M)(e + ig).
* The turn at every point is kept.  Roots of the eliminated form at which ζ = ω = 0, which mean nothing, are at
  infinity then, where they are told sooner than as multiple roots.

Mixed volumes, for the paper's choices: 4800 for six points, 25,984 for seven, 158,464 for eight.  Regeneration, point
by point, counts eight on 75,000 paths, and nine, in the unknowns of `nine_point_system`, on 97,000.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mechanisms.families.four_bar_curve import NAMES, curve_columns, nine_point_system

if TYPE_CHECKING:
    from solvers import System
    from solvers.regeneration import Blocks

__all__ = ["as_curve_roots", "nine_point_blocks", "sparse_blocks", "sparse_columns", "sparse_system"]

_SQUARES = {"k_M": "h_M", "k_N": "h_N"}


def sparse_columns(chosen: Sequence[str]) -> tuple[str, ...]:
    """The names of the design unknowns of `sparse_system`, in order."""
    return tuple(_SQUARES.get(name, name) for name in curve_columns(chosen))


@cache
def sparse_system(points: int, chosen: tuple[str, ...]) -> System:
    """Eq. (19) for some points, with h for k, and the coupler's turns by cosine and sine.

    Parameters
    ----------
    points : int
        6 to 9.
    chosen : tuple of str
        The 9 − points parameters that are given, in the order of `NAMES`.

    Returns
    -------
    System
        Unknowns: `sparse_columns`, then c_i, s_i for each point.  Parameters: as of `curve_system`.

    Examples
    --------
    >>> sparse_system(8, ("g",)).size
    (24, 24)
    """
    from sympy import I, expand, symbols

    from solvers import System

    names = {name: symbols(name) for name in (*NAMES, "h_M", "h_N")}
    g = names["g"]
    equations, parameters = [], []
    unknowns = [names[name] for name in sparse_columns(chosen)]
    dyads = []
    for pivot, length, along, sign in (("M", "L_MR", "e", -1), ("N", "L_NS", "f", 1)):
        x, y, arm = names[f"x_{pivot}"], names[f"y_{pivot}"], sign * names[along]
        known = names[length] ** 2 - arm**2 - g**2 - x**2 - y**2
        dyads.append((x, y, arm, known if length in chosen else names[f"h_{pivot}"]))
    for i in range(points):
        a, ac, c, s = symbols(f"A{i} Ac{i} c{i} s{i}")
        for x, y, arm, h in dyads:
            X, Xc = a - x - I * y, ac - x + I * y
            U = expand(X * (arm + I * g) + Xc * (arm - I * g))
            V = expand(I * (Xc * (arm - I * g) - X * (arm + I * g)))
            equations.append(U * c + V * s + a * ac - a * (x - I * y) - ac * (x + I * y) - h)
        equations.append(c**2 + s**2 - 1)
        unknowns += [c, s]
        parameters += [a, ac]
    return System(equations, unknowns, parameters + [names[name] for name in chosen])


def as_curve_roots(
    roots: NDArray[np.complex128], chosen: Sequence[str], parameters: NDArray[np.complex128]
) -> NDArray[np.complex128]:
    """Roots of `sparse_system` as roots of `curve_system`.

    Parameters
    ----------
    roots : (n, unknowns) array
    chosen : sequence of str
    parameters : (parameters,) array
        Of either system.

    Returns
    -------
    (n, unknowns) array
    """
    names = sparse_columns(chosen)
    values = dict(zip(names, roots.T)) | dict(zip(chosen, parameters[len(parameters) - len(chosen) :]))
    found = roots.copy()
    for pivot in "MN":
        if f"h_{pivot}" in names:
            found[:, names.index(f"h_{pivot}")] += values[f"x_{pivot}"] ** 2 + values[f"y_{pivot}"] ** 2
    c, s = roots[:, len(names) :: 2], roots[:, len(names) + 1 :: 2]
    found[:, len(names) :: 2], found[:, len(names) + 1 :: 2] = c + 1j * s, c - 1j * s
    return found


def sparse_blocks(points: int, chosen: Sequence[str]) -> Blocks:
    """`sparse_system` for regeneration: each dyad a group, each point a block.

    Parameters
    ----------
    points : int
    chosen : sequence of str
        Of the pivots' coordinates and g; another choice couples the dyads, or is no linear function of theirs.

    Raises
    ------
    ValueError
        Another parameter is chosen, or g is not.
    """
    from solvers.regeneration import Blocks

    if "g" not in chosen or set(chosen) & {"L_MR", "L_NS", "e", "f"}:
        raise ValueError(f"regeneration needs g chosen, and with it pivots only; {', '.join(chosen)} are chosen")
    system, names = sparse_system(points, tuple(chosen)), sparse_columns(chosen)
    groups, unknowns = [], []
    for pivot, arm in (("M", "e"), ("N", "f")):
        own = [name for name in names if name in (f"x_{pivot}", f"y_{pivot}", f"h_{pivot}", arm)]
        x = {name: system.unknowns[names.index(name)] for name in own}
        bilinear = [x[arm] * x[name] for name in own if name[0] in "xy"]
        groups.append((1, *x.values(), *bilinear))
        unknowns.append(tuple(names.index(name) for name in own))
    return Blocks(system, tuple(groups), tuple(unknowns), belongs=(0, 1, None), locals=2)


def nine_point_blocks() -> Blocks:
    """`nine_point_system` for regeneration.

    >>> nine_point_blocks().count
    8
    """
    from solvers.regeneration import Blocks

    system = nine_point_system()
    a, ac, z, zc, b, bc, w, wc = system.unknowns[:8]
    groups = ((1, a, ac, z, zc, z * ac, zc * a), (1, b, bc, w, wc, w * bc, wc * b))
    return Blocks(system, groups, ((0, 1, 2, 3), (4, 5, 6, 7)), belongs=(0, 1, None), locals=2)
