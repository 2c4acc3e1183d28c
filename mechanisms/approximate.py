"""More positions than a linkage can meet: the best approximation, in the mean or at the worst position.

Two norms, both over all positions at once: least squares (`least_squares_fit`) and Chebyshev (`minimax_fit`), with
bounds on the unknowns and smooth inequality constraints.  Neither problem is convex for a linkage, so what
counts is where the search begins:

- complete exact solves over a few of the positions give starts that already are linkages near the task
  (`spread_subsets` chooses the positions);
- all critical points of a dyad fitted to many poses can be computed, which proves the optimum
  (`mechanisms.dyad_fit`);
- Sobol points of a box serve where neither is at hand (`sobol_points`).
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["Fit", "best_fit", "geodesic_fit", "least_squares_fit", "minimax_fit", "sobol_points", "spread_subsets"]

Residuals = Callable[[NDArray[np.float64]], NDArray[np.float64]]
Jacobian = Callable[[NDArray[np.float64]], NDArray[np.float64]]

#: Step of central differences, relative: the cube root of the rounding unit balances both errors.
STEP = np.finfo(float).eps ** (1 / 3)
#: Sequential linear programs at most; twenty are usual.
MAX_PROGRAMS = 300
#: A trust region smaller than this, relative to the unknowns, ends the descent.
SMALLEST_REGION = 1e-12
#: What a unit of violated constraint costs in the programs, in units of the residual: an exact penalty.
PENALTY = 1e3
#: Part of a step over which its acceleration is measured, how often the damping is raised before a geodesic
#: descent ends, and the least damping.
GEODESIC_STEP, GEODESIC_TRIES, LEAST_DAMPING = 0.1, 12, 1e-18
#: Two fits whose unknowns agree to this part of their size are one.
SAME_FIT = 1e-6


@dataclass(frozen=True)
class Fit:
    """The end of one descent.

    Attributes
    ----------
    x : (n,) array
        The unknowns.
    residuals : (m,) array
        At `x`.
    value : float
        What was minimised: root of the mean square, or the largest absolute residual.
    converged : bool
        Whether the descent ended because nothing got better, not because it ran out of steps.
    start : int
        Which start it came from.
    """

    x: NDArray[np.float64]
    residuals: NDArray[np.float64]
    value: float
    converged: bool = True
    start: int = 0

    @property
    def rms(self) -> float:
        """Root of the mean square of the residuals."""
        return float(np.sqrt(np.mean(self.residuals**2))) if self.residuals.size else 0.0

    @property
    def worst(self) -> float:
        """The largest absolute residual."""
        return float(np.abs(self.residuals).max(initial=0.0))


def sobol_points(bounds: ArrayLike, count: int, seed: int = 0) -> NDArray[np.float64]:
    """Scrambled Sobol points in a box.

    Parameters
    ----------
    bounds : (n, 2) array
        Lowest and highest value of each unknown.
    count : int
        How many; rounded up to a power of two inside, so that they fill the box evenly.

    Returns
    -------
    (count, n) array
    """
    from scipy.stats import qmc

    box = np.asarray(bounds, dtype=float)
    sampler = qmc.Sobol(len(box), seed=np.random.default_rng(seed))
    return box[:, 0] + sampler.random_base2(int(np.ceil(np.log2(max(count, 2)))))[:count] * (box[:, 1] - box[:, 0])


def spread_subsets(positions: int, size: int, count: int, seed: int = 0) -> list[tuple[int, ...]]:
    """Subsets of positions that are spread over all of them: an even one first, then random ones, 0 always first.

    Examples
    --------
    >>> spread_subsets(24, 5, 1)
    [(0, 5, 10, 14, 19)]
    """
    if not 1 <= size <= positions:
        raise ValueError(f"{size} of {positions} positions cannot be chosen")
    even = tuple(int(k) for k in np.round(np.arange(size) * positions / size).astype(int))
    found = [even]
    rng = np.random.default_rng(seed)
    if size == positions:
        return found
    for _ in itertools.count():
        if len(found) >= count or len(found) > 50 * count:
            return found[:count]
        chosen = (0, *sorted(1 + rng.choice(positions - 1, size - 1, replace=False)))
        found.append(tuple(int(k) for k in chosen))
    return found


def least_squares_fit(
    residuals: Residuals,
    start: ArrayLike,
    bounds: ArrayLike | None = None,
    jacobian: Jacobian | None = None,
    tolerance: float = 1e-15,
    steps: int = 400,
) -> Fit:
    """The least-squares fit that a start leads to (Levenberg–Marquardt; trust region with bounds).

    Parameters
    ----------
    residuals : callable
        (n,) to (m,).
    start : (n,) array
    bounds : (n, 2) array, optional
    jacobian : callable, optional
        (n,) to (m, n); central differences otherwise.

    Examples
    --------
    >>> fit = least_squares_fit(lambda x: np.array([x[0] - 1, x[0] - 2, x[0] - 6]), [0.0])
    >>> round(float(fit.x[0]), 6), round(fit.value, 4)
    (3.0, 2.1602)
    """
    from scipy.optimize import least_squares

    x = np.asarray(start, dtype=float)
    slopes: Any = jacobian if jacobian is not None else lambda x: differences(residuals, x)
    options: dict[str, Any] = {"method": "lm"}
    if bounds is not None:
        box = np.asarray(bounds, dtype=float)
        options = {"method": "trf", "bounds": (box[:, 0], box[:, 1])}
        x = np.clip(x, box[:, 0], box[:, 1])
    elif len(residuals(x)) < len(x):
        options = {"method": "trf"}
    found = least_squares(
        residuals,
        x,
        slopes,
        xtol=tolerance,
        ftol=tolerance,
        gtol=tolerance,
        max_nfev=steps,
        x_scale="jac",
        **options,
    )
    return Fit(found.x, found.fun, float(np.sqrt(np.mean(found.fun**2))), bool(found.status > 0))


def geodesic_fit(residuals: Residuals, start: ArrayLike, jacobian: Jacobian, steps: int = 1000) -> Fit:
    """The least-squares fit that a start leads to, for long curved valleys.

    Levenberg–Marquardt steps with the acceleration of the residuals along them (M. K. Transtrum, J. P. Sethna,
    Improvements to the Levenberg–Marquardt algorithm for nonlinear least-squares minimization): where the
    Jacobian is nearly singular, a straight step leaves the valley at once and a bent one does not.

    Examples
    --------
    >>> def rosenbrock(x): return np.array([1 - x[0], 100 * (x[1] - x[0] ** 2)])
    >>> def slopes(x): return np.array([[-1.0, 0.0], [-200 * x[0], 100.0]])
    >>> bool(geodesic_fit(rosenbrock, [-1.2, 1.0], slopes).value < 1e-12)
    True
    """
    x = np.asarray(start, dtype=float)
    r, damping = residuals(x), 1e-3
    total, converged = float(r @ r), False
    for _ in range(steps):
        slope = jacobian(x)
        if not (np.all(np.isfinite(slope)) and np.isfinite(total)):
            break
        u, s, vt = np.linalg.svd(slope, full_matrices=False)
        for _ in range(GEODESIC_TRIES):
            filtered = vt.T * (s / (s * s + damping))
            step = -filtered @ (u.T @ r)
            ahead = residuals(x + GEODESIC_STEP * step)
            bend = 2 / GEODESIC_STEP * ((ahead - r) / GEODESIC_STEP - slope @ step)
            turn = -0.5 * filtered @ (u.T @ bend)
            if np.linalg.norm(turn) <= 0.75 * np.linalg.norm(step):
                trial = x + step + turn
                new = residuals(trial)
                if float(new @ new) < total:
                    break
            damping = max(4 * damping, LEAST_DAMPING)
        else:
            converged = True
            break
        x, r, total = trial, new, float(new @ new)
        damping = max(damping / 6, LEAST_DAMPING)
    return Fit(x, r, float(np.sqrt(np.mean(r**2))), converged)


def minimax_fit(
    residuals: Residuals,
    start: ArrayLike,
    bounds: ArrayLike | None = None,
    constraints: Residuals | None = None,
    jacobian: Jacobian | None = None,
    constraint_jacobian: Jacobian | None = None,
    programs: int = MAX_PROGRAMS,
) -> Fit:
    """The Chebyshev fit that a start leads to, by sequential linear programs in a trust region (HiGHS).

    Each program minimises ε subject to −ε ≤ r + J d ≤ ε and c + C d ≤ 0 for a step d in a box; the step is
    taken when the true residual falls, else the box shrinks (K. Madsen, An algorithm for minimax solution of
    overdetermined systems of non-linear equations).  Unlike descent group by group, which may jam, all unknowns
    move together.

    Parameters
    ----------
    residuals : callable
        (n,) to (m,).
    constraints : callable, optional
        (n,) to (k,), met where not positive; scaled like the residuals.

    Examples
    --------
    The best parabola a + b x² for |x| on [−1, 1] misses it by 1/8:

    >>> grid = np.linspace(-1, 1, 201)
    >>> fit = minimax_fit(lambda p: p[0] + p[1] * grid**2 - abs(grid), [0.0, 0.0])
    >>> round(fit.value, 6)
    0.125
    """
    x = np.asarray(start, dtype=float).copy()
    box = None if bounds is None else np.asarray(bounds, dtype=float)
    if box is not None:
        x = np.clip(x, box[:, 0], box[:, 1])
    slopes = jacobian or (lambda y: differences(residuals, y))
    limits = constraints or (lambda y: np.zeros(0))
    limit_slopes = constraint_jacobian or (lambda y: differences(limits, y))
    scale = np.maximum(np.abs(x), 1.0)
    if box is not None:
        scale = np.minimum(scale, np.maximum(box[:, 1] - box[:, 0], 1e-12))
    region, r, c = 0.1, residuals(x), limits(x)
    merit = _merit(r, c)
    converged = False
    for _ in range(programs):
        if not (np.all(np.isfinite(r)) and np.all(np.isfinite(c))):
            break
        slope, limit_slope = slopes(x), limit_slopes(x)
        if not (np.all(np.isfinite(slope)) and np.all(np.isfinite(limit_slope))):
            break  # the edge of what exists at all: a linkage that cannot be closed beyond
        step, foretold = _program(r, slope, c, limit_slope, region * scale, x, box)
        if step is None or merit - foretold <= 1e-13 * max(merit, 1e-300):
            converged = step is not None
            break
        trial, new_r, new_c, new, ratio = x + step, r, c, merit, -1.0
        for correction in (False, True):
            if correction:
                # Curved constraints turn even good steps down; the same program with the curvature just seen.
                bent = new_r - slope @ step, new_c - limit_slope @ step
                if not len(c) or not (np.all(np.isfinite(bent[0])) and np.all(np.isfinite(bent[1]))):
                    break
                second, _ = _program(bent[0], slope, bent[1], limit_slope, region * scale, x, box)
                if second is None:
                    break
                trial = x + second
            new_r, new_c = residuals(trial), limits(trial)
            new = _merit(new_r, new_c)
            ratio = (merit - new) / (merit - foretold) if np.isfinite(new) else -1.0
            if ratio > 0.05:
                break
        if ratio > 0.05:
            x, r, c, merit = trial, new_r, new_c, new
            region = min(2.0 * region, 1.0) if ratio > 0.75 else region
        region *= 0.25 if ratio <= 0.05 else 0.5 if ratio < 0.25 else 1.0
        if region <= SMALLEST_REGION:
            converged = True
            break
    return Fit(x, r, float(np.abs(r).max(initial=0.0)), converged)


def best_fit(fits: Iterable[Fit], count: int | None = None) -> list[Fit]:
    """Different fits, the best first; those that ended in the same place are one."""
    kept: list[Fit] = []
    for fit in sorted((f for f in fits if np.isfinite(f.value)), key=lambda f: f.value):
        size = max(1.0, float(np.abs(fit.x).max(initial=0.0)))
        if all(np.abs(fit.x - other.x).max(initial=0.0) > SAME_FIT * size for other in kept):
            kept.append(fit)
    return kept if count is None else kept[:count]


def differences(function: Residuals, x: NDArray[np.float64]) -> NDArray[np.float64]:
    """The Jacobian by central differences, (m, n)."""
    columns = []
    for k in range(len(x)):
        h = STEP * max(1.0, abs(x[k]))
        up, down = x.copy(), x.copy()
        up[k] += h
        down[k] -= h
        columns.append((function(up) - function(down)) / (up[k] - down[k]))
    return np.array(columns).T if columns else np.zeros((len(function(x)), 0))


def linear_minimax(matrix: NDArray[np.float64], values: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
    """The p with the least max |matrix p − values|, by one linear program, and that maximum.

    >>> p, worst = linear_minimax(np.ones((3, 1)), np.array([1.0, 2.0, 6.0]))
    >>> round(float(p[0]), 9), round(worst, 9)
    (3.5, 2.5)
    """
    size = np.maximum(np.abs(matrix).max(axis=0), 1e-300)
    found, worst = _linear_program(-values, matrix / size, None, None, None, None)
    if found is None:
        raise ValueError("the linear program has no solution; the matrix holds numbers that are not finite")
    p = found / size
    return p, float(np.abs(matrix @ p - values).max(initial=worst * 0))


def _merit(r: NDArray[np.float64], c: NDArray[np.float64]) -> float:
    return float(np.abs(r).max(initial=0.0) + PENALTY * np.maximum(c, 0.0).max(initial=0.0))


def _program(
    r: NDArray[np.float64],
    slopes: NDArray[np.float64],
    c: NDArray[np.float64],
    limit_slopes: NDArray[np.float64],
    region: NDArray[np.float64],
    x: NDArray[np.float64],
    box: NDArray[np.float64] | None,
) -> tuple[NDArray[np.float64] | None, float]:
    """The step of one linear program and the merit that it foretells."""
    low, high = -region, region
    if box is not None:
        low, high = np.maximum(low, box[:, 0] - x), np.minimum(high, box[:, 1] - x)
    unit = max(float(np.abs(r).max(initial=0.0)), 1e-300)  # HiGHS works to 1e-7 of numbers of size one
    step, value = _linear_program(
        r / unit, slopes * region / unit, low / region, high / region, c / unit, limit_slopes * region / unit
    )
    return (None, 0.0) if step is None else (step * region, value * unit)


def _linear_program(
    r: NDArray[np.float64],
    slopes: NDArray[np.float64],
    low: NDArray[np.float64] | None,
    high: NDArray[np.float64] | None,
    c: NDArray[np.float64] | None,
    limit_slopes: NDArray[np.float64] | None,
) -> tuple[NDArray[np.float64] | None, float]:
    """min ε + PENALTY·s  with |r + slopes d| ≤ ε, c + limit_slopes d ≤ s, low ≤ d ≤ high."""
    from scipy.optimize import linprog

    m, n = slopes.shape
    limited = c is not None and len(c) > 0
    one = np.ones((m, 1))
    rows = [np.hstack([slopes, -one, 0 * one]), np.hstack([-slopes, -one, 0 * one])]
    right = [-r, r]
    if limited:
        assert c is not None and limit_slopes is not None
        rows.append(np.hstack([limit_slopes, np.zeros((len(c), 1)), -np.ones((len(c), 1))]))
        right.append(-c)
    span = [(None, None)] * n if low is None or high is None else list(zip(low.tolist(), high.tolist()))
    found = linprog(
        np.r_[np.zeros(n), 1.0, PENALTY],
        A_ub=np.vstack(rows),
        b_ub=np.concatenate(right),
        bounds=[*span, (0, None), (0, None if limited else 0)],
        method="highs",
    )
    if found.x is None or found.status not in (0, 1):
        return None, 0.0
    return found.x[:n], float(found.fun)
