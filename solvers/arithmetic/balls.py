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


def dense(entries: Sequence[Any], pattern: Sequence[Sequence[int]], size: int) -> Any:
    """Sparse entries as a square `flint.acb_mat`."""
    from flint import acb, acb_mat

    matrix = acb_mat([[acb(0)] * size for _ in range(size)])
    for (i, j), entry in zip(pattern, entries):
        matrix[int(i), int(j)] = entry
    return matrix
