"""The total-degree start: its points solve it, and all of them are there."""

import itertools

import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st

from solvers import System, solve
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


def test_what_is_given_as_a_product_stays_one():
    """Wilkinson's polynomial: a rounded coefficient moves its roots by tenths, and rounding errors do, too."""
    system = System([sympy.prod([x - k for k in range(1, 21)])], [x])
    assert len(system.program.code) > 21  # terms
    homotopy = total_degree(system, np.zeros(0))
    assert "J" not in homotopy.program.outputs
    found = solve(system, start="total-degree", certificates=False)
    assert np.abs(np.sort(found.points[:, 0].real) - np.arange(1, 21)).max() < 1e-9


@pytest.mark.parametrize("scale", [None, np.array([0.25, 8.0])])
def test_sums_of_terms_give_the_same_homotopy_as_the_tape(scale):
    plain = System([3 * x**2 * y - x / 7 + 2, x * y**2 + y**2 - 5], [x, y])
    kept = System([3 * x**2 * y - x / 7 + 2, (x + 1) * (y**2 + z) - 5 - z * (x + 1)], [x, y], [z])
    written, embedded = (total_degree(s, v, 3, scale) for s, v in ((plain, np.zeros(0)), (kept, np.array([0.5]))))
    assert "J" in written.program.outputs and "J" not in embedded.program.outputs
    rng = np.random.default_rng(3)
    points = (rng.normal(size=(4, 2)) + 1j * rng.normal(size=(4, 2))).T
    for r in (0.0, 0.3, 1.0):
        F = [h.program.replay(list(points), list(h.target + r * h.direction))["F"] for h in (written, embedded)]
        assert np.allclose(F[0], F[1], rtol=1e-13)
