"""Every configuration in which a linkage can be assembled with its input at a given value.

The closure polynomials of :mod:`mechanisms.polynomials` with one unknown given are solved completely: once
at random dimensions for each structure, then by parameter homotopy for each linkage and each value.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from mechanisms.closure import Closure
from mechanisms.curve import need_one_freedom
from mechanisms.linkage import Input, Linkage
from mechanisms.polynomials import Structure, closure_polynomials, dimensions, generic, real_configurations

if TYPE_CHECKING:
    from solvers.solutions import Ledger, Solutions
    from solvers.system import System

_SYSTEMS: dict[Structure, System] = {}
_GENERIC: dict[Structure, Solutions] = {}


@dataclass(frozen=True, eq=False)
class Assemblies:
    """All assemblies at one value of the input.

    Attributes
    ----------
    x : (k, n) float array
        The real configurations, sorted.
    complex_count : int
        Number of finite complex solutions, which no real linkage shows.
    ledger : Ledger
        Account of the solver's paths.
    """

    x: np.ndarray
    complex_count: int
    ledger: Ledger

    def __repr__(self) -> str:
        return f"Assemblies({len(self.x)} real, {self.complex_count} complex)"


def assemblies(linkage: Linkage, driven: Input | str, value: float, seed: int = 0) -> Assemblies:
    """Return every assembly of a linkage with its input at a value.

    Parameters
    ----------
    linkage : Linkage
        With one degree of freedom.
    driven : Input or str
        The input; a string names one of ``linkage.inputs``.
    value : float
        Its value, from the reference: radians, or the length unit for a translation.
    seed : int
        Of the solver's random choices.

    Returns
    -------
    Assemblies

    Examples
    --------
    >>> four_bar = Linkage({"A": 0, "B": 1j, "C": 3 + 2j, "D": 4},
    ...                    {"ground": "AD", "crank": "AB", "coupler": "BC", "follower": "CD"})
    >>> assemblies(four_bar, Input("crank"), 0.3)
    Assemblies(2 real, 0 complex)
    """
    from solvers.solve import solve

    if isinstance(driven, str):
        driven = linkage.inputs[driven]
    start = generic_assemblies(linkage, driven)
    closure = Closure.of(linkage)
    structure = Structure.of(linkage, driven)
    given = _given(closure, driven, value)
    if not len(start.points):
        return Assemblies(np.zeros((0, closure.size)), 0, start.ledger)
    solutions = solve(
        _system(structure),
        np.array([*dimensions(structure, closure), *given]),
        start=start,
        seed=seed,
        certificates=False,
    )
    z, w, s = _unpacked(structure, solutions.points, given)
    x, _ = real_configurations(structure, closure, z, w, s)
    order = sorted(range(len(x)), key=lambda i: tuple(float(v) for v in np.round(x[i], 9)))
    return Assemblies(x[order], len(solutions.points) - len(x), solutions.ledger)


def generic_assemblies(linkage: Linkage, driven: Input) -> Solutions:
    """Return the solutions at random dimensions of the same structure, solved once and kept; how many there
    are is
    the number of assemblies, real and complex, of nearly every linkage of the structure."""
    linkage.check_input(driven)
    closure = Closure.of(linkage)
    need_one_freedom(closure)
    structure = Structure.of(linkage, driven)
    if structure not in _GENERIC:
        _GENERIC[structure] = generic(_system(structure), structure, linkage, more=1)
    return _GENERIC[structure]


def _given(closure: Closure, driven: Input, value: float) -> list[complex]:
    """Return the parameter that stands for the input: e^{i·value}, or the displacement over the scale."""
    gradient, unit = closure.gradient(driven)
    if driven.translation:
        return [value / unit * float(gradient.sum())]
    return [complex(np.exp(1j * value))]


def _system(structure: Structure) -> System:
    if structure in _SYSTEMS:
        return _SYSTEMS[structure]
    import sympy as sp

    from solvers.system import System

    poly = closure_polynomials(structure)
    link, base = structure.driven
    u = sp.Symbol("u")
    swap: dict[Any, Any] = {}
    if base < 0:
        swap[poly.s[link]] = u
    elif link < structure.rotations:
        swap |= {poly.z[link]: u * poly.z[base], poly.w[link]: poly.w[base] / u}
    else:  # the ground against a moving link: that link turns the other way
        swap |= {poly.z[base]: 1 / u, poly.w[base]: u}
    free = _free_rotations(structure)
    equations = [e.subs(swap) for e in poly.equations] + [poly.z[k] * poly.w[k] - 1 for k in free]
    slides = [s for j, s in poly.s.items() if not (base < 0 and j == link)]
    groups = [[poly.z[k] for k in free], [poly.w[k] for k in free]] + ([slides] if slides else [])
    unknowns = [symbol for group in groups for symbol in group]
    _SYSTEMS[structure] = System(equations, unknowns, [*poly.parameters, u], groups=groups)
    return _SYSTEMS[structure]


def _free_rotations(structure: Structure) -> list[int]:
    link, base = structure.driven
    given = -1 if base < 0 else link if link < structure.rotations else base
    return [k for k in range(structure.rotations) if k != given]


def _unpacked(
    structure: Structure, points: np.ndarray, given: list[complex]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return z, w, s of all solutions, with the input's own put back."""
    link, base = structure.driven
    free, r = _free_rotations(structure), structure.rotations
    z, w = np.ones((2, len(points), r + 1), dtype=complex)
    z[:, free], w[:, free] = points[:, : len(free)], points[:, len(free) : 2 * len(free)]
    s = points[:, 2 * len(free) :]
    if base < 0:
        s = np.insert(s, structure.kept_slides().index(link), given[0], axis=1)
    elif link < r:
        z[:, link], w[:, link] = given[0] * z[:, base], w[:, base] / given[0]
    else:
        z[:, base], w[:, base] = 1 / given[0], given[0]
    return z[:, :r], w[:, :r], s
