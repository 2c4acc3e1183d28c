"""Sets of approximate points and groups that act on them."""

import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from solvers.points import Group, PointSet, pairs_of_equals


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10**6), st.integers(1, 60), st.integers(1, 5), st.integers(1, 12))
def test_numbers_are_those_of_comparing_all_with_all(seed, count, size, places):
    rng = np.random.default_rng(seed)
    place = rng.normal(size=(places, size)) + 1j * rng.normal(size=(places, size))
    which = rng.integers(places, size=count)
    points = place[which] * (1 + 1e-12 * rng.normal(size=(count, size)))
    order = {}
    expected = [order.setdefault(k, len(order)) for k in which.tolist()]
    whole = PointSet(size, seed=seed)
    assert whole.add(points).tolist() == expected
    parts, numbers = PointSet(size, seed=seed), []
    for part in np.array_split(points, 4):
        numbers += parts.add(part).tolist()
    assert numbers == expected and len(parts) == len(order)
    assert parts.find(points).tolist() == expected
    assert np.all(parts.find(points + 10) == -1)


def test_points_far_and_near_have_their_own_tolerance():
    known = PointSet(1)
    assert known.add(np.array([[1e6], [1e6 + 1e-3], [1.0], [1.0 + 1e-3]])).tolist() == [0, 0, 1, 2]


def test_an_empty_set_knows_nothing():
    known = PointSet(2)
    assert known.find(np.ones((3, 2))).tolist() == [-1, -1, -1] and known.find(np.ones((0, 2))).tolist() == []
    assert known.add(np.ones((0, 2))).tolist() == []


def test_the_dihedral_group_of_the_square():
    turn, flip = (lambda z: z * 1j), np.conj
    probe = np.array([[1 + 0.3j]])
    group = Group([turn, flip], probe, np.zeros(0))
    assert group.order == 8
    rng = np.random.default_rng(0)
    points = rng.normal(size=(20, 1)) + 1j * rng.normal(size=(20, 1))
    chosen = group.representatives(points, np.zeros(0))
    for image in group.orbits(points, np.zeros(0)):
        assert np.allclose(group.representatives(image, np.zeros(0)), chosen)
    assert len(group.members(points, np.zeros(0))) == 160
    assert len(group.members(np.array([[1.0 + 0j]]), np.zeros(0))) == 4  # on an axis of symmetry


def test_symmetries_may_look_at_the_parameters():
    group = Group([lambda points, p: p[..., :1] - points], np.array([[1.0 + 1j]]), np.array([5.0]))
    assert group.order == 2
    assert np.allclose(group.members(np.array([[2.0]]), np.array([5.0])), [[2], [3]])


def test_functions_that_are_no_group_are_refused():
    with pytest.raises(ValueError, match="finite group"):
        Group([lambda points: points + 1], np.ones((1, 1)), np.zeros(0))
    with pytest.raises(ValueError, match="not finite"):
        Group([lambda points: points * np.nan], np.ones((1, 1)), np.zeros(0))


@pytest.mark.parametrize("seed", range(6))
def test_pairs_and_members_against_all_distances(seed):
    """Points of sizes from a thousandth to a thousand million, some twice within the tolerance, some just outside."""
    rng = np.random.default_rng(seed)
    base = (rng.normal(size=(60, 3)) + 1j * rng.normal(size=(60, 3))) * 10.0 ** rng.uniform(-3, 9, (60, 1))
    size = np.abs(base).max(axis=1, keepdims=True)
    turned = np.exp(2j * np.pi * rng.random((60, 3)))
    points = np.concatenate([base, base + 0.4e-7 * size * turned, base[:20] + 3e-7 * size[:20] * turned[:20]])
    distance = np.abs(points[:, None] - points[None]).max(axis=2)
    largest = np.abs(points).max(axis=1)
    close = distance <= 1e-7 * np.maximum(largest[:, None], largest[None])
    wanted = {(i, j) for i, j in np.argwhere(close).tolist() if i < j}
    assert set(map(tuple, pairs_of_equals(points, 1e-7).tolist())) == wanted and len(wanted) >= 60
    known = PointSet(3)
    known.add(base)
    found = known.find(points)
    assert (found[:120] == np.tile(np.arange(60), 2)).all() and (found[120:] < 0).all()


@pytest.mark.parametrize("count, tolerance", [(80, 0.5), (300, 0.1), (2000, 1e-2), (1500, 1e-6)])
def test_pairs_in_a_crowd_are_those_of_all_distances(count, tolerance):
    """So many points within reach that they are looked for in a plane; one of them is no number."""
    rng = np.random.default_rng(count)
    points = rng.normal(size=(count, 3)) + 1j * rng.normal(size=(count, 3))
    tenth = count // 10
    points[:tenth] = points[tenth : 2 * tenth] * (1 + 1.5 * tolerance * rng.random((tenth, 1)))
    points[-1] = np.nan
    distance = np.abs(points[:, None] - points[None]).max(axis=2)
    size = np.abs(points).max(axis=1)
    expected = np.argwhere(np.triu(distance <= tolerance * np.maximum(size[:, None], size[None]), 1))
    found = pairs_of_equals(points, tolerance)
    assert len(expected) > tenth / 2 and np.array_equal(found, expected)


def test_one_point_that_is_hardly_known_makes_no_crowd():
    """Each has a reach of its own: that of one is larger than everything, and all pairs are not looked at."""
    rng = np.random.default_rng(1)
    points = rng.normal(size=(20_000, 2)) + 1j * rng.normal(size=(20_000, 2))
    tolerance = np.full(len(points), 1e-9)
    tolerance[7] = 0.3
    began = time.perf_counter()
    found = pairs_of_equals(points, tolerance)
    assert time.perf_counter() - began < 2.0
    assert len(found) and (found == 7).any(axis=1).all()
