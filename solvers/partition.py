"""Groupings of the unknowns, and the number of paths that each would cost.

The multihomogeneous Bézout number of a partition of the unknowns into groups of sizes k_1, …, k_m is the
coefficient of y_1^k_1 … y_m^k_m in the product over the equations i of (d_i1 y_1 + … + d_im y_m), where d_ij is
the degree of equation i in group j (Morgan and Sommese, Applied Mathematics and Computation 24, 1987). It is
computed row by row like a permanent; the search over partitions is exhaustive for few unknowns and a local search
from several starts beyond.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from math import inf, prod

import numpy as np

from solvers.degrees import PRIME, degree_bounds, replay_modular
from solvers.system import System

#: How many partitions there are of 0, 1, 2, … unknowns (Bell's numbers), and steps that one costs per unknown.
BELL = (1, 1, 2, 5, 15, 52, 203, 877, 4140)
STEPS_PER_UNKNOWN = 10
#: Steps of the recursion that a search may spend, about a second's worth. Counted, not timed, so that the answer
#: does not depend on the machine. All partitions are looked at if that is within the budget.
SEARCH_BUDGET = 3_000_000

Groups = tuple[tuple[int, ...], ...]


@dataclass(frozen=True)
class Partition:
    """A partition of the unknowns and its number of paths.

    Attributes
    ----------
    groups : tuple of tuple of int
        Indices of unknowns.
    degrees : tuple of tuple of int
        ``degrees[j][i]`` is the degree of equation i in group j.
    bezout : int
        The multihomogeneous Bézout number.
    """

    groups: Groups
    degrees: tuple[tuple[int, ...], ...]
    bezout: int

    def __repr__(self) -> str:
        inside = " ".join("{" + ",".join(map(str, group)) + "}" for group in self.groups)
        return f"Partition({inside}, {self.bezout} paths)"


def multihomogeneous_bezout(degrees: Sequence[Sequence[int]], sizes: Sequence[int], bound: int | None = None) -> int:
    """The multihomogeneous Bézout number.

    Parameters
    ----------
    degrees : sequence of shape (groups, equations)
        Degree of each equation in each group.
    sizes : sequence of int, shape (groups,)
        Number of unknowns in each group; their sum is the number of equations.
    bound : int, optional
        Give up as soon as the number is known to exceed this; ``bound + 1`` is returned then.

    Examples
    --------
    >>> multihomogeneous_bezout([[1, 1], [1, 1]], [1, 1])  # two bilinear equations
    2
    """
    groups, equations = len(sizes), len(degrees[0])
    if sum(sizes) != equations:
        raise ValueError(f"groups of {sum(sizes)} unknowns for {equations} equations")
    strides = [1]
    for size in sizes:
        strides.append(strides[-1] * (size + 1))
    columns = list(zip(*degrees))
    # Rows with few groups first: they branch least.
    order = sorted(range(equations), key=lambda i: sum(d > 0 for d in columns[i]))
    layer = {0: 1}
    for row in order:
        moves = [(strides[j], sizes[j], columns[row][j]) for j in range(groups) if columns[row][j] > 0]
        after: dict[int, int] = {}
        for state, ways in layer.items():
            for stride, size, degree in moves:
                if state // stride % (size + 1) < size:
                    after[state + stride] = after.get(state + stride, 0) + ways * degree
        layer = after
    (total,) = layer.values() if layer else (0,)
    return total if bound is None or total <= bound else bound + 1


def partition_of(system: System, groups: Sequence[Sequence[int]]) -> Partition:
    """The given grouping with its degrees and its multihomogeneous Bézout number.

    >>> from sympy import symbols
    >>> x, y = symbols("x y")
    >>> partition_of(System([x * y - 1, x * y + x + y], [x, y]), [[0], [1]])
    Partition({0} {1}, 2 paths)
    """
    checked = tuple(tuple(int(k) for k in group) for group in groups)
    if sorted(k for group in checked for k in group) != list(range(len(system.unknowns))):
        raise ValueError(f"the groups {checked} must hold each of the {len(system.unknowns)} unknowns once")
    degrees = tuple(tuple(map(int, row)) for row in system.degrees_in([list(g) for g in checked]))
    sizes = [len(group) for group in checked]
    return Partition(checked, degrees, multihomogeneous_bezout(degrees, sizes))


def best_partition(system: System, budget: int = SEARCH_BUDGET) -> Partition:
    """The partition of the unknowns with the fewest paths that the search finds.

    All partitions, for up to eight unknowns and if the budget allows; else moves, merges and splits from several
    starts.
    Of two partitions with the same number of paths the one with fewer groups is taken. The search is
    deterministic.

    Parameters
    ----------
    system : System
        With as many equations as unknowns.
    budget : int
        Steps of the recursion that the search may spend.

    Examples
    --------
    >>> from sympy import symbols
    >>> x, y, u, v = symbols("x y u v")
    >>> best_partition(System([x * u - 1, y * v - 2, x * v + y - 3, y * u + v], [x, y, u, v]))
    Partition({0} {1,3} {2}, 4 paths)
    """
    rows, columns = system.size
    if rows != columns:
        raise ValueError(f"{rows} equations for {columns} unknowns: only square systems have a number of paths")
    degree = _degree_table(system)

    def price(groups: Groups, bound: int | None) -> int:
        return multihomogeneous_bezout([degree(group) for group in groups], [len(g) for g in groups], bound)

    if columns < len(BELL) and BELL[columns] * columns * STEPS_PER_UNKNOWN <= budget:
        candidates: Iterator[Groups] = _all_partitions(columns)
        best, fewest = None, None
        for groups in candidates:
            number = price(groups, fewest)
            if fewest is None or (number, len(groups)) < (fewest, len(best or ())):
                best, fewest = groups, number
        assert best is not None
    else:
        best = _local_search(system, price, budget)
    return partition_of(system, best)


def _all_partitions(count: int) -> Iterator[Groups]:
    """Every partition of range(count), by restricted growth strings."""

    def grow(k: int, groups: list[list[int]]) -> Iterator[Groups]:
        if k == count:
            yield tuple(tuple(group) for group in groups)
            return
        for group in groups:
            group.append(k)
            yield from grow(k + 1, groups)
            group.pop()
        groups.append([k])
        yield from grow(k + 1, groups)
        groups.pop()

    return grow(0, [])


def _local_search(system: System, price: Callable[[Groups, int | None], int], budget: int) -> Groups:
    """Steepest descent over merges of two groups and moves of one unknown, from several starts."""
    count = len(system.unknowns)
    seen: dict[frozenset[tuple[int, ...]], int] = {}
    spent = 0

    def cost(groups: Groups) -> tuple[float, int]:
        nonlocal spent
        key = frozenset(groups)
        if key not in seen:
            work = count * len(groups) * prod(len(group) + 1 for group in groups)
            if spent + work > budget:
                return inf, len(groups)
            spent += work
            seen[key] = price(groups, None)
        return seen[key], len(groups)

    best: Groups = (tuple(range(count)),)
    for start in _starts(system):
        here = start
        while True:
            nearest = min(_neighbours(here), key=cost, default=here)
            if cost(nearest) >= cost(here):
                break
            here = nearest
        if cost(here) < cost(best):
            best = here
    return best


def _starts(system: System) -> list[Groups]:
    """One group; halves of the list of unknowns (isotropic pairs are often listed so); interleaved; singletons."""
    count = len(system.unknowns)
    everything = tuple(range(count))
    half = count // 2
    starts: list[Groups] = [(everything,), (everything[:half], everything[half:])]
    starts += [tuple(everything[k::step] for k in range(step)) for step in (2, 3)]
    starts.append(tuple(everything[k : k + 2] for k in range(0, count, 2)))
    if count <= 12:  # singletons cost 2^unknowns states for one number
        starts.append(tuple((k,) for k in everything))
    return starts


def _neighbours(groups: Groups) -> Iterator[Groups]:
    def tidy(parts: list[tuple[int, ...]]) -> Groups:
        return tuple(sorted(tuple(sorted(part)) for part in parts if part))

    for a in range(len(groups)):
        for b in range(a):
            rest = [g for k, g in enumerate(groups) if k not in (a, b)]
            yield tidy([*rest, groups[a] + groups[b]])
    for a, group in enumerate(groups):
        for unknown in group:
            left = tuple(k for k in group if k != unknown)
            for b in range(len(groups)):
                if b != a:
                    rest = [g for k, g in enumerate(groups) if k not in (a, b)]
                    yield tidy([*rest, left, (*groups[b], unknown)])
            if left:
                yield tidy([*(g for k, g in enumerate(groups) if k != a), left, (unknown,)])


def _degree_table(system: System) -> Callable[[tuple[int, ...]], tuple[int, ...]]:
    """Degrees of all equations in a group, remembered; up to ten unknowns all groups are measured in one go."""
    count = len(system.unknowns)
    if count <= 10:
        masks = np.arange(1, 1 << count)
        table = _degrees_in_many(system, (masks[:, None] >> np.arange(count)) & 1)
        rows = [tuple(row) for row in table.T.tolist()]
        return lambda group: rows[sum(1 << k for k in group) - 1]

    @cache
    def measured(group: tuple[int, ...]) -> tuple[int, ...]:
        member = np.zeros((1, count), np.int64)
        member[0, list(group)] = 1
        return tuple(_degrees_in_many(system, member)[:, 0].tolist())

    return lambda group: measured(tuple(sorted(group)))


def _degrees_in_many(system: System, members: np.ndarray) -> np.ndarray:
    """Degrees of the equations in many groups at once, shape (equations, groups).

    Parameters
    ----------
    members : ndarray of 0 and 1, shape (groups, unknowns)

    The equations are sampled over a prime field on one random line for each group, all lines in one replay of
    the program, and the divided differences are taken for all of them together.
    """
    program = system.program
    groups = len(members)
    samples = max(degree_bounds(program, set(range(program.unknowns))), default=0) + 1
    rng = np.random.default_rng(20)
    nodes = np.arange(1, samples + 1, dtype=np.int64)
    inputs = []
    for k in range(program.unknowns + 2 * program.parameters):
        base, slope = int(rng.integers(1, PRIME)), int(rng.integers(1, PRIME))
        moving = members[:, k] if k < program.unknowns else np.zeros(groups, np.int64)
        inputs.append(((base + slope * nodes[None, :] * moving[:, None]) % PRIME).ravel())
    values = replay_modular(program, inputs, groups * samples)
    inverses = [0] + [pow(k, -1, PRIME) for k in range(1, samples)]
    degrees = np.empty((len(values), groups), np.int64)
    for i, value in enumerate(values):
        table = value.reshape(groups, samples)
        found = np.full(groups, -1)
        for order in range(samples):
            found[table[:, 0] != 0] = order
            if order + 1 < samples:
                table = (table[:, 1:] - table[:, :-1]) % PRIME * inverses[order + 1] % PRIME
        degrees[i] = found
    return degrees
