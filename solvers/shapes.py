"""Is it a system that can be solved? And if it has too many equations: squaring up, and telling roots from excess.

A system with more equations than unknowns is replaced by as many random combinations of its equations as it has
unknowns. Every root of the system is one of the combinations; the other roots of these are *excess* and are
recognised because the equations left out do not vanish there (Sommese and Wampler, The Numerical Solution of
Systems of Polynomials, 2005, section 13.5).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from solvers.from_sympy import InvalidSystem
from solvers.graph import Builder
from solvers.supports import TooManyTerms, terms
from solvers.system import System, evaluate

#: A point is a root of an equation if the equation's zero set is nearer than this, relative to the point.
NEAR = 1e-6
#: Singular values below this, relative to the largest, do not count towards the rank at a random point.
RANK = 1e-9
#: Equations with more terms than this in one of them are evaluated as they stand, not multiplied out.
FEW_TERMS = 5_000
#: Random points at which ranks and values are looked at: one bad point does not matter.
_POINTS = 3


def check_shape(system: System, values: np.ndarray) -> None:
    """Refuse a system that has no isolated roots for a reason that can be named.

    Parameters
    ----------
    system : System
    values : ndarray, shape (parameters,)

    Raises
    ------
    InvalidSystem
        One sentence: no equations or unknowns, an equation that is zero or constant, an unknown that does not
        occur, fewer equations than unknowns, an equation that is a multiple of another, or dependent equations.

    Examples
    --------
    >>> from sympy import symbols
    >>> x, y = symbols("x y")
    >>> check_shape(System([x + y - 1, 2*x + 2*y - 2], [x, y]), np.zeros(0))
    Traceback (most recent call last):
        ...
    solvers.from_sympy.InvalidSystem: equations 0 and 1 are multiples of each other, so the roots are not isolated
    """
    rows, columns = system.size
    if columns == 0:
        raise InvalidSystem("the system has no unknowns")
    if rows == 0:
        raise InvalidSystem("the system has no equations")
    F, J = _random_values(system, values)
    _check_equations(system, values, F, J)
    _check_unknowns(system, J)
    if rows < columns:
        raise InvalidSystem(
            f"{rows} equation{'s' * (rows > 1)} for {columns} unknowns leave a whole set of solutions, of "
            f"dimension {columns - rows} or more: add equations, or make unknowns parameters"
        )
    values = np.linalg.svd(_normalised(J), compute_uv=False)  # the largest entries of the matrices are one
    rank = int((values > RANK).sum(axis=1).min())
    if rank < columns:
        _check_multiples(F, J)
        raise InvalidSystem(
            f"the equations are dependent: their Jacobian has rank {rank} at a random point, not {columns}, so "
            "the system has either no roots or whole sets of them"
        )


def _random_values(system: System, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(2005)
    shape = (_POINTS, len(system.unknowns))
    points = rng.normal(size=shape) + 1j * rng.normal(size=shape)
    with np.errstate(all="ignore"):
        try:
            F, J = terms(system, values, limit=FEW_TERMS).evaluate(points)  # most solves need them anyway
        except (TooManyTerms, ZeroDivisionError):
            F, J = evaluate(system.jacobian_program, points, values)
    if not (np.all(np.isfinite(F)) and np.all(np.isfinite(J))):
        bad = int(np.flatnonzero(~np.isfinite(F).all(axis=0) | ~np.isfinite(J).all(axis=(0, 2)))[0])
        raise InvalidSystem(f"equation {bad} is not finite at the given parameters: it divides by zero or overflows")
    return F, J


def _check_equations(system: System, values: np.ndarray, F: np.ndarray, J: np.ndarray) -> None:
    degrees = system.degrees
    for i, degree in enumerate(degrees):
        vanishes = np.all(np.abs(J[:, i]).max(axis=1) <= 1e-14 * np.abs(F[:, i]))
        if degree > 0 and vanishes:
            sizes = _sizes_with_unknowns(system, values, i)
            if np.any(sizes):  # x^2 - 1e20 is no constant: its roots are large
                continue
            if sizes.size:
                raise InvalidSystem(
                    f"the coefficients of equation {i} are too small for double precision: multiply it by a power "
                    "of ten, or measure the unknowns in other units"
                )
        if degree < 0 or (vanishes and not np.any(F[:, i])):
            raise InvalidSystem(f"equation {i} is zero at the given parameters: leave it out")
        if degree == 0 or vanishes:
            value = complex(F[0, i])
            shown = f"{value.real:.6g}" if value.imag == 0 else f"{value:.6g}"
            raise InvalidSystem(f"equation {i} is the constant {shown}, which is never zero: there are no roots")


def _sizes_with_unknowns(system: System, values: np.ndarray, equation: int) -> np.ndarray:
    """Sizes of the coefficients that stand before unknowns; none if the equation has too many terms to look."""
    try:
        expanded = terms(system, values, limit=FEW_TERMS)
    except (TooManyTerms, ZeroDivisionError):
        return np.zeros(0)
    return np.abs(expanded.coefficients[equation][np.any(expanded.supports[equation], axis=1)])


def _check_unknowns(system: System, J: np.ndarray) -> None:
    missing = np.flatnonzero(np.all(J == 0, axis=(0, 1)))
    if missing.size:
        names = ", ".join(str(system.unknowns[k]) for k in missing)
        verb = "does" if missing.size == 1 else "do"
        raise InvalidSystem(f"{names} {verb} not occur in any equation, so the roots are not isolated: leave it out")


def _normalised(J: np.ndarray) -> np.ndarray:
    """Rows and columns of size one, so that the units of the user do not look like a lack of rank."""
    J = J / np.maximum(np.abs(J).max(axis=2, keepdims=True), 1e-300)
    return J / np.maximum(np.abs(J).max(axis=1, keepdims=True), 1e-300)


def _check_multiples(F: np.ndarray, J: np.ndarray) -> None:
    """Name two equations that are multiples of each other, if that is why the rank is low."""
    rows = np.concatenate([F[:, :, None], J], axis=2).transpose(1, 0, 2).reshape(F.shape[1], -1)
    rows = rows / np.linalg.norm(rows, axis=1, keepdims=True)
    cosines = np.abs(rows @ rows.conj().T)
    pairs = np.argwhere(np.triu(cosines > 1 - 1e-12, 1))
    if len(pairs):
        i, j = pairs[0]
        raise InvalidSystem(f"equations {i} and {j} are multiples of each other, so the roots are not isolated")


def square_up(system: System, seed: int = 0) -> System:
    """As many random combinations of the equations as there are unknowns.

    Each combination is one of the equations of highest degree plus random multiples of those left out, so that
    the degrees stay as low as they can. A system with no more equations than unknowns is returned as it is.

    Examples
    --------
    >>> from sympy import symbols
    >>> x, y = symbols("x y")
    >>> square_up(System([x**2 - 1, x*y - 1, x - y], [x, y]))
    System(2 equations, 2 unknowns, 0 parameters, degrees 2·2)
    """
    rows, columns = system.size
    if rows <= columns:
        return system
    order = sorted(range(rows), key=lambda i: (-system.degrees[i], i))
    kept, extra = sorted(order[:columns]), order[columns:]
    rng = np.random.default_rng([seed, 2005])
    weights = np.exp(2j * np.pi * rng.random((columns, rows - columns)))
    builder = Builder(columns, len(system.parameters))
    nodes = system.embed(builder)
    combined = []
    for i, row in zip(kept, weights):
        added = [builder.multiply(builder.constant(w), nodes[j]) for w, j in zip(row, extra)]
        combined.append(builder.total([nodes[i], *added]))
    groups = None
    if system.groups is not None:
        groups = [[system.unknowns[k] for k in group] for group in system.groups]
    return System.from_program(builder.finish({"F": combined}), system.unknowns, system.parameters, groups)


def satisfied(system: System, points: Any, values: Any = None, near: float = NEAR) -> np.ndarray:
    """Which points are roots of all equations, to first order.

    The distance from a point to the zero set of an equation f is about |f| / |∇f|. It must be below `near` times
    the size of the point for every equation. Where the gradient vanishes with f (a multiple factor), the distance
    is about the square root of |f| over its second derivatives; there the point is let through.

    Parameters
    ----------
    system : System
    points : array, shape (points, unknowns)
    values : values of the parameters
    near : float

    Returns
    -------
    ndarray of bool, shape (points,)

    Examples
    --------
    >>> from sympy import symbols
    >>> x, y = symbols("x y")
    >>> satisfied(System([x**2 - 1, x*y - 1, x - y], [x, y]), [[1, 1], [1, -1]]).tolist()
    [True, False]
    """
    points = np.atleast_2d(np.asarray(points, np.complex128))
    return np.all(_near_zero(system, points, system.values_of(values), near), axis=1)


def genuine(system: System, points: Any, values: Any = None) -> np.ndarray:
    """Which roots of the squared-up, cleared equations are roots of the system as it was given.

    Not genuine are excess roots of an overdetermined system, and points where a denominator vanishes that was
    cleared.

    Parameters
    ----------
    system : System
    points : array, shape (points, unknowns)
    values : values of the parameters

    Returns
    -------
    ndarray of bool, shape (points,)

    Examples
    --------
    >>> from sympy import symbols
    >>> x, y = symbols("x y")
    >>> genuine(System([(x**2 - 1) / (x - 1), y - x], [x, y]), [[1, 1], [-1, -1]]).tolist()
    [False, True]
    """
    points = np.asarray(points, np.complex128).reshape(-1, len(system.unknowns))
    rows, columns = system.size
    good = np.ones(len(points), bool)
    if rows > columns:
        good &= satisfied(system, points, values)
    if system.poles:
        poles = System(system.poles, system.unknowns, system.parameters)
        good &= ~np.any(_near_zero(poles, points, system.values_of(values), NEAR), axis=1)
    return good


def _near_zero(system: System, points: np.ndarray, values: np.ndarray, near: float) -> np.ndarray:
    """Where an equation vanishes, to first order, shape (points, equations)."""
    if not len(points):
        return np.zeros((0, system.size[0]), bool)
    F, J = evaluate(system.jacobian_program, points, values)
    size = np.maximum(np.abs(points), 1e-3 * np.abs(points).max(axis=1, initial=1.0)[:, None])
    with np.errstate(all="ignore"):
        # In units of the size of each unknown, so that one large unknown does not hide another.
        slope = np.abs(J * size[:, None, :]).max(axis=2)
        # Where f and its gradient both vanish to rounding, nothing can be said against the point.
        typical = np.maximum(slope.max(axis=1, keepdims=True), 1.0)
        silent = (np.abs(F) <= near**2 * typical) & (slope <= near * typical)
        return (np.abs(F) <= near * slope) | silent
