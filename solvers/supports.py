"""The terms of a system: its equations expanded into exponents and exact coefficients.

A system stays a straight-line program everywhere else. Here, and only here, it is multiplied out, because a
mixed volume is a matter of exponents. The program is replayed over exact sparse polynomials (FLINT), with a
guard on their size: a factored kinematic equation of a few lines may hold millions of terms.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np

from solvers.degrees import PRIME, residue
from solvers.from_sympy import InvalidSystem
from solvers.system import System
from solvers.tape import ADD, FMA, FMS, FNMA, INV, MUL, NEG, SQR, SUB, Exact, Program, rounded

#: More terms than this in one product are refused: at 1e6 terms the mixed cells are out of reach anyway.
TERM_LIMIT = 1_000_000
#: Seed of the residues that stand for parameters without values; any seed gives the same supports.
_GENERIC_SEED = 314159


class TooManyTerms(InvalidSystem):
    """An equation has too many terms to be expanded; it can be solved by starts that do not expand it."""


@dataclass(frozen=True, eq=False)
class Terms:
    """The expanded equations of a system.

    Attributes
    ----------
    supports : tuple of ndarray, each of shape (terms, unknowns), int64
        The exponents of each equation, in decreasing lexicographic order.
    exact : tuple of tuple of (Fraction, Fraction)
        The exact coefficients (real part, imaginary part), in the order of the supports.
    """

    supports: tuple[np.ndarray, ...]
    exact: tuple[tuple[Exact, ...], ...]

    @cached_property
    def coefficients(self) -> tuple[np.ndarray, ...]:
        """The coefficients rounded to complex128, one array of shape (terms,) for each equation.

        Raises InvalidSystem if one is too large for that.
        """
        rows = []
        for number, row in enumerate(self.exact):
            try:
                rows.append(np.array([rounded(value) for value in row], dtype=np.complex128))
            except InvalidSystem as error:
                raise InvalidSystem(f"equation {number}, multiplied out: {error}") from None
        return tuple(rows)

    @property
    def count(self) -> int:
        """The number of terms of all equations together."""
        return sum(len(support) for support in self.supports)

    def evaluate(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Values (n, equations) and Jacobians (n, equations, unknowns) at points (n, unknowns) with no zeros.

        >>> from sympy import symbols
        >>> x, y = symbols("x y")
        >>> [part.tolist() for part in terms(System([x**2 - y], [x, y])).evaluate(np.array([[3.0, 2.0]]))]
        [[[(7+0j)]], [[[(6+0j), (-1+0j)]]]]
        """
        values = [np.prod(points[:, None, :] ** s, axis=2) * row for s, row in zip(self.supports, self.coefficients)]
        slopes = [value @ s for s, value in zip(self.supports, values)]
        return np.stack([v.sum(axis=1) for v in values], axis=1), np.stack(slopes, axis=1) / points[:, None, :]

    def __repr__(self) -> str:
        return f"Terms({'+'.join(str(len(s)) for s in self.supports)} terms)"


def terms(system: System, parameters: Any = None, limit: int = TERM_LIMIT) -> Terms:
    """Exponents and exact coefficients of a system at given parameters.

    Parameters
    ----------
    system : System
    parameters : mapping or sequence of numbers
        One value for each parameter; doubles are taken as the binary fractions that they are.
    limit : int
        Largest number of terms of any polynomial met on the way.

    Returns
    -------
    Terms

    Raises
    ------
    TooManyTerms
        A product on the way would have more terms than `limit`.

    Examples
    --------
    >>> from sympy import symbols
    >>> x, y = symbols("x y")
    >>> expanded = terms(System([(x + y) ** 2 - x**2, x * y - 1], [x, y]))
    >>> expanded.supports[0].tolist(), expanded.coefficients[0].tolist()
    ([[1, 1], [0, 2]], [(2+0j), (1+0j)])
    """
    values = system.values_of(parameters)
    # A solve asks for the same terms three times: for its start, for its scales and for its target.
    expanded = system.once(("terms", values.tobytes()), lambda: _terms(system, values, limit))
    if max(map(len, expanded.supports), default=0) > limit:
        raise TooManyTerms(_too_many(limit))
    return expanded


