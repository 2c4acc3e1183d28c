"""Linear-product start systems: every equation a product of generic linear forms, start points by index.

A product structure gives for each equation a list of sets of unknowns. Equation i of the start system is the
product of one generic affine linear form in the unknowns of each set. It covers the equation of the target if
every monomial of the target is a product of at most one unknown from each set (Verschelde and Cools, Applicable
Algebra in Engineering, Communication and Computing 4, 1993). A start point solves one linear form from each
equation. Whether a choice of forms has a solution depends on the sets alone (Hall's condition), so the choices
are counted on a small graph of states, and start point k is found by walking down that graph: none is stored.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from solvers.homotopy import Homotopy
from solvers.start import START_VANISHES, blended, random_gammas
from solvers.system import System

#: States of the counting graph; multihomogeneous structures have at most a few thousand.
STATE_LIMIT = 200_000
#: Start points solved for together: bounds the memory of one call.
_BATCH = 4096

Structure = tuple[tuple[tuple[int, ...], ...], ...]
_State = tuple[frozenset[int], tuple[frozenset[int], ...]]


@dataclass(frozen=True, eq=False)
class ProductPoints:
    """The solutions of a linear-product system, by number.

    Attributes
    ----------
    forms : tuple of ndarray, each of shape (factors, unknowns + 1)
        The linear forms of each equation, constant last.
    graph : ChoiceGraph
        Which choices of one form per equation have a solution.
    """

    forms: tuple[np.ndarray, ...]
    graph: ChoiceGraph

    @property
    def count(self) -> int:
        """The number of solutions."""
        return self.graph.count

    def points(self, indices: np.ndarray) -> np.ndarray:
        """Start points by number, shape (len(indices), unknowns); no other start point is computed."""
        wanted = [int(k) for k in indices]
        if any(not 0 <= k < self.count for k in wanted):
            raise IndexError(f"start points are numbered 0 … {self.count - 1}")
        n = len(self.forms)
        points = np.empty((len(wanted), n), np.complex128)
        for first in range(0, len(wanted), _BATCH):
            chosen = self.graph.choices(wanted[first : first + _BATCH])
            rows = np.empty((len(chosen), n, n + 1), np.complex128)
            for i, forms in enumerate(self.forms):
                rows[:, i] = forms[chosen[:, i]]
            points[first : first + len(chosen)] = np.linalg.solve(rows[:, :, :n], -rows[:, :, n:])[:, :, 0]
        return points


def linear_product(
    system: System,
    structure: Sequence[Sequence[Iterable[int]]],
    values: np.ndarray,
    seed: int = 0,
    unknown_scale: np.ndarray | None = None,
    equation_scale: np.ndarray | None = None,
    name: str = "linear product",
) -> Homotopy:
    """The homotopy from a linear-product system to a square system at given parameter values.

    Parameters
    ----------
    system : System
    structure : for each equation a sequence of sets of unknowns (indices)
        Must cover the equation, see the head of this module; too few factors for the degree of an equation, or
        for its degree in one unknown, are refused.
    values : ndarray, shape (parameters,)
    seed : int
        Seed of the generic coefficients.
    unknown_scale, equation_scale : ndarray, shape (n,), optional
        Typical sizes of the unknowns, and factors that bring the equations to size one.

    Raises
    ------
    ValueError
        The structure does not cover the equations, or it has too many different states to be counted.

    Examples
    --------
    >>> from sympy import symbols
    >>> x, y = symbols("x y")
    >>> system = System([x * y - 1, x * y + x + y], [x, y])
    >>> linear_product(system, [[[0], [1]], [[0], [1]]], np.zeros(0))
    Homotopy(linear product, 2 paths, 2 unknowns)
    """
    rows, n = system.size
    if rows != n:
        raise ValueError(f"{rows} equations for {n} unknowns: a start system needs as many")
    checked: Structure = tuple(tuple(tuple(sorted(set(s))) for s in sets) for sets in structure)
    _check_cover(system, checked)
    points = ProductPoints(_random_forms(checked, n, seed), ChoiceGraph(checked))
    builder, x, equations = blended(system, unknown_scale is not None)
    nodes = []
    for i, sets in enumerate(checked):
        product = builder.parameter(i)
        for members, row in zip(sets, points.forms[i]):
            terms = [builder.multiply(builder.constant(row[k]), x[k]) for k in members]
            product = builder.multiply(product, builder.total([*terms, builder.constant(row[n])]))
        nodes.append(builder.add(product, builder.multiply(builder.parameter(n + i), equations[i])))
    weights = np.ones(n) if equation_scale is None else equation_scale
    still = values if unknown_scale is None else np.concatenate([values, unknown_scale])
    return Homotopy(
        program=builder.finish({"F": nodes}),
        start=np.concatenate([random_gammas(n, seed), np.zeros(n), still]),
        target=np.concatenate([np.zeros(n), weights, still]),
        starts=points,
        moving=range(2 * n),
        unknown_scale=unknown_scale,
        name=name,
        smallest=START_VANISHES,
        seed=seed,
    )


def _random_forms(structure: Structure, n: int, seed: int) -> tuple[np.ndarray, ...]:
    """Coefficients on the unit circle: generic, and no form is nearly constant or nearly homogeneous."""
    rng = np.random.default_rng([seed, 1993])
    forms = []
    for sets in structure:
        table = np.zeros((len(sets), n + 1), np.complex128)
        for row, members in zip(table, sets):
            where = [*members, n]
            row[where] = np.exp(2j * np.pi * rng.random(len(where)))
        forms.append(table)
    return tuple(forms)


def _check_cover(system: System, structure: Structure) -> None:
    rows, n = system.size
    if len(structure) != rows:
        raise ValueError(f"a structure for {len(structure)} equations was given, the system has {rows}")
    single = system.degrees_in([[k] for k in range(n)])
    for i, sets in enumerate(structure):
        if any(not 0 <= k < n for members in sets for k in members):
            raise ValueError(f"the structure of equation {i} holds an index that is no unknown: {sets}")
        if len(sets) < system.degrees[i]:
            raise ValueError(f"equation {i} has degree {system.degrees[i]}, its structure only {len(sets)} factors")
        for k in range(n):
            held = sum(k in members for members in sets)
            if held < single[k, i]:
                raise ValueError(
                    f"equation {i} has degree {single[k, i]} in {system.unknowns[k]}, "
                    f"which is in only {held} factors of its structure"
                )


class ChoiceGraph:
    """Counts the choices of one linear form per equation that have a solution, and finds choice k.

    After the first i equations a choice of sets matters only through its state: the unknowns that are already
    determined, and the remaining sets without them. Layer i holds the states after i equations; each knows how
    many ways lead from it to the end.
    """

    def __init__(self, structure: Structure) -> None:
        self._positions: list[list[np.ndarray]] = []
        layers: list[dict[_State, int]] = [{(frozenset(), ()): 0}]
        moves: list[list[list[int]]] = []  # [row][state][kind of set] -> state of the next layer, or -1
        for sets in structure:
            kinds = sorted(set(sets))
            self._positions.append([np.flatnonzero([s == kind for s in sets]) for kind in kinds])
            after: dict[_State, int] = {}
            table = []
            for state in layers[-1]:
                row = []
                for kind in kinds:
                    following = _advance(state, frozenset(kind))
                    row.append(-1 if following is None else after.setdefault(following, len(after)))
                table.append(row)
            if sum(map(len, layers)) + len(after) > STATE_LIMIT:
                raise ValueError("the product structure has too many different states to be counted; use fewer sets")
            moves.append(table)
            layers.append(after)
        ways = [1] * len(layers[-1])
        self._steps: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
        for positions, table in zip(reversed(self._positions), reversed(moves)):
            weights = [[len(p) * (ways[to] if to >= 0 else 0) for p, to in zip(positions, row)] for row in table]
            below = [[ways[to] if to >= 0 else 1 for to in row] for row in table]
            totals = [sum(row) for row in weights]
            dtype = np.int64 if max(totals, default=0) < 2**62 else object
            cumulative = np.array([[sum(row[: k + 1]) for k in range(len(row))] for row in weights], dtype=dtype)
            shape = (len(table), len(positions))
            self._steps.append((cumulative.reshape(shape), np.array(below, dtype).reshape(shape), np.array(table)))
            ways = totals
        self._steps.reverse()
        self.count = ways[0] if ways else 0

    def choices(self, indices: Sequence[int]) -> np.ndarray:
        """Which form of each equation the start points with these indices solve, shape (indices, equations)."""
        rank = np.array(indices, dtype=np.int64 if self.count < 2**62 else object)
        state = np.zeros(len(rank), np.int64)
        chosen = np.empty((len(rank), len(self._steps)), np.int64)
        for i, (cumulative, below, table) in enumerate(self._steps):
            kind = np.asarray(rank[:, None] >= cumulative[state], bool).sum(axis=1)
            before = np.where(kind > 0, cumulative[state, kind - 1], 0)
            inside = rank - before
            each = below[state, kind]
            copy = (inside // each).astype(np.int64)
            rank = inside % each
            for which, positions in enumerate(self._positions[i]):
                here = kind == which
                chosen[here, i] = positions[copy[here]]
            state = table[state, kind]
        return chosen


def _advance(state: _State, members: frozenset[int]) -> _State | None:
    """The state after one more form in the given unknowns; None if the forms are dependent."""
    known, sets = state
    family = [*sets, members - known]
    owner: dict[int, int] = {}
    for k in range(len(family)):
        if not _match(k, family, owner, set()):
            return None
    # A family of sets with as many unknowns as sets determines these unknowns: take them out, and look again.
    while True:
        closed = _closed_family(family, owner)
        if closed is None:
            break
        unknowns = frozenset().union(*(family[k] for k in closed))
        known = known | unknowns
        family = [members - unknowns for k, members in enumerate(family) if k not in closed]
        owner = {}
        for k in range(len(family)):
            _match(k, family, owner, set())
    return known, tuple(sorted(family, key=sorted))


def _match(k: int, family: list[frozenset[int]], owner: dict[int, int], tried: set[int]) -> bool:
    """Find an unknown for set k by an augmenting path."""
    for unknown in sorted(family[k]):
        if unknown in tried:
            continue
        tried.add(unknown)
        if unknown not in owner or _match(owner[unknown], family, owner, tried):
            owner[unknown] = k
            return True
    return False


def _closed_family(family: list[frozenset[int]], owner: dict[int, int]) -> set[int] | None:
    for first in range(len(family)):
        reached, stack = {first}, [first]
        free = False
        while stack and not free:
            for unknown in family[stack.pop()]:
                if unknown not in owner:
                    free = True
                    break
                if owner[unknown] not in reached:
                    reached.add(owner[unknown])
                    stack.append(owner[unknown])
        if not free:
            return reached
    return None
