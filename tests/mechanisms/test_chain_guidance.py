"""Three-link chains through five poses: every ratio pair in a box.

Authorities: the determinant of Eq. (3) itself; chains that are known; Newton's method from a dense grid.
"""

import numpy as np
import pytest

from mechanisms.families.chain import SerialChain, link_matrix
from mechanisms.families.chain_guidance import RatioBox, five_pose_chains
from mechanisms.task import TaskError


def poses_of(seed: int) -> tuple[SerialChain, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    z = rng.normal(size=(4, 2)) @ [1, 1j]
    chain = SerialChain(z[0], tuple(z[1:]), (1.0, rng.uniform(-4, 4), rng.choice([-1, 1]) * rng.uniform(0.4, 3)))
    phi = np.r_[0.0, np.sort(rng.uniform(0.3, 2.5, 4))]
    return chain, chain.tip(phi), chain.turning(phi)


def determinant(ratios: np.ndarray, points: np.ndarray, angles: np.ndarray) -> np.ndarray:
    """The columns of Eq. (3) and the displacements, scaled to unit columns; (n, 2) ratios to (n,)."""
    phi = (angles[1:] - angles[0]) / ratios[:, 1:]
    three = np.stack([np.ones(len(ratios)), ratios[:, 0], ratios[:, 1]], axis=1)
    matrix = link_matrix(three, phi)
    moves = np.broadcast_to((points[1:] - points[0])[:, None], (len(ratios), 4, 1))
    full = np.concatenate([matrix, moves], axis=2)
    full = full / np.linalg.norm(full, axis=1, keepdims=True)
    return np.linalg.det(full)


@pytest.mark.parametrize("seed", range(8))
def test_known_chain_is_found_and_all_fit(seed: int) -> None:
    chain, points, angles = poses_of(seed)
    found = five_pose_chains(points, angles)
    assert found.proved
    assert np.abs(found.ratios - chain.ratios[1:]).max(axis=1).min() < 1e-8
    for one in found.chains:
        phi = (angles - angles[0]) / one.ratios[-1]
        np.testing.assert_allclose(one.tip(phi), points, atol=1e-8 * max(1.0, *one.lengths))


@pytest.mark.parametrize("seed", [1, 4])
def test_newton_from_a_grid_finds_no_other(seed: int) -> None:
    _, points, angles = poses_of(seed)
    box = RatioBox((-5, 5), (-5, 5))
    found = five_pose_chains(points, angles, box).ratios
    least = np.ptp(angles) / box.largest_turn
    first, last = np.meshgrid(
        np.linspace(-5, 5, 60), np.r_[np.linspace(-5, -least, 40), np.linspace(least, 5, 40)]
    )
    x, h = np.stack([first.ravel(), last.ravel()], axis=1), 1e-6
    for _ in range(40):
        value = determinant(x, points, angles)
        slopes = [(determinant(x + h * e, points, angles) - determinant(x - h * e, points, angles)) / (2 * h)
                  for e in np.eye(2)]  # fmt: skip
        det = np.imag(np.conj(slopes[0]) * slopes[1])
        step = np.stack([np.imag(np.conj(value) * slopes[1]), -np.imag(np.conj(value) * slopes[0])], axis=1)
        step = -step / np.where(det == 0, 1, det)[:, None]
        x = x + step * np.minimum(1.0, 0.3 / np.maximum(np.linalg.norm(step, axis=1), 1e-300))[:, None]
    trivial = np.minimum.reduce(
        [np.abs(x[:, 0]), np.abs(x[:, 0] - 1), np.abs(x[:, 1] - 1), np.abs(x[:, 0] - x[:, 1]), np.abs(1 / x[:, 1])]
    )
    ends = (np.abs(determinant(x, points, angles)) < 1e-10) & (trivial > 1e-2)
    ends &= (np.abs(x[:, 0]) <= 5) & (np.abs(x[:, 1]) <= 5) & (np.abs(x[:, 1]) >= least)
    assert ends.sum() > 10
    distance = np.abs(x[ends][:, None, :] - found[None, :, :]).max(axis=2).min(axis=1)
    assert distance.max() < 1e-5


def test_a_smaller_box_holds_the_solutions_inside_it() -> None:
    _, points, angles = poses_of(2)
    everything = five_pose_chains(points, angles).ratios
    part = five_pose_chains(points, angles, RatioBox((-2, 1.5), (0.3, 4.0))).ratios
    inside = (everything >= [-2, 0.3]).all(axis=1) & (everything <= [1.5, 4.0]).all(axis=1)
    np.testing.assert_allclose(part, everything[inside], atol=1e-10)


def test_exchanging_the_first_two_links_is_a_symmetry() -> None:
    _, points, angles = poses_of(3)
    found = five_pose_chains(points, angles, RatioBox((-4, 4), (-4, 4), 40.0)).ratios
    swapped = np.stack([1 / found[:, 0], found[:, 1] / found[:, 0]], axis=1)
    least = np.ptp(angles) / 40.0
    inside = (np.abs(swapped) <= 4).all(axis=1) & (np.abs(swapped[:, 1]) >= least)
    for row in swapped[inside]:
        assert np.abs(found - row).max(axis=1).min() < 1e-7


def test_refusals() -> None:
    with pytest.raises(TaskError, match="determined by five"):
        five_pose_chains([0, 1, 2], [0, 1, 2])
    with pytest.raises(TaskError, match="does not turn"):
        five_pose_chains([0, 1, 2, 3j, 4], [0, 0, 0, 0, 0])
    with pytest.raises(TaskError, match="turn further than allowed"):
        five_pose_chains([0, 1, 2, 3j, 4], [0, 1, 2, 3, 4], RatioBox((-1, 1), (-0.1, 0.1), 1.0))
