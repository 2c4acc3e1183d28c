"""Newton's method to as many digits as are wanted, for many approximate roots at once.

Up to sixteen digits: iterates and residuals in double-double, Jacobians and linear algebra in double precision
(iterative refinement; Higham, "Accuracy and Stability of Numerical Algorithms", §§ 12 and 25.2). More digits: all
of it in Arb numbers of that precision, without their error bounds, and the results as mpmath numbers.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import log2
from typing import Any

import numpy as np

from solvers.arithmetic import balls, double_double
from solvers.arithmetic.double_double import DoubleDouble
from solvers.arithmetic.multiprecision import from_ball
from solvers.arithmetic.values import exact_parameters
from solvers.from_sympy import InvalidSystem
from solvers.krawczyk import inverses
from solvers.system import System
from solvers.tape import Exact, Program

#: Digits that a double holds; with more asked for, the results are mpmath numbers.
DOUBLE_DIGITS = 16
#: Newton steps at one precision. From three digits, quadratic convergence needs five to reach thirty.
STEPS = 12
#: A Newton step below this (relative) leaves the Jacobian as it is: the next steps still gain eight digits each.
FROZEN_STEP = 1e-8
#: Newton stagnates when a step is not shorter than this share of the one before.
STAGNATION = 0.5
#: A point that Newton makes smaller than this share of itself converges to the origin.
AT_ORIGIN = 1e-8
#: Bits beyond those asked for, against cancellation in the residual; more are added when they do not do.
GUARD_BITS = 64
#: Times that the guard bits are doubled.
RAISES = 4


@dataclass(frozen=True, eq=False, repr=False)
class Refined:
    """Refined points and how good they are.

    Attributes
    ----------
    points : ndarray of complex, shape (n, k), or list of n mpmath column vectors (k, 1)
        An array up to sixteen digits, mpmath vectors for more.
    errors : ndarray of float, shape (n,)
        Estimated distance to the root divided by the root's largest coordinate: the last Newton step, or the
        rounding of the result if that is more. An estimate, not a proof; `solvers.certify` proves.
    converged : ndarray of bool, shape (n,)
        Whether the error is below 10^-digits (2^-52 for sixteen).
    digits : int
    """

    points: Any
    errors: np.ndarray
    converged: np.ndarray
    digits: int

    def __len__(self) -> int:
        return len(self.points)

    def __repr__(self) -> str:
        worst = f", largest relative error {np.nanmax(self.errors):.1e}" if len(self) else ""
        return f"Refined({int(self.converged.sum())} of {len(self)} points to {self.digits} digits{worst})"


def refine(system: System, points: Any, parameters: Any = None, digits: int = DOUBLE_DIGITS) -> Refined:
    """Sharpen approximate roots by Newton's method to any number of digits.

    Parameters
    ----------
    system : System
        With at least as many equations as unknowns; with more, Gauss-Newton.
    points : Solutions, or array of complex, shape (n, k)
    parameters : mapping or sequence of numbers, optional
        Default: ``points.parameters``. Taken exactly, so that digits beyond the sixteenth mean something.
    digits : int
        Decimal digits wanted, relative to the largest coordinate of each point.

    Returns
    -------
    Refined

    Raises
    ------
    InvalidSystem
        Fewer equations than unknowns, parameter values missing, or points of another shape.
    ValueError
        `digits` is not a positive whole number.

    Notes
    -----
    Multiple roots converge slowly and are reported as not converged.

    Examples
    --------
    >>> from sympy import symbols
    >>> x = symbols("x")
    >>> refined = refine(System([x**2 - 2], [x]), [[1.4]], digits=40)
    >>> import mpmath
    >>> mpmath.nstr(refined.points[0][0].real, 40)
    '1.41421356237309504880168872420969807857'
    """
    if isinstance(digits, bool) or int(digits) != digits or digits < 1:
        raise ValueError(f"digits must be a positive whole number, not {digits!r}")
    equations, unknowns = system.size
    if equations < unknowns:
        raise InvalidSystem(f"{equations} equations do not determine {unknowns} unknowns: nothing to refine")
    if parameters is None:
        parameters = getattr(points, "parameters", None)
    exact = exact_parameters(system, parameters)
    start = np.asarray(getattr(points, "points", points), dtype=np.complex128)
    if start.size == 0:
        start = start.reshape(0, unknowns)
    if start.ndim != 2 or start.shape[1] != unknowns:
        raise InvalidSystem(f"points of shape {start.shape} were given; the shape must be (n, {unknowns})")
    jacobian = system.jacobian_program
    x, errors = newton_double_double(system.program, jacobian, DoubleDouble(start), DoubleDouble.of(exact))
    if digits <= DOUBLE_DIGITS:
        errors = np.maximum(errors, 2.0**-53)
        return Refined(x.hi, errors, errors <= max(10.0**-digits, 2.0**-52), int(digits))
    vectors, errors = _refine_many_digits(jacobian, x, exact, int(digits))
    return Refined(vectors, errors, errors <= 10.0**-digits, int(digits))


def newton_double_double(
    residual: Program, jacobian: Program, points: DoubleDouble, parameters: DoubleDouble, floor: float = 0.0
) -> tuple[DoubleDouble, np.ndarray]:
    """Newton's method in double-double over lanes.

    Parameters
    ----------
    residual : Program
        Output "F".
    jacobian : Program
        Outputs "F" and "J".
    points : DoubleDouble, shape (n, k)
    parameters : DoubleDouble, shape (parameters,) or (n, parameters)
    floor : float
        What is smaller counts as this large: nothing is near the origin relative to its own size.

    Returns
    -------
    points : DoubleDouble, shape (n, k)
    errors : ndarray, shape (n,)
        Last Newton step relative to the largest coordinate; infinite where Newton broke down.
    """
    n, k = points.shape
    hi, lo = points.hi.copy(), points.lo.copy()
    errors = np.full(n, np.inf)
    start = np.maximum(np.abs(hi).max(axis=1, initial=0.0), floor)
    C = np.full((n, k, len(residual.outputs["F"])), np.nan, np.complex128)
    stale = np.ones(n, bool)  # whose Jacobian has to be found again
    active = np.flatnonzero(np.isfinite(hi).all(axis=1))
    with np.errstate(all="ignore"):
        for _ in range(STEPS):
            if not len(active):
                break
            fresh = active[stale[active]]
            C[fresh] = _left_inverses(jacobian, hi[fresh], _rows(parameters.hi, fresh))
            x = DoubleDouble(hi[active], lo[active])
            here = DoubleDouble(_rows(parameters.hi, active), _rows(parameters.lo, active))
            F = double_double.replay(residual, x, here)["F"]
            dx = np.matmul(C[active], F.hi[..., None])[..., 0]
            x = x - dx
            size = np.abs(x.hi).max(axis=1)
            # A point that all but vanishes is on its way to the origin, where nothing is relative to it.
            size = np.where(size > AT_ORIGIN * start[active], size, start[active])
            step = np.abs(dx).max(axis=1) / np.maximum(size, 1e-300)
            # Where rounding has taken over, a step is no longer shorter than the last: keep the better point.
            better = (step < STAGNATION * errors[active]) | ~np.isfinite(errors[active])
            better &= np.isfinite(step)
            kept = active[better]
            hi[kept], lo[kept], errors[kept] = x.hi[better], x.lo[better], step[better]
            stale[kept] = step[better] > FROZEN_STEP
            active = kept[step[better] > double_double.EPSILON]
    # The rounding of the sum x - dx itself.
    return DoubleDouble(hi, lo), np.maximum(errors, double_double.EPSILON)


def _rows(values: np.ndarray, index: np.ndarray) -> np.ndarray:
    return values[index] if np.ndim(values) == 2 else values


def _left_inverses(jacobian: Program, x: np.ndarray, parameters: np.ndarray) -> np.ndarray:
    from solvers.system import evaluate

    J = evaluate(jacobian, x, parameters)[1]
    if J.shape[1] == J.shape[2]:
        return inverses(J)
    return np.linalg.pinv(J) if np.isfinite(J).all() else np.full(J.transpose(0, 2, 1).shape, np.nan)


def _refine_many_digits(
    jacobian: Program, x: DoubleDouble, parameters: tuple[Exact, ...], digits: int
) -> tuple[list[Any], np.ndarray]:
    import mpmath

    vectors, errors = [], np.full(len(x.hi), np.inf)
    for index, (hi, lo) in enumerate(zip(x.hi, x.lo)):
        best = [balls.sum_of(a, b) for a, b in zip(hi, lo)]
        guard = GUARD_BITS
        for _ in range(RAISES if np.isfinite(hi).all() else 0):
            bits = int(digits * log2(10)) + guard
            point, error = _newton_arb(jacobian, best, parameters, bits, 10.0 ** -(digits + 2))
            if error < errors[index]:
                best, errors[index] = point, error
            if errors[index] <= 10.0**-digits:
                break
            guard *= 2
        vectors.append(mpmath.matrix([from_ball(z) for z in best]))
    return vectors, errors


def _newton_arb(
    jacobian: Program, point: list[Any], parameters: tuple[Exact, ...], bits: int, target: float
) -> tuple[list[Any], float]:
    """Newton's method at one precision: the last point and its relative step (inf if it broke down)."""
    from flint import ctx

    error = np.inf
    start = max(abs(z).upper() for z in point)
    with ctx.workprec(bits):
        constants = [balls.ball(value) for value in jacobian.constants]
        for _ in range(STEPS):
            out = balls.replay(jacobian, point, parameters, constants)
            J = balls.dense(out["J"], jacobian.pattern.tolist(), (len(out["F"]), len(point)))
            try:
                dx = balls.least_squares(J.mid(), balls.column(out["F"]).mid()).entries()
            except ZeroDivisionError:
                break
            moved = [(z - d).mid() for z, d in zip(point, dx)]
            size = max(abs(z).upper() for z in moved)
            size = size if size > AT_ORIGIN * start else start
            step = float((max(abs(d).upper() for d in dx) / size).mid()) if size > 0 else 0.0
            if not step < error:
                break
            point, error = moved, step
            if step <= target:
                break
    return point, error
