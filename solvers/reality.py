"""Is a system real, decided on its exact coefficients and parameter values?

A root can be proved real only if conjugation maps the roots of the system to roots. With all coefficients and
parameters real it does. A system in isotropic coordinates (z and its conjugate as two unknowns) is real in
another sense: conjugating all numbers and exchanging the two unknowns of each pair maps its equations to
themselves.
"""

from __future__ import annotations

import random
from collections.abc import Sequence
from typing import Any

from solvers.from_sympy import InvalidSystem
from solvers.system import System
from solvers.tape import Exact

#: A prime that is 3 modulo 4, so that the integers with an imaginary unit form a field modulo it, in which the
#: Frobenius map is conjugation.
PRIME = 2**127 - 1


def conjugation_order(system: System, pairs: Sequence[tuple[Any, Any]]) -> list[int]:
    """The permutation of the unknowns that exchanges each pair.

    Raises
    ------
    InvalidSystem
        A pair names something that is not an unknown, or an unknown twice.
    """
    where = {str(symbol): k for k, symbol in enumerate(system.unknowns)}
    order = list(range(len(where)))
    seen: set[int] = set()
    for pair in pairs:
        try:
            first, second = (where[str(symbol)] for symbol in pair)
        except (KeyError, ValueError, TypeError):
            raise InvalidSystem(f"the conjugate pair {pair} is not a pair of unknowns") from None
        if first == second or {first, second} & seen:
            raise InvalidSystem(f"the conjugate pair {pair} uses an unknown twice")
        seen |= {first, second}
        order[first], order[second] = second, first
    return order


def is_real(system: System, parameters: Sequence[Exact], order: Sequence[int] | None = None) -> bool:
    """Whether conjugation maps the equations at these parameter values to themselves.

    Parameters
    ----------
    parameters : sequence of exact values
    order : sequence of int, optional
        With it, conjugation also permutes the unknowns. The equations may change places and signs.

    Returns
    -------
    bool
        Without `order`, True means that every coefficient and parameter is real: a proof, but complex
        coefficients that happen to cancel are not seen through. With `order`, the polynomials are compared at a
        random point of a field of 2^254 elements: different ones agree there with a probability below
        (degree) / 2^254 (Schwartz, "Fast probabilistic algorithms for verification of polynomial identities",
        J. ACM 1980).

    Examples
    --------
    >>> from sympy import I, symbols
    >>> z, w = symbols("z w")
    >>> circle = System([z * w - 1, z + w - 1], [z, w])
    >>> is_real(circle, ()), is_real(circle, (), [1, 0])
    (True, True)
    >>> is_real(System([z * w - 1, z + I * w - 1], [z, w]), (), [1, 0])
    False
    """
    if order is None:
        return all(value[1] == 0 for value in (*system.program.constants, *parameters))
    rng = random.Random(127)
    point = [_Residue(rng.randrange(PRIME), rng.randrange(PRIME)) for _ in system.unknowns]
    here = _values(system, parameters, point)
    there = [value.conjugate() for value in _values(system, parameters, [point[k].conjugate() for k in order])]
    for value in there:
        matches = [k for k, other in enumerate(here) if other in (value, -value)]
        if not matches:
            return False
        here.pop(matches[0])
    return True


def _values(system: System, parameters: Sequence[Exact], point: Sequence[_Residue]) -> list[_Residue]:
    constants = [_Residue.of(value) for value in system.program.constants]
    numbers = [_Residue.of(value) for value in parameters]
    return system.program.replay(point, numbers, constants=constants)["F"]


class _Residue:
    """a + b i modulo the prime."""

    __slots__ = ("a", "b")

    def __init__(self, a: int, b: int) -> None:
        self.a, self.b = a % PRIME, b % PRIME

    @classmethod
    def of(cls, value: Exact) -> _Residue:
        return cls(*(part.numerator * pow(part.denominator, -1, PRIME) for part in value))

    def conjugate(self) -> _Residue:
        return _Residue(self.a, -self.b)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Residue) and (self.a, self.b) == (other.a, other.b)

    def __hash__(self) -> int:
        return hash((self.a, self.b))

    def __neg__(self) -> _Residue:
        return _Residue(-self.a, -self.b)

    def __add__(self, other: _Residue) -> _Residue:
        return _Residue(self.a + other.a, self.b + other.b)

    def __sub__(self, other: _Residue) -> _Residue:
        return _Residue(self.a - other.a, self.b - other.b)

    def __mul__(self, other: _Residue) -> _Residue:
        return _Residue(self.a * other.a - self.b * other.b, self.a * other.b + self.b * other.a)

    def __rtruediv__(self, one: int) -> _Residue:
        scale = one * pow(self.a * self.a + self.b * self.b, -1, PRIME)
        return _Residue(self.a * scale, -self.b * scale)
