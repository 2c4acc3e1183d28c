"""One root to begin with, at parameters that are made to fit it."""

from __future__ import annotations

from typing import Any

import numpy as np

from solvers.graph import Builder
from solvers.local import magnitudes, newton
from solvers.system import InvalidSystem, System, differentiated, evaluate

#: Random starts from which the best-conditioned one is taken: a seed is a special point, often with a condition
#: number of a million, and paths are lost on leaving it.
SEEDS = 12
#: So many are made at most, until one is regular at all: roots that are always multiple attract others, too.
MOST_SEEDS, REGULAR = 120, 1e10
#: The terms of each equation cancel to this at a root, relative.
CANCELLED = 1e-8


def given_root(system: System, start: tuple[Any, Any]) -> tuple[np.ndarray, np.ndarray]:
    """The root (point, parameters) that a caller gives, refined; shapes (1, unknowns) and (parameters,)."""
    point = np.atleast_2d(np.asarray(start[0], np.complex128))
    values = system.values_of(start[1])
    if point.shape[1] != len(system.unknowns):
        raise InvalidSystem(f"the start point has {point.shape[1]} coordinates, not {len(system.unknowns)}")
    refined, _, _ = newton(system.jacobian_program, point, values)
    return refined, values


def random_root(system: System, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """A root of the system with parameters made to fit: the best-conditioned of several.

    From a random point and random parameters, Gauss and Newton's method on all of them together finds the nearest
    pair that satisfies the equations.

    Returns
    -------
    point : ndarray, shape (1, unknowns)
    parameters : ndarray, shape (parameters,)

    Raises
    ------
    InvalidSystem
        No pair was found.
    """
    n, m = len(system.unknowns), len(system.parameters)
    builder = Builder(n + m, 0)
    nodes = system.program.embed(builder, list(range(n)), list(range(n, n + m)))
    program = differentiated(builder, nodes)
    best: tuple[float, np.ndarray] | None = None
    for tried in range(MOST_SEEDS):
        if tried >= SEEDS and best is not None and best[0] <= REGULAR:
            break
        z = rng.normal(size=n + m) + 1j * rng.normal(size=n + m)
        for _ in range(60):
            with np.errstate(all="ignore"):
                F, J = evaluate(program, z, np.zeros(0))
            if not (np.isfinite(F).all() and np.isfinite(J).all()):
                break
            rows = np.maximum(np.abs(J[0]).max(axis=1), 1e-300)  # equations in units of their own
            step = np.linalg.lstsq(J[0] / rows[:, None], F[0] / rows, rcond=None)[0]
            length = np.abs(step).max()
            z = z - step * min(1.0, 1.0 / max(length, 1e-300))
            if length < 1e-13 * np.abs(z).max():
                break
        else:
            continue
        if not np.isfinite(z).all():
            continue
        values = z[n:]
        point, _, conditions = newton(system.jacobian_program, z[None, :n], values)
        condition = float(conditions[0])
        size = magnitudes(system.jacobian_program, point, values)
        residual = (np.abs(system.evaluate(point, values)[0]) / size).max()
        if residual < CANCELLED and (best is None or condition < best[0]):
            best = condition, np.concatenate([point[0], values])
    if best is None or best[0] > REGULAR:
        raise InvalidSystem(
            "no regular root could be made from random parameters; give a start pair (point, parameters)"
        )
    return best[1][None, :n], best[1][n:]
