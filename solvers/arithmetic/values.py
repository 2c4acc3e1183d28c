"""The exact value of a number, whatever its kind.

Certificates and refinement speak about the system as it was given: a float is the dyadic rational that it
stores, a rational number is itself, and nothing is rounded on the way.
"""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np

from solvers.from_sympy import InvalidSystem, exact_number
from solvers.tape import Exact, exact

if TYPE_CHECKING:
    from solvers.system import System


def exact_value(number: Any) -> Exact:
    """The exact (real part, imaginary part) of a number as fractions.

    Parameters
    ----------
    number : int, float, complex, Fraction, numpy scalar, SymPy number, mpmath number or flint rational
        Irrational SymPy numbers are rounded to 60 digits, as they are in the equations of a system.

    Raises
    ------
    InvalidSystem
        The number is not finite, or not a number at all.

    Examples
    --------
    >>> exact_value(Fraction(1, 3))
    (Fraction(1, 3), Fraction(0, 1))
    >>> exact_value(0.25 - 1j)
    (Fraction(1, 4), Fraction(-1, 1))
    """
    try:
        if isinstance(number, str):  # complex() would read it; a text for a number is a mistake
            raise ValueError
        if isinstance(number, (int, float, complex, Fraction, np.number)):
            return exact(number)
        if hasattr(number, "as_real_imag"):  # SymPy
            return exact_number(number)
        if hasattr(number, "_mpc_"):
            return _mpf_fraction(number.real), _mpf_fraction(number.imag)
        if hasattr(number, "_mpf_"):
            return _mpf_fraction(number), Fraction(0)
        if hasattr(number, "p") and hasattr(number, "q"):  # flint fmpq
            return Fraction(int(number.p), int(number.q)), Fraction(0)
        return exact(complex(number))
    except (TypeError, ValueError, OverflowError, AttributeError) as error:
        if isinstance(error, InvalidSystem):
            raise
        raise InvalidSystem(f"{number!r} is not a finite number") from None


def _mpf_fraction(number: Any) -> Fraction:
    sign, mantissa, exponent, _ = number._mpf_
    if not mantissa and exponent:  # mpmath writes infinities and NaN with an empty mantissa
        raise ValueError
    return (-1) ** sign * Fraction(int(mantissa)) * Fraction(2) ** int(exponent)


def exact_parameters(system: System, parameters: Any = None) -> tuple[Exact, ...]:
    """Parameter values in the order of ``system.parameters``, to the last bit.

    Parameters
    ----------
    parameters : mapping from symbol (or its name) to number, or sequence of numbers, or None
        Numbers of any kind that :func:`exact_value` takes.

    Raises
    ------
    InvalidSystem
        A value is missing, is not finite, or there are too many.

    Examples
    --------
    >>> from sympy import Rational, symbols
    >>> from solvers.system import System
    >>> x, p = symbols("x p")
    >>> exact_parameters(System([x**2 - p], [x], [p]), {p: Rational(1, 3)})
    ((Fraction(1, 3), Fraction(0, 1)),)
    """
    if parameters is None:
        parameters = ()
    if isinstance(parameters, Mapping):
        by_name = {str(key): value for key, value in parameters.items()}
        missing = [str(symbol) for symbol in system.parameters if str(symbol) not in by_name]
        if missing:
            raise InvalidSystem(f"no value for the parameter {missing[0]}; give all of {system.parameters}")
        parameters = [by_name[str(symbol)] for symbol in system.parameters]
    values = tuple(exact_value(value) for value in parameters)
    if len(values) != len(system.parameters):
        raise InvalidSystem(
            f"{len(values)} parameter values were given, the system has {len(system.parameters)} parameters"
        )
    return values


def rounded(values: tuple[Exact, ...]) -> np.ndarray:
    """Exact values rounded to double precision, complex array of shape (n,)."""
    return np.array([complex(float(re), float(im)) for re, im in values], dtype=np.complex128)
