"""Arb balls: the tape over rigorous complex numbers of any precision (python-flint).

The precision is python-flint's own, ``flint.ctx.prec`` in bits; use ``flint.ctx.workprec(bits)`` round a
computation.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from solvers.tape import Exact, Program


def ball(value: Exact) -> Any:
    """An exact number as an Arb ball at the current precision (`flint.acb`); exact where the bits suffice.

    Examples
    --------
    >>> from fractions import Fraction
    >>> b = ball((Fraction(1, 4), Fraction(0)))
    >>> b.is_exact()
    True
    """
    from flint import acb, arb, fmpq

    re, im = (arb(fmpq(part.numerator, part.denominator)) for part in value)
    return acb(re, im)


def replay(
    program: Program, unknowns: Sequence[Any], parameters: Sequence[Exact], constants: Sequence[Any] | None = None
) -> dict[str, list[Any]]:
    """All outputs of a program over Arb balls, with exact parameters and constants.

    Parameters
    ----------
    unknowns : sequence of flint.acb
    parameters : sequence of exact values
    constants : sequence of flint.acb, optional
        Balls of the program's constants, when a caller evaluates many points at one precision.
    """
    if constants is None:
        constants = [ball(value) for value in program.constants]
    return program.replay(unknowns, [ball(value) for value in parameters], constants=constants)


def dense(entries: Sequence[Any], pattern: Sequence[Sequence[int]], shape: tuple[int, int]) -> Any:
    """Sparse entries as a `flint.acb_mat` of the given shape."""
    from flint import acb_mat

    matrix = acb_mat(*shape)
    for (i, j), entry in zip(pattern, entries):
        matrix[i, j] = entry
    return matrix


def column(values: Sequence[Any]) -> Any:
    """Balls as a `flint.acb_mat` with one column."""
    from flint import acb_mat

    return acb_mat([[value] for value in values])


def least_squares(J: Any, F: Any) -> Any:
    """An approximate solution of J dx = F, without error bounds; least squares for more rows than columns.

    The normal equations double the digits that an ill-conditioned J costs; here precision is cheap.

    Raises
    ------
    ZeroDivisionError
        The matrix is singular.
    """
    if J.nrows() > J.ncols():
        adjoint = J.conjugate().transpose()
        J, F = adjoint * J, adjoint * F
    dx = J.solve(F, algorithm="approx")
    if not all(z.is_finite() for z in dx.entries()):
        raise ZeroDivisionError("singular matrix")
    return dx


def sum_of(hi: complex, lo: complex) -> Any:
    """hi + lo exactly (`flint.acb`), for a double-double."""
    from flint import acb, ctx

    with ctx.workprec(2200):  # two doubles of any exponents
        return acb(complex(hi)) + acb(complex(lo))
