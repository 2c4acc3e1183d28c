"""The closure equations as polynomials, derived once for each structure of a linkage.

e^{iq} becomes an unknown z, its conjugate e^{−iq} an unknown w of its own with z w = 1, and each loop gives
itself and its conjugate. What the graph fixes is a :class:`Structure`; the dimensions are parameters, so
that one system serves all linkages of that structure.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from mechanisms.closure import Closure
from mechanisms.curve import settle, wrap
from mechanisms.linkage import Input, Linkage

if TYPE_CHECKING:
    from solvers.solutions import Solutions
    from solvers.system import System

#: |w − z̄| below this makes a root a candidate for a real configuration; Newton on the real equations then
#: decides.
NEARLY_REAL = 1e-6
#: Solves at random dimensions with another start when a path fails.
ATTEMPTS = 4


@dataclass(frozen=True)
class Structure:
    """What the polynomials depend on besides numbers; hashable, the key of the cache of systems.

    Attributes
    ----------
    turned, slid : tuple of tuple of bool
        Which coefficients A and B of the closure are there.
    slide_class : tuple of int
    gears : tuple of tuple of int
    driven : (int, int)
        Rotation classes of the driven link and of its base; (displacement, −1) for a slider.
    graph : tuple of tuple of int
        Points of each link: two graphs may have the same coefficients, but other relations among them.
    """

    turned: tuple[tuple[bool, ...], ...]
    slid: tuple[tuple[bool, ...], ...]
    slide_class: tuple[int, ...]
    gears: tuple[tuple[int, ...], ...]
    driven: tuple[int, int]
    graph: tuple[tuple[int, ...], ...]

    @classmethod
    def of(cls, linkage: Linkage, driven: Input, closure: Closure | None = None) -> Structure:
        """Return the structure of a linkage with an input, with its own loops or those of a closure."""
        closure = closure or Closure.of(linkage)
        number = {point: i for i, point in enumerate(linkage.points)}
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
            tuple(tuple(number[point] for point in members) for members in linkage.links.values()),
        )

    @property
    def rotations(self) -> int:
        """Number of rotations."""
        return len(self.turned[0])

    def lonely_slides(self) -> tuple[int, ...]:
        """Displacements that are alone in one loop and in no other: they are eliminated by hand."""
        driven = self.driven[0] if self.driven[1] < 0 else -1
        return tuple(
            j for j in range(len(self.slide_class)) if j != driven and [sum(row) for row in self.slid if row[j]] == [1]
        )

    def kept_slides(self) -> list[int]:
        """Displacements that stay unknowns (or are the input)."""
        return [j for j in range(len(self.slide_class)) if j not in self.lonely_slides()]


@dataclass(frozen=True)
class Polynomials:
    """Closure polynomials in symbols: z, w (lists, the ground's 1 last), s by number, and the parameters."""

    z: list[Any]
    w: list[Any]
    s: dict[int, Any]
    loops: list[list[Any]]
    gears: list[Any]
    parameters: list[Any]

    @property
    def equations(self) -> list[Any]:
        """All of them, loop after loop, then the gears."""
        return [e for loop in self.loops for e in loop] + self.gears


@lru_cache(maxsize=256)
def closure_polynomials(structure: Structure) -> Polynomials:
    """Return the loops and gears of a structure as polynomials; z w = 1 is left to the user.

    The parameters are, for each loop, its constant, its A and its B, then the same conjugated.
    """
    import sympy as sp

    rotations = structure.rotations
    z = [*sp.symbols(f"z:{rotations}"), sp.Integer(1)]
    w = [*sp.symbols(f"w:{rotations}"), sp.Integer(1)]
    s = {j: sp.Symbol(f"s{j}") for j in structure.kept_slides()}
    parameters: list[Any] = []
    sides: list[list[tuple[Any, Any]]] = []  # of each loop: the sum without, and the factor of, a lonely slide
    for e, name in ((z, "a"), (w, "b")):
        side = []
        for l in range(len(structure.turned)):
            parameters.append(sp.Symbol(f"{name}c{l}"))
            total, factor = parameters[-1], sp.Integer(0)
            for k in range(rotations):
                if structure.turned[l][k]:
                    parameters.append(sp.Symbol(f"{name}{l}_{k}"))
                    total += parameters[-1] * e[k]
            for j, there in enumerate(structure.slid[l]):
                if there:
                    parameters.append(sp.Symbol(f"{name}s{l}_{j}"))
                    factor = parameters[-1] * e[structure.slide_class[j]]
                    total += factor * s[j] if j in s else 0
            side.append((total, factor))
        sides.append(side)
    lonely = structure.lonely_slides()
    loops: list[list[Any]] = []
    gears: list[Any] = []
    for l, (loop, conjugate) in enumerate(zip(*sides)):
        if any(structure.slid[l][j] for j in lonely):
            # total + s·factor = 0 and its conjugate, with the real s eliminated.
            loops.append([loop[0] * conjugate[1] - conjugate[0] * loop[1]])
        else:
            loops.append([loop[0], conjugate[0]])
    for row in structure.gears:
        left = sp.prod([z[k] ** c for k, c in enumerate(row) if c > 0])
        left *= sp.prod([w[k] ** -c for k, c in enumerate(row) if c < 0])
        gears.append(left - 1)
    return Polynomials(z, w, s, loops, gears, parameters)


def dimensions(structure: Structure, closure: Closure, conjugate: Closure | None = None) -> list[complex]:
    """Return the values of those parameters; the conjugated ones may come from another closure."""
    values: list[complex] = []
    for source, flip in ((closure, False), (conjugate or closure, True)):
        for l, row in enumerate(structure.turned):
            numbers = [source.constant[l]]
            numbers += [source.matrix[l, k] for k, there in enumerate(row) if there]
            numbers += [source.slides[l, j] for j, there in enumerate(structure.slid[l]) if there]
            values += [np.conj(n) if flip else n for n in numbers]
    return values


def generic(
    system: System,
    structure: Structure,
    linkage: Linkage,
    more: int = 0,
    loops: Callable[[Linkage], Closure] = Closure.of,
    seed: int = 20,
) -> Solutions:
    """Solve a system at random complex dimensions that linkages of this graph can have.

    Two random linkages of the graph stand for the dimensions and for their conjugates; ``more`` random
    numbers follow for the parameters after the dimensions. A solve with a failed path is repeated from
    another random start.
    """
    from solvers.solve import solve

    rng = np.random.default_rng(seed)
    first, second = (loops(_shaken(linkage, rng)) for _ in range(2))
    extra = list(rng.normal(size=more) + 1j * rng.normal(size=more))
    values = np.array([*dimensions(structure, first, second), *extra])
    best = None
    for attempt in range(ATTEMPTS):
        found = solve(system, values, start="multihomogeneous", seed=seed + attempt, certificates=False)
        if best is None or len(found.points) > len(best.points):
            best = found
        if not found.ledger.failed:
            break
    assert best is not None
    return best


def _shaken(linkage: Linkage, rng: np.random.Generator) -> Linkage:
    def anywhere() -> complex:
        return complex(*rng.normal(size=2))

    return replace(
        linkage,
        points={name: anywhere() for name in linkage.points},
        sliders=[replace(slider, direction=anywhere()) for slider in linkage.sliders],
        slots=[replace(slot, direction=anywhere()) for slot in linkage.slots],
    )


def real_configurations(
    structure: Structure, closure: Closure, z: np.ndarray, w: np.ndarray, s: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the real configurations among solutions, and which of the solutions they are.

    Parameters
    ----------
    structure : Structure
    closure : Closure
    z, w : (k, rotations) complex arrays
    s : (k, kept) complex array
        The displacements that were not eliminated.

    Returns
    -------
    x : (m, n) float array
        Rotations in (−π, π].
    which : (m,) int array
    """
    found, which = [], []
    for i in range(len(z)):
        size = max(1.0, float(np.abs(z[i]).max()), float(np.abs(s[i]).max(initial=0.0)))
        off = max(float(np.abs(w[i] - z[i].conj()).max()), float(np.abs(s[i].imag).max(initial=0.0)))
        if off > NEARLY_REAL * size:
            continue
        x = np.zeros(closure.size)
        x[: closure.rotations] = np.angle(z[i])
        if structure.lonely_slides():
            x = closure.with_displacements(x)
        x[[closure.rotations + j for j in structure.kept_slides()]] = s[i].real
        x, moved = settle(closure, x)
        if math.isfinite(moved):
            found.append(wrap(closure, x))
            which.append(i)
    return np.array(found).reshape(-1, closure.size), np.array(which, dtype=int)
