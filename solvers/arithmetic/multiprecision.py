"""mpmath numbers: the tape at any precision, and the way from Arb's numbers to mpmath's.

The precision is mpmath's own, ``mpmath.mp.prec`` in bits; use ``mpmath.workprec(bits)`` round a computation.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from solvers.tape import Exact, Program


def number(value: Exact) -> Any:
    """An exact number rounded to mpmath's precision (`mpmath.mpc`).

    Examples
    --------
    >>> import mpmath
    >>> from fractions import Fraction
    >>> with mpmath.workdps(30):
    ...     print(number((Fraction(1, 3), Fraction(0))).real)
    0.333333333333333333333333333333
    """
    import mpmath

    return mpmath.mpc(*(mpmath.mpf(part.numerator) / part.denominator for part in value))


def replay(program: Program, unknowns: Sequence[Any], parameters: Sequence[Exact] = ()) -> dict[str, list[Any]]:
    """All outputs of a program over mpmath numbers, with exact parameters and constants.

    Parameters
    ----------
    unknowns : sequence of mpmath numbers
    parameters : sequence of exact values
    """
    return program.replay(
        unknowns,
        [number(value) for value in parameters],
        constants=[number(value) for value in program.constants],
    )


def from_ball(z: Any) -> Any:
    """The midpoint of an Arb ball (`flint.acb`) as an `mpmath.mpc`, to the last bit."""
    import mpmath
    from mpmath.libmp import from_man_exp

    parts = []
    for part in (z.real.mid(), z.imag.mid()):
        mantissa, exponent = part.man_exp()
        parts.append(mpmath.mp.make_mpf(from_man_exp(int(mantissa), int(exponent))))
    return mpmath.mp.make_mpc((parts[0]._mpf_, parts[1]._mpf_))
