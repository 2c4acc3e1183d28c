"""Systems written as Python formulas, where SymPy is not needed and its import would cost more than the solve.

A formula is a function of plain arithmetic.  Called with the names' `Term` objects it writes a straight-line program;
called with SymPy symbols, numbers or arrays it gives expressions or values, so that one text serves all.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from solvers.graph import Builder, Node
from solvers.system import System

__all__ = ["Term", "system_of"]


class Term:
    """A node of a graph, with sums, products and whole powers; the other operand may be an exact number."""

    __slots__ = ("builder", "node")

    def __init__(self, builder: Builder, node: Node) -> None:
        self.builder, self.node = builder, node

    def _other(self, value: Any) -> Node:
        return value.node if isinstance(value, Term) else self.builder.constant(value)

    def __add__(self, other: Any) -> Term:
        return Term(self.builder, self.builder.add(self.node, self._other(other)))

    def __sub__(self, other: Any) -> Term:
        return Term(self.builder, self.builder.sub(self.node, self._other(other)))

    def __mul__(self, other: Any) -> Term:
        return Term(self.builder, self.builder.multiply(self.node, self._other(other)))

    def __rsub__(self, other: Any) -> Term:
        return Term(self.builder, self.builder.sub(self._other(other), self.node))

    def __neg__(self) -> Term:
        return Term(self.builder, self.builder.negate(self.node))

    def __pow__(self, exponent: int) -> Term:
        return Term(self.builder, self.builder.power(self.node, exponent))

    __radd__ = __add__
    __rmul__ = __mul__


def system_of(
    formula: Callable[[Mapping[str, Any]], Sequence[Any]], unknowns: Sequence[str], parameters: Sequence[str] = ()
) -> System:
    """The system whose equations a formula gives.

    Parameters
    ----------
    formula : callable
        From a mapping of every name to its term to the equations' left sides.
    unknowns, parameters : sequence of str

    Returns
    -------
    System
        Its unknowns and parameters are the names.

    Examples
    --------
    >>> system = system_of(lambda v: [v["x"] ** 2 - v["a"], 2 * v["x"] * v["y"] - 1], ["x", "y"], ["a"])
    >>> system
    System(2 equations, 2 unknowns, 1 parameter, degrees 2·2)
    """
    builder = Builder(len(unknowns), len(parameters))
    terms = {name: Term(builder, builder.unknown(k)) for k, name in enumerate(unknowns)}
    terms |= {name: Term(builder, builder.parameter(k)) for k, name in enumerate(parameters)}
    nodes = [equation.node for equation in formula(terms)]
    return System.from_program(builder.finish({"F": nodes}), unknowns, parameters)
