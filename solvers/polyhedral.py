"""Polyhedral start systems: as many paths as the mixed volume, never more.

The supports of the equations, each with the constant added (Li and Wang, SIAM Journal on Mathematical Analysis 27,
1996: then solutions with zero coordinates are counted as well; :mod:`solvers.stable_cells` leaves out what comes from
infinity with them), get random coefficients c of modulus one. This generic system is solved first: for each mixed
cell its parameters move on the toric path c·exp(-r·w), where w are the heights of the points above the cell, from r so
large that only the binomials of the cell are left, to 0 (Huber and Sturmfels, Mathematics of Computation 64, 1995).
Its solutions, as many as the mixed volume and all distinct, are the start points of a straight line from the
coefficients c to those of the target.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from solvers.generic import KEPT, Generic
from solvers.homotopy import Homotopy
from solvers.mixed_cells import MixedCells, mixed_cells
from solvers.stable_cells import stable_cells
from solvers.supports import TERM_LIMIT, terms
from solvers.system import System

#: exp(-INVISIBLE): what is left of the largest term outside the binomials where a toric path begins. Newton's
#: method takes the solution of the binomials to the path from there.
INVISIBLE = 7.0
#: Toric paths tracked in one call: each brings a row of heights as long as the list of terms.
BATCH = 8192
#: Two start points nearer than this, relative, are the same: one of their paths has jumped.
SAME_POINT = 1e-8
#: Rungs of tighter steps for toric paths that fail or clash.
RUNGS = 4


class PolyhedralError(ArithmeticError):
    """Toric paths failed on every rung of the ladder."""


@dataclass(eq=False)
class ToricPoints:
    """The solutions of a generic system with given supports, by number.

    Attributes
    ----------
    generic : Generic
    coefficients : ndarray, shape (terms,)
        Of all equations, one after another.
    """

    generic: Generic
    coefficients: np.ndarray
    _kept: np.ndarray | None = field(default=None, repr=False)

    @property
    def cells(self) -> MixedCells:
        """The mixed cells that the solutions come from."""
        return self.generic.cells

    @property
    def count(self) -> int:
        """The mixed volume."""
        return self.cells.mixed_volume

    @property
    def reached(self) -> np.ndarray:
        """The coefficients where the toric paths end, shape (terms,)."""
        return self.coefficients * self.generic.faded[0]

    def points(self, indices: np.ndarray) -> np.ndarray:
        """Solutions of the generic system by number, shape (len(indices), unknowns).

        Raises PolyhedralError if a toric path cannot be tracked.
        """
        wanted = np.asarray(indices, np.int64)
        if self.count > KEPT:
            return self._solve(wanted)
        if self._kept is None:
            self._kept = self._solve(np.arange(self.count))
        return self._kept[wanted]

    def binomial_points(self, indices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Where toric paths begin, shape (paths, unknowns), and their cells."""
        wanted = np.asarray(indices, np.int64)
        cell_of = self.generic.cell_of(wanted)
        at = np.cumsum([0, *map(len, self.cells.supports[:-1])])
        edges = self.coefficients[at[:, None] + self.cells.edges]
        angles = np.angle(-edges[:, :, 0] / edges[:, :, 1]) / (2 * np.pi)
        base = np.einsum("cij,cj->ci", self.generic.inverses, angles)
        points = np.exp(2j * np.pi * (base[cell_of] + self.generic.turns(wanted, cell_of)))
        return points, cell_of

    def _solve(self, indices: np.ndarray) -> np.ndarray:
        """Track toric paths; failed and clashing ones climb a ladder of tighter steps."""
        from solvers.kernel.reference import REACHED, Settings
        from solvers.points import pairs_of_equals

        ends = np.full((len(indices), len(self.cells.supports)), np.nan, np.complex128)
        doubtful = np.arange(len(indices))
        _, coefficients, unknowns = self.generic.faded
        settings = Settings()
        for rung in range(RUNGS):
            for first in range(0, len(doubtful), BATCH):
                batch = doubtful[first : first + BATCH]
                starts, cell_of = self.binomial_points(indices[batch])
                tracked = self.generic.engine.track(
                    starts,
                    self.coefficients * coefficients[cell_of],
                    -self.generic.heights[cell_of],
                    start=INVISIBLE + 2.0 * rung,
                    end=0.0,
                    settings=settings,
                    kind="toric",
                    pivoted=True,  # the binomials of each cell ask for an order of elimination of their own
                )
                arrived = tracked.status == REACHED
                ends[batch] = np.where(arrived[:, None], tracked.x * unknowns[cell_of], np.nan)
            failed = np.flatnonzero(np.isnan(ends[:, 0]))
            whole = np.flatnonzero(~np.isnan(ends[:, 0]))
            # Near a coordinate plane points differ by the ratio of small coordinates.
            compared = np.log(ends[whole]) if self.cells.fade else ends[whole]
            doubtful = np.union1d(failed, whole[pairs_of_equals(compared, SAME_POINT).ravel()])
            if not len(doubtful):
                return ends
            settings = settings.tighter()
        raise PolyhedralError(
            f"{len(doubtful)} of {len(indices)} toric paths failed; use another seed, or a total-degree start"
        )


