"""What a catalogue entry is made from: the system, a root to begin with, symmetries, and what has to be stored."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from solvers import System

__all__ = ["MADE_FROM", "SHIPPED", "Recipe", "recipe"]

Array = NDArray[np.complex128]

#: First part of an entry's name -> "module:function"; the function takes the parts of the name after it.
MADE_FROM = {
    "trammel": "mechanisms.families.trammel_generic:trammel_recipe",
    "four-bar-path": "mechanisms.families.four_bar_generic:curve_recipe",
    "alt-burmester": "mechanisms.families.alt_burmester:mixed_recipe",
}
#: The entries that are shipped: what the paper's choices need, and the nine points.
SHIPPED = (
    "trammel:7",
    "trammel:6",
    "trammel:5",
    "four-bar-path:9",
    "four-bar-path:8:g",
    "four-bar-path:7:y_N,g",
    "four-bar-path:6:y_M,y_N,g",
    "alt-burmester:1:8",
    "alt-burmester:2:6",
    "alt-burmester:3:4",
    "alt-burmester:4:2",
)


@dataclass(frozen=True)
class Recipe:
    """How the generic solutions of one problem are made and kept.

    Parameters
    ----------
    name : str
    title : str
        The problem in a few words.
    system : solvers.System
    start : callable
        ``start(rng)``: a random root and parameters that it solves, (unknowns,) and (parameters,).
    symmetry : sequence of callable
        Maps of roots to roots of the same parameters, for monodromy.
    kept : int
        How many leading unknowns are stored.
    restore : callable
        ``restore(kept, parameters)``: whole roots from stored columns, to rounding.
    orbit : callable or None
        ``orbit(points, parameters)``: (members, n, unknowns), all roots that one stands for; None when every root
        is stored.
    count : int or None
        Number of roots, where an independent route has established it.
    source : str
        Of that number.
    """

    name: str
    title: str
    system: System
    start: Callable[[np.random.Generator], tuple[Array, Array]]
    kept: int
    restore: Callable[[Array, Array], Array]
    symmetry: Sequence[Callable[[Any], Any]] = ()
    orbit: Callable[[Array, Array], Array] | None = None
    count: int | None = None
    source: str = ""
    extra: dict[str, Any] = field(default_factory=dict)


def recipe(name: str) -> Recipe:
    """The recipe of an entry, shipped or not.

    Raises
    ------
    KeyError
        When no family makes entries of that name.

    Examples
    --------
    >>> recipe("trammel:7").system.size
    (12, 12)
    """
    first, *rest = name.split(":")
    if first not in MADE_FROM:
        raise KeyError(name)
    module, _, function = MADE_FROM[first].partition(":")
    return getattr(import_module(module), function)(name, *rest)
