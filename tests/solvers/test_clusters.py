"""Clusters of four and more roots a millionth apart, and multiple roots, told from each other."""

import numpy as np
import pytest
from sympy import Rational, expand, prod, symbols

from solvers import System, solve
from solvers.clusters import with_clusters_resolved

x, y = symbols("x y")
CLOSE = Rational(1, 10**6)


def near_one(*places):
    """The product of x − 1 − k·1e-6 over some places k, expanded."""
    return expand(prod(x - 1 - k * CLOSE for k in places))


CLUSTERS = [(0, 1, 2, 3), (-1, 0, 1, 3), (0, 1, 2, 3, 4), (0, 1, 2, 3, 4, 5)]


def check_cluster(places, seeds):
    for seed in seeds:
        solutions = solve(System([near_one(*places)], [x]), seed=seed)
        assert len(solutions) == len(places) == solutions.certificate.distinct, (places, seed)
        assert len(solutions.singular) == 0 and solutions.ledger.balanced and solutions.complete
        exact = 1 + 1e-6 * np.array(places)
        assert np.abs(np.sort(solutions.points[:, 0].real) - exact).max() < 1e-15


@pytest.mark.parametrize("places", CLUSTERS)
def test_roots_a_millionth_apart(places):
    check_cluster(places, range(5))


@pytest.mark.slow
@pytest.mark.parametrize("places", CLUSTERS)
def test_roots_a_millionth_apart_on_a_thousand_seeds(places):
    check_cluster(places, range(1000))


@pytest.mark.parametrize("start", ["total-degree", "polyhedral"])
def test_two_unknowns(start):
    system = System([near_one(0, 1, 2, 3), y**2 + x - 3], [x, y])
    solutions = solve(system, start=start)
    assert len(solutions) == 8 == solutions.certificate.distinct and solutions.certificate.real.all()
    assert np.abs(solutions.points[:, 1] ** 2 + solutions.points[:, 0] - 3).max() < 1e-14


def test_a_cluster_off_the_axes():
    """All unknowns, and the equations, mixed: kernel and cokernel are no unit vectors."""
    first, second = near_one(0, 1, 2, 4).subs(x, x + y), x - 2 * y + (x + y) ** 2
    system = System([expand(first + 3 * second), expand(second - 2 * first)], [x, y])
    solutions = solve(system, start="total-degree")
    sums = np.sort(solutions.points.sum(axis=1).real)
    assert len(solutions) == 4 and np.abs(sums - 1 - 1e-6 * np.array([0, 1, 2, 4])).max() < 1e-14


@pytest.mark.parametrize("places, doubles", [((0, 0, 1, 1), 2), ((0, 0, 1, 1, 3), 2), ((0, 0, 1, 3), 1)])
def test_double_roots_in_a_cluster(places, doubles):
    solutions = solve(System([near_one(*places)], [x]), start="total-degree")
    assert solutions.singular.multiplicity.tolist() == [2] * doubles and solutions.ledger.balanced
    assert len(solutions) == len(places) - 2 * doubles
    twice = sorted(k for k in set(places) if places.count(k) == 2)
    assert np.abs(np.sort(solutions.singular.points[:, 0].real) - 1 - 1e-6 * np.array(twice)).max() < 1e-15


@pytest.mark.parametrize("multiplicity", [3, 4, 5, 6])
def test_a_multiple_root_stays_one_and_is_known_to_full_accuracy(multiplicity):
    place = Rational(7, 3)  # no binary number: only exact coefficients have a multiple root
    for seed in range(4):
        solutions = solve(System([expand((x - place) ** multiplicity * (x + 2))], [x]), seed=seed)
        assert len(solutions) == 1 and solutions.singular.multiplicity.tolist() == [multiplicity]
        assert abs(solutions.singular.points[0, 0] - 7 / 3) < 1e-15


def test_other_ends_are_left_alone():
    for system in (
        System([x**2, y**2], [x, y]),  # a kernel of dimension two
        System([(x - 1) ** 2, y - 1], [x, y]),  # fewer than three
        System([(x - 1) ** 3 * (x + 1)], [x]),
    ):
        solutions = solve(system, start="total-degree")
        again = with_clusters_resolved(system, solutions)
        assert again.singular.multiplicity.tolist() == solutions.singular.multiplicity.tolist()
        assert len(again) == len(solutions)


def test_a_root_of_multiplicity_six_is_one_root():
    """Its multiplicity shows in the sixth root of what Newton's method leaves: two triple roots at 1e-16, once."""
    system = System([(x - 1) ** 6 * (x + 2), y - x], [x, y])
    for seed in range(60):
        found = solve(system, start="polyhedral", seed=seed, certificates=False)
        assert found.singular.multiplicity.tolist() == [6], seed
