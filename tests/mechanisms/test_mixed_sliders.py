"""Sliders among poses and points: the slider-crank that positions were sampled from is found, and no other."""

from __future__ import annotations

import numpy as np
import pytest
from four_bar_samples import four_bar_poses, inverted_slider_crank_poses, mixed_task, slider_crank_poses

from mechanisms import synthesize
from mechanisms.families.mixed_sliders import slider_candidates

KINDS = {"slider-crank": slider_crank_poses, "inverted slider-crank": inverted_slider_crank_poses}


@pytest.mark.parametrize(("count", "points"), [(4, 2), (3, 4)], ids=str)
@pytest.mark.parametrize("kind", KINDS)
def test_positions_of_a_slider_crank_lead_back_to_it(kind, count, points):
    for seed in range(6):
        poses, (crank, slider) = KINDS[kind](np.random.default_rng(seed), count + points)
        (found,) = slider_candidates(mixed_task(poses, count), 2)
        assert found.extra["kind"] == kind and found.pose_error < 1e-9
        places = found.linkage.points
        assert abs(places["O1"] - crank.fixed) + abs(places["A1"] - crank.moving) < 1e-6
        pivot = places["A2"] - slider.moving if kind == "slider-crank" else places["O2"] - slider.fixed
        assert abs(pivot) < 1e-6
        line = slider.fixed if kind == "slider-crank" else slider.moving
        assert abs((found.linkage.sliders[0].direction * line.conjugate()).imag) < 1e-6


@pytest.mark.parametrize("kind", KINDS)
def test_a_task_says_that_two_of_its_paths_are_a_slider_crank(kind):
    poses, _ = KINDS[kind](np.random.default_rng(1), 6)
    result = synthesize(mixed_task(poses, 4))
    assert result.ledger["at_infinity"] == 2 and result.ledger["failed"] == 0
    (found,) = [design for design in result.designs if design.extra.get("kind") == kind]
    assert found.worst_pose_error < 1e-9
    assert set(found.verdicts) == {"crank", "follower"}


def test_the_sequence_is_kept():
    poses, _ = slider_crank_poses(np.random.default_rng(1), 6)
    order = [0, 4, 2, 1, 5, 3]
    (plain,) = slider_candidates(mixed_task(poses, 4), 2)
    (other,) = slider_candidates(mixed_task(poses, 4, free={"sequence": order}), 2)
    assert abs(plain.linkage.points["O1"] - other.linkage.points["O1"]) < 1e-9
    for place, number in enumerate(order):
        for link, turn in other.poses[place].items():
            assert np.exp(1j * turn) == pytest.approx(np.exp(1j * plain.poses[number][link]), abs=1e-8)


def test_positions_of_a_four_bar_have_no_slider():
    poses, _ = four_bar_poses(np.random.default_rng(3), 6)
    assert list(slider_candidates(mixed_task(poses, 4), 2)) == []
