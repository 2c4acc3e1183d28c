"""The compact index agrees with the set of points that keeps them all."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from solvers.key_index import KeyIndex
from solvers.points import PointSet


def cloud(rng, count, size):
    return rng.normal(size=(count, size)) + 1j * rng.normal(size=(count, size))


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10**6), size=st.integers(1, 4), parts=st.integers(1, 8))
def test_the_index_knows_what_the_whole_points_would_tell(seed, size, parts):
    rng = np.random.default_rng(seed)
    places = cloud(rng, 60, size) * 10.0 ** rng.integers(-3, 4, size=(60, 1))
    whole, index = PointSet(size), KeyIndex(size)
    for _ in range(parts):
        points = places[rng.integers(len(places), size=25)] * (1 + 1e-11 * rng.normal(size=(25, size)))
        known = whole.find(points)
        found = index.find(points)
        assert np.array_equal(known >= 0, found >= 0)
        # One number for one point, another for another.
        assert len(np.unique(found[found >= 0])) == len(np.unique(known[known >= 0]))
        before = len(whole)
        fresh = index.add(points)
        whole.add(points)
        assert fresh.sum() == len(whole) - before and len(index) == len(whole)
        # Of equal new points the first one counts.
        assert np.allclose(points[fresh], whole.points[before:])


@pytest.mark.parametrize("distance, same", [(1e-9, True), (1e-5, False)])
def test_near_points_are_one_and_others_are_not(distance, same):
    rng = np.random.default_rng(0)
    points = cloud(rng, 1000, 3)
    index = KeyIndex(3)
    index.add(points)
    moved = points + distance * np.exp(1j * rng.uniform(0, 6, points.shape))
    assert np.all((index.find(moved) >= 0) == same)


def test_points_that_agree_in_one_number_are_told_apart():
    # The first real number is the one that is sorted: ten points that share it.
    index = KeyIndex(2)
    functional = index._functionals[:, 0]
    along = np.array([functional[1], -functional[0]])
    points = np.array([3.0, 4.0]) + np.arange(10)[:, None] * along
    assert np.ptp((points @ functional).real) < 1e-12
    assert index.add(points).all() and len(index) == 10
    assert not index.add(points[::-1]).any()


def test_memory_is_32_bytes_a_point_however_they_come():
    rng = np.random.default_rng(1)
    index = KeyIndex(20)
    for count in rng.integers(1, 400, size=60):
        index.add(cloud(rng, count, 20))
    assert index.nbytes == 32 * len(index)
    assert len(index._runs) < 10


def test_nothing_is_known_at_first():
    index = KeyIndex(2)
    assert len(index) == 0 and index.find(np.zeros((0, 2))).size == 0
    assert index.find(np.ones((3, 2))).tolist() == [-1] * 3 and index.add(np.zeros((0, 2))).size == 0
