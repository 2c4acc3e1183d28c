"""Degrees without expansion, sizes, groups, evaluation."""

import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st

from solvers import InvalidSystem, System

x, y, z, p = sympy.symbols("x y z p")
MONOMIALS = [x**i * y**j for i in range(4) for j in range(4)]


@settings(max_examples=40, deadline=None)
@given(st.lists(st.tuples(st.sampled_from(MONOMIALS), st.integers(-3, 3)), min_size=1, max_size=6), st.integers(1, 3))
def test_degrees_are_those_of_the_expanded_polynomial(terms, power):
    form = sum(c * m for m, c in terms) + x
    equation = form**power - form ** (power - 1) * x * y
    expanded = sympy.Poly(sympy.expand(equation), x, y)
    expected = -1 if expanded.is_zero else expanded.total_degree()
    system = System([equation, y - 1], [x, y])
    assert system.degrees[0] == expected
    if not expanded.is_zero:
        assert system.degrees_in([[0], [1]])[:, 0].tolist() == [expanded.degree(x), expanded.degree(y)]


def test_cancelling_terms_do_not_count():
    assert System([(x + y) ** 3 - x**3 - y**3 - 3 * x**2 * y - 3 * x * y**2 + x], [x, y]).degrees == (1,)
    assert System([(x + sympy.I) * (x - sympy.I) - x**2 + y], [x, y]).degrees == (1,)


def test_values_and_jacobians_are_those_of_sympy():
    equations = [x**2 * y - p * z, (x + y) ** 3 - z, x * y * z - p**2]
    system = System(equations, [x, y, z], [p])
    rng = np.random.default_rng(0)
    points = rng.normal(size=(5, 3)) + 1j * rng.normal(size=(5, 3))
    F, J = system.evaluate(points, [0.7])
    matrix = sympy.Matrix(equations)
    for point, values, jacobian in zip(points, F, J):
        at = dict(zip([x, y, z, p], [*point, 0.7]))
        assert np.allclose(values, np.array(matrix.subs(at)).astype(complex).ravel())
        assert np.allclose(jacobian, np.array(matrix.jacobian([x, y, z]).subs(at)).astype(complex))


def test_thousands_of_terms_are_no_deep_recursion():
    system = System([sum(k * x ** (k % 7) * y ** (k % 5) for k in range(1, 4000)) + (x + y) ** 3, y - 1], [x, y])
    assert system.degrees == (10, 1)


def test_numbers_of_all_kinds():
    equation = sympy.Rational(1, 3) * x**2 + 0.25 * x + sympy.sqrt(2) + sympy.I * 2 - sympy.pi
    F, _ = System([equation], [x]).evaluate([[2]])
    assert np.allclose(F, 4 / 3 + 0.5 + np.sqrt(2) + 2j - np.pi)


@pytest.mark.parametrize(
    "groups, message", [([[x]], "exactly once"), ([[x, y], [y]], "exactly once"), ([[x], [z]], "z")]
)
def test_groups_that_are_no_partition(groups, message):
    with pytest.raises(InvalidSystem, match=message):
        System([x - 1, y - 1], [x, y], groups=groups)


def test_it_prints_well():
    assert repr(System([x**2 - p], [x], [p])) == "System(1 equation, 1 unknown, 1 parameter, degrees 2)"
