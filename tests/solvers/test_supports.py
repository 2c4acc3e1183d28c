"""Expansion against SymPy's own."""

from fractions import Fraction

import numpy as np
import pytest
import sympy

from solvers.supports import TooManyTerms, degrees_of, generic_supports, terms
from solvers.system import System

x, y, z, p = sympy.symbols("x y z p")


def as_dictionary(expanded, equation):
    return {
        tuple(exponents): sympy.Rational(re.numerator, re.denominator)
        + sympy.I * sympy.Rational(im.numerator, im.denominator)
        for exponents, (re, im) in zip(expanded.supports[equation].tolist(), expanded.exact[equation])
    }


@pytest.mark.parametrize(
    "expression",
    [
        (x + 2 * y) ** 3 - (x - y) * (x + y) * z,
        (x - sympy.I * y + sympy.Rational(1, 3)) ** 4 - (x + sympy.I) * (z - 5),
        x * (y * (z - 1) + 2) - (x * y * z + 2 * x),
        sum((k + 1) * x**k * y ** (7 - k) for k in range(8)) * (1 - x) - 3 * z,
        -(x - (y - (z - (x**2 - y)))),
        sympy.Integer(7) + 0 * x,
    ],
)
def test_terms_agree_with_sympy(expression):
    expanded = terms(System([expression], [x, y, z]))
    assert as_dictionary(expanded, 0) == dict(sympy.Poly(expression, x, y, z).terms()) or (
        as_dictionary(expanded, 0) == {}
    )


def test_cancelled_equation_has_no_terms():
    expanded = terms(System([(x + y) ** 2 - x**2 - 2 * x * y - y**2, x - 1], [x, y]))
    assert [len(s) for s in expanded.supports] == [0, 2]
    assert degrees_of(expanded.supports, [0, 1]) == [-1, 1]


def test_parameters_and_generic_supports():
    system = System([(x + p) ** 2 - p**2, x * y / p - 1], [x, y], [p])
    at_two = terms(system, [2])
    assert at_two.supports[0].tolist() == [[2, 0], [1, 0]]
    assert at_two.exact[1] == ((Fraction(1, 2), 0), (Fraction(-1), 0))
    at_zero_of_coefficient = terms(System([(p - 2) * x**2 + x - 1], [x], [p]), [2])
    assert at_zero_of_coefficient.supports[0].tolist() == [[1], [0]]
    assert [s.tolist() for s in generic_supports(system)] == [[[2, 0], [1, 0]], [[1, 1], [0, 0]]]


def test_float_coefficients_are_kept_to_the_last_bit():
    expanded = terms(System([0.1 * x - 0.2], [x]))
    assert expanded.exact[0][0][0] == Fraction(0.1)


def test_size_guard_says_what_to_do():
    unknowns = sympy.symbols("x0:12")
    big = sympy.prod([sum(unknowns) + k for k in range(9)])
    with pytest.raises(TooManyTerms, match="multihomogeneous"):
        terms(System([big], unknowns), limit=20_000)


def test_long_sums_do_not_take_quadratic_time():
    from solvers.graph import Builder

    builder = Builder(2, 0)
    nodes = [builder.multiply(builder.constant(k + 1), builder.power(0, k)) for k in range(4_000)]
    system = System.from_program(builder.finish({"F": [builder.total(nodes)]}))
    expanded = terms(system)
    assert len(expanded.supports[0]) == 4_000
    assert np.array_equal(expanded.supports[0][:, 0], np.arange(3_999, -1, -1))


def test_terms_are_kept_for_the_same_values_only():
    system = System([p * x**2 - y, x + y], [x, y], [p])
    first = terms(system, [2])
    assert terms(system, [2]) is first
    assert terms(system, [3]).coefficients[0].tolist() == [3, -1]
    with pytest.raises(TooManyTerms):
        terms(system, [3], limit=1)
