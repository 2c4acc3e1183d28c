"""Every configuration in which a linkage can be assembled with its input at a given value.

The closure equations become polynomials: e^{iq} is an unknown z, its conjugate e^{−iq} an unknown w of its
own with z w = 1, and each loop gives itself and its conjugate. The structure of the graph fixes the system,
the dimensions are its parameters, so that one system, solved once at random dimensions, serves all linkages
of that structure by parameter homotopy.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from mechanisms.closure import Closure
from mechanisms.curve import need_one_freedom, settle, wrap
from mechanisms.linkage import Input, Linkage

if TYPE_CHECKING:
    from solvers.solutions import Ledger, Solutions
    from solvers.system import System

#: |w − z̄| below this makes a root a candidate for a real configuration; Newton on the real equations then
#: decides.
NEARLY_REAL = 1e-6


@dataclass(frozen=True)
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


@dataclass(frozen=True)
class Structure:
    """What the polynomials depend on besides numbers: hashable, the key of the cache of systems."""

    turned: tuple[tuple[bool, ...], ...]
    slid: tuple[tuple[bool, ...], ...]
    slide_class: tuple[int, ...]
    gears: tuple[tuple[int, ...], ...]
    driven: tuple[int, int]  # rotation classes (link, relative_to), or (slide, −1)

    @classmethod
    def of(cls, closure: Closure, driven: Input) -> Structure:
        """Return the structure of a linkage with an input."""
        gradient, _ = closure.gradient(driven)
        if driven.translation:
            pair = int(np.argmax(np.abs(gradient))) - closure.rotations, -1
        else:
            pair = closure.class_of[driven.link], closure.class_of[driven.relative_to]
        return cls(
            tuple(map(tuple, (closure.matrix != 0).tolist())),
            tuple(map(tuple, (closure.slides != 0).tolist())),
            tuple(int(k) for k in closure.slide_class),
            tuple(tuple(int(c) for c in row) for row in closure.gears),
            pair,
        )

    def lonely_slides(self) -> tuple[int, ...]:
        """Displacements that are alone in one loop and in no other: they are eliminated by hand."""
        driven = self.driven[0] if self.driven[1] < 0 else -1
        return tuple(
            j
            for j in range(len(self.slide_class))
            if j != driven and [sum(row) for row in self.slid if row[j]] == [1]
        )

    def kept_slides(self) -> list[int]:
        """Displacements that stay unknowns."""
        driven = self.driven[0] if self.driven[1] < 0 else -1
        return [j for j in range(len(self.slide_class)) if j != driven and j not in self.lonely_slides()]


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
    if isinstance(driven, str):
        driven = linkage.inputs[driven]
    linkage.check_input(driven)
    closure = Closure.of(linkage)
    need_one_freedom(closure)
    structure = Structure.of(closure, driven)
    system, _ = _system(structure)
    from solvers.solve import solve

    sign_unit = _input_unit(closure, driven)
    target = _numbers(structure, closure, closure, value / sign_unit)
    solutions = solve(system, target, start=generic_solutions(linkage, driven), seed=seed, certificates=False)
    x, others = _real(structure, closure, solutions.points, value / sign_unit)
    return Assemblies(x, others, solutions.ledger)


def generic_solutions(linkage: Linkage, driven: Input) -> Solutions:
    """Return the solutions for random complex dimensions of the same structure, solved once and kept."""
    return _generic(Structure.of(Closure.of(linkage), driven), _Frozen(linkage))


class _Frozen:
    """A linkage that is equal to any other, so that the cache below looks at the structure alone."""

    def __init__(self, linkage: Linkage) -> None:
        self.linkage = linkage

    def __hash__(self) -> int:
        return 0

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Frozen)


@lru_cache(maxsize=256)
def _generic(structure: Structure, frozen: _Frozen) -> Solutions:
    from solvers.solve import solve

    system, _ = _system(structure)
    rng = np.random.default_rng(20)
    first, second = (Closure.of(_shaken(frozen.linkage, rng)) for _ in range(2))
    value = rng.normal() + 1j * rng.normal()
    return solve(system, _numbers(structure, first, second, value), seed=0, certificates=False)


def _shaken(linkage: Linkage, rng: np.random.Generator) -> Linkage:
    """The same graph with random dimensions: two of them stand for the dimensions and their conjugates."""

    def anywhere() -> complex:
        return complex(*rng.normal(size=2))

    from dataclasses import replace

    return replace(
        linkage,
        points={name: anywhere() for name in linkage.points},
        sliders=[replace(slider, direction=anywhere()) for slider in linkage.sliders],
        slots=[replace(slot, direction=anywhere()) for slot in linkage.slots],
    )


def _input_unit(closure: Closure, driven: Input) -> float:
    gradient, unit = closure.gradient(driven)
    return unit * float(gradient.sum()) if driven.translation else unit


@lru_cache(maxsize=256)
def _system(structure: Structure) -> tuple[System, tuple[Any, ...]]:
    """Return the polynomial system of a structure, with its parameters in the order of :func:`_numbers`."""
    import sympy as sp

    from solvers.system import System

    loops, rotations = len(structure.turned), len(structure.turned[0])
    count = len(structure.slide_class)
    link, base = structure.driven
    translation = base < 0
    z = [*sp.symbols(f"z:{rotations}"), sp.Integer(1)]
    w = [*sp.symbols(f"w:{rotations}"), sp.Integer(1)]
    s = list(sp.symbols(f"s:{count}"))
    unknown_z = [k for k in range(rotations) if translation or k != link]
    u, v = sp.symbols("u v")  # e^{i·input} and its conjugate, or the displacement
    if translation:
        s[link] = u
    elif link < rotations:
        z[link], w[link] = u * z[base], v * w[base]
    else:  # the ground is driven against a moving link
        z[base], w[base] = v, u
        unknown_z.remove(base)
    alone = structure.lonely_slides()
    parameters: list[Any] = []
    sides: list[list[tuple[Any, Any]]] = []  # of each loop: the sum without, and the factor of, a lonely slide
    for e, name in ((z, "a"), (w, "b")):
        side = []
        for l in range(loops):
            parameters.append(sp.Symbol(f"{name}c{l}"))
            total, factor = parameters[-1], sp.Integer(0)
            for k in range(rotations):
                if structure.turned[l][k]:
                    parameters.append(sp.Symbol(f"{name}{l}_{k}"))
                    total += parameters[-1] * e[k]
            for j in range(count):
                if structure.slid[l][j]:
                    parameters.append(sp.Symbol(f"{name}s{l}_{j}"))
                    factor = parameters[-1] * e[structure.slide_class[j]]
                    total += 0 if j in alone else factor * s[j]
            side.append((total, factor))
        sides.append(side)
    equations: list[Any] = []
    for l, (loop, conjugate) in enumerate(zip(*sides)):
        if any(structure.slid[l][j] for j in alone):
            # total + s·factor = 0 and its conjugate, with the real s eliminated.
            equations.append(loop[0] * conjugate[1] - conjugate[0] * loop[1])
        else:
            equations += [loop[0], conjugate[0]]
    for row in structure.gears:
        left = sp.prod([z[k] ** c for k, c in enumerate(row) if c > 0])
        left *= sp.prod([w[k] ** -c for k, c in enumerate(row) if c < 0])
        equations.append(left - 1)
    equations += [z[k] * w[k] - 1 for k in unknown_z]
    parameters += [u] if translation else [u, v]
    slides = [s[j] for j in structure.kept_slides()]
    groups = [[z[k] for k in unknown_z], [w[k] for k in unknown_z]] + ([slides] if slides else [])
    unknowns = [symbol for group in groups for symbol in group]
    return System(equations, unknowns, parameters, groups=groups), tuple(parameters)


def _numbers(structure: Structure, closure: Closure, conjugate: Closure, value: complex) -> np.ndarray:
    """Return the parameters: dimensions of one closure, conjugated dimensions of another, and the input."""
    values: list[complex] = []
    for source, flip in ((closure, False), (conjugate, True)):
        for l, row in enumerate(structure.turned):
            numbers = [source.constant[l]]
            numbers += [source.matrix[l, k] for k, there in enumerate(row) if there]
            numbers += [source.slides[l, j] for j, there in enumerate(structure.slid[l]) if there]
            values += [np.conj(n) if flip else n for n in numbers]
    if structure.driven[1] < 0:
        return np.array([*values, value])
    return np.array([*values, np.exp(1j * value), np.exp(-1j * value)])


def _real(structure: Structure, closure: Closure, points: np.ndarray, value: float) -> tuple[np.ndarray, int]:
    """Return the real configurations among the roots, sorted, and the number of the others."""
    link, base = structure.driven
    rotations, translation = closure.rotations, base < 0
    unknown = [k for k in range(rotations) if translation or k != (link if link < rotations else base)]
    slides = structure.kept_slides()
    found: list[np.ndarray] = []
    others = 0
    for point in points:
        z, w, s = np.split(point, [len(unknown), 2 * len(unknown)])
        size = max(1.0, float(np.abs(point).max()))
        if max(np.abs(w - z.conj()).max(initial=0.0), np.abs(s.imag).max(initial=0.0)) > NEARLY_REAL * size:
            others += 1
            continue
        x = np.zeros(closure.size)
        x[unknown] = np.angle(z)
        x[[rotations + j for j in slides]] = s.real
        if translation:
            x[rotations + link] = value
        elif link < rotations:
            x[link] = value + (x[base] if base < rotations else 0.0)
        else:
            x[base] = -value
        if structure.lonely_slides():
            x = closure.with_displacements(x)
        x, moved = settle(closure, x)
        if not math.isfinite(moved):
            others += 1
            continue
        found.append(wrap(closure, x))
    found.sort(key=lambda x: tuple(np.round(x, 9)))
    return np.array(found).reshape(-1, closure.size), others


def by_rotation(closure: Closure, x: np.ndarray) -> list[Mapping[str, float]]:
    """Return configurations (k, n) as mappings from link to rotation, as ``judge`` takes them."""
    return [{k: float(v) for k, v in closure.link_rotations(row).items()} for row in x]
