"""Regeneration: equations are met one after the other, and what is lost at infinity is lost early.

A start system made for all equations at once has as many paths as the equations could have roots; most end at
infinity or on sets of roots that mean nothing. Here the roots of the first k equations, cut by generic slices to a
finite number, are the start of the k + 1st (Hauenstein, Sommese, Wampler, *Regeneration homotopies for solving systems
of polynomials*, Math. Comp. 80, 2011). Its own start is a product of two forms: one is a slice less, one holds local
unknowns. Only regular ends go on: an isolated regular root of all equations lies on components which are met
regularly at every stage.

The systems meant are those of points and poses. There are design unknowns in groups; each *block* of equations adds
some local unknowns and one equation more. Each equation belongs to one group, in the functions of which it is linear
with coefficients that are linear in the local unknowns, or to none, and then it holds local unknowns only. A slice
of a group is a generic linear form in the group's functions: 1, x, e, x·e if these occur. So roots are kept for each
*cell*: a number of blocks that are met, and the number of slices in each group.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import Any

import numpy as np

from solvers.ends import FAILED, INFINITE, REGULAR, SINGULAR, Ends
from solvers.graph import Builder, Node
from solvers.homotopy import Homotopy, Listed
from solvers.points import PointSet
from solvers.simple_ends import simple_ends
from solvers.start import START_VANISHES
from solvers.system import System
from solvers.tape import Program
from solvers.tracking import Run, track_all

__all__ = ["Blocks", "Cell", "regenerate"]

#: While paths fail, a cell is tracked so many times more from other starts.
AGAIN = 1


@dataclass(frozen=True, eq=False)
class Blocks:
    """How a square system is made of blocks.

    Attributes
    ----------
    system : System
        The design unknowns first, then the local unknowns block by block; equations block by block.
    groups : tuple of tuple of SymPy expressions
        The functions of each group of design unknowns, 1 among them.
    unknowns : tuple of tuple of int
        The design unknowns of each group.
    belongs : tuple of int or None
        The group of each equation of a block.
    locals : int
        Local unknowns of a block: one less than its equations.
    """

    system: System
    groups: tuple[tuple[Any, ...], ...]
    unknowns: tuple[tuple[int, ...], ...]
    belongs: tuple[int | None, ...]
    locals: int

    @property
    def design(self) -> int:
        """Number of design unknowns."""
        return sum(map(len, self.unknowns))

    @property
    def count(self) -> int:
        """Number of blocks."""
        return len(self.system.unknowns[self.design :]) // self.locals


@dataclass(frozen=True, eq=False)
class Cell:
    """The roots of some blocks on some slices.

    Attributes
    ----------
    blocks : int
    slices : tuple of int
        Number of slices in each group.
    points : ndarray, shape (n, design unknowns + local unknowns of the blocks)
    paths, singular, at_infinity, failed : int
        Of the homotopy that has led here.
    """

    blocks: int
    slices: tuple[int, ...]
    points: np.ndarray
    paths: int = 0
    singular: int = 0
    at_infinity: int = 0
    failed: int = 0


def regenerate(blocks: Blocks, values: Any, seed: int = 0, run: Run | None = None) -> Iterator[Cell]:
    """Meet the blocks one after the other.

    Parameters
    ----------
    blocks : Blocks
    values : sequence of complex
        Parameter values.
    seed : int
    run : Run, optional
        Workers and progress.

    Yields
    ------
    Cell
        Every cell, as it is found; the last one holds all regular roots of the system.

    Raises
    ------
    ArithmeticError
        A path to the first points failed.

    Examples
    --------
    Two blocks of two bilinear equations; c is a local unknown of the first, d of the second.

    >>> from sympy import symbols
    >>> x, y, a, b, c, d = symbols("x y a b c d")
    >>> equations = [x * c + 2 * c - x + 1, y * c - c + 3 * y + 2, 2 * x * d + d - x - 4, y * d - 5 * d + y - 1]
    >>> system = System(equations, [x, y, c, d])
    >>> blocks = Blocks(system, groups=((1, x), (1, y)), unknowns=((0,), (1,)), belongs=(0, 1), locals=1)
    >>> [(cell.blocks, cell.slices, len(cell.points)) for cell in regenerate(blocks, [])]
    [(0, (1, 1), 1), (1, (0, 1), 1), (1, (1, 0), 1), (2, (0, 0), 2)]
    """
    work = _Work(blocks, blocks.system.values_of(values), seed, run or Run())
    sizes = tuple(map(len, blocks.unknowns))
    cells = {sizes: Cell(0, sizes, work.first())}
    yield cells[sizes]
    for done in range(1, blocks.count + 1):
        after: dict[tuple[int, ...], Cell] = {}
        for slices in product(*(range(size + 1) for size in sizes)):
            if sum(slices) != sum(sizes) - done:
                continue
            after[slices] = work.next_cell(done, slices, cells)
            yield after[slices]
        cells = after


@dataclass(eq=False)
class _Work:
    blocks: Blocks
    values: np.ndarray
    seed: int
    run: Run
    rng: np.random.Generator = field(init=False)

    def __post_init__(self) -> None:
        self.rng = np.random.default_rng([self.seed, 2011])
        self.widths = [len(functions) for functions in self.blocks.groups]
        self.slices = [self._random(len(u), w) for u, w in zip(self.blocks.unknowns, self.widths)]
        self.functions = System(
            [f for functions in self.blocks.groups for f in functions],
            self.blocks.system.unknowns[: self.blocks.design],
        )
        self.programs: dict[tuple[int, ...], Program] = {}

        self.fresh()

    def fresh(self) -> None:
        """New random local forms and γ; the slices stay, as the roots that are known lie on them."""
        self.local = [self._random(self.blocks.locals + 1) for _ in self.blocks.belongs]
        self.gammas = self._random(len(self.blocks.belongs))

    def _random(self, *shape: int) -> np.ndarray:
        return np.exp(2j * np.pi * self.rng.random(shape))

    # -- where it begins ------------------------------------------------------------------------------------
    def first(self) -> np.ndarray:
        """The points on all slices: of each group alone, then put together."""
        parts = []
        names = self.blocks.system.unknowns
        for members, functions, rows in zip(self.blocks.unknowns, self.blocks.groups, self.slices):
            equations = [sum(complex(c) * f for c, f in zip(row, functions)) for row in rows]
            parts.append(self._all_roots(System(equations, [names[k] for k in members])))
        points = np.zeros((int(np.prod([len(part) for part in parts])), self.blocks.design), np.complex128)
        for row, chosen in zip(points, product(*parts)):
            for members, part in zip(self.blocks.unknowns, chosen):
                row[list(members)] = part
        return points

    def local_starts(self, equation: int) -> np.ndarray:
        """Local unknowns where the local forms of the other equations vanish, and the equations without a group."""
        size, program = self.blocks.locals, self.blocks.system.program
        builder = Builder(size, 0)
        y = [builder.unknown(k) for k in range(size)]
        zeros = [builder.zero] * (program.unknowns - size)
        values = [builder.constant(complex(v)) for v in self.values]
        whole = program.embed(builder, [*zeros[: self.blocks.design], *y, *zeros[self.blocks.design :]], values)
        nodes = []
        for k, group in enumerate(self.blocks.belongs):
            if group is None:
                nodes.append(whole[k])
            elif k != equation:
                nodes.append(_form(builder, [builder.constant(complex(c)) for c in self.local[k]], y))
        return self._all_roots(System.from_program(builder.finish({"F": nodes})))

    def _all_roots(self, system: System) -> np.ndarray:
        """All of them, or none: with one missing here every cell would be short without a sign."""
        from solvers.solve import solve

        found = solve(system, seed=self.seed, certificates=False)
        if found.ledger.failed:
            raise ArithmeticError(f"a start of regeneration is not complete ({found.evidence}); use another seed")
        return found.points

    # -- from cell to cell ----------------------------------------------------------------------------------
    def next_cell(self, done: int, slices: tuple[int, ...], cells: dict[tuple[int, ...], Cell]) -> Cell:
        """One block more on the given slices, from the cells with one slice more; again while paths fail."""
        best = self.tracked(done, slices, cells)
        for _ in range(AGAIN):
            if not best.failed:
                break
            self.fresh()
            best = min(best, self.tracked(done, slices, cells), key=lambda cell: cell.failed)
        return best

    def tracked(self, done: int, slices: tuple[int, ...], cells: dict[tuple[int, ...], Cell]) -> Cell:
        """All paths to a cell, once."""
        starts = []
        for equation, group in enumerate(self.blocks.belongs):
            if group is None:
                continue
            parent = tuple(n + (k == group) for k, n in enumerate(slices))
            if parent in cells:
                known, local = cells[parent].points, self.local_starts(equation)
                rows = np.repeat(np.arange(len(known)), len(local))
                starts.append(np.concatenate([known[rows], np.tile(local, (len(known), 1))], axis=1))
        points = np.concatenate(starts)
        homotopy = self._homotopy(done, slices, points)
        ends, _ = track_all(homotopy, self.run, precise=False)  # other starts are cheaper than more digits
        simple = self._simple(homotopy, ends)
        found = np.concatenate([ends.x[ends.kind == REGULAR], simple])
        singular, lost, failed = (int(np.sum(ends.kind == kind)) for kind in (SINGULAR, INFINITE, FAILED))
        return Cell(done, slices, found, len(points), singular - len(simple), lost, failed)

    def _simple(self, homotopy: Homotopy, ends: Ends) -> np.ndarray:
        """Singular ends that are proved to be simple roots: see :mod:`solvers.simple_ends`."""
        system = System.from_program(homotopy.program)
        points = ends.x[(ends.kind == SINGULAR) & (ends.winding <= 1)]
        points = points[simple_ends(system, points, homotopy.target)[0]]
        known = PointSet(points.shape[1])
        known.add(ends.x[ends.kind == REGULAR])
        return points[known.find(points) < 0]

    def _homotopy(self, done: int, slices: tuple[int, ...], points: np.ndarray) -> Homotopy:
        """From (slice)·(local form) to each equation of the last block; its program is the same for all cells."""
        blocks, rng = self.blocks, np.random.default_rng([self.seed, done, *slices])
        total, left = sum(self.widths), sum(slices)
        held = np.zeros((left, total), np.complex128)
        going = np.zeros((len(blocks.belongs), max(self.widths)), np.complex128)
        row = 0
        offsets = np.cumsum([0, *self.widths])
        for own, count in enumerate(slices):
            held[row : row + count, offsets[own] : offsets[own + 1]] = self.slices[own][:count]
            row += count
        for k, group in enumerate(blocks.belongs):
            if group is not None:
                # A group without a slice left to spare has one that nothing else uses: no path starts on it.
                spare = self.slices[group][slices[group]] if slices[group] < len(self.slices[group]) else None
                going[k, : self.widths[group]] = self._random(self.widths[group]) if spare is None else spare
        # Mixed, the slices have the same entries whatever their groups: one order of elimination serves them all.
        mixed = np.linalg.qr(rng.normal(size=(left, left)) + 1j * rng.normal(size=(left, left)))[0] @ held
        still = np.concatenate([mixed.ravel(), going.ravel(), np.concatenate(self.local), self.values])
        size = len(blocks.belongs)
        key = (done, *slices)
        if key not in self.programs:
            self.programs[key] = self._program(done, left)
        return Homotopy(
            program=self.programs[key],
            start=np.concatenate([self.gammas, np.zeros(size), still]),
            target=np.concatenate([np.zeros(size), np.ones(size), still]),
            starts=Listed(points),
            moving=range(2 * size),
            name=f"block {done} of {blocks.count}, slices {'+'.join(map(str, slices))}",
            smallest=START_VANISHES,
            seed=self.seed,
        )

    def _program(self, done: int, left: int) -> Program:
        blocks, size = self.blocks, len(self.blocks.belongs)
        total, widest = sum(self.widths), max(self.widths)
        unknowns = blocks.design + done * blocks.locals
        forms = size * (blocks.locals + 1)
        builder = Builder(unknowns, 2 * size + left * total + size * widest + forms + len(self.values))
        x = [builder.unknown(k) for k in range(unknowns)]
        places = iter(range(builder.parameters))

        def take(count: int) -> list[Node]:
            return [builder.parameter(next(places)) for _ in range(count)]

        first, last = take(size), take(size)
        held = [take(total) for _ in range(left)]
        going = [take(widest) for _ in range(size)]
        local = [take(blocks.locals + 1) for _ in range(size)]
        values = take(len(self.values))
        missing = [builder.zero] * (len(blocks.system.unknowns) - unknowns)
        equations = blocks.system.embed(builder, [*x, *missing], values)[: size * done]
        functions = self.functions.embed(builder, x[: blocks.design], [])
        offsets = np.cumsum([0, *self.widths])
        nodes = [builder.total([builder.multiply(c, f) for c, f in zip(row, functions)]) for row in held]
        nodes += equations[: size * (done - 1)]
        for k, group in enumerate(blocks.belongs):
            target = equations[size * (done - 1) + k]
            if group is None:
                nodes.append(target)
                continue
            own = functions[offsets[group] : offsets[group + 1]]
            cut = builder.total([builder.multiply(c, f) for c, f in zip(going[k], own)])
            start = builder.multiply(cut, _form(builder, local[k], x[-blocks.locals :]))
            nodes.append(builder.add(builder.multiply(first[k], start), builder.multiply(last[k], target)))
        return builder.finish({"F": nodes})


def _form(builder: Builder, coefficients: Sequence[Node], unknowns: Sequence[Node]) -> Node:
    """A linear form, constant last."""
    terms = [builder.multiply(c, y) for c, y in zip(coefficients, unknowns)]
    return builder.total([*terms, coefficients[-1]])