def toric_points(supports: Sequence[np.ndarray], seed: int = 0, generic: Generic | None = None) -> ToricPoints:
    """The solutions of the generic system with these supports.

    Parameters
    ----------
    supports : sequence of n integer arrays, each of shape (points, n)
        Sorted and without repetitions, as :class:`solvers.mixed_cells.MixedCells` holds them.
    seed : int
    generic : Generic, optional
        If the mixed cells of these supports are known.

    Examples
    --------
    >>> square = np.array([[0, 0], [0, 1], [1, 0], [1, 1]])
    >>> toric_points([square, square]).points(np.arange(2)).shape
    (2, 2)
    """
    generic = generic or Generic(mixed_cells(supports, seed))
    rng = np.random.default_rng([seed, 1995])
    return ToricPoints(generic, np.exp(2j * np.pi * rng.random(sum(map(len, supports)))))


def polyhedral(
    system: System,
    values: np.ndarray,
    seed: int = 0,
    unknown_scale: np.ndarray | None = None,
    equation_scale: np.ndarray | None = None,
    zeros: bool = True,
    cells: MixedCells | None = None,
) -> Homotopy:
    """The homotopy from a generic system with the same supports to a square system at given parameter values.

    Parameters
    ----------
    system : System
    values : ndarray, shape (parameters,)
    seed : int
    unknown_scale, equation_scale : ndarray, shape (n,), optional
        Typical sizes of the unknowns, and factors that bring the equations to size one.
    zeros : bool
        Whether solutions with a zero coordinate are wanted; without them there may be fewer paths.
    cells : MixedCells, optional
        The mixed cells, if they are known.

    Raises
    ------
    TooManyTerms
        The equations are too large to be multiplied out.

    Examples
    --------
    >>> from sympy import symbols
    >>> x, y = symbols("x y")
    >>> polyhedral(System([x**2 * y**2 + x * y - 3, x**2 + y - 1], [x, y]), np.zeros(0))
    Homotopy(polyhedral, 6 paths, 2 unknowns)
    """
    supports, targets = scaled_terms(system, values, unknown_scale, equation_scale, zeros)
    none = tuple(np.flatnonzero(targets == 0).tolist())  # constants that were added
    key = ("generic", seed if cells is None else None, none, *(support.tobytes() for support in supports))
    generic = system.once(key, lambda: Generic(cells or fewest_cells(supports, targets, seed)))
    starts = toric_points(supports, seed, generic)
    return Homotopy(
        program=generic.program,
        start=starts.reached,
        target=targets,
        starts=starts,
        unknown_scale=unknown_scale,
        name="polyhedral",
        seed=seed,
    )


def fewest_cells(
    supports: Sequence[np.ndarray], targets: np.ndarray, seed: int = 0, patience: int = 2**60
) -> MixedCells:
    """The mixed cells; where constants were added, the stable ones among them.

    Parameters
    ----------
    supports : sequence of n integer arrays
    targets : ndarray, shape (terms,)
        The coefficients: an added constant has the coefficient zero.
    seed, patience
        As of :func:`solvers.mixed_cells.mixed_cells`, which see for what is raised.

    Examples
    --------
    >>> supports = [np.array([[0, 0], [0, 1], [0, 2], [1, 3]]), np.array([[0, 0], [1, 0], [2, 0], [3, 1]])]
    >>> [fewest_cells(supports, np.array([c, 2, 3, 5, c, 7, -4, 3])).mixed_volume for c in (0, 1)]
    [6, 8]
    """
    at = np.cumsum([0, *map(len, supports)])
    added = [bool(len(s)) and not s[0].any() and targets[k] == 0 for s, k in zip(supports, at)]
    stable = stable_cells(supports, added, seed, patience) if any(added) else None
    return mixed_cells(supports, seed, patience=patience) if stable is None else stable


def scaled_terms(
    system: System,
    values: np.ndarray,
    unknown_scale: np.ndarray | None = None,
    equation_scale: np.ndarray | None = None,
    zeros: bool = True,
    limit: int = TERM_LIMIT,
) -> tuple[list[np.ndarray], np.ndarray]:
    """Sorted supports (with the constant, if `zeros`) and the scaled coefficients, all in one row."""
    expanded = terms(system, values, limit)
    supports, rows = [], []
    for i, (support, row) in enumerate(zip(expanded.supports, expanded.coefficients)):
        exponents, coefficients = support[::-1], row[::-1]
        if zeros and not (len(support) and not support[-1].any()):
            exponents = np.concatenate([np.zeros((1, support.shape[1]), np.int64), exponents])
            coefficients = np.concatenate([[0.0], coefficients])
        if unknown_scale is not None:
            coefficients = coefficients * np.prod(np.asarray(unknown_scale) ** exponents, axis=1)
        if equation_scale is not None:
            coefficients = coefficients * equation_scale[i]
        supports.append(exponents)
        rows.append(coefficients)
    return supports, np.concatenate(rows)
