"""Decimal data as exact SymPy numbers."""

from __future__ import annotations

from fractions import Fraction
from typing import Any


def decimal(text: str) -> Any:
    """A decimal number as an exact SymPy rational."""
    from sympy import Rational

    value = Fraction(text)
    return Rational(value.numerator, value.denominator)


def complex_decimal(re: str, im: str) -> Any:
    from sympy import I

    return decimal(re) + I * decimal(im)


def symbols(names: str) -> Any:
    import sympy

    return sympy.symbols(names)
