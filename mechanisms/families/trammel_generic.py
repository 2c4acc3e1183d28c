"""Generic solutions of the trammel's synthesis, for `mechanisms.catalogue`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mechanisms.catalogue.recipes import Recipe
from mechanisms.families.trammel import MOST_POSES, random_instance, trammel_system

__all__ = ["COUNTS", "trammel_name", "trammel_recipe"]

Array = NDArray[np.complex128]

#: Finite roots for generic poses and conditions: (poses, quadratic condition) -> number.  Found by monodromy with trace
#: test, and by the paths of total degree of the quartics: 4⁶, 4⁵, 4⁵·2, 4⁴, 4⁴·2.
COUNTS = {(7, False): 560, (6, False): 370, (6, True): 420, (5, False): 183, (5, True): 208}


def trammel_name(poses: int, quadratic: bool = False) -> str:
    """The entry's name."""
    return f"trammel:{poses}:quadratic" if quadratic else f"trammel:{poses}"


def trammel_recipe(name: str, poses: str, variant: str = "") -> Recipe:
    """The recipe of ``trammel:7`` and the like.

    Raises
    ------
    ValueError
        When the name means nothing.
    """
    number, quadratic = int(poses), variant == "quadratic"
    if not 3 <= number <= MOST_POSES or variant not in ("", "quadratic") or (quadratic and number == MOST_POSES):
        raise ValueError(name)
    conditions = MOST_POSES - number
    words = f" with {conditions} condition{'s' if conditions > 1 else ''}" if conditions else ""
    return Recipe(
        name=name,
        title=f"rotatory trammel through {number} poses{words}{', one of them quadratic' if quadratic else ''}",
        system=trammel_system(number, quadratic),
        start=lambda rng: random_instance(number, rng, quadratic),
        kept=6,
        restore=lambda kept, parameters: _with_turns(kept, parameters, number),
        count=COUNTS.get((number, quadratic)),
        source="total degree of the quartics" if (number, quadratic) in COUNTS else "",
    )


def _with_turns(kept: Array, parameters: Array, poses: int) -> Array:
    """The disk's turns s_i from the six essential unknowns: the root that the two quadratics have in common."""
    m, mc, d, dc, R, Rc = kept.T
    turns = []
    for p, pc, c, cc in parameters[: 4 * (poses - 1)].reshape(-1, 4):
        low, high = (m - d - R - p) * cc / c - m, (mc - dc - Rc - pc) * c / cc - mc
        turns.append((R * Rc - low * high) / (d * high - R * dc))  # R s² + d s + low, high s² + d̄ s + R̄
    return np.column_stack([kept, *turns])