def _terms(system: System, values: np.ndarray, limit: int) -> Terms:
    import flint

    numbers = [(Fraction(v.real), Fraction(v.imag)) for v in values.tolist()]
    count = len(system.unknowns)
    ring = flint.fmpq_mpoly_ctx.get(_names(count), flint.Ordering.lex)

    def part(value: Fraction) -> Any:
        return ring.constant(flint.fmpq(value.numerator, value.denominator))

    def lift(value: Exact) -> Any:
        return _Gaussian(part(value[0]), part(value[1]))

    generators: list[Any] = list(ring.gens())
    if not any(im for _, im in (*numbers, *system.program.constants)):
        rows = _expand(system.program, generators, [part(re) for re, _ in numbers], lambda v: part(v[0]), limit)
        rows = [_Gaussian(row, ring.constant(0)) for row in rows]
    else:
        generators = [_Gaussian(g, ring.constant(0)) for g in generators]
        rows = _expand(system.program, generators, [lift(v) for v in numbers], lift, limit)
    if max(map(len, rows), default=0) > limit:
        raise TooManyTerms(_too_many(limit))
    supports, coefficients = zip(*(row.terms(count) for row in rows)) if rows else ((), ())
    return Terms(supports, coefficients)


def generic_supports(system: System, limit: int = TERM_LIMIT) -> tuple[np.ndarray, ...]:
    """The exponents of each equation when the parameters are generic, shape (terms, unknowns) each.

    The coefficients are followed in a prime field with random residues for the parameters, which is fast; a
    term is overlooked with probability below degree / 2^31. Raises TooManyTerms as :func:`terms` does.

    >>> from sympy import symbols
    >>> x, y, p = symbols("x y p")
    >>> [s.tolist() for s in generic_supports(System([(x + p) ** 2 - p**2 * (1 + y)], [x, y], [p]))]
    [[[2, 0], [1, 0], [0, 1]]]
    """
    import flint

    rng = np.random.default_rng(_GENERIC_SEED)
    count = len(system.unknowns)
    ring = flint.nmod_mpoly_ctx.get(_names(count), PRIME, flint.Ordering.lex)  # type: ignore[call-arg, arg-type]

    def lift(value: Exact) -> Any:
        return ring.constant(residue(value))

    parameters = [ring.constant(int(rng.integers(1, PRIME))) for _ in system.parameters]
    rows = _expand(system.program, list(ring.gens()), parameters, lift, limit)
    supports = []
    for row in rows:
        keys = sorted((tuple(map(int, m)) for m in row.monoms()), reverse=True)
        supports.append(np.array(keys, dtype=np.int64).reshape(-1, count))
    return tuple(supports)


def degrees_of(supports: Sequence[np.ndarray], group: Sequence[int]) -> list[int]:
    """The degree of each equation in a group of unknowns, read off its exponents; -1 for the zero polynomial.

    >>> degrees_of([np.array([[2, 1], [0, 3]])], [0])
    [2]
    """
    return [int(s[:, list(group)].sum(axis=1).max()) if len(s) else -1 for s in supports]


class _Gaussian:
    """A polynomial with coefficients in Q(i), as real and imaginary part; real ones cost no more than over Q."""

    __slots__ = ("im", "re")

    def __init__(self, re: Any, im: Any) -> None:
        self.re = re
        self.im = im

    def __len__(self) -> int:
        return max(len(self.re), len(self.im))

    def __add__(self, other: _Gaussian) -> _Gaussian:
        return _Gaussian(self.re + other.re, self.im + other.im)

    def __neg__(self) -> _Gaussian:
        return _Gaussian(-self.re, -self.im)

    def __mul__(self, other: _Gaussian) -> _Gaussian:
        if not self.im and not other.im:
            return _Gaussian(self.re * other.re, self.im)
        return _Gaussian(
            self.re * other.re - self.im * other.im,
            self.re * other.im + self.im * other.re,
        )

    def terms(self, unknowns: int) -> tuple[np.ndarray, tuple[Exact, ...]]:
        """Exponents in decreasing order, and coefficients."""
        parts = [dict(zip(part.monoms(), map(_fraction, part.coeffs()))) for part in (self.re, self.im)]
        zero = Fraction(0)
        # Polynomials keep their terms in this order themselves.
        keys = sorted({**parts[0], **parts[1]}, reverse=True) if parts[1] else list(parts[0])
        values = tuple((parts[0].get(key, zero), parts[1].get(key, zero)) for key in keys)
        return np.array(keys, dtype=np.int64).reshape(-1, unknowns), values

    def inverse(self) -> _Gaussian:
        norm = self.re * self.re + self.im * self.im
        return _Gaussian(self.re / norm, -self.im / norm)


