"""A homotopy is a system whose parameters move."""

import numpy as np
import sympy

from solvers import System
from solvers.homotopy import Listed, parameter_homotopy
from solvers.kernel.reference import REACHED, track
from solvers.system import differentiated
from solvers.tracking import engine_of

x, y, a, b = sympy.symbols("x y a b")


def test_parameters_are_the_start_at_one_and_the_target_at_zero():
    system = System([x**2 - a, y - b * x], [x, y], [a, b])
    homotopy = parameter_homotopy(system.program, [1, 2], [4, 3j], np.array([[1, 2], [-1, -2]]))
    assert np.array_equal(homotopy.target + 1.0 * homotopy.direction, [1, 2])
    assert np.array_equal(homotopy.target + 0.0 * homotopy.direction, [4, 3j])


def test_the_whole_path_against_its_formula():
    # x = ±sqrt(p(r)), y = x b(r): everywhere on the way, not only at the end.
    system = System([x**2 - a, y - b * x], [x, y], [a, b])
    homotopy = parameter_homotopy(system.program, [1, 2], [4j, 3], np.array([[1, 2], [-1, -2]], complex))
    builder, equations = homotopy.builder()
    program = differentiated(builder, equations)
    for stop in (0.9, 0.5, 0.1, 1e-3):
        done = track(program, homotopy.starts.array, homotopy.target, homotopy.direction, end=stop)
        p = homotopy.target + stop * homotopy.direction
        assert np.all(done.status == REACHED)
        assert np.allclose(done.x[:, 0], np.array([1, -1]) * np.sqrt(p[0]), rtol=1e-12)
        assert np.allclose(done.x[:, 1], done.x[:, 0] * p[1], rtol=1e-12)


def test_engines_are_made_once_for_a_program():
    system = System([x**2 - a], [x], [a])
    one, two = (parameter_homotopy(system.program, [1], [t], np.array([[1.0]])) for t in (2, 3))
    assert engine_of(one) is engine_of(two)


def test_samples_lie_where_paths_begin_and_on_the_way():
    system = System([x**2 - a], [x], [a])
    points, parameters = parameter_homotopy(system.program, [1], [5], np.array([[1.0], [-1.0]])).samples(4)
    assert points.shape == (6, 1) and np.array_equal(points[:2], [[1], [-1]])
    assert np.array_equal(parameters[:2], [[1], [1]]) and np.all((parameters[2:].real > 1) & (parameters[2:].real < 5))


def test_listed_starts_are_given_by_number():
    starts = Listed(np.arange(6).reshape(3, 2))
    assert starts.count == 3 and starts.points(np.array([2, 0])).tolist() == [[4, 5], [0, 1]]


def test_it_prints_well():
    homotopy = parameter_homotopy(System([x**2 - a], [x], [a]).program, [1], [5], np.array([[1.0], [-1.0]]))
    assert repr(homotopy) == "Homotopy(parameter homotopy, 2 paths, 1 unknowns)"


def test_samples_come_from_every_part_of_a_list():
    x, p = sympy.symbols("x p")
    system = System([x**2 - p], [x], [p])
    starts = np.repeat([[1.0], [-1.0]], 50, axis=0)
    points, _ = parameter_homotopy(system.program, [1], [5], starts).samples(3)
    assert {1.0, -1.0} <= set(points[:, 0].tolist())
