"""What is said to reach the total degree does: against the mixed cells, on dense and sparse supports."""

import numpy as np
import pytest

from solvers.dense import reaches_total_degree
from solvers.mixed_cells import mixed_volume

RNG = np.random.default_rng(15)


def random_supports(n):
    """Constants, the pure powers of some unknowns, and a few other points."""
    supports = []
    for _ in range(n):
        degree = int(RNG.integers(1, 4))
        inside = RNG.integers(0, degree + 1, (3, n))
        inside = inside[inside.sum(axis=1) <= degree]
        powers = degree * np.eye(n, dtype=np.int64)[RNG.random(n) < 0.4]
        supports.append(np.unique(np.vstack([np.zeros((1, n), np.int64), inside, powers]), axis=0))
    return supports


@pytest.mark.parametrize("n", [2, 3, 4])
def test_no_mixed_volume_is_less_where_it_is_said_to_be_the_total_degree(n):
    said = 0
    for _ in range(60):
        supports = random_supports(n)
        degree = int(np.prod([support.sum(axis=1).max() for support in supports]))
        if reaches_total_degree(supports):
            said += 1
            assert mixed_volume(supports) == degree
        elif degree:
            assert mixed_volume(supports) < degree
    assert 10 <= said <= 55


def test_a_product_of_unknowns_loses_roots_to_infinity():
    pair = np.array([[0, 0], [1, 0], [0, 1], [1, 1]])
    assert not reaches_total_degree([pair, pair]) and mixed_volume([pair, pair]) == 2


def test_too_many_unknowns_and_empty_equations_say_nothing():
    line = np.vstack([np.zeros((1, 20), np.int64), np.eye(20, dtype=np.int64)])
    assert not reaches_total_degree([line] * 20)
    assert not reaches_total_degree([np.zeros((0, 1), np.int64)])
    assert not reaches_total_degree([])
