"""Exact numbers as text that other programs read."""

from __future__ import annotations

from fractions import Fraction

from solvers.from_sympy import InvalidSystem
from solvers.tape import Exact, approximately, double

#: Denominators up to this are written as fractions, which every format reads.
LARGEST_DENOMINATOR = 10**6
#: Decimal expansions up to this many digits are written in full; longer numbers are rounded to 17 digits.
LONGEST_EXPANSION = 60


def decimal(value: Fraction) -> str:
    """A number as an integer, a short fraction, an exact decimal, or (last choice) rounded to 17 digits.

    >>> decimal(Fraction(-3, 7)), decimal(Fraction(1, 2**30)), decimal(Fraction(5))
    ('-3/7', '0.000000000931322574615478515625', '5')

    Raises
    ------
    InvalidSystem
        No double is near: the programs that read the text would stop, or take it for zero.
    """
    if value.denominator <= LARGEST_DENOMINATOR and abs(value.numerator) < 10**15:
        return str(value)
    nearest = double(value)
    if nearest == 0:
        raise InvalidSystem(
            f"the number {approximately(value)} is too small for double precision and would be written as 0: "
            "multiply its equation by a power of ten, or measure the unknowns in other units"
        )
    digits = _expansion(value)
    return digits if digits is not None else f"{nearest:.17g}"


def _expansion(value: Fraction) -> str | None:
    rest, places = value.denominator, 0
    twos = (rest & -rest).bit_length() - 1
    rest >>= twos
    fives = 0
    while rest % 5 == 0:
        rest //= 5
        fives += 1
    places = max(twos, fives)
    if rest != 1 or places > LONGEST_EXPANSION:
        return None
    whole = str(abs(value.numerator) * 10**places // value.denominator).rjust(places + 1, "0")
    sign = "-" if value < 0 else ""
    text = f"{sign}{whole[:-places]}.{whole[-places:]}" if places else sign + whole
    return text if len(text) <= LONGEST_EXPANSION + 20 else None


def coefficient(value: Exact, unit: str) -> str:
    """A complex number in parentheses, with the given name of the imaginary unit; never empty.

    >>> coefficient((Fraction(1, 2), Fraction(-2)), "i"), coefficient((Fraction(3), Fraction(0)), "i")
    ('(1/2 - 2*i)', '3')
    """
    re, im = value
    if im == 0:
        return decimal(re)
    sign = "-" if im < 0 else "+"
    head = decimal(re) if re else "0"
    return f"({head} {sign} {decimal(abs(im))}*{unit})"
