"""Refinement against roots known to any number of digits."""

from fractions import Fraction
from types import SimpleNamespace

import mpmath
import numpy as np
import pytest
from sympy import Rational, expand, prod, symbols

from solvers.arithmetic import multiprecision
from solvers.arithmetic.values import exact_parameters
from solvers.from_sympy import InvalidSystem
from solvers.refine import refine
from solvers.system import System

x, y, p = symbols("x y p")


def test_double_precision_is_reached_to_the_last_bit():
    system = System([x**2 + y**2 - 5, x * y - 2], [x, y])
    refined = refine(system, [[1.001, 1.999], [2 + 1e-7, 1], [-1, -2 - 1e-4j]])
    assert np.array_equal(refined.points.real, [[1, 2], [2, 1], [-1, -2]])
    assert np.all(np.abs(refined.points.imag) < 1e-30)
    assert refined.converged.all() and np.all(refined.errors <= 2.0**-52)
    assert repr(refined) == "Refined(3 of 3 points to 16 digits, largest relative error 1.1e-16)"


def test_ill_conditioned_roots_are_found_to_the_last_bit():
    """Wilkinson's polynomial: in double precision Newton stops with four digits, in double-double with sixteen."""
    system = System([expand(prod(x - k for k in range(1, 16)))], [x])
    rng = np.random.default_rng(1)
    starts = np.arange(1, 16)[:, None] + 1e-4 * rng.normal(size=(15, 1))
    refined = refine(system, starts)
    assert refined.converged.all()
    assert np.array_equal(refined.points[:, 0], np.arange(1, 16))


@pytest.mark.parametrize("digits", [17, 30, 50, 200, 1000])
def test_any_number_of_digits(digits):
    system = System([x**2 - p, y**3 - x], [x, y], [p])
    refined = refine(system, [[1.414, 1.122]], [2], digits)
    assert refined.converged.all()
    with mpmath.workdps(digits + 10):
        root, sixth = mpmath.sqrt(2), mpmath.root(2, 6)
        assert abs(refined.points[0][0] - root) < mpmath.mpf(10) ** -digits
        assert abs(refined.points[0][1] - sixth) < mpmath.mpf(10) ** -digits


def test_ill_conditioned_roots_to_many_digits():
    system = System([expand(prod(x - Rational(k, 7) for k in range(1, 21)))], [x])
    refined = refine(system, [[13 / 7 + 1e-7]], digits=60)
    assert refined.converged.all()
    with mpmath.workdps(70):
        assert abs(refined.points[0][0] - mpmath.mpf(13) / 7) < mpmath.mpf(10) ** -60


def test_exact_parameters_matter():
    """1/3 the rational number, and 1/3 the float, give other digits after the sixteenth."""
    system = System([x - p], [x], [p])
    for value, exact in ((Fraction(1, 3), Fraction(1, 3)), (1 / 3, Fraction(1 / 3))):
        point = refine(system, [[0.3]], [value], digits=40).points[0][0]
        with mpmath.workdps(50):
            assert abs(point - mpmath.mpf(exact.numerator) / exact.denominator) < mpmath.mpf(10) ** -40


def test_the_residual_vanishes_in_an_arithmetic_of_its_own():
    """Refined in Arb, checked in mpmath."""
    rng = np.random.default_rng(2)
    names = symbols("z0:4")
    matrix = rng.normal(size=(4, 4))
    equations = [z**2 - 1 + sum(float(a) * v for a, v in zip(row, names)) / 10 for z, row in zip(names, matrix)]
    system = System(equations, names)
    refined = refine(system, rng.choice([-1.0, 1.0], size=(3, 4)), digits=50)
    assert refined.converged.all()
    with mpmath.workdps(60):
        for point in refined.points:
            residual = multiprecision.replay(system.program, list(point), exact_parameters(system))["F"]
            assert max(abs(r) for r in residual) < mpmath.mpf(10) ** -49


def test_multiple_roots_are_reported():
    refined = refine(System([x**2 - 2 * x + 1], [x]), [[1.01]])
    assert not refined.converged[0] and refined.errors[0] > 1e-9
    assert not refine(System([x**2 - 2 * x + 1], [x]), [[1.01]], digits=30).converged[0]


def test_broken_points_are_reported_and_kept():
    system = System([x / p - y, y**2 - 2], [x, y], [p])
    refined = refine(system, [[np.nan, 1], [1.4, 1.4], [0, 0]], [1])
    assert refined.converged.tolist() == [False, True, False]
    assert not refine(system, [[1, 1]], [0]).converged.any()
    assert not refine(system, [[1, 1]], [0], digits=30).converged.any()


def test_roots_at_the_origin():
    system = System([x**2 + x + y, y - x * y], [x, y])
    refined = refine(system, [[1e-9, 1e-10]])
    assert refined.converged[0] and np.all(np.abs(refined.points[0]) < 1e-25)
    assert refine(system, [[0, 0]]).converged[0]
    many = refine(system, [[1e-9, 1e-10]], digits=40)
    assert many.converged[0] and max(abs(z) for z in many.points[0]) < 1e-49


def test_more_equations_than_unknowns():
    system = System([x**2 - 2, y - x, x * y - 2], [x, y])
    refined = refine(system, [[1.41, 1.42]])
    assert refined.converged[0] and np.allclose(refined.points[0], np.sqrt(2), rtol=2e-16)
    with mpmath.workdps(50):
        point = refine(system, [[1.41, 1.42]], digits=40).points[0]
        assert abs(point[0] - mpmath.sqrt(2)) < mpmath.mpf(10) ** -40


def test_solutions_and_messages():
    system = System([x**2 - p], [x], [p])
    solved = SimpleNamespace(points=np.array([[2.1], [-2.1]]), parameters=np.array([4.0]))
    assert refine(system, solved).points.tolist() == [[2], [-2]]
    assert len(refine(system, np.zeros((0, 1)), [1]).points) == 0
    for digits in (0, -3, 2.5, True):
        with pytest.raises(ValueError, match="whole number"):
            refine(system, [[2.0]], [4], digits)
    with pytest.raises(InvalidSystem, match="do not determine"):
        refine(System([x + y], [x, y]), [[1, 1]])
    with pytest.raises(InvalidSystem, match="shape must be"):
        refine(system, [[2.0, 1.0]], [4])
