"""The straight-line program of a system: plain arrays that every arithmetic replays and that travel as data.

Programs are written by a :class:`solvers.graph.Builder`.
"""

from __future__ import annotations

import decimal
from collections.abc import Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from solvers.graph import Builder, Node

# Instruction codes. The result of instruction k lives in slot (number of inputs + k).
ADD, SUB, MUL, SQR, NEG, INV, FMA, FMS, FNMA = range(9)
NAMES = ("add", "sub", "mul", "sqr", "neg", "inv", "fma", "fms", "fnma")
#: operands that an instruction reads: FMA is a*b+c, FMS is a*b-c, FNMA is c-a*b
ARITY = (2, 2, 2, 1, 1, 1, 3, 3, 3)

Exact = tuple[Fraction, Fraction]


def exact(value: Any) -> Exact:
    """The exact value of a number as a pair of fractions (real part, imaginary part).

    Binary floats are dyadic rationals and are kept to the last bit.

    >>> exact(0.5 + 2j)
    (Fraction(1, 2), Fraction(2, 1))
    """
    if isinstance(value, tuple):
        return value
    if isinstance(value, (int, Fraction)):
        return (Fraction(value), Fraction(0))
    number = complex(value)
    return (Fraction(number.real), Fraction(number.imag))


def rounded(value: Exact) -> complex:
    """A number to double precision.

    >>> rounded((Fraction(1, 2), Fraction(2)))
    (0.5+2j)
    """
    re, im = value
    try:
        return complex(re.numerator / re.denominator, im.numerator / im.denominator)
    except OverflowError:
        return complex(double(re), double(im))  # one of them says what is wrong


def double(value: Fraction) -> float:
    """A fraction to double precision.

    Raises
    ------
    InvalidSystem
        It is too large.

    >>> double(Fraction(-(10**400), 3))
    Traceback (most recent call last):
        ...
    solvers.from_sympy.InvalidSystem: the number -3.33333e+399 is beyond the range of double precision, about 1e308: \
divide its equation by a power of ten, or measure the unknowns in other units
    """
    try:
        return value.numerator / value.denominator
    except OverflowError:
        from solvers.from_sympy import InvalidSystem  # that module needs this one

        raise InvalidSystem(
            f"the number {approximately(value)} is beyond the range of double precision, about 1e308: "
            "divide its equation by a power of ten, or measure the unknowns in other units"
        ) from None


def approximately(value: Fraction) -> str:
    """Six digits of a number of any size.

    >>> approximately(Fraction(-2, 3 * 10**5000))
    '-6.66667e-5001'
    """
    six = decimal.Context(prec=6, Emax=decimal.MAX_EMAX, Emin=decimal.MIN_EMIN)
    quotient = six.divide(decimal.Decimal(value.numerator), decimal.Decimal(value.denominator))
    return f"{quotient.normalize(six):g}"


