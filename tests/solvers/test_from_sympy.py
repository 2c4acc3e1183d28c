"""SymPy in: what is a polynomial system, exactly, and what is not."""

from fractions import Fraction

import numpy as np
import pytest
import sympy

from solvers import InvalidSystem, System
from solvers.from_sympy import exact_number, program_from_sympy

x, y, p = sympy.symbols("x y p")


@pytest.mark.parametrize(
    "number, value",
    [
        (sympy.Rational(1, 3), (Fraction(1, 3), 0)),
        (sympy.Float("0.1"), (Fraction(0.1), 0)),
        (2 + 3 * sympy.I, (2, 3)),
        (sympy.Rational(-7, 2) * sympy.I, (0, Fraction(-7, 2))),
    ],
)
def test_numbers_stay_exact(number, value):
    assert exact_number(sympy.sympify(number)) == value


def test_high_precision_floats_keep_their_digits():
    number = sympy.Float("1.23456789012345678901234567890123456789", 40)
    re, im = exact_number(number)
    assert im == 0 and abs(re - Fraction("1.23456789012345678901234567890123456789")) < Fraction(1, 10**38)


def test_irrational_numbers_are_rounded_to_sixty_digits():
    re, _ = exact_number(sympy.sqrt(2))
    assert abs(re**2 - 2) < Fraction(1, 10**58)


def test_equalities_are_differences():
    one, two = (System([f], [x]).evaluate([[1.7]])[0] for f in (sympy.Eq(x**2, x + 1), x**2 - x - 1))
    assert np.array_equal(one, two)


def test_denominators_are_cleared_and_remembered():
    equations, program, poles = program_from_sympy([1 / x + 1 / (y - p) - 2], [x, y], [p])
    assert len(poles) == 1 and poles[0].subs({x: 0}) == 0 and poles[0].subs({y: p}) == 0
    value = program.replay([2.0, 5.0], [1.0])["F"][0]
    assert np.isclose(abs(value), abs((1 / 2 + 1 / 4 - 2) * 2 * 4))
    assert sympy.simplify(equations[0] / poles[0] - (1 / x + 1 / (y - p) - 2)) == 0


def test_denominators_of_parameters_stay():
    system = System([x / p - 1], [x], [p])
    assert not system.poles and np.allclose(system.evaluate([[3.0]], [3.0])[0], 0)


@pytest.mark.parametrize(
    "equation, message",
    [
        (sympy.sin(x), "holds sin"),
        (sympy.Abs(x), "holds Abs"),
        (x ** sympy.Rational(1, 2), "holds sqrt"),
        (2**x, "is not polynomial"),
        (x**p, "is not polynomial"),
        (sympy.nan + 0 * x, "not finite|nan"),
        (sympy.zoo + x, "not finite|zoo"),
        (sympy.Symbol("w") + x, "w, neither"),
        (sympy.Matrix([x]), "holds Matrix"),
        ("x", "not a SymPy expression"),
        (None, "not a SymPy expression"),
        (sympy.true, "not an equation"),
    ],
)
def test_what_is_not_polynomial_is_named(equation, message):
    with pytest.raises(InvalidSystem, match=message) as error:
        System([x - 1, equation], [x, y], [p])
    assert "equation 1" in str(error.value)


def test_strings_are_never_evaluated():
    with pytest.raises(InvalidSystem):
        System(["__import__('os').getcwd()"], [x])