def _fraction(value: Any) -> Fraction:
    return Fraction(int(value.p), int(value.q))


def _names(count: int) -> tuple[str, ...]:
    return tuple(f"x{k}" for k in range(count))


def _expand(program: Program, unknowns: list[Any], parameters: list[Any], lift: Any, limit: int) -> list[Any]:
    """Replay a program over polynomials.

    A sum of many terms arrives as a chain of additions; adding them one by one would copy the growing sum
    each time. So a slot may hold a list of summands, which is added up as a balanced tree when it is needed.
    """
    outputs = program.outputs["F"].tolist()
    zero, one = lift((Fraction(0), Fraction(0))), lift((Fraction(1), Fraction(0)))
    slots: list[Any] = [*unknowns, *parameters, *[zero] * len(parameters)]
    slots += [lift(value) for value in program.constants]
    uses = _uses(program, outputs)

    def value(slot: int) -> Any:
        held = slots[slot]
        if type(held) is list:
            held = slots[slot] = _tree_sum(held)
        return held

    def summands(slot: int) -> list[Any]:
        held = slots[slot]
        if type(held) is not list:
            return [held]
        if uses[slot] == 1:
            slots[slot] = None
            return held
        return [value(slot)]

    def product(a: int, b: int) -> Any:
        left, right = slots[a], slots[b]
        if type(left) is list or type(right) is list:
            left, right = value(a), value(b)
        most = len(left) * len(right)
        if most > 50 * limit:
            raise TooManyTerms(_too_many(limit))
        result = left * right
        if most > limit and len(result) > limit:
            raise TooManyTerms(_too_many(limit))
        return result

    for op, a, b, c in program.code.tolist():
        if op in (MUL, SQR):
            result: Any = product(a, b if op == MUL else a)
        elif op == NEG:
            result = -value(a)
        elif op == INV:
            held = value(a)
            result = held.inverse() if isinstance(held, _Gaussian) else one / held
        elif op == ADD:
            first, second = summands(a), summands(b)
            if len(first) < len(second):
                first, second = second, first
            first += second
            result = first
        elif op == SUB:
            result = summands(a)
            result.append(-value(b))
        elif op == FMA:
            result = summands(c)
            result.append(product(a, b))
        elif op == FMS:
            result = [product(a, b), -value(c)]
        elif op == FNMA:
            result = summands(c)
            result.append(-product(a, b))
        else:
            raise AssertionError(f"instruction {op}")
        slots.append(result)
    return [value(k) for k in outputs]


def _uses(program: Program, outputs: list[int]) -> list[int]:
    """How often each slot is read; an output counts twice, so that its summands are never given away."""
    from solvers.tape import ARITY

    uses = [0] * (program.inputs + len(program.code))
    for op, *operands in program.code.tolist():
        for slot in operands[: ARITY[op]]:
            uses[slot] += 1
    for slot in outputs:
        uses[slot] += 2
    return uses


def _tree_sum(summands: list[Any]) -> Any:
    while len(summands) > 1:
        paired = [a + b for a, b in zip(summands[::2], summands[1::2])]
        if len(summands) % 2:
            paired.append(summands[-1])
        summands = paired
    return summands[0]


def _too_many(limit: int) -> str:
    return (
        f"the equations have more than {limit} terms when multiplied out; "
        "use a total-degree or multihomogeneous start, which keep them factored"
    )