@dataclass(frozen=True, eq=False)
class Program:
    """A straight-line program as plain arrays.

    Slots are numbered: unknowns, parameters, velocities, constants (in this order), then one per instruction.

    Attributes
    ----------
    unknowns, parameters : int
        Numbers of unknowns and of parameters; there are as many velocities as parameters.
    constants : tuple of (Fraction, Fraction)
        Exact constants, real and imaginary part.
    code : ndarray, shape (instructions, 4), int32
        Rows (operation, a, b, c); an operand that is not read is 0.
    outputs : dict of str to ndarray of int32
        Named lists of slots.
    """

    unknowns: int
    parameters: int
    constants: tuple[Exact, ...]
    code: np.ndarray
    outputs: dict[str, np.ndarray]
    pattern: np.ndarray = field(default_factory=lambda: np.zeros((0, 2), np.int32))

    @property
    def inputs(self) -> int:
        """Number of slots before the first instruction."""
        return self.unknowns + 2 * self.parameters + len(self.constants)

    @cached_property
    def constant_values(self) -> np.ndarray:
        """The constants rounded to double precision, shape (constants,)."""
        return np.array([rounded(value) for value in self.constants], dtype=np.complex128)

    @cached_property
    def constant_halves(self) -> np.ndarray:
        """The constants in double-double, shape (constants, 4): leading (re, im) and trailing (re, im)."""
        table = np.zeros((len(self.constants), 4))
        for k, parts in enumerate(self.constants):
            for j, part in enumerate(parts):
                table[k, j] = double(part)
                table[k, j + 2] = float(part - Fraction(table[k, j]))
        return table

    def __repr__(self) -> str:
        sizes = ", ".join(f"{name}: {len(slots)}" for name, slots in self.outputs.items())
        return f"Program({self.unknowns} unknowns, {len(self.code)} instructions; {sizes})"

    def replay(
        self,
        unknowns: Sequence[Any],
        parameters: Sequence[Any] = (),
        velocities: Sequence[Any] | None = None,
        constants: Sequence[Any] | None = None,
    ) -> dict[str, list[Any]]:
        """Run the program over any numbers that know ``+ - * /``: arrays, double-doubles, mpmath, Arb balls.

        Parameters
        ----------
        unknowns, parameters, velocities : sequences
            One number (or one array of numbers, a lane for each path) for each input.
        constants : sequence, optional
            The constants in the arithmetic of the caller; double precision if not given.

        Returns
        -------
        dict of str to list
            The values of each named output.

        Examples
        --------
        >>> from solvers.graph import Builder
        >>> b = Builder(1, 0)
        >>> x = b.unknown(0)
        >>> program = b.finish({"F": [b.sub(b.square(x), b.constant(2))]})
        >>> program.replay([3.0])["F"]
        [(7+0j)]
        """
        if velocities is None:
            velocities = [0.0] * self.parameters
        if constants is None:
            constants = self.constant_values.tolist()
        slots: list[Any] = [*unknowns, *parameters, *velocities, *constants]
        push = slots.append
        for op, a, b, c in self.code.tolist():
            if op == FMA:
                push(slots[a] * slots[b] + slots[c])
            elif op == MUL:
                push(slots[a] * slots[b])
            elif op == ADD:
                push(slots[a] + slots[b])
            elif op == FNMA:
                push(slots[c] - slots[a] * slots[b])
            elif op == SUB:
                push(slots[a] - slots[b])
            elif op == FMS:
                push(slots[a] * slots[b] - slots[c])
            elif op == SQR:
                push(slots[a] * slots[a])
            elif op == NEG:
                push(-slots[a])
            else:
                push(1 / slots[a])
        return {name: [slots[k] for k in where.tolist()] for name, where in self.outputs.items()}

    def embed(self, builder: Builder, unknowns: Sequence[Node], parameters: Sequence[Node]) -> list[Node]:
        """Write this program's output "F" into a larger graph, on other nodes for its unknowns and parameters.

        This is how a start system, a slice or a scaling is put round a system without going back to SymPy.
        """
        nodes: list[Node] = [*unknowns, *parameters, *[builder.zero] * self.parameters]
        nodes += [builder.constant(value) for value in self.constants]
        wanted = self.outputs["F"].tolist()
        needed = max([self.inputs, *(k + 1 for k in wanted)]) - self.inputs
        for op, a, b, c in self.code[:needed].tolist():
            if op == ADD:
                node = builder.add(nodes[a], nodes[b])
            elif op == SUB:
                node = builder.sub(nodes[a], nodes[b])
            elif op == SQR:
                node = builder.square(nodes[a])
            elif op == NEG:
                node = builder.negate(nodes[a])
            elif op == INV:
                node = builder.invert(nodes[a])
            else:
                node = builder.multiply(nodes[a], nodes[b])
                if op == FMA:
                    node = builder.add(node, nodes[c])
                elif op == FMS:
                    node = builder.sub(node, nodes[c])
                elif op == FNMA:
                    node = builder.sub(nodes[c], node)
            nodes.append(node)
        return [nodes[k] for k in wanted]
