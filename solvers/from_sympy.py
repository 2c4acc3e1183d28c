"""SymPy expressions into a straight-line program, without expanding them.

Common subexpressions are shared, numbers stay exact, and an equation with unknowns in a denominator is
multiplied by it (the denominator is remembered as a pole: a point where it vanishes is no solution).
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

from solvers.graph import Builder, Node
from solvers.tape import Exact, Program


class InvalidSystem(ValueError):
    """The equations are not a polynomial system that can be solved; the message says which and why."""


def program_from_sympy(
    equations: Sequence[Any], unknowns: Sequence[Any], parameters: Sequence[Any]
) -> tuple[tuple[Any, ...], Program, tuple[Any, ...]]:
    """Equations, their program (output "F") and the denominators that were cleared.

    Raises
    ------
    InvalidSystem
        Names the first equation that is not polynomial in the unknowns and rational in the parameters.
    """
    import sympy

    _check_symbols(unknowns, parameters)
    builder = Builder(len(unknowns), len(parameters))
    leaves = {symbol: builder.unknown(k) for k, symbol in enumerate(unknowns)}
    leaves |= {symbol: builder.parameter(k) for k, symbol in enumerate(parameters)}
    unknown_set = set(unknowns)
    cleared, poles, nodes = [], [], []
    memo: dict[Any, Node] = dict(leaves)
    for number, equation in enumerate(equations):
        try:
            expression = sympy.sympify(equation, strict=True)
        except sympy.SympifyError:
            raise InvalidSystem(f"equation {number} is {equation!r}, not a SymPy expression") from None
        if isinstance(expression, sympy.Equality):
            expression = expression.lhs - expression.rhs
        if not isinstance(expression, sympy.Expr):
            raise InvalidSystem(f"equation {number} is {expression}, not an equation")
        strange = expression.free_symbols - set(leaves)
        if strange:
            names = ", ".join(sorted(map(str, strange)))
            raise InvalidSystem(f"equation {number} holds {names}, neither an unknown nor a parameter")
        if _has_poles(expression, unknown_set):
            expression, pole = sympy.fraction(sympy.together(expression))
            poles.append(pole)
        cleared.append(expression)
        nodes.append(_node(expression, builder, memo, unknown_set, number))
    return tuple(cleared), builder.finish({"F": nodes}), tuple(poles)


def _check_symbols(unknowns: Sequence[Any], parameters: Sequence[Any]) -> None:
    import sympy

    for symbol in (*unknowns, *parameters):
        if not isinstance(symbol, sympy.Symbol):
            raise InvalidSystem(f"{symbol!r} is not a SymPy symbol")
    names = [*unknowns, *parameters]
    repeated = [s for k, s in enumerate(names) if s in names[:k]]
    if repeated:
        raise InvalidSystem(f"the symbol {repeated[0]} is listed twice among unknowns and parameters")


def _has_poles(expression: Any, unknowns: set[Any]) -> bool:
    return any(
        power.exp.is_negative and power.base.free_symbols & unknowns
        for power in expression.atoms(_sympy().Pow)
        if power.exp.is_Integer
    )


def _sympy() -> Any:
    import sympy

    return sympy


def _node(root: Any, builder: Builder, memo: dict[Any, Node], unknowns: set[Any], number: int) -> Node:
    """The node of an expression; an explicit stack, because sums of many thousand terms nest deeply."""
    stack = [root]
    while stack:
        item = stack[-1]
        if item in memo:
            stack.pop()
            continue
        if item.is_Add or item.is_Mul:
            waiting = [arg for arg in item.args if arg not in memo]
            if waiting:
                stack += waiting
                continue
            operands = [memo[arg] for arg in item.args]
            if item.is_Add:
                memo[item] = builder.total(operands)
            else:
                product = builder.one
                for operand in operands:
                    product = builder.multiply(product, operand)
                memo[item] = product
        elif item.is_Pow and item.exp.is_Integer:
            if item.base not in memo:
                stack.append(item.base)
                continue
            memo[item] = builder.power(memo[item.base], int(item.exp))
        elif item.is_number:
            memo[item] = builder.constant(exact_number(item, number))
        else:
            raise InvalidSystem(
                f"equation {number} is not polynomial: it holds {item}"
                + (" of an unknown" if item.free_symbols & unknowns else "")
                + ". Replace angles by rotations or by tangents of half-angles, and roots by new unknowns."
            )
        stack.pop()
    return memo[root]


def exact_number(value: Any, equation: int = 0) -> Exact:
    """The exact (real, imaginary) fractions of a SymPy number; irrational ones are rounded to 60 digits."""
    re, im = value.as_real_imag()
    parts = []
    for part in (re, im):
        if part.is_Rational:
            parts.append(Fraction(int(part.p), int(part.q)))
            continue
        number = part if part.is_Float else part.evalf(60)
        if not number.is_Float or not number.is_finite:
            raise InvalidSystem(f"equation {equation} holds the number {value}, which is not finite")
        sign, mantissa, exponent, _ = number._mpf_
        fraction = Fraction(int(mantissa)) * Fraction(2) ** int(exponent)
        parts.append(-fraction if sign else fraction)
    return parts[0], parts[1]
