"""Multihomogeneous start systems: products of linear forms, each in one group of the unknowns.

Equation i becomes the product over the groups j of d_ij generic affine linear forms in the unknowns of group j
(Wampler, Mechanism and Machine Theory 28, 1993). The number of paths is the multihomogeneous Bézout number.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from solvers.homotopy import Homotopy
from solvers.partition import Partition, best_partition, partition_of
from solvers.start_linear_product import linear_product
from solvers.system import System


def multihomogeneous(
    system: System,
    values: np.ndarray,
    seed: int = 0,
    unknown_scale: np.ndarray | None = None,
    equation_scale: np.ndarray | None = None,
    groups: Partition | Sequence[Sequence[int]] | None = None,
) -> Homotopy:
    """The homotopy from a multihomogeneous start system to a square system at given parameter values.

    Parameters
    ----------
    system : System
    values : ndarray, shape (parameters,)
    seed : int
        Seed of the generic coefficients.
    unknown_scale, equation_scale : ndarray, shape (n,), optional
        Typical sizes of the unknowns, and factors that bring the equations to size one.
    groups : Partition or sequence of groups of unknowns (indices), optional
        The system's own groups if it has any, else the grouping with the fewest paths that a search finds.

    Examples
    --------
    >>> from sympy import symbols
    >>> x, y = symbols("x y")
    >>> multihomogeneous(System([x * (y - 2) + 1, x**2 * y - 1], [x, y]), np.zeros(0))
    Homotopy(multihomogeneous, 3 paths, 2 unknowns)
    """
    if groups is None:
        groups = system.groups
    if groups is None:
        partition = best_partition(system)
    else:
        partition = groups if isinstance(groups, Partition) else partition_of(system, groups)
    structure = [
        [group for group, degrees in zip(partition.groups, partition.degrees) for _ in range(degrees[equation])]
        for equation in range(system.size[0])
    ]
    return linear_product(system, structure, values, seed, unknown_scale, equation_scale, name="multihomogeneous")
