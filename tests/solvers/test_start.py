"""The total-degree start: its points solve it, and all of them are there."""

import itertools

import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st

from solvers import System
from solvers.start import RootsOfUnity, random_gammas, total_degree

x, y, z = sympy.symbols("x y z")


@settings(max_examples=40, deadline=None)
@given(st.lists(st.integers(1, 5), min_size=1, max_size=4))
def test_start_points_are_all_tuples_of_roots_of_unity(degrees):
    starts = RootsOfUnity(tuple(degrees))
    points = starts.points(np.arange(starts.count))
    assert np.allclose(points ** np.array(degrees), 1)
    turns = np.rint(np.angle(points) / (2 * np.pi) * degrees).astype(int) % degrees
    assert sorted(map(tuple, turns.tolist())) == sorted(itertools.product(*map(range, degrees)))


def test_ten_million_points_cost_what_is_asked_for():
    starts = RootsOfUnity((10,) * 9)
    assert starts.count == 10**9 and starts.points(np.array([0, 10**9 - 1])).shape == (2, 9)


@pytest.mark.parametrize("scale", [None, np.array([8.0, 0.5, 1.0])])
def test_the_homotopy_begins_at_the_start_and_ends_at_the_system(scale):
    system = System([x**2 + y * z - 3, y**3 - x, z + x - y], [x, y, z])
    weights = None if scale is None else np.array([4.0, 1.0, 0.25])
    homotopy = total_degree(system, np.zeros(0), 3, scale, weights)
    starts = homotopy.starts.points(np.arange(homotopy.starts.count))
    assert homotopy.starts.count == 6
    values = np.array(homotopy.program.replay(list(starts.T), list(homotopy.start))["F"])
    assert np.abs(values).max() < 1e-12
    point = np.array([0.3 + 1j, -2, 0.7])
    own = np.array(homotopy.program.replay(list(point), list(homotopy.target))["F"])
    theirs = system.evaluate(homotopy.in_user_units(point[None]))[0][0]
    assert np.allclose(own, theirs * (1 if weights is None else weights))


def test_gammas_are_of_size_one_and_depend_on_the_seed():
    assert np.allclose(np.abs(random_gammas(50, 1)), 1)
    assert np.array_equal(random_gammas(5, 1), random_gammas(5, 1))
    assert not np.any(random_gammas(5, 1) == random_gammas(5, 2))
