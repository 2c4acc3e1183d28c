"""Degrees against SymPy's, where terms cancel and where they do not."""

from fractions import Fraction

import pytest
import sympy

from solvers.degrees import PRIME, degree_bounds, degrees, residue
from solvers.system import System

x, y, z, p = sympy.symbols("x y z p")


@pytest.mark.parametrize(
    "equation",
    [
        (x + y) ** 3 - x**3 - y**3,
        (x * y - z) ** 2 - x**2 * y**2,
        x * (y + z) - y * (x + z) - z * (x - y),
        (x + sympy.I * y) * (x - sympy.I * y) - x**2,
        sympy.Rational(1, 3) * x**4 + z,
        (x + y + z) ** 5,
    ],
)
def test_degrees_are_those_of_the_expanded_equation(equation):
    program = System([equation, x - 1, y - 1], [x, y, z]).program
    expanded = sympy.expand(equation)
    for group in ([0], [1], [2], [0, 1], [0, 1, 2]):
        chosen = [(x, y, z)[k] for k in group]
        known = sympy.Poly(expanded, *chosen).total_degree() if expanded != 0 else -1
        assert degrees(program, group)[0] == known
        assert degree_bounds(program, set(group))[0] >= known


def test_zero_has_no_degree_and_parameters_are_generic():
    program = System([x - x, p * x - x / p], [x], [p]).program
    assert degrees(program, [0]) == [-1, 1]


def test_residues_follow_exact_arithmetic():
    i, third = residue((Fraction(0), Fraction(1))), residue((Fraction(1, 3), Fraction(0)))
    assert i * i % PRIME == PRIME - 1
    assert 3 * third % PRIME == 1
