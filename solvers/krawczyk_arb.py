"""Krawczyk's test for one point in Arb balls of any precision; see `solvers.krawczyk` for the theorem.

On rectangles the test is K(X) = x - C F(x) + (I - C J(X)) (X - x) inside the interior of X: a product of
rectangles is a real box of twice the dimension, symmetric about its centre, so the same argument holds.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from solvers.arithmetic import balls
from solvers.arithmetic.discs import U
from solvers.krawczyk import INFLATIONS, NEAR, NEAR_ORIGIN, Question

#: Newton steps in Arb at one precision; from nine digits, 1024 bits need six.
ARB_STEPS = 12
#: Newton converges at least this fast to a simple root near which it starts; to a double root the ratio is 1/2.
ARB_RATIO = 0.3
#: Steps that stop shrinking above this relative length are no rounding error: there is no simple root.
LONG_STEP = 1e-6
#: From this precision on, a Jacobian whose condition takes three quarters of the bits counts as singular: a start
#: of 53 bits does not tell roots of a condition of 10^57 apart, and a singular one would ask for ever more bits.
SINGULAR_BITS = 256


@dataclass(frozen=True)
class ArbBox:
    """What Arb proved about one point.

    Attributes
    ----------
    bits : int
        The precision.
    inclusion, unique : list of flint.acb
        The root lies in the first box; no other root lies in the second, which holds the first.
    """

    bits: int
    inclusion: list[Any]
    unique: list[Any]

    def disc(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Midpoint (complex), inclusion radii and uniqueness radii in double precision, rounded the safe way."""
        from flint import acb, arb

        mid = np.array([complex(float(z.real.mid()), float(z.imag.mid())) for z in self.inclusion])
        radii, unique = np.empty(len(mid)), np.empty(len(mid))
        for i, (inner, outer) in enumerate(zip(self.inclusion, self.unique)):
            centre = acb(mid[i])
            radii[i] = float((inner - centre).abs_upper()) * (1 + 4 * U) + 2.0**-1000
            # The largest disc round mid inside the rectangle `outer`.
            reach = [
                arb(part.rad()) - abs(part.mid() - middle)
                for part, middle in ((outer.real, centre.real), (outer.imag, centre.imag))
            ]
            unique[i] = max(0.0, min(float(part.lower()) * (1 - 4 * U) for part in reach))
        return mid, radii, unique


def krawczyk_arb(question: Question, point: Sequence[Any], bits: int) -> ArbBox | None:
    """Test one point in Arb at a precision.

    Parameters
    ----------
    point : sequence of complex or flint.acb
        Taken as exact.
    bits : int

    Returns
    -------
    ArbBox, or None if the test failed at this precision.

    Raises
    ------
    NotNearRoot
        Newton's method does not converge from the point to a simple root beside it; more bits will not help.
    """
    from flint import ctx

    with ctx.workprec(bits):
        constants = [balls.ball(value) for value in question.jacobian.constants]
        parameters = [balls.ball(value) for value in question.parameters]
        pattern, shape = question.jacobian.pattern.tolist(), (question.size, question.size)

        def run(z: Sequence[Any]) -> tuple[Any, Any]:
            out = question.jacobian.replay(z, parameters, constants=constants)
            return balls.column(out["F"]), balls.dense(out["J"], pattern, shape)

        try:
            x = _newton_arb(run, point, bits)
            return _test_arb(run, x, bits)
        except ZeroDivisionError:  # a Jacobian that is singular to this precision
            return None


class NotNearRoot(ArithmeticError):
    """Newton's method does not converge from a point to a simple root beside it."""


def _length(vector: Any) -> float:
    return max(float(z.abs_upper()) for z in vector.entries())


def _is_rounding(z: Any) -> bool:
    """Whether a value is no larger than its error; an imaginary part may be tiny and exact beside a real one of noise.

    >>> from flint import acb, arb
    >>> _is_rounding(acb(arb(0, 1e-30), 1e-120)), _is_rounding(acb(1e-20, 0))
    (True, False)
    """
    return bool(abs(z.mid()) <= 2 * max(z.real.rad(), z.imag.rad()))


def _newton_arb(run: Any, point: Sequence[Any], bits: int) -> list[Any]:
    from flint import acb

    x = [acb(z) for z in point]
    first, last = None, None
    for _ in range(ARB_STEPS):
        F, J = run(x)
        zeros = [_is_rounding(z) for z in F.entries()]
        if all(zeros):  # a root as far as these bits can tell
            return x
        # Steps out of rounding errors say nothing about the point: more bits will.
        doubt = ZeroDivisionError if any(zeros) else NotNearRoot
        dx = J.mid().solve(F.mid(), algorithm="approx")
        x = [(z - d).mid() for z, d in zip(x, dx.entries())]
        length, size = _length(dx), max(float(abs(z)) for z in x)
        if not np.isfinite(length):
            raise doubt
        if first is None:
            first = length
            if length > NEAR * size and length > NEAR_ORIGIN:
                raise doubt
        if length <= size * 2.0 ** (-0.6 * bits):  # the error left is the square of this
            return x
        if last is not None and length > ARB_RATIO * last:
            raise doubt if length > LONG_STEP * size else ZeroDivisionError
        last = length
    raise ZeroDivisionError


def _test_arb(run: Any, x: list[Any], bits: int) -> ArbBox | None:
    """K(X) = x - C F(x) + (I - C J(X)) (X - x) inside the interior of X, on rectangles."""
    from flint import acb, acb_mat, arb

    k = len(x)
    identity = acb_mat([[int(i == j) for j in range(k)] for i in range(k)])
    F, J = run(x)
    C = J.mid().solve(identity, algorithm="approx").mid()
    CF = (C * F).entries()
    largest = max((abs(z).upper() for z in x), default=arb(1))
    scale = largest if largest > 0 else arb(1)
    half = arb(2) ** (-bits // 2)
    # Radii about the square root of the rounding error: the image's radius is about their square.
    radii = [(abs(z).upper() + scale * arb(2) ** -30) * half + 16 * c.abs_upper() for z, c in zip(x, CF)]
    for _ in range(INFLATIONS):
        radii = [radius.upper() for radius in radii]
        around = [acb(arb(0, radius), arb(0, radius)) for radius in radii]
        X = [z + step for z, step in zip(x, around)]
        A = identity - C * run(X)[1]
        moved = (A * balls.column(around)).entries()
        image = [z - c + step for z, c, step in zip(x, CF, moved)]
        if all(outer.contains_interior(inner) for outer, inner in zip(X, image)):
            return ArbBox(bits, image, X)
        radii = [8 * max(radius, (c + s).abs_upper()) for radius, c, s in zip(radii, CF, moved)]
    if bits >= SINGULAR_BITS and _length(C) * _length(J) > 2.0 ** (0.75 * bits):
        raise NotNearRoot
    return None
