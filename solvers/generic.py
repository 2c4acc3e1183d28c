"""All systems with given supports: what the polyhedral homotopy needs that does not depend on coefficients.

The program whose parameters are the coefficients and the engine that tracks it, and for each mixed cell the
heights of all points above it and the lattice of its binomials. Worked out once, used for every random start.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from solvers.binomial import Lattice, binomial_lattices, turns_of
from solvers.mixed_cells import MixedCells
from solvers.monomials import coefficient_program
from solvers.tape import Program

if TYPE_CHECKING:
    from solvers.kernel.engine import Engine

#: Up to so many start points are kept in memory (and checked to be distinct); beyond, they are tracked on demand.
KEPT = 1_000_000


@dataclass(eq=False)
class Generic:
    """All systems with the supports of some mixed cells: what does not depend on their coefficients.

    Attributes
    ----------
    cells : MixedCells
    """

    cells: MixedCells

    @cached_property
    def program(self) -> Program:
        """The equations; the parameters are the coefficients, one equation after another."""
        return coefficient_program(self.cells.supports)

    @cached_property
    def _above(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        return normals_and_heights(self.cells)

    @property
    def heights(self) -> np.ndarray:
        """How fast each coefficient vanishes on the toric paths of a cell, shape (cells, terms)."""
        return self._above[1]

    @cached_property
    def faded(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """What `fade` makes of coefficients, (terms,), and in the coordinates of each cell of coefficients,
        (cells, terms), and of unknowns, (cells, n).
        """
        fade, (normals, heights, units) = self.cells.fade, self._above
        liftings = np.concatenate([*self.cells.liftings, np.zeros(0)])
        return np.exp(-fade * liftings), np.exp(-fade * heights * units[:, None]), np.exp(-fade * normals)

    @cached_property
    def first(self) -> np.ndarray:
        """Number of the first solution of each cell, shape (cells,)."""
        return np.cumsum([0, *self.cells.volumes], dtype=np.int64)[: len(self.cells)]

    @cached_property
    def lattices(self) -> list[Lattice]:
        """Of the binomials x^(b - a) = -c_a / c_b of each cell."""
        return binomial_lattices(self.cells.steps, self.cells.volumes)

    @cached_property
    def inverses(self) -> np.ndarray:
        """The inverse exponents of each cell, shape (cells, n, n)."""
        n = len(self.cells.supports)
        return np.array([lattice.inverse for lattice in self.lattices]).reshape(-1, n, n)

    def turns(self, indices: np.ndarray, cell_of: np.ndarray) -> np.ndarray:
        """Where solutions lie in their cell's lattice, in turns, shape (len(indices), n)."""
        if self.cells.mixed_volume > KEPT:
            return self._turns(indices, cell_of)
        return self._all_turns[indices]

    @cached_property
    def _all_turns(self) -> np.ndarray:
        indices = np.arange(self.cells.mixed_volume)
        return self._turns(indices, self.cell_of(indices))

    def _turns(self, indices: np.ndarray, cell_of: np.ndarray) -> np.ndarray:
        turns = np.zeros((len(indices), len(self.cells.supports)))
        several = np.flatnonzero(self.cells.volumes[cell_of] > 1)
        if not several.size:
            return turns
        cells, which = np.unique(cell_of[several], return_inverse=True)
        numbers = indices[several] - self.first[cell_of[several]]
        turns[several] = turns_of([self.lattices[cell] for cell in cells.tolist()], which, numbers)
        return turns

    def cell_of(self, indices: np.ndarray) -> np.ndarray:
        """The cell that a solution comes from."""
        return np.searchsorted(self.first, indices, side="right") - 1

    @cached_property
    def engine(self) -> Engine:
        """Tracks these systems while their coefficients move."""
        from solvers.kernel.engine import Engine

        program = self.program
        angles = np.random.default_rng(1995).random((4, program.unknowns + program.parameters))
        samples = np.exp(2j * np.pi * angles)
        return Engine(program, (samples[:, : program.unknowns], samples[:, program.unknowns :]))


def heights_above(cells: MixedCells) -> np.ndarray:
    """Heights of all points above each cell, the lowest one outside the edges being 1, shape (cells, terms).

    The height of γ in support i is w(γ) + ⟨γ, η⟩ less its value on the edge, and zero on the edge. The mixed cells
    are exact; for the speed of a path a rounded height is as good.
    """
    return normals_and_heights(cells)[1]


def normals_and_heights(cells: MixedCells) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The normals η of the cells, shape (cells, n), the heights above them in units of the lowest, and these units."""
    n = len(cells.supports)
    first, last = cells.edges[:, :, 0], cells.edges[:, :, 1]
    rise = np.empty((len(cells), n, 1))
    for i, lifting in enumerate(cells.liftings):
        rise[:, i, 0] = lifting[last[:, i]] - lifting[first[:, i]]
    normals = -np.linalg.solve(cells.steps.astype(np.float64), rise)[:, :, 0]
    rows = []
    for i, (support, lifting) in enumerate(zip(cells.supports, cells.liftings)):
        level = lifting + normals @ support.T
        here = np.arange(len(cells))
        height = level - level[here, first[:, i]][:, None]
        height[here, first[:, i]] = height[here, last[:, i]] = np.inf
        rows.append(height)
    heights = np.concatenate(rows, axis=1)
    units = heights.min(axis=1, initial=np.inf)
    outside = np.isfinite(heights)  # nothing, where all equations are binomials
    heights = np.divide(heights, units[:, None], out=np.zeros_like(heights), where=outside)
    return normals, heights, np.where(np.isfinite(units), units, 0.0)

