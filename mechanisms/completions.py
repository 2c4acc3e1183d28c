"""Every way to assemble the rest of a linkage when some of its links stand.

The links that stand must hold themselves (as the links of Assur groups before a group do); the others are
then a structure without freedom, and its assemblies are the roots of the loops that they close.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from mechanisms.closure import Closure
from mechanisms.linkage import GROUND, Input, Linkage
from mechanisms.polynomials import Structure, closure_polynomials, dimensions, generic, real_configurations

if TYPE_CHECKING:
    from solvers.solutions import Solutions
    from solvers.system import System

_SYSTEMS: dict[Any, System] = {}
_GENERIC: dict[Any, Solutions] = {}


def completions(linkage: Linkage, standing: Mapping[str, float], seed: int = 0) -> np.ndarray:
    """Return all real configurations in which some links have given rotations.

    Parameters
    ----------
    linkage : Linkage
    standing : mapping of str to float
        Rotations of the links that stand, radians; they close their own loops, and no slider or pin in a
        slot is among them.
    seed : int
        Of the solver's random choices.

    Returns
    -------
    (k, n) float array

    Examples
    --------
    >>> four_bar = Linkage({"A": 0, "B": 1j, "C": 3 + 2j, "D": 4},
    ...                    {"ground": "AD", "crank": "AB", "coupler": "BC", "follower": "CD"})
    >>> completions(four_bar, {"crank": 0.0}).shape
    (2, 3)
    """
    from solvers.solve import solve

    names = {GROUND, *standing}
    stages = {link: 0 if link in names else 1 for link in linkage.links}

    def loops(of: Linkage) -> Closure:
        return Closure.in_stages(of, stages)

    closure = loops(linkage)
    known = sorted({closure.class_of[link] for link in names} - {closure.rotations})
    if len(known) == closure.rotations:
        return closure.configuration(standing)[None]
    # Any link of the rest serves as the input that a structure is named by; it has no say in the equations.
    structure = Structure.of(linkage, _any_input(linkage, closure, names), closure)
    key = structure, tuple(known)
    if key not in _SYSTEMS:
        _SYSTEMS[key] = _system(structure, known, closure.loop_stage)
        _GENERIC[key] = generic(_SYSTEMS[key], structure, linkage, more=len(known), loops=loops)
    given = {closure.class_of[link]: np.exp(1j * angle) for link, angle in standing.items()}
    values = np.array([*dimensions(structure, closure), *(given[k] for k in known)])
    points = solve(_SYSTEMS[key], values, start=_GENERIC[key], seed=seed, certificates=False).points
    rest = [k for k in range(closure.rotations) if k not in known]
    z, w = np.ones((2, len(points), closure.rotations), dtype=complex)
    z[:, rest], w[:, rest] = points[:, : len(rest)], points[:, len(rest) : 2 * len(rest)]
    for k in known:
        z[:, k], w[:, k] = given[k], 1 / given[k]
    return real_configurations(structure, closure, z, w, points[:, 2 * len(rest) :])[0]


def _any_input(linkage: Linkage, closure: Closure, names: set[str]) -> Input:
    return Input(next(k for k in linkage.links if k not in names and closure.class_of[k] < closure.rotations))


def _system(structure: Structure, known: list[int], loop_stage: np.ndarray) -> System:
    import sympy as sp

    from solvers.system import System

    poly = closure_polynomials(structure)
    given = sp.symbols(f"k:{len(known)}")
    swap: dict[Any, Any] = {poly.z[k]: g for k, g in zip(known, given)}
    swap |= {poly.w[k]: 1 / g for k, g in zip(known, given)}
    rest = [k for k in range(structure.rotations) if k not in known]
    equations = [e.subs(swap) for loop, stage in zip(poly.loops, loop_stage) if stage for e in loop]
    equations += [e.subs(swap) for e, row in zip(poly.gears, structure.gears) if any(row[k] for k in rest)]
    equations += [poly.z[k] * poly.w[k] - 1 for k in rest]
    slides = list(poly.s.values())
    groups = [[poly.z[k] for k in rest], [poly.w[k] for k in rest]] + ([slides] if slides else [])
    return System(equations, [u for group in groups for u in group], [*poly.parameters, *given], groups=groups)
