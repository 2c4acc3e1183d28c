"""What cannot be solved is said in a sentence; what has too many equations is squared up and sorted."""

import numpy as np
import pytest
import sympy

from benchmarks.zoo import ZOO
from solvers.from_sympy import InvalidSystem
from solvers.polyhedral import polyhedral
from solvers.shapes import check_shape, genuine, satisfied, square_up
from solvers.system import System
from solvers.tracking import Run, track_all

x, y, z, p = sympy.symbols("x y z p")


@pytest.mark.parametrize(
    "equations, unknowns, words",
    [
        ([], [x], "no equations"),
        ([sympy.Integer(1)], [], "no unknowns"),
        ([x - 1, sympy.Integer(0)], [x, y], "equation 1 is zero"),
        ([(x + y) ** 2 - x**2 - 2 * x * y - y**2, x], [x, y], "equation 0 is zero"),
        ([x - 1, sympy.Integer(5)], [x, y], "equation 1 is the constant 5"),
        ([x - 1, x + 2 - x], [x, y], "equation 1 is the constant 2"),
        ([x - 1, sympy.Rational(1, 10**400) * x * y - 1], [x, y], "coefficients of equation 1 are too small"),
        ([sympy.Rational(1, 10**400) * (x - 1)], [x], "coefficients of equation 0 are too small"),
        ([x**2 - 1, x - 1], [x, y], "y does not occur"),
        ([x**2 - 1], [x, y, z], "y, z do not occur"),
        ([x + y + z], [x, y, z], "of dimension 2 or more"),
        ([x * y - 1, 3 * x * y - 3], [x, y], "equations 0 and 1 are multiples"),
        ([x + y - 1, x - z, y + z - 1], [x, y, z], "rank 2"),
        ([x + y - 1, x + y - 2], [x, y], "rank 1"),
    ],
)
def test_sentences(equations, unknowns, words):
    with pytest.raises(InvalidSystem) as caught:
        check_shape(System(equations, unknowns), np.zeros(0))
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_parameters_can_make_an_equation_degenerate():
    system = System([p * x**2 - p, x * y - 1], [x, y], [p])
    check_shape(system, np.array([2.0]))
    with pytest.raises(InvalidSystem, match="equation 0 is zero"):
        check_shape(system, np.array([0.0]))
    with pytest.raises(InvalidSystem, match="not finite"):
        check_shape(System([x / p - 1], [x], [p]), np.array([0.0]))


@pytest.mark.parametrize("name", list(ZOO))
def test_the_zoo_passes(name):
    check_shape(ZOO[name].build(), np.zeros(0))


def test_units_do_not_look_like_a_lack_of_rank():
    check_shape(System([1e-9 * x + 1e12 * y - 1, 1e-9 * x - 1e12 * y - 3e-4], [x, y]), np.zeros(0))


def test_overdetermined_systems_are_squared_up_and_sorted():
    """The twisted cubic meets a plane in three points; its three quadrics are two too many for a square system."""
    equations = [x * z - y**2, y - x**2, z - x * y, x + y + z - 1]
    system = System(equations, [x, y, z])
    check_shape(system, np.zeros(0))
    square = square_up(system, seed=4)
    assert square.size == (3, 3)
    assert square.degrees == (2, 2, 2)
    ends, _ = track_all(polyhedral(square, np.zeros(0), seed=1), Run())
    finite = ends.x[np.isfinite(ends.x).all(axis=1)]
    good = satisfied(system, finite)
    roots = finite[good]
    assert len(roots) == 3
    assert not np.all(good)  # there is excess
    expected = np.roots([1, 1, 1, -1])
    assert np.abs(np.sort_complex(roots[:, 0]) - np.sort_complex(expected)).max() < 1e-8
    assert np.abs(roots - np.stack([roots[:, 0] ** k for k in (1, 2, 3)], axis=1)).max() < 1e-8


def test_every_root_of_the_system_is_a_root_of_the_combinations():
    system = System([x**3 - p, x * y - 1, y**2 - x - 2, x + y**3 - 7], [x, y], [p])
    square = square_up(system, seed=1)
    assert square.degrees == (3, 3)
    points = np.random.default_rng(0).normal(size=(12, 2)) + 1j
    F, _ = system.evaluate(points, [2.0])
    G, _ = square.evaluate(points, [2.0])
    weights, *_ = np.linalg.lstsq(F, G, rcond=None)
    assert np.abs(F @ weights - G).max() < 1e-10 * np.abs(F).max()


def test_satisfied_forgives_rounding_but_not_nearness():
    system = System([x**2 + y**2 - 25, x * y - 12, x - y + 1], [x, y])
    exact = np.array([[3.0, 4.0]])
    assert satisfied(system, exact * (1 + 1e-10)).all()
    assert not satisfied(system, exact * (1 + 1e-4)).any()
    assert satisfied(system, np.zeros((0, 2))).shape == (0,)


def test_satisfied_lets_multiple_factors_through():
    system = System([(x - 1) ** 2, x * y - 1, y - 1], [x, y])
    assert satisfied(system, [[1.0, 1.0]]).all()
    assert satisfied(system, [[1.0 + 1e-8, 1.0 - 1e-8]]).all()
    assert not satisfied(system, [[2.0, 0.5]]).any()


def test_square_systems_are_left_alone():
    system = System([x**2 - 1], [x])
    assert square_up(system) is system


def test_poles_are_not_roots():
    system = System([(x**2 - 1) * (x - 2) / (x - 1) ** 2 + p - p, y * x - 2], [x, y], [p])
    points = [[1.0, 2.0], [-1.0, -2.0], [2.0, 1.0]]
    assert genuine(system, points, [1.0]).tolist() == [False, True, True]
