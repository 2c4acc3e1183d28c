"""Generic solutions of coupler-curve synthesis, for `mechanisms.catalogue`."""

from __future__ import annotations

from functools import partial

import numpy as np
from numpy.typing import NDArray

from mechanisms.catalogue.recipes import Recipe
from mechanisms.families.four_bar_curve import (
    NAMES,
    cognate,
    curve_columns,
    curve_instance,
    curve_system,
    nine_point_instance,
    nine_point_system,
    swap,
    swapped_curve,
)

__all__ = ["COUNTS", "NINE", "curve_name", "curve_recipe"]

Array = NDArray[np.complex128]

#: The entry of the nine-point problem.
NINE = "four-bar-path:9"
#: Numbers of roots that another route than monodromy has established, and which.
_PAPER = "Wampler, Morgan, Sommese 1992"
COUNTS = {
    NINE: (8652, f"{_PAPER}; regeneration agrees"),
    "four-bar-path:8:g": (8984, "regeneration and monodromy agree"),
    "four-bar-path:7:y_N,g": (3200, "a polyhedral start and monodromy agree"),
    "four-bar-path:6:y_M,y_N,g": (1320, "a polyhedral start and monodromy agree"),
}


def curve_name(points: int, chosen: tuple[str, ...]) -> str:
    """The entry's name: ``four-bar-path:8:g``."""
    return f"four-bar-path:{points}:{','.join(chosen)}" if chosen else NINE


def curve_recipe(name: str, points: str, chosen: str = "") -> Recipe:
    """The recipe of ``four-bar-path:9``, ``four-bar-path:8:g`` and the like.

    Raises
    ------
    ValueError
        When the name means nothing.
    """
    number, given = int(points), tuple(chosen.split(",")) if chosen else ()
    if name == NINE:
        return Recipe(
            name=name,
            title="four-bar whose coupler curve passes through nine points",
            system=nine_point_system(),
            start=nine_point_instance,
            symmetry=(swap,),
            kept=8,
            restore=_nine_point_turns,
            orbit=_nine_point_orbit,
            count=COUNTS[NINE][0],
            source=COUNTS[NINE][1],
        )
    ordered = tuple(item for item in NAMES if item in given)
    if ordered != given or len(given) + number != len(NAMES) or number < 2:
        raise ValueError(name)
    exchange = swapped_curve(given)
    count, source = COUNTS.get(name, (None, ""))
    return Recipe(
        name=name,
        title=f"four-bar whose coupler curve passes through {number} points, {', '.join(given)} given",
        system=curve_system(number, given),
        start=partial(curve_instance, number, given),
        symmetry=() if exchange is None else (exchange,),
        kept=len(curve_columns(given)),
        restore=partial(_curve_turns, number, given),
        count=count,
        source=source,
        orbit=None if exchange is None else lambda x, parameters: np.stack([x, exchange(x)]),
    )


def _nine_point_orbit(points: Array, parameters: Array) -> Array:
    """Three cognates, each with its dyads in either order."""
    second = cognate(swap(points), parameters)
    third = cognate(swap(second), parameters)
    return np.stack([image for x in (points, second, third) for image in (x, swap(x))])


def _nine_point_turns(kept: Array, parameters: Array) -> Array:
    """The turns t_i, t̄_i: the two dyads' equations are linear in them."""
    columns = [kept]
    for delta, delta_c in parameters.reshape(-1, 2):
        rows, right = [], []
        for a, ac, z, zc in (kept[:, :4].T, kept[:, 4:].T):
            rows.append(np.stack([z * (ac + delta_c), zc * (a + delta)], axis=-1))
            right.append(z * ac + zc * a - delta * ac - delta_c * a - delta * delta_c)
        columns.append(_solve_pairs(np.stack(rows, axis=1), np.stack(right, axis=1)))
    return np.concatenate(columns, axis=1)


def _curve_turns(points: int, chosen: tuple[str, ...], kept: Array, parameters: Array) -> Array:
    """The turns T_i, T̄_i: the two dyads' equations are linear in them."""
    values = dict(zip(curve_columns(chosen), kept.T))
    values |= dict(zip(chosen, (np.full(len(kept), v) for v in parameters[2 * points :])))
    e, f, g = values["e"], values["f"], values["g"]
    m, mc = values["x_M"] + 1j * values["y_M"], values["x_M"] - 1j * values["y_M"]
    n, nc = values["x_N"] + 1j * values["y_N"], values["x_N"] - 1j * values["y_N"]
    k_m = values["k_M"] if "k_M" in values else values["L_MR"] ** 2 - e**2 - g**2
    k_n = values["k_N"] if "k_N" in values else values["L_NS"] ** 2 - f**2 - g**2
    columns = [kept]
    for a, ac in parameters[: 2 * points].reshape(-1, 2):
        rows, right = [], []
        for x, xc, arm, arm_c, k in (
            (a - m, ac - mc, -e - 1j * g, -e + 1j * g, k_m),
            (a - n, ac - nc, f - 1j * g, f + 1j * g, k_n),
        ):
            rows.append(np.stack([xc * arm, x * arm_c], axis=-1))
            right.append(k - x * xc)
        columns.append(_solve_pairs(np.stack(rows, axis=1), np.stack(right, axis=1)))
    return np.concatenate(columns, axis=1)


def _solve_pairs(matrix: Array, right: Array) -> Array:
    """Solve (n, 2, 2) systems by Cramer's rule."""
    (p, q), (r, s) = matrix[:, 0].T, matrix[:, 1].T
    determinant = p * s - q * r
    u, v = right.T
    return np.stack([(u * s - q * v) / determinant, (p * v - r * u) / determinant], axis=1)
