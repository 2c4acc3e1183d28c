"""Sums of terms as programs, written by arrays: equations, Jacobian and velocities at once.

A graph of nodes finds what any expressions have in common, at some microseconds a node. Of equations that are given
as exponents it is known beforehand: powers of unknowns, products of these from left to right, and sums. So whole
lists of instructions are written at once, and a system that has never been met is ready in less than a millisecond.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

import numpy as np

from solvers.tape import FMA, MUL, SQR, Exact, Program

#: Stands for the slot of the number one, which no instruction need read.
ONE = -1


def coefficient_program(supports: Sequence[np.ndarray]) -> Program:
    """The program of a system whose parameters are all its coefficients, equation after equation.

    Parameters
    ----------
    supports : sequence of n integer arrays, each of shape (terms, n)
        Exponents, none of them twice in an equation.

    Returns
    -------
    Program
        Outputs F, J (sparse, with its pattern) and Ft, all parameters moving.

    Examples
    --------
    >>> program = coefficient_program([np.array([[0], [2]])])  # a + b x²
    >>> program
    Program(1 unknowns, 5 instructions; F: 1, J: 1, Ft: 1)
    >>> program.replay([3.0], [5.0, 2.0], [0.1, 1.0])
    {'F': [23.0], 'J': [(12+0j)], 'Ft': [9.1]}
    """
    n, count = len(supports), sum(map(len, supports))
    writer = _Writer(n, count, _powers(supports), [])
    coefficients = n + np.arange(count)
    sums = writer.polynomials(supports, coefficients)
    pattern = np.argwhere(sums.gradient >= 0)
    return writer.program(
        {"F": sums.values, "J": sums.gradient[tuple(pattern.T)], "Ft": writer.sums(*sums.terms(coefficients + count))},
        pattern,
    )


def blended_program(
    supports: Sequence[np.ndarray], coefficients: Sequence[Sequence[Exact]], degrees: Sequence[int]
) -> Program:
    """a_i·(x_i^{d_i} − 1) + b_i·F_i(x) with the parameters a_1, …, a_n, b_1, …, b_n; outputs F, J and Ft.

    Parameters
    ----------
    supports : sequence of n integer arrays, each of shape (terms, n)
        Exponents of F, none of them twice in an equation.
    coefficients : sequence of n sequences of (Fraction, Fraction)
    degrees : sequence of int
        d_i, at least one.

    Examples
    --------
    >>> two = (Fraction(2), Fraction(0))
    >>> program = blended_program([np.array([[3]])], [[two]], [3])  # a (x³ - 1) + 2 b x³
    >>> program.replay([2.0], [1.0, 10.0], [0.0, 1.0])
    {'F': [(167+0j)], 'J': [(252+0j)], 'Ft': [(16+0j)]}
    """
    n = len(supports)
    one, minus_one = (Fraction(1), Fraction(0)), (Fraction(-1), Fraction(0))
    ends = [np.array([np.zeros(n, np.int64), degree * row]) for degree, row in zip(degrees, np.eye(n, dtype=np.int64))]
    everything = [*ends, *supports]
    values = [value for row in coefficients for value in row]
    writer = _Writer(n, 2 * n, _powers(everything), [minus_one, one, *values])
    own = writer.constants
    sums = writer.polynomials(everything, np.concatenate([np.tile(own[:2], n), own[2:]]))
    a, b = n + np.arange(n), 2 * n + np.arange(n)
    start, target = sums.values[:n], sums.values[n:]

    def blend(first: np.ndarray, second: np.ndarray) -> np.ndarray:
        return writer.emit(FMA, second, target, writer.emit(MUL, first, start))

    slopes, own_slope = sums.gradient[n:], np.diagonal(sums.gradient[:n])
    gradient = np.full((n, n), ONE)
    i, k = np.nonzero((slopes >= 0) & ~np.eye(n, dtype=bool))
    gradient[i, k] = writer.emit(MUL, b[i], slopes[i, k])
    diagonal = writer.emit(MUL, a, own_slope)
    there = np.flatnonzero(np.diagonal(slopes) >= 0)
    diagonal[there] = writer.emit(FMA, b[there], slopes[there, there], diagonal[there])
    np.fill_diagonal(gradient, diagonal)
    pattern = np.argwhere(gradient >= 0)
    outputs = {"F": blend(a, b), "J": gradient[tuple(pattern.T)], "Ft": blend(a + 2 * n, b + 2 * n)}
    return writer.program(outputs, pattern)


def _powers(supports: Sequence[np.ndarray]) -> list[int]:
    """The exponents above one: factors of derivatives."""
    return sorted({power for support in supports for power in support.ravel().tolist() if power > 1})


class _Sums:
    """Slots of polynomials and of their derivatives (shape (polynomials, unknowns), ONE where there is none)."""

    def __init__(self, values: np.ndarray, gradient: np.ndarray, group: np.ndarray, factor: np.ndarray) -> None:
        self.values, self.gradient = values, gradient
        self._group, self._factor = group, factor

    def terms(self, coefficients: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, int]:
        """The same terms with other coefficients, to be summed."""
        return self._group, coefficients, self._factor, len(self.values)


class _Writer:
    """Instructions, in blocks; `constants` are the slots of the constants given, `powers` those of whole numbers."""

    def __init__(self, unknowns: int, parameters: int, powers: list[int], constants: list[Exact]) -> None:
        self.unknowns, self.parameters = unknowns, parameters
        whole = [(Fraction(power), Fraction(0)) for power in (0, *powers)]
        self._values = [*whole, *constants]
        self.zero = unknowns + 2 * parameters
        self.powers = {power: self.zero + k for k, power in enumerate(powers, 1)}
        self._next = self.zero + len(self._values)
        self.constants = np.arange(self.zero + len(whole), self._next)
        self._blocks: list[np.ndarray] = []

    def emit(self, op: int | np.ndarray, a: np.ndarray, b: np.ndarray, c: np.ndarray | int = 0) -> np.ndarray:
        """One instruction for each row of operands; the slots of their results."""
        block = np.empty((len(a), 4), np.int32)
        block[:, 0], block[:, 1], block[:, 2], block[:, 3] = op, a, b, c
        self._blocks.append(block)
        self._next += len(a)
        return np.arange(self._next - len(a), self._next)

    def polynomials(self, supports: Sequence[np.ndarray], coefficients: np.ndarray) -> _Sums:
        """Sums of coefficients (slots, one polynomial after another) times monomials, and all their derivatives."""
        n, exponents = self.unknowns, np.vstack(supports)
        group = np.repeat(np.arange(len(supports)), [len(s) for s in supports])
        term, unknown = np.nonzero(exponents)
        power = exponents[term, unknown]
        lowered = exponents[term]
        lowered[np.arange(len(term)), unknown] -= 1
        slots = self._monomials(np.vstack([exponents, lowered]))
        whole, factor = slots[: len(exponents)], slots[len(exponents) :]
        many = np.flatnonzero(power > 1)
        if many.size:
            # The factor of a derivative belongs to its monomial: other equations may use them together, too.
            pairs, where = np.unique(power[many] * self._next + factor[many], return_inverse=True)
            known = np.array([self.powers[p] for p in (pairs // self._next).tolist()])
            factor[many] = self.emit(MUL, known, pairs % self._next)[where]
        gradient = np.full(len(supports) * n, ONE)
        places, entry = np.unique(group[term] * n + unknown, return_inverse=True)
        order = np.argsort(entry, kind="stable")
        gradient[places] = self.sums(entry[order], coefficients[term[order]], factor[order], len(places))
        values = self.sums(group, coefficients, whole, len(supports))
        return _Sums(values, gradient.reshape(-1, n), group, whole)

    def sums(self, group: np.ndarray, coefficients: np.ndarray, factors: np.ndarray, count: int) -> np.ndarray:
        """Sums of products of slots; `group` says which of the `count` sums each belongs to, in increasing order."""
        order = np.lexsort([factors != ONE, group])  # a coefficient without a factor is where a sum begins
        group, coefficients, factors = group[order], coefficients[order], factors[order]
        first = np.ones(len(group), bool)
        first[1:] = group[1:] != group[:-1]
        written = np.flatnonzero(~(first & (factors == ONE)))
        held = np.array(coefficients)
        held[written] = self._next + np.arange(len(written))
        before = np.zeros(len(group), np.int64)
        before[1:] = held[:-1]
        before[first] = 0
        self.emit(np.where(first[written], MUL, FMA), coefficients[written], factors[written], before[written])
        result = np.full(count, self.zero)
        result[group] = held  # the last of each group stays
        return result

    def _monomials(self, exponents: np.ndarray) -> np.ndarray:
        """The slots of monomials; ONE for the empty one. Products are taken from left to right, each once."""
        rows, where = distinct(exponents)
        slots = np.full(len(rows), ONE)
        new = np.zeros(len(rows), bool)  # whether a row differs from the one before in what has been looked at
        new[:1] = True
        for k in range(self.unknowns):
            column = rows[:, k]
            new[1:] |= column[1:] != column[:-1]
            powers = self._power_slots(k, column)
            alone = (slots == ONE) & (column > 0)
            times = (slots != ONE) & (column > 0)
            lead = np.flatnonzero(times & new)
            held = np.zeros(len(rows), np.int64)
            held[lead] = self.emit(MUL, slots[lead], powers[lead])
            leader = np.maximum.accumulate(np.where(new, np.arange(len(rows)), 0))
            slots = np.where(times, held[leader], np.where(alone, powers, slots))
        return slots[where]

    def _power_slots(self, k: int, exponents: np.ndarray) -> np.ndarray:
        """The slots of powers of one unknown, by halving exponents."""
        known = {0: ONE, 1: k}

        def slot(power: int) -> int:
            if power not in known:
                a, b = slot(power - power // 2), slot(power // 2)
                known[power] = int(self.emit(SQR if a == b else MUL, np.array([a]), np.array([0 if a == b else b]))[0])
            return known[power]

        powers = exponents.tolist()
        for power in sorted(set(powers)):
            slot(power)
        return np.array([known[power] for power in powers])

    def program(self, outputs: dict[str, np.ndarray], pattern: np.ndarray) -> Program:
        """What has been written."""
        return Program(
            unknowns=self.unknowns,
            parameters=self.parameters,
            constants=tuple(self._values),
            code=np.concatenate([np.zeros((0, 4), np.int32), *self._blocks]),
            outputs={name: slots.astype(np.int32) for name, slots in outputs.items()},
            pattern=pattern.astype(np.int32),
        )


def distinct(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distinct rows of whole numbers, none below zero, in increasing order, and which of them each row is.

    >>> distinct(np.array([[1, 0], [0, 2], [1, 0]]))[0].tolist()
    [[0, 2], [1, 0]]
    """
    radix = int(rows.max(initial=0)) + 1
    if radix ** rows.shape[1] < 2**62:
        keys = rows @ (radix ** np.arange(rows.shape[1])[::-1])
        _, first, where = np.unique(keys, return_index=True, return_inverse=True)
        return rows[first], where
    distinct, where = np.unique(rows, axis=0, return_inverse=True)
    return distinct, where.ravel()
