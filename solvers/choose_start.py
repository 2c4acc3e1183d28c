"""Which start: the one with the fewest paths that can be had at a fair set-up cost, and the reason in words."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import prod
from typing import Any

import numpy as np

from solvers.dense import reaches_total_degree
from solvers.homotopy import Homotopy
from solvers.mixed_cells import MixedCells, TooManyCells
from solvers.partition import Partition, best_partition, partition_of
from solvers.polyhedral import fewest_cells, polyhedral, scaled_terms
from solvers.start import total_degree
from solvers.start_linear_product import ChoiceGraph, Structure, linear_product
from solvers.start_multihomogeneous import multihomogeneous
from solvers.supports import TooManyTerms, degrees_of, terms
from solvers.system import System

STARTS = ("total-degree", "multihomogeneous", "polyhedral")
#: Up to so many paths nothing is gained by looking for fewer.
FEW_PATHS = 6
#: Terms of all equations up to which mixed cells are looked for, and cells that may be looked at (about a second).
MANY_TERMS = 5_000
PATIENCE = 100_000
#: Why the total degree is best.
NO_LESS = "the mixed volume is no less"
#: Steps of the search over groupings when there are no mixed cells (about a second).
SEARCH = 3_000_000


@dataclass(frozen=True)
class Choice:
    """A start and why.

    Attributes
    ----------
    start : str
        "total-degree", "multihomogeneous" or "polyhedral".
    paths : int
    reason : str
    groups : Partition or None
        Of a multihomogeneous start.
    cells : MixedCells or None
        Of a polyhedral start.
    structure : tuple or None
        Of a linear-product start: for each equation its sets of unknowns (indices).
    """

    start: str
    paths: int
    reason: str
    groups: Partition | None = None
    cells: MixedCells | None = None
    structure: Structure | None = None

    def __repr__(self) -> str:
        return f"Choice({self.start}, {self.paths} paths: {self.reason})"

    def homotopy(
        self,
        system: System,
        values: np.ndarray,
        seed: int = 0,
        unknown_scale: np.ndarray | None = None,
        equation_scale: np.ndarray | None = None,
    ) -> Homotopy:
        """The homotopy of this start; arguments as of :func:`solvers.start.total_degree`."""
        if self.start == "total-degree":
            homotopy = total_degree(system, values, seed, unknown_scale, equation_scale)
        elif self.start == "multihomogeneous":
            homotopy = multihomogeneous(system, values, seed, unknown_scale, equation_scale, groups=self.groups)
        elif self.structure is not None:
            homotopy = linear_product(system, self.structure, values, seed, unknown_scale, equation_scale)
        else:
            homotopy = polyhedral(system, values, seed, unknown_scale, equation_scale, cells=self.cells)
        return replace(homotopy, reason=self.reason)


def choose_start(system: System, values: Any = None, start: Any = "auto") -> Choice:
    """The start to use for a square system at given parameter values.

    Parameters
    ----------
    system : System
    values : ndarray, shape (parameters,)
    start : str or sequence
        "auto", or the start that is wanted; or a product structure for a linear-product start: for each equation
        a sequence of sets of unknowns.

    Raises
    ------
    ValueError
        The start is unknown, or the structure does not fit the system.
    TooManyTerms
        A polyhedral start is asked for, and the equations are too large to be multiplied out.

    Examples
    --------
    >>> from sympy import symbols
    >>> x, y, z = symbols("x y z")
    >>> choose_start(System([x * y * z - 1, x * y + y * z + z - 2, x + y * z], [x, y, z]))
    Choice(polyhedral, 4 paths: the mixed volume; the total degree is 12)
    """
    values = system.values_of(values)
    if not isinstance(start, str):
        structure = _structure(system, start)
        return Choice("linear-product", ChoiceGraph(structure).count, "with the structure given", structure=structure)
    if start == "auto":
        return system.once(("start", values.tobytes()), lambda: _automatic(system, values))
    if start == "total-degree":
        return Choice(start, system.bezout, "as asked for")
    if start == "multihomogeneous":
        partition = _partition(system, SEARCH)
        return Choice(start, partition.bezout, f"as asked for, with {_groups(partition)}", partition)
    if start == "polyhedral":
        cells = fewest_cells(*scaled_terms(system, values))
        return Choice(start, cells.mixed_volume, "as asked for", cells=cells)
    raise ValueError(f"the start {start!r} is unknown; choose one of auto, {', '.join(STARTS)}")


def _automatic(system: System, values: np.ndarray) -> Choice:
    degree = system.bezout
    if system.groups is not None:
        partition = _partition(system, 0)
        if partition.bezout <= degree:
            reason = f"the system's own {_groups(partition)}; the total degree is {degree}"
            return Choice("multihomogeneous", partition.bezout, reason, partition)
    if degree <= FEW_PATHS:
        return Choice("total-degree", degree, "so few paths need no search for fewer")
    if _is_dense(system, values, degree):
        return Choice("total-degree", degree, NO_LESS)
    cells, why_not = _cells(system, values)
    if cells is not None:
        volume = cells.mixed_volume
        if volume >= degree:
            return Choice("total-degree", degree, NO_LESS)
        # Sparse starts of size one suit a system better than dense products of random linear forms do, even
        # where a grouping of the unknowns has no more paths; and no grouping has fewer.
        return Choice("polyhedral", volume, f"the mixed volume; the total degree is {degree}", cells=cells)
    partition = _partition(system, SEARCH)
    if partition.bezout < degree:
        reason = f"{_groups(partition)}; the total degree is {degree}; no mixed volume: {why_not}"
        return Choice("multihomogeneous", partition.bezout, reason, partition)
    return Choice("total-degree", degree, f"no grouping saves any; no mixed volume: {why_not}")


def _is_dense(system: System, values: np.ndarray, degree: int) -> bool:
    """Whether there are as many roots as the degree says, which holds for all values of the parameters."""
    try:
        supports = terms(system, values, limit=MANY_TERMS).supports
    except TooManyTerms:
        return False
    return prod(degrees_of(supports, range(len(system.unknowns)))) == degree and reaches_total_degree(supports)


def _cells(system: System, values: np.ndarray) -> tuple[MixedCells | None, str]:
    try:
        supports, coefficients = scaled_terms(system, values, limit=MANY_TERMS)
    except TooManyTerms:
        return None, f"the equations have more than {MANY_TERMS} terms"
    if len(coefficients) > MANY_TERMS:
        return None, f"the equations have {len(coefficients)} terms"
    try:
        return fewest_cells(supports, coefficients, patience=PATIENCE), ""
    except TooManyCells:
        return None, "there are too many mixed cells"


def _structure(system: System, given: Any) -> Structure:
    """Sets of unknowns as indices."""
    where = {symbol: k for k, symbol in enumerate(system.unknowns)}
    try:
        return tuple(tuple(tuple(sorted({where[s] for s in one})) for one in sets) for sets in given)
    except (KeyError, TypeError) as error:
        raise ValueError(
            f"a start must be a name, Solutions, or for each equation a list of sets of unknowns; {error} is none"
        ) from None


def _partition(system: System, budget: int) -> Partition:
    if system.groups is not None:
        return partition_of(system, system.groups)
    return best_partition(system, budget)


def _groups(partition: Partition) -> str:
    return "1 group" if len(partition.groups) == 1 else f"{len(partition.groups)} groups"
