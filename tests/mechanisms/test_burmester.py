"""Five poses: published dyads, sampled linkages, invariance, sliders."""

from __future__ import annotations

import numpy as np
import pytest
from four_bar_samples import four_bar_poses, inverted_slider_crank_poses, slider_crank_poses

from mechanisms.families.burmester import (
    affine_system,
    dyad_parameters,
    five_pose_dyads,
    generic_dyads,
    is_isotropic,
    projective_system,
)
from mechanisms.families.motion_dyads import Poses
from solvers import solve

#: Three sets of five poses (x, y, degrees); the dyads of the first, G and z, were found by an independent tracker.
FIRST = [(0, 0, 0), (-0.5, -1.9, 90), (1.7, 0, 45), (-1.6, 0.4, 35), (-1.5, 0.1, 25)]
SECOND = [(0, 0, 0), (-0.8, 1.3, -15), (1, 0.6, 60), (0.9, 0.7, 90), (-1.1, 1.3, -95)]
THIRD = [(0, 0, 0), (-0.8, 1.6, -90), (-1, 0.8, -60), (0.9, -0.8, 25), (0.4, -0.7, 55)]
FIRST_DYADS = [
    (-1.6874789503 - 1.7809118296j, -1.7559332762 + 0.2946847085j),
    (2.3353009543 + 0.3550839741j, 1.9611255331 - 1.2317089267j),
    (1.6942280402 - 5.3955878374j, -0.7687809304 - 3.5810827512j),
    (3.3832837230 - 1.4416208928j, 1.9997523193 - 2.7569928456j),
]


def miss(dyads, fixed, moving):
    """Distance of the nearest dyad found."""
    return min((max(abs(d.fixed - fixed), abs(d.moving - moving)) for d in dyads if d.kind == "RR"), default=np.inf)


def test_the_published_dyads_are_found():
    dyads = five_pose_dyads(Poses.of(FIRST))
    assert len(dyads) == 4
    for fixed, moving in FIRST_DYADS:
        assert miss(dyads, fixed, moving) < 2e-10


@pytest.mark.parametrize(("given", "real"), [(FIRST, 4), (SECOND, 2), (THIRD, 0)])
def test_sixteen_paths_of_the_quadrics_end_in_the_same_four_roots(given, real):
    poses = Poses.of(given)
    found = solve(affine_system(), dyad_parameters(poses), "total-degree")
    assert affine_system().bezout == 16 == found.ledger.tracked
    assert (found.ledger.finite, found.ledger.at_infinity, found.ledger.failed) == (4, 12, 0)
    dyads = five_pose_dyads(poses)
    assert len(dyads) == real
    for dyad in dyads:
        place = np.array([dyad.moving, np.conj(dyad.moving), dyad.fixed, np.conj(dyad.fixed)]) / poses.size
        assert np.abs(found.points - place).max(axis=1).min() < 1e-9


def test_of_six_roots_in_the_product_of_planes_two_are_isotropic():
    found = solve(projective_system(), dyad_parameters(Poses.of(FIRST)), "total-degree", certificates=False)
    assert len(found) == 6
    assert sum(map(is_isotropic, found.points)) == 2
    assert len(generic_dyads()) == 4


def test_the_true_dyads_of_sampled_four_bars_are_found():
    rng = np.random.default_rng(5)
    for _ in range(25):
        poses, true = four_bar_poses(rng)
        dyads = five_pose_dyads(poses)
        assert len(dyads) in (2, 4)
        for dyad in true:
            assert miss(dyads, dyad.fixed, dyad.moving) < 1e-9 * poses.size
        assert max(dyad.errors(poses).max() for dyad in dyads) < 1e-9 * poses.size


@pytest.mark.parametrize(
    ("sample", "kind"), [(slider_crank_poses, "PR"), (inverted_slider_crank_poses, "RP")], ids=["PR", "RP"]
)
def test_a_slider_is_a_root_at_infinity(sample, kind):
    rng = np.random.default_rng(6)
    for _ in range(8):
        poses, (crank, slider) = sample(rng)
        assert slider.errors(poses).max() < 1e-12  # the sample itself
        dyads = five_pose_dyads(poses)
        assert miss(dyads, crank.fixed, crank.moving) < 1e-8 * poses.size
        (found,) = [dyad for dyad in dyads if dyad.kind == kind]
        pivot, line = ("moving", "fixed") if kind == "PR" else ("fixed", "moving")
        assert abs(getattr(found, pivot) - getattr(slider, pivot)) < 1e-8 * poses.size
        assert abs((getattr(found, line) * np.conj(getattr(slider, line))).imag) < 1e-8
        assert found.errors(poses).max() < 1e-8 * poses.size


def test_moved_scaled_and_reordered_poses_have_the_same_dyads():
    poses = Poses.of(FIRST)
    before = five_pose_dyads(poses)
    motion, shift = 3.7 * np.exp(0.8j), 11 - 4j
    order = [3, 1, 4, 0, 2]
    for keep in (order, list(range(5))[::-1]):
        points, angles = motion * poses.points[keep] + shift, poses.angles[keep] + 0.8
        after = five_pose_dyads(Poses(points, angles - angles[0]))
        assert len(after) == 4
        for dyad in before:
            moving = poses.carry(dyad.moving)[keep[0]]
            assert miss(after, motion * dyad.fixed + shift, motion * moving + shift) < 1e-8


def test_equal_angles_of_two_poses_are_no_obstacle():
    poses = Poses.of([(0, 0, 0), (1, 0.2, 0), (1.7, 0, 45), (-1.6, 0.4, 35), (-1.5, 0.1, 35)])
    found = solve(affine_system(), dyad_parameters(poses), "total-degree")
    assert len(found) == 4
    for dyad in five_pose_dyads(poses):
        assert dyad.errors(poses).max() < 1e-9
