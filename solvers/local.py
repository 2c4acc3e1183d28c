"""What can be told about a system at one point: its Newton step, its condition, the sizes of its terms."""

from __future__ import annotations

import contextlib
from functools import cache

import numpy as np

from solvers.replay import compiled_loops, sizes
from solvers.system import evaluate
from solvers.tape import Program

#: Unknowns smaller than this part of the typical size are measured beside it: paths can end at 0.
ORIGIN = 1e-8
#: A Newton step below this is the last one needed.
CONFIRMED = 1e-9
#: Rounds of balancing: each halves the logarithms of what is left to do.
ROUNDS = 40


def newton_step(
    program: Program, points: np.ndarray, parameters: np.ndarray, typical: float = 0.0
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """One Newton step at each point.

    Returns
    -------
    step : ndarray, shape (n, unknowns)
        J⁻¹F; infinite where J is singular.
    size : ndarray, shape (n,)
        Of the step, each unknown in its own size.
    condition : ndarray, shape (n,)
        Estimate of the scaled condition number, from the solution for one random right-hand side: seldom more than
        a few times too small, for the price of nothing.
    """
    loops = compiled_loops("newton_sweep")
    if loops is None:
        return _step_by_numpy(program, points, parameters, typical)
    step = np.empty(points.shape, np.complex128)
    size, condition = np.empty((2, len(points)))
    loops.newton_steps(
        program.code,
        np.concatenate([parameters, np.zeros(len(parameters)), program.constant_values]).astype(np.complex128),
        np.ascontiguousarray(points, np.complex128),
        relative_weights(points, typical),
        program.outputs["F"],
        program.outputs["J"],
        program.pattern,
        _phases(points.shape[1]),
        step,
        size,
        condition,
    )
    return step, size, np.where(np.isfinite(condition), condition, np.inf)


@cache
def _phases(count: int) -> np.ndarray:
    return np.asarray(np.exp(2j * np.pi * np.random.default_rng(1).random(count)))


def _step_by_numpy(
    program: Program, points: np.ndarray, parameters: np.ndarray, typical: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    with np.errstate(all="ignore"):
        residual, scaled, weights, _ = in_own_units(program, points, parameters, typical)
        right = np.stack([residual, np.broadcast_to(_phases(residual.shape[1]), residual.shape)], axis=2)
    finite = np.isfinite(scaled).all(axis=(1, 2)) & np.isfinite(right).all(axis=(1, 2))
    solved = np.full(right.shape, np.inf, np.complex128)
    with np.errstate(all="ignore"):
        try:
            solved[finite] = np.linalg.solve(scaled[finite], right[finite])
        except np.linalg.LinAlgError:
            for k in np.flatnonzero(finite):
                with contextlib.suppress(np.linalg.LinAlgError):
                    solved[k] = np.linalg.solve(scaled[k], right[k])
        # At a multiple root whole rows vanish: against one, the size of the terms, that shows.
        norm = np.maximum(np.abs(scaled).sum(axis=2).max(axis=1), 1)
        condition = norm * np.abs(solved[:, :, 1]).max(axis=1)
        step = solved[:, :, 0]
        return step * weights, np.abs(step).max(axis=1), np.where(np.isfinite(condition), condition, np.inf)


def newton(
    program: Program, points: np.ndarray, parameters: np.ndarray, typical: float = 0.0, steps: int = 4
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A few Newton steps in double precision: points, size of the last step, scaled condition number.

    A step that would leave the neighbourhood (a thousandth of the point) is not taken. A step below `CONFIRMED` is
    the last: the next would be its square, or rounding noise.
    """
    x = np.array(points)
    size, condition = np.full(len(x), np.inf), np.full(len(x), np.inf)
    active = np.arange(len(x))
    for _ in range(steps):
        step, size[active], condition[active] = newton_step(program, x[active], parameters, typical)
        near = size[active] < 1e-3
        x[active[near]] -= step[near]
        active = active[near & (size[active] > CONFIRMED)]
        if not active.size:
            break
    return x, size, condition


def relative_weights(x: np.ndarray, typical: float = 0.0) -> np.ndarray:
    """Sizes of the unknowns at points: their moduli, or a small part of the largest one or of the typical size."""
    size = np.abs(x)
    return np.maximum(size, np.maximum(1e-4 * size.max(axis=1, keepdims=True), max(ORIGIN * typical, 1e-300)))


def in_own_units(
    program: Program, points: np.ndarray, parameters: np.ndarray, typical: float = 0.0
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Equations and Jacobians at points, each unknown beside its own size, each equation beside that of its terms.

    Returns
    -------
    F : ndarray, shape (n, equations)
    J : ndarray, shape (n, equations, unknowns)
    weights : ndarray, shape (n, unknowns)
        What the unknowns were divided by …
    sizes : ndarray, shape (n, equations)
        … and the equations.
    """
    F, J = evaluate(program, points, parameters)
    weights = relative_weights(points, typical)
    rows = _magnitudes_at(program, weights, parameters)
    return F / rows, J * weights[:, None, :] / rows[:, :, None], weights, rows


def magnitudes(program: Program, x: np.ndarray, parameters: np.ndarray, typical: float = 0.0) -> np.ndarray:
    """Sizes of the terms of each equation before they cancel, shape (n, equations).

    An unknown that vanishes counts with its relative weight, so that no size is zero by accident. The program is
    replayed on absolute values with every difference made a sum. The rounding error of an equation is a small
    multiple of the rounding unit times this; unlike the largest entry of its gradient it does not vanish at a
    singular root.
    """
    return _magnitudes_at(program, relative_weights(x, typical), parameters)


def _magnitudes_at(program: Program, weights: np.ndarray, parameters: np.ndarray) -> np.ndarray:
    return np.maximum(sizes(program, weights, np.abs(parameters)), 1e-300)


def balanced_condition(matrices: np.ndarray) -> np.ndarray:
    """Condition numbers of matrices whose rows and columns are scaled to largest entries of one.

    Parameters
    ----------
    matrices : (n, k, k) array

    Returns
    -------
    (n,) array

    Examples
    --------
    >>> balanced_condition(np.array([[[1e9, 1.0], [-1.0, 1e-9]]])).round(3)
    array([1.])
    """
    with np.errstate(all="ignore"):
        for _ in range(ROUNDS):
            for axis in (2, 1):
                largest = np.abs(matrices).max(axis=axis, keepdims=True)
                matrices = matrices / np.sqrt(np.where(largest > 0, largest, 1.0))
        values = np.linalg.svd(matrices, compute_uv=False)
        return np.where(values[:, -1] > 0, values[:, 0] / values[:, -1], np.inf)
